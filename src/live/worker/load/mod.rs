//! Identification of the load on the flange, during motion and for each window.

mod track;
mod watch;
mod within;

pub(super) use watch::LoadWatch;
pub(super) use within::load_of_window;
