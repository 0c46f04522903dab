//! Friction with hysteresis at reversals.

use serde::{Deserialize, Serialize};

use super::checked::{check_length, check_not_negative, check_positive};
use super::error::SetupError;
use crate::MAX_JOINTS;
use crate::robot::Hysteresis;

/// A spring that slips (Maxwell slip, as in Al-Bender, Lampaert and Swevers, *The generalized
/// Maxwell-slip model*, 2005): F = k Δq after a reversal, and ±F_max once it slides. It depends on
/// the positions of reversals and not on the speed, and follows a reversal within the distance 2
/// F_max/k.
///
/// It adds to the model's friction. If it is part of the joint's Coulomb friction, reduce that
/// parameter by as much.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaxwellSlip {
    /// F_max, the torque at which it slides \[N·m, or N\]; 0 is none.
    pub torque_nm: f64,
    /// k \[N·m/rad, or N/m\].
    pub stiffness_nm_rad: f64,
}

/// Elements of all joints and their states. Empty if there are none.
#[derive(Clone, Debug)]
pub(super) struct SlipElements {
    torques_nm: Vec<f64>,
    pub(super) state: Hysteresis,
}

impl SlipElements {
    pub(super) fn new(elements: &[MaxwellSlip]) -> Self {
        let presliding = |of: &MaxwellSlip| 2.0 * of.torque_nm / of.stiffness_nm_rad;
        let torques_nm = elements.iter().map(|of| of.torque_nm).collect();
        Self { torques_nm, state: Hysteresis::new(elements.iter().map(presliding).collect()) }
    }

    /// Subtracts their friction at these positions from the torques \[N·m, or N\].
    pub(super) fn take_off(&self, q: &[f64], torques: &mut [f64; MAX_JOINTS]) {
        let shares = self.state.shares(q);
        for ((torque, own), share) in torques.iter_mut().zip(&self.torques_nm).zip(shares) {
            *torque -= own * share;
        }
    }
}

pub(super) fn validate(elements: &[MaxwellSlip], joints: usize) -> Result<(), SetupError> {
    check_length("unmodelled.hysteresis", joints, elements.len())?;
    for element in elements {
        check_not_negative("unmodelled.hysteresis.torque_nm", element.torque_nm)?;
        check_positive("unmodelled.hysteresis.stiffness_nm_rad", element.stiffness_nm_rad)?;
    }
    Ok(())
}
