//! Robustness studies: effects of noise and model errors on the identification methods, with a
//! simulated arm whose parameters are known.
//!
//! | step | type or function |
//! |---|---|
//! | plan file: methods, axes, levels | [`Plan`] |
//! | every level of each axis, combined with every level of all other axes | [`Grid`] |
//! | result of one method for one arm and one seed, compared with the true parameters | [`Run`] |
//! | the runs on disk, so that a study can be continued | [`Store`] |
//! | the remaining runs, on several threads | [`execute()`] |
//! | parts of the runs for several machines, and their merge | [`Shard`], [`merge()`] |
//! | the results | [`Summary`], [`markdown()`], [`heat_maps`] |
//!
//! A run is a function of its grid cell, its method and its seed. Every file except `runs.jsonl` is
//! a function of the set of runs. Neither the runs nor these files depend on the number of threads
//! or on interruptions.

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
pub use run::{Outcome, Run, TruthComparison};
pub use shard::{NotAShard, Shard};
pub use simulated::{SimulatedError, check_robot, simulate};
pub use store::{Header, Store};
pub use summary::{CellSummary, Figures, Summary};
pub use torque::ReferenceTorque;
