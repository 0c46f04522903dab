//! External torque of every sample, as soon as the bus thread has it.
//!
//! The bus thread passes each sample to a queue without waiting ([`SampleTap`]). The observer
//! thread ([`Observing`]) runs the momentum observer and publishes one message per sample: in
//! shared memory for processes of the service's user, then to the clients of a socket for everybody
//! else. A third thread ([`watch_models`]) reads new results and hands over complete observers, so
//! that the observer thread reads no file and allocates no model.

mod clients;
mod models;
mod observing;
mod samples;
mod status;

pub use clients::{ClientSender, Clients, MAX_CLIENTS, clients};
pub use models::{ModelQueue, ModelSource, ObserverModel, watch_models};
pub use observing::{Observing, ObservingParts};
pub use samples::{ObservedSample, SampleTap, sample_queue};
pub use status::{ExternalTorqueStatus, JointTorque, SharedExternalTorque};
