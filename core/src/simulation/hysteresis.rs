//! Friction that lags at reversals.

use serde::{Deserialize, Serialize};

use super::checked::{check_length, check_not_negative, check_positive};
use super::error::SetupError;

/// A spring that slips (Maxwell slip, as in Al-Bender, Lampaert and Swevers, *The generalized Maxwell-slip
/// model*, 2005): F = k Δq after a reversal, and ±F_max once it slides. It depends on where the joint
/// turned and not on its speed, and follows a reversal on the way 2 F_max/k.
///
/// It comes on top of the model's friction: where it is a part of the joint's Coulomb friction, that
/// parameter has to be as much smaller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaxwellSlip {
    /// F_max, the torque at which it slides \[N·m, or N\]; 0 is none.
    pub torque_nm: f64,
    /// k \[N·m/rad, or N/m\].
    pub stiffness_nm_rad: f64,
}

impl MaxwellSlip {
    /// The friction after a way from where it was `torque_nm`, positive against a positive velocity
    /// \[N·m, or N\]. The way has to be in one direction: then it is exact, whatever its length.
    fn after(&self, torque_nm: f64, way_rad: f64) -> f64 {
        let stuck = torque_nm + self.stiffness_nm_rad * way_rad;
        stuck.clamp(-self.torque_nm, self.torque_nm)
    }
}

/// The elements of all joints, with what they held at the last sample. Empty where there are none.
#[derive(Clone, Debug)]
pub(super) struct Hysteresis {
    elements: Vec<MaxwellSlip>,
    /// Position \[rad\] and friction \[N·m\] of each at the last sample.
    held: Vec<(f64, f64)>,
}

impl Hysteresis {
    pub(super) fn new(elements: Vec<MaxwellSlip>) -> Self {
        Self { held: vec![(0.0, 0.0); elements.len()], elements }
    }

    /// Unloaded, at these positions.
    pub(super) fn restart(&mut self, q: &[f64]) {
        for (held, q) in self.held.iter_mut().zip(q) {
            *held = (*q, 0.0);
        }
    }

    /// Remembers the friction at the positions of a sample. Between two samples a joint moves one way:
    /// its reversals are at samples.
    pub(super) fn settle(&mut self, q: &[f64]) {
        for ((element, held), q) in self.elements.iter().zip(&mut self.held).zip(q) {
            *held = (*q, element.after(held.1, q - held.0));
        }
    }

    /// Friction of each joint at positions since the last sample \[N·m, or N\].
    pub(super) fn torques(&self, q: &[f64]) -> impl Iterator<Item = f64> {
        let joints = self.elements.iter().zip(&self.held).zip(q);
        joints.map(|((element, held), q)| element.after(held.1, q - held.0))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The loop over there and back again encloses 4 F_max (A − F_max/k), in whatever steps.
    #[test]
    fn what_is_lost_in_a_cycle_depends_on_the_way_alone() {
        let (element, amplitude) =
            (MaxwellSlip { torque_nm: 2.0, stiffness_nm_rad: 1000.0 }, 0.01_f64);
        let expected = 4.0 * 2.0 * (amplitude - 0.002);
        for steps in [400_u32, 10_000] {
            let mut friction = Hysteresis::new(vec![element]);
            friction.restart(&[amplitude]);
            let (mut before, mut lost) = (amplitude, 0.0);
            for k in 1..=2 * steps {
                let turn = core::f64::consts::TAU * f64::from(k) / f64::from(steps);
                let q = amplitude * turn.cos();
                let half_way = friction.torques(&[0.5 * (before + q)]).sum::<f64>();
                friction.settle(&[q]);
                // The first turn loads the spring.
                if k > steps {
                    lost += half_way * (q - before);
                }
                before = q;
            }
            assert!((lost / expected - 1.0).abs() < 1e-3, "{lost}, not {expected}");
        }
    }

    #[test]
    fn a_standing_joint_keeps_its_friction_and_a_restart_forgets_it() {
        let element = MaxwellSlip { torque_nm: 2.0, stiffness_nm_rad: 1000.0 };
        let mut friction = Hysteresis::new(vec![element]);
        friction.restart(&[0.5]);
        let now = |friction: &Hysteresis, q: f64| friction.torques(&[q]).sum::<f64>();
        assert!(now(&friction, 0.5).abs() < 1e-12);
        assert!((now(&friction, 0.501) - 1.0).abs() < 1e-9);
        friction.settle(&[0.6]);
        friction.settle(&[0.6]);
        assert!((now(&friction, 0.6) - 2.0).abs() < 1e-12);
        assert!((now(&friction, 0.599) - 1.0).abs() < 1e-9);
        friction.restart(&[0.6]);
        assert!(now(&friction, 0.6).abs() < 1e-12);
    }
}
