//! Inverse and direct dynamics, regressor, mass matrix and base parameters.
