//! Studies of robustness: what the identification methods make of noise and of errors of the model,
//! on a simulated arm whose parameters are known.
//!
//! | step | where |
//! |---|---|
//! | the plan as it is typed: methods, axes, levels | [`Plan`] |
//! | every level of each axis with every level of all others | [`Grid`] |
//! | one arm, one seed, one method, held against the truth | [`Run`] |
//! | the runs on disk, so that a study can be continued | [`Store`] |
//! | the runs that are left, on several threads | [`execute()`] |
//! | a part of the runs for each of several machines, and all of them put together | [`Shard`], [`merge()`] |
//! | what they come to | [`Summary`], [`markdown()`], [`heat_maps`] |
//!
//! A run is a function of its cell of the grid and its seed, and every file but `runs.jsonl` one of
//! the set of runs: neither depends on the number of threads, nor on interruptions.

mod error;
mod execute;
mod grid;
mod heat_map;
mod level;
mod markdown;
mod measure;
mod merge;
mod plan;
mod progress;
mod run;
mod shard;
mod simulated;
mod start;
mod store;
mod summary;
mod torque;

pub use error::{PlanError, StudyError};
pub use execute::execute;
pub use grid::{Grid, GridCell};
pub use heat_map::heat_maps;
pub use level::{Level, Noise};
pub use markdown::{markdown, table};
pub use merge::merge;
pub use plan::{AxisPlan, MethodPlan, Plan};
pub use progress::Progress;
pub use run::{Judged, Outcome, Run};
pub use shard::{NotAShard, Shard};
pub use simulated::{SimulatedError, check_robot, simulate};
pub use store::{Header, Store};
pub use summary::{CellSummary, Figures, Summary};
pub use torque::ReferenceTorque;
