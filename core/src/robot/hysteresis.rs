//! The state of friction that lags at reversals.

use super::{JointFriction, Robot};
use crate::MAX_JOINTS;

/// Where friction that lags stands between its two directions, −1 to 1, of every joint: a spring that slips. After a
/// reversal it turns over a way, in proportion to what the joint has gone, and then slides. It depends on where the joint
/// turned and not on its speed.
#[derive(Clone, Debug)]
pub struct Hysteresis {
    /// The way over which it turns \[rad or m\]; 0 at joints without, where it stands at 0.
    ways: Vec<f64>,
    /// Position \[rad or m\] and share of each joint at the last sample; nothing before the first.
    held: Vec<(f64, f64)>,
}

impl Hysteresis {
    /// That of joints with these ways \[rad or m\], 0 at those without.
    pub fn new(ways: Vec<f64>) -> Self {
        Self { ways, held: Vec::new() }
    }

    /// That of a robot; nothing where no joint has any.
    pub fn of(robot: &Robot) -> Option<Self> {
        let ways: Vec<_> = robot.own_friction().iter().map(JointFriction::way).collect();
        let any = ways.iter().any(Option::is_some);
        any.then(|| Self::new(ways.into_iter().map(Option::unwrap_or_default).collect()))
    }

    /// The same over ways of this share of those that it has.
    #[must_use]
    pub(crate) fn with_ways_of(mut self, share: f64) -> Self {
        self.ways.iter_mut().for_each(|way| *way *= share);
        self
    }

    /// Midway between both directions, at these positions \[rad or m\].
    pub fn restart(&mut self, q: &[f64]) {
        self.held.clear();
        self.held.extend(q.iter().map(|q| (*q, 0.0)));
    }

    /// Remembers where it stands at the positions \[rad or m\] of a sample. Between two samples a joint moves one way: its reversals are
    /// at samples.
    pub fn settle(&mut self, q: &[f64]) {
        for ((way, held), q) in self.ways.iter().zip(&mut self.held).zip(q) {
            *held = (*q, after(*way, *held, *q));
        }
    }

    /// Where it stands at positions \[rad or m\] since the last sample, 0 beyond the joints. Exact over a way in one direction.
    pub fn shares(&self, q: &[f64]) -> [f64; MAX_JOINTS] {
        let mut shares = [0.0; MAX_JOINTS];
        let joints = self.ways.iter().zip(&self.held).zip(q);
        for (share, ((way, held), q)) in shares.iter_mut().zip(joints) {
            *share = after(*way, *held, *q);
        }
        shares
    }

    /// Where it stands at the positions \[rad or m\] of the next sample, the first of which finds it midway.
    pub fn follow(&mut self, q: &[f64]) -> [f64; MAX_JOINTS] {
        if self.held.is_empty() {
            self.restart(q);
        }
        self.settle(q);
        self.shares(q)
    }

    /// How much it turns for each unit of way \[1/rad or 1/m\] at a joint, counted from 0, where it does not slide; 0 at
    /// joints without.
    pub(crate) fn slope(&self, joint: usize) -> f64 {
        if self.ways[joint] > 0.0 { 2.0 / self.ways[joint] } else { 0.0 }
    }
}

fn after(way: f64, (position, share): (f64, f64), q: f64) -> f64 {
    if way > 0.0 { (share + 2.0 * (q - position) / way).clamp(-1.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The loop over there and back again encloses 4 (A − ½ way), in whatever steps.
    #[test]
    fn what_is_lost_in_a_cycle_depends_on_the_way_alone() {
        let (way, amplitude) = (0.004, 0.01_f64);
        let expected = 4.0 * (amplitude - 0.5 * way);
        for steps in [400_u32, 10_000] {
            let mut friction = Hysteresis::new(vec![way]);
            friction.restart(&[amplitude]);
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
        friction.restart(&[0.5, 0.5]);
        let now = |friction: &Hysteresis, q: f64| friction.shares(&[q, q])[0];
        assert!(now(&friction, 0.5).abs() < 1e-12);
        assert!((now(&friction, 0.501) - 0.5).abs() < 1e-9);
        friction.settle(&[0.6, 0.6]);
        friction.settle(&[0.6, 0.6]);
        assert!((now(&friction, 0.6) - 1.0).abs() < 1e-12);
        assert!((now(&friction, 0.599) - 0.5).abs() < 1e-9);
        assert!(friction.shares(&[0.599, 0.599])[1].abs() < f64::MIN_POSITIVE, "no such joint");
        friction.restart(&[0.6, 0.6]);
        assert!(now(&friction, 0.6).abs() < 1e-12);
    }
}
