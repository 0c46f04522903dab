//! Description of an arm: links, joints, transmission, limits, friction and the names of
//! parameters.

mod angle;
mod arm;
mod capsule;
mod error;
mod file;
mod friction;
mod hidden;
mod hysteresis;
mod index;
mod joint;
mod known_torque;
mod limit;
mod link_frame;
mod nominal;
mod parameter_kind;
mod parameters;
mod recorded_torque;
mod transmission;

pub use angle::Angle;
pub use arm::Robot;
pub use capsule::Capsule;
pub use error::RobotError;
pub use friction::{FrictionLaw, FrictionTerms, JointFriction, SignModel};
pub use hidden::is_hidden;
pub use hysteresis::Hysteresis;
pub use index::{JointIndex, MotorIndex};
pub use joint::{Joint, JointKind, Limits};
pub use known_torque::{Counterbalance, KnownTorque};
pub use link_frame::{NamedFrame, NoSuchFrame};
pub use nominal::NominalParameters;
pub use parameter_kind::ParameterKind;
pub use parameters::{Parameter, ParameterTable};
pub use recorded_torque::{RecordedTorque, TorqueTerm};
pub use transmission::{Transmission, TransmissionError};
