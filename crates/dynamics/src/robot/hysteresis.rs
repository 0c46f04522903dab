//! State of friction with hysteresis at reversals.

use super::{JointFriction, Robot};
use crate::MAX_JOINTS;

/// Hysteresis of the friction between its two directions, −1 to 1, of every joint: a spring that
/// slips. After a reversal it changes over the presliding distance, in proportion to the travel of
/// the joint, and then slides. It depends on the positions of reversals and not on the speed.
#[derive(Clone, Debug)]
pub struct Hysteresis {
    /// Presliding distance of each joint \[rad or m\]; 0 at joints without hysteresis, whose state
    /// stays 0.
    presliding_distances: Vec<f64>,
    /// Position \[rad or m\] and share of each joint at the last sample; empty before the first.
    states: Vec<(f64, f64)>,
}

impl Hysteresis {
    /// Creates the hysteresis of joints with these presliding distances \[rad or m\], 0 at those
    /// without.
    pub fn new(presliding_distances: Vec<f64>) -> Self {
        Self { presliding_distances, states: Vec::new() }
    }

    /// Creates the hysteresis of a robot; `None` if no joint has any.
    pub fn from_robot(robot: &Robot) -> Option<Self> {
        let presliding_distances: Vec<_> =
            robot.own_friction().iter().map(JointFriction::presliding_distance).collect();
        let any = presliding_distances.iter().any(Option::is_some);
        any.then(|| {
            Self::new(presliding_distances.into_iter().map(Option::unwrap_or_default).collect())
        })
    }

    /// Returns the same with presliding distances scaled by this share.
    #[must_use]
    pub fn with_scaled_distances(mut self, share: f64) -> Self {
        self.presliding_distances
            .iter_mut()
            .for_each(|presliding_distance| *presliding_distance *= share);
        self
    }

    /// Sets the state midway between both directions, at these positions \[rad or m\].
    pub fn restart_at(&mut self, q: &[f64]) {
        self.states.clear();
        self.states.extend(q.iter().map(|q| (*q, 0.0)));
    }

    /// Updates the state of each joint to its position \[rad or m\] at a sample. Between two
    /// samples a joint is assumed to move in one direction, so its reversals are at samples.
    pub fn settle(&mut self, q: &[f64]) {
        for ((presliding_distance, states), q) in
            self.presliding_distances.iter().zip(&mut self.states).zip(q)
        {
            *states = (*q, share_after(*presliding_distance, *states, *q));
        }
    }

    /// Returns the shares at positions \[rad or m\] since the last sample, 0 beyond the joints.
    /// Exact within a presliding distance in one direction.
    pub fn shares(&self, q: &[f64]) -> [f64; MAX_JOINTS] {
        let mut shares = [0.0; MAX_JOINTS];
        let joints = self.presliding_distances.iter().zip(&self.states).zip(q);
        for (share, ((presliding_distance, states), q)) in shares.iter_mut().zip(joints) {
            *share = share_after(*presliding_distance, *states, *q);
        }
        shares
    }

    /// Advances to the positions \[rad or m\] of the next sample. At the first sample the state is
    /// midway.
    pub fn advance_to(&mut self, q: &[f64]) -> [f64; MAX_JOINTS] {
        if self.states.is_empty() {
            self.restart_at(q);
        }
        self.settle(q);
        self.shares(q)
    }

    /// Returns the derivative of the share with respect to the position \[1/rad or 1/m\] at a
    /// joint, counted from 0, where it does not slide; 0 at joints without hysteresis.
    pub(crate) fn slope(&self, joint: usize) -> f64 {
        if self.presliding_distances[joint] > 0.0 {
            2.0 / self.presliding_distances[joint]
        } else {
            0.0
        }
    }
}

fn share_after(presliding_distance: f64, (position, share): (f64, f64), q: f64) -> f64 {
    if presliding_distance > 0.0 {
        (share + 2.0 * (q - position) / presliding_distance).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The loop over there and back again encloses 4 (A − ½ distance), in whatever steps.
    #[test]
    fn what_is_lost_in_a_cycle_depends_on_the_way_alone() {
        let (distance, amplitude) = (0.004, 0.01_f64);
        let expected = 4.0 * (amplitude - 0.5 * distance);
        for steps in [400_u32, 10_000] {
            let mut friction = Hysteresis::new(vec![distance]);
            friction.restart_at(&[amplitude]);
            let (mut before, mut lost) = (amplitude, 0.0);
            for k in 1..=2 * steps {
                let turn = core::f64::consts::TAU * f64::from(k) / f64::from(steps);
                let q = amplitude * turn.cos();
                let half_way = friction.shares(&[0.5 * (before + q)])[0];
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
        let mut friction = Hysteresis::new(vec![0.004, 0.0]);
        friction.restart_at(&[0.5, 0.5]);
        let now = |friction: &Hysteresis, q: f64| friction.shares(&[q, q])[0];
        assert!(now(&friction, 0.5).abs() < 1e-12);
        assert!((now(&friction, 0.501) - 0.5).abs() < 1e-9);
        friction.settle(&[0.6, 0.6]);
        friction.settle(&[0.6, 0.6]);
        assert!((now(&friction, 0.6) - 1.0).abs() < 1e-12);
        assert!((now(&friction, 0.599) - 0.5).abs() < 1e-9);
        assert!(friction.shares(&[0.599, 0.599])[1].abs() < f64::MIN_POSITIVE, "no such joint");
        friction.restart_at(&[0.6, 0.6]);
        assert!(now(&friction, 0.6).abs() < 1e-12);
    }
}
