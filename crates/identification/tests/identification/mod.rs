//! IDIM-LS on simulated motions and on the real recording, through the public interface.

mod checks;
mod cross_validation;
mod exact;
mod friction;
mod noise;
mod recorded_torque;
mod recording;
mod recordings;
mod refusals;
mod robust;
mod timing;
mod unchecked;
