//! Offline analysis of recordings: screening, identification, prediction, payload, drive gains,
//! excitation and export of a stored result.

mod bus_log;
mod choices;
mod counted;
mod excitation;
mod export;
mod external_torque;
mod gains;
pub mod identify;
mod payload;
mod predict;
mod recording_file;
mod recordings;
mod result_lines;
pub mod screening;
mod stored_model;
mod torque_difference;

pub use bus_log::{LogError, read_log};
pub use choices::{Choice, ChoiceError, DataChoices};
pub use counted::{CountError, CountedPiece, check_cell_rate, count_samples, measurement_pairs};
pub use excitation::{
    AdviceForResult, Assignment, AssignmentError, CheckedLinks, DesignedMotion, ExpectationError,
    ExpectedParameter, Floor, PlayError, PlayedMotion, RequestedChecks, RequestedDesign,
    ShapeProblem, TaskParameter, UnreadShape, WantedLoad, expectation_line,
};
pub use export::{ConsistentError, ConsistentModel, Exported, Format, NO_FRICTION, WriteError};
pub use external_torque::{
    ExternalTorqueRow, ExternalTorqueSummary, JointExternalTorque, identified_bandwidth_hz,
};
pub use gains::{FindGainsError, FoundGain, FoundGains, find_drive_gains};
pub use payload::{LoadError, find_load};
pub use recording_file::{RecordingError, check_compression, read_recording, recording_source};
pub use recordings::identify_recordings;
pub use result_lines::read_result_line;
pub use stored_model::{JudgedUse, OTHER_CONFIGURATION, ResultError, StoredModel};
pub use torque_difference::{JointDifference, TorqueDifferenceError, torque_difference};
