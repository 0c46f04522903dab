//! A model as source code without dependencies: inverse dynamics, gravity, friction and the
//! covariance of the torque.

mod c;
mod elementary;
mod error;
mod program;
mod rust;
mod statements;
mod tape;

pub use c::to_c;
pub use error::CodeError;
pub use program::CodeModel;
pub use rust::to_rust;
