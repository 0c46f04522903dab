//! Zero-phase filters, differences and decimation. They turn a recorded position into position,
//! velocity and acceleration, and a fast record into independent rows (paper, section 3.1.1).
//!
//! Every function reproduces its counterpart in SciPy or NumPy, which the golden values in
//! `tests/golden` verify: `butter` and `cheby1` with `output="sos"`, `sosfiltfilt` with odd
//! padding, `numpy.gradient` with edge order 1.

mod complex_lanes;
mod decimation;
mod design;
mod difference;
mod error;
mod interpolation;
mod limits;
mod mode_group;
mod modes;
mod record;
mod sections;
mod zero_phase;
mod zero_phase_decimation;

pub use decimation::ParallelDecimation;
pub use design::{butterworth_low_pass, chebyshev1_low_pass};
pub use difference::central_difference;
pub(crate) use difference::difference_neighbours;
pub use error::SignalError;
pub use interpolation::delay_linear;
pub use limits::MAX_ORDER;
pub use record::Group;
pub(crate) use record::group_of;
pub use sections::SecondOrderSections;
pub use zero_phase::OddPadding;
