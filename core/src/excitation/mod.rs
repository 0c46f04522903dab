//! The next motion: a finite Fourier series within an arm's limits that tells of its parameters what an
//! identification lacks.
//!
//! A [`Task`] says which arm, which limits ([`Bounds`]), what is known already and what is wanted ([`Aim`]).
//! [`design`] starts from a random series well inside the limits and improves it by a barrier method (Nocedal
//! and Wright, *Numerical Optimization*, ch. 7.2 and 19.6), so that every iterate may be run; gradients
//! are analytic. [`sweep`](sweep()) moves one joint at a time at constant speeds instead, for friction laws. [`advise`] tries swings of one joint or two instead, which words can say. The series and its use for robots: J. Swevers, C. Ganseman, D. Tükel, J. De Schutter and H. Van Brussel,
//! *Optimal robot excitation and identification*, IEEE Transactions on Robotics and Automation 13, 1997.
//!
//! ```text
//! {advice, terms} → {design, candidates, sweep} → {search, descent, told, simulated, swing} → task → {barrier, information, objective} → bounds → shapes → basis → {series, error, random, clearance} → limit_kind
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
mod limit_kind;
mod objective;
mod random;
mod search;
mod series;
mod shapes;
mod simulated;
mod sweep;
mod swing;
mod task;
mod terms;
mod told;

pub use advice::{Advice, Advised, advise};
pub use bounds::{Bounds, Margins, Used};
pub use design::{CHECK_HZ, Design, Progress, design, first};
pub use error::ExcitationError;
pub use limit_kind::LimitKind;
pub use series::{Course, FourierSeries, JointSeries, State};
pub use shapes::{Corners, LEAST_GAP_M, Nearest, Other, Shapes};
pub use simulated::simulated;
pub use sweep::{Pass, Sweep, Swept, sweep};
pub use swing::{Swing, Swings};
pub use task::{Aim, Noise, Task};
pub use terms::{SweptJoint, Term, terms};
pub use told::{Predicted, information, predicted, rows};
