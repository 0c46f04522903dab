//! Binary logs of Vector's tools (BLF): objects in compressed containers.
//!
//! A file begins with a header, `LOGG`. Objects follow, each with a header `LOBJ`, its length and
//! its type. An object of the type "container" holds further objects, compressed by zlib; an object
//! may continue in the next container. Objects that are no frames are skipped. Stamps are times
//! since the start of the recording. Channel 1 is the interface `can1`, as in a text log (ASC).

mod error;
mod file;
mod object;

pub use error::BlfError;
pub use file::BlfSource;
