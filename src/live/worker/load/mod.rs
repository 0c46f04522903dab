//! The load on the flange, while the arm moves and for each window.

mod status;
mod track;
mod watch;
mod within;

pub use status::{LoadState, LoadStatus};
pub(super) use watch::LoadWatch;
pub(super) use within::load_of_window;
