//! Observation: the motion, and both sides of the equation y = X θ + ε along it.
//!
//! Methods solve these rows, and the judgement checks the model on them.

mod filtered_positions;
mod group;
mod hysteresis;
mod inverse_dynamics;
mod known_torque;
mod matrix;
mod motion;
mod reference;
mod torque;

pub(crate) use filtered_positions::FilteredPositions;
pub(crate) use group::{MotionGroup, States};
pub(crate) use hysteresis::{hysteresis_along, hysteresis_from};
pub(crate) use inverse_dynamics::{InverseDynamics, torque_rates};
pub(crate) use known_torque::{known_at, torque_equation};
pub use matrix::observation_matrix;
pub(crate) use matrix::{
    AuxiliaryObservation, BaseColumns, fitted_gravity_matrices, fitted_matrix, fitted_matrix_of,
    gravity_matrices_at, matrix_at, regressor_rows,
};
pub(crate) use motion::motion_along;
pub use motion::{Motion, filtered_motion};
pub(crate) use reference::find_reference;
pub(crate) use torque::{delay_samples, delayed_torque, filtered_torque};
