//! Reference motions that respect limits.
//!
//! A [`MoveSequence`] is data: where to go, how fast, how long to stay. Planning it against the
//! [`JointLimits`] gives a [`Trajectory`]: position, velocity and acceleration of every joint at
//! every time, by trapezoidal velocity (bang-bang acceleration), all joints of a move starting and
//! arriving together. [`RandomMoves`] makes sequences of the kind that excites an arm's dynamics,
//! and [`SampledReference`] follows a recorded reference instead. Both are a [`Reference`].

mod error;
mod limits;
mod moves;
mod planned;
mod random;
mod recorded;
mod trapezoid;

pub use error::TrajectoryError;
pub use limits::JointLimits;
pub use moves::{Move, MoveSequence};
pub use planned::Trajectory;
pub use random::RandomMoves;
pub use recorded::{ReferenceInterpolation, SampledReference};

/// A motion that is known at every time.
pub trait Reference {
    /// Number of joints.
    fn joints(&self) -> usize;

    /// Writes position \[rad\], velocity \[rad/s\] and acceleration \[rad/s²\] of every joint at
    /// `time_s`. Before the start and after the end the motion stands still. The slices have one
    /// entry per joint; entries beyond are not changed.
    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    );
}

impl<R: Reference + ?Sized> Reference for &R {
    fn joints(&self) -> usize {
        (**self).joints()
    }
    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        (**self).evaluate(time_s, position, velocity, acceleration);
    }
}
