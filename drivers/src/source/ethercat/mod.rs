//! Sources for EtherCAT. They read the process data of captures and taps, as frames of a layout.

mod clock;
mod decode;
mod error;
mod file;
mod seen;
#[cfg(target_os = "linux")]
mod tap;

pub use error::EthercatError;
pub use file::CaptureSource;
pub use seen::TrafficSummary;
#[cfg(target_os = "linux")]
pub use tap::TapSource;
