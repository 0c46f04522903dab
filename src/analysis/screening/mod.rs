//! Checks of the signals before anything is fitted: sample rate, limits of the robot, joints at
//! rest, and the law of the commands.

mod commanded_law;
mod limits;
mod sample_rate;
mod standstill;

pub use commanded_law::{LawError, commanded_controller};
pub use limits::{
    BeyondLimits, Cause, FRICTION_LAWS_REMEDY, LIMITS_REMEDY, LimitExcess, LimitedQuantity,
    check_limits, open_limits, unlisted_laws,
};
pub use sample_rate::RateError;
pub(crate) use sample_rate::{check_rate, checked_measurement};
pub use standstill::still_joints;
