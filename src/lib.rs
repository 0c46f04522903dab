//! The service: from frames on a drive bus to identified parameters.

pub mod stream;
