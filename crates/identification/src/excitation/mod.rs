//! Next motion: a finite Fourier series within an arm's limits, which identifies the parameters
//! that an identification lacks.
//!
//! A [`Task`] contains the arm, the limits ([`Bounds`]), the prior information and the aim
//! ([`DesignObjective`]). [`design`] starts from a random series well inside the limits. It
//! improves the series by a barrier method (Nocedal and Wright, *Numerical Optimization*, ch. 7.2
//! and 19.6), so that every iterate may be run. Gradients are analytic. [`sweep`](sweep()) instead
//! moves one joint at a time at constant speeds, for friction laws. [`advise`] instead tries
//! excitations of one joint or two, which can be described in words. The series and its use for
//! robots: J. Swevers, C. Ganseman, D. Tükel, J. De Schutter and H. Van Brussel, *Optimal robot
//! excitation and identification*, IEEE Transactions on Robotics and Automation 13, 1997.
//!
//! ```text
//! {advice, terms} → {design, candidates, sweep}
//!     → {search, descent, prediction, simulated, joint_excitation} → task
//!     → {barrier, information, objective} → bounds → error → shapes → basis
//!     → {series, random, clearance, solid} → limit_kind
//! ```

mod advice;
mod barrier;
mod basis;
mod bounds;
mod candidates;
mod clearance;
mod descent;
mod design;
mod error;
mod information;
mod joint_excitation;
mod limit_kind;
mod limits;
mod objective;
mod prediction;
mod random;
mod search;
mod series;
mod shapes;
mod simulated;
mod solid;
mod sweep;
mod task;
mod terms;

pub use advice::{Advice, Advised, advise};
pub use bounds::{Bounds, Margins, UsedLimit};
pub use design::{CHECK_HZ, Design, Progress, design, first_motion};
pub use error::ExcitationError;
pub use joint_excitation::{JointExcitation, JointExcitations};
pub use limit_kind::LimitKind;
pub use limits::DesignLimits;
pub use prediction::{Predicted, information, predict_result, rows};
pub use series::{Course, FourierSeries, JointSeries, State};
pub use shapes::{MIN_GAP_M, Nearest, Neighbour, Shapes};
pub use simulated::{TorqueNoise, simulate_motion, simulate_record};
pub use solid::{Corners, NearestPoints, Solid, Wall, WallKind};
pub use sweep::{Sweep, SweepDesign, SweepPass, sweep};
pub use task::{DesignObjective, Noise, Task};
pub use terms::{FrictionTermPrediction, SweptJoint, predict_terms};
