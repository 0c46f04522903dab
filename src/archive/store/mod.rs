//! Results on disk: complete or not at all, a bounded number, with what reproduces them.

mod against;
mod configurations;
mod error;
mod folder;
mod history;
mod known;
mod load;
mod owed;
mod record;
mod samples;
mod timestamp;

pub use against::Against;
pub use configurations::ConfigurationTexts;
pub use error::StoreError;
pub(crate) use folder::RECENT_LINES;
pub use folder::{DEFAULT_KEEP, Store, Stored, result_file};
pub use history::{
    HISTORY_SCHEMA, HistoryError, HistoryFollower, HistoryLine, HistoryMark, ParameterValue,
    read_history,
};
pub use known::{KeptValue, Known, read_known};
pub use load::{FoundLoad, LoadChange, mass_text};
pub use record::{Beside, ResultRecord, WindowProvenance};
pub use samples::input_sha256;
pub use timestamp::Timestamp;
