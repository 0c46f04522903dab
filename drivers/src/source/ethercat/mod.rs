//! EtherCAT as a source: process data of captures and of a tap, as the frames of their layout.

mod clock;
mod decode;
mod error;
mod file;
mod seen;
mod tap;

pub use error::EthercatError;
pub use file::CaptureSource;
pub use seen::TrafficSummary;
pub use tap::TapSource;
