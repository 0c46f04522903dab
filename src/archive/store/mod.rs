//! Results on disk: written completely or not at all, bounded in number, with the data that
//! reproduces them.

mod against;
mod configurations;
mod earlier_version;
mod error;
mod folder;
mod history;
mod load;
mod model_context;
mod pending;
mod record;
mod samples;
mod timestamp;

pub use against::ModelDifference;
pub use configurations::ConfigurationTexts;
pub use earlier_version::{EarlierLayout, EarlierVersion, EarlierVersionError, NEWER_FOLDER};
pub use error::StoreError;
#[cfg(target_os = "linux")]
pub(crate) use folder::LATEST_FILE;
pub use folder::{DEFAULT_KEEP, Store, Stored, number_of_result, result_file};
pub(crate) use history::day_rows;
pub use history::{
    AlarmCheckpoint, AlarmState, DaySummary, HISTORY_SCHEMA, HistoryError, HistoryFollower,
    HistoryLine, HistoryMark, MeanPart, ParameterValue, WeightedMean, for_each_day, for_each_line,
    history_parts, read_history,
};
pub use load::{FoundLoad, LoadChange, mass_text};
pub use model_context::{KeptValue, ModelContext, read_known};
pub use record::{Attachments, Recordings, ResultRecord, WindowProvenance};
pub use samples::input_sha256;
pub use timestamp::Timestamp;
