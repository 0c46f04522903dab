//! A load that is known.

use serde::Serialize;

/// A load whose mass and centre somebody knows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KnownLoad {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Centre of mass in the frame of the last link \[m\].
    pub centre_m: [f64; 3],
}
