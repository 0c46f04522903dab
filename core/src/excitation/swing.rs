//! A motion that words can say: joints that swing from a posture and back.

use core::f64::consts::TAU;

use super::series::{FourierSeries, JointSeries};

/// Highest speed of a swing, relative to half its way times ω: that of sin φ − ½ sin 2φ.
pub(super) const SPEED: f64 = 1.299_038_105_676_658;

/// A joint that moves from where it begins to another place and back, so many times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Counted from 0.
    pub joint: usize,
    /// Where it turns \[rad or m\].
    pub to: f64,
    /// How many times.
    pub times: usize,
}

/// Joints that swing from a posture and back, all others at rest; it begins and ends at rest without acceleration.
#[derive(Clone, Debug, PartialEq)]
pub struct Swings {
    /// Its length \[s\].
    pub duration_s: f64,
    /// Where each joint begins \[rad or m\].
    pub posture: Vec<f64>,
    /// Those that move.
    pub swings: Vec<Swing>,
}

impl Swings {
    /// As a series: a way d is ½ d ((1 − cos φ) − ¼ (1 − cos 2φ)), with φ = ω t.
    pub fn series(&self) -> FourierSeries {
        let harmonics = self.swings.iter().map(|of| 2 * of.times).max().unwrap_or(0);
        let rest = |position: &f64| JointSeries {
            mean: *position,
            sine: vec![0.0; harmonics],
            cosine: vec![0.0; harmonics],
        };
        let mut joints: Vec<JointSeries> = self.posture.iter().map(rest).collect();
        for Swing { joint, to, times } in &self.swings {
            let own = &mut joints[*joint];
            let half = 0.5 * (to - own.mean);
            own.mean += 0.75 * half;
            own.cosine[times - 1] = -half;
            own.cosine[2 * times - 1] = 0.25 * half;
        }
        FourierSeries { duration_s: self.duration_s, joints }
    }

    /// Highest speed \[rad/s or m/s\] and acceleration \[rad/s² or m/s²\] of one of its swings.
    pub fn peaks(&self, swing: &Swing) -> [f64; 2] {
        let way = (swing.to - self.posture[swing.joint]).abs();
        let omega = TAU * swing.times as f64 / self.duration_s;
        [0.5 * SPEED * way * omega, way * omega * omega]
    }

    /// The same for so many times its length.
    #[must_use]
    pub(super) fn repeated(&self, times: usize) -> Self {
        let swings = self.swings.iter().map(|of| Swing { times: times * of.times, ..*of });
        let duration_s = times as f64 * self.duration_s;
        Self { duration_s, posture: self.posture.clone(), swings: swings.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_is_what_is_said_of_it() {
        let swing = Swing { joint: 1, to: -0.5, times: 3 };
        let swings = Swings { duration_s: 6.0, posture: vec![0.2, 0.7], swings: vec![swing] };
        let series = swings.series();
        let states: Vec<_> = (0..=6000).map(|k| series.state(f64::from(k) / 1000.0)).collect();
        let largest = |of: &dyn Fn(usize) -> f64| (0..=6000).map(of).fold(f64::MIN, f64::max);
        assert!(states.iter().all(|s| (s.position[0] - 0.2).hypot(s.velocity[0]) < 1e-15));
        assert!((largest(&|k| states[k].position[1]) - 0.7).abs() < 1e-12);
        assert!((largest(&|k| -states[k].position[1]) - 0.5).abs() < 1e-12);
        let [speed, acceleration] = swings.peaks(&swing);
        assert!((largest(&|k| states[k].velocity[1].abs()) / speed - 1.0).abs() < 1e-5);
        assert!((largest(&|k| states[k].acceleration[1].abs()) / acceleration - 1.0).abs() < 1e-5);
        // At rest without acceleration, and there three times.
        let near = series.state(1e-6);
        assert!(near.velocity[1].abs() < 1e-9 && near.acceleration[1].abs() < 1e-4, "{near:?}");
        let turns = states.iter().filter(|s| s.position[1] < -0.5 + 1e-9).count();
        assert_eq!(turns, 3);
        let twice = swings.repeated(2);
        let [own, of_twice] = [swings.peaks(&swing), twice.peaks(&twice.swings[0])];
        assert!(own.iter().zip(of_twice).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
