//! The motion of a scenario.

use didim_core::trajectory::{Reference, SampledReference, Trajectory};

/// Moves that are planned, or a motion that is given point by point.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Moves.
    Moves(Trajectory),
    /// Points, as `didim design` writes them.
    Recorded(SampledReference),
}

impl Motion {
    /// From its start to its end \[s\].
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Moves(moves) => moves.duration_s(),
            Self::Recorded(points) => points.duration_s(),
        }
    }
}

impl Reference for Motion {
    fn joints(&self) -> usize {
        match self {
            Self::Moves(moves) => moves.joints(),
            Self::Recorded(points) => points.joints(),
        }
    }

    fn at(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        match self {
            Self::Moves(moves) => moves.at(time_s, position, velocity, acceleration),
            Self::Recorded(points) => points.at(time_s, position, velocity, acceleration),
        }
    }
}
