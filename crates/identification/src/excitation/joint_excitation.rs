//! Motion that can be described in words: joints move from a posture to another position and back.

use core::f64::consts::TAU;
use didim_dynamics::robot::JointIndex;

use super::series::{Course, FourierSeries, JointSeries, State};
use didim_dynamics::trajectory::Reference;

/// Highest speed relative to half the travel times ω: the maximum of sin φ − ½ sin 2φ.
pub(super) const PEAK_SPEED: f64 = 1.299_038_105_676_658;

/// Single-joint excitation: a joint moves from its start to another position and back, several
/// times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointExcitation {
    /// The joint.
    pub joint: JointIndex,
    /// Reversal position \[rad or m\].
    pub reversal_position: f64,
    /// Number of repetitions.
    pub repetitions: usize,
}

/// Excitations of joints from a posture and back, with all other joints at rest. The motion begins
/// and ends at rest without acceleration.
#[derive(Clone, Debug, PartialEq)]
pub struct JointExcitations {
    /// Duration \[s\].
    pub duration_s: f64,
    /// Start position of each joint \[rad or m\].
    pub posture: Vec<f64>,
    /// Excitations of the moving joints.
    pub excitations: Vec<JointExcitation>,
}

impl JointExcitations {
    /// Converts the motion to a Fourier series. A joint with the travel d has the displacement ½ d
    /// ((1 − cos φ) − ¼ (1 − cos 2φ)) with φ = ω t.
    pub fn series(&self) -> FourierSeries {
        let harmonics = self.excitations.iter().map(|of| 2 * of.repetitions).max().unwrap_or(0);
        let mut joints: Vec<JointSeries> = self
            .posture
            .iter()
            .map(|position: &f64| JointSeries {
                mean: *position,
                sine: vec![0.0; harmonics],
                cosine: vec![0.0; harmonics],
            })
            .collect();
        for JointExcitation { joint, reversal_position: to, repetitions: times } in
            &self.excitations
        {
            let joint_series = &mut joints[*joint];
            let half = 0.5 * (to - joint_series.mean);
            joint_series.mean += 0.75 * half;
            joint_series.cosine[times - 1] = -half;
            joint_series.cosine[2 * times - 1] = 0.25 * half;
        }
        FourierSeries { duration_s: self.duration_s, joints }
    }

    /// Returns the highest speed \[rad/s or m/s\] and acceleration \[rad/s² or m/s²\] of one of its
    /// excitations.
    pub fn peaks(&self, excitation: &JointExcitation) -> [f64; 2] {
        let travel = (excitation.reversal_position - self.posture[excitation.joint]).abs();
        let omega = TAU * excitation.repetitions as f64 / self.duration_s;
        [0.5 * PEAK_SPEED * travel * omega, travel * omega * omega]
    }

    /// Returns the motion, repeated for this multiple of its duration.
    #[must_use]
    pub(super) fn repeat(&self, times: usize) -> Self {
        let excitation_list = self
            .excitations
            .iter()
            .map(|of| JointExcitation { repetitions: times * of.repetitions, ..*of });
        let duration_s = times as f64 * self.duration_s;
        Self { duration_s, posture: self.posture.clone(), excitations: excitation_list.collect() }
    }
}

impl Course for JointExcitations {
    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns the state of the [series](JointExcitations::series) in closed form.
    fn state(&self, time_s: f64) -> State {
        let mut state = State::default();
        state.position[..self.posture.len()].copy_from_slice(&self.posture);
        if time_s <= 0.0 || time_s >= self.duration_s {
            return state;
        }
        for JointExcitation { joint, reversal_position: to, repetitions } in &self.excitations {
            let (half, omega) =
                (0.5 * (to - self.posture[*joint]), TAU * *repetitions as f64 / self.duration_s);
            let (sin, cos) = (omega * time_s).sin_cos();
            let (sin_2, cos_2) = (2.0 * sin * cos, 1.0 - 2.0 * sin * sin);
            let joint = joint.position();
            state.position[joint] += half * (1.0 - cos - 0.25 * (1.0 - cos_2));
            state.velocity[joint] = half * omega * (sin - 0.5 * sin_2);
            state.acceleration[joint] = half * omega * omega * (cos - cos_2);
            state.jerk[joint] = half * omega.powi(3) * (2.0 * sin_2 - sin);
        }
        state
    }
}

impl Reference for JointExcitations {
    fn joints(&self) -> usize {
        self.posture.len()
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        self.state(time_s).copy_to(self.joints(), position, velocity, acceleration);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_joint_excitation_is_what_is_said_of_it() {
        let excitation =
            JointExcitation { joint: JointIndex::new(1), reversal_position: -0.5, repetitions: 3 };
        let excitations = JointExcitations {
            duration_s: 6.0,
            posture: vec![0.2, 0.7],
            excitations: vec![excitation],
        };
        let series = excitations.series();
        let states: Vec<_> = (0..=6000).map(|k| series.state(f64::from(k) / 1000.0)).collect();
        for (k, of_series) in states.iter().enumerate() {
            let own = excitations.state(k as f64 / 1000.0);
            let [own, of_series] = [&own, of_series]
                .map(|s| [s.position[1], s.velocity[1], s.acceleration[1], s.jerk[1]]);
            let is_close = own.iter().zip(of_series).all(|(a, b)| (a - b).abs() < 1e-10);
            assert!(is_close, "{k}: {own:?} {of_series:?}");
        }
        let largest = |of: &dyn Fn(usize) -> f64| (0..=6000).map(of).fold(f64::MIN, f64::max);
        assert!(states.iter().all(|s| (s.position[0] - 0.2).hypot(s.velocity[0]) < 1e-15));
        assert!((largest(&|k| states[k].position[1]) - 0.7).abs() < 1e-12);
        assert!((largest(&|k| -states[k].position[1]) - 0.5).abs() < 1e-12);
        let [speed, acceleration] = excitations.peaks(&excitation);
        assert!((largest(&|k| states[k].velocity[1].abs()) / speed - 1.0).abs() < 1e-5);
        assert!((largest(&|k| states[k].acceleration[1].abs()) / acceleration - 1.0).abs() < 1e-5);
        // The joint starts at rest without acceleration, and reaches the reversal position three
        // times.
        let near = series.state(1e-6);
        assert!(near.velocity[1].abs() < 1e-9 && near.acceleration[1].abs() < 1e-4, "{near:?}");
        let turns = states.iter().filter(|s| s.position[1] < -0.5 + 1e-9).count();
        assert_eq!(turns, 3);
        let twice = excitations.repeat(2);
        let [own, of_twice] = [excitations.peaks(&excitation), twice.peaks(&twice.excitations[0])];
        assert!(own.iter().zip(of_twice).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
