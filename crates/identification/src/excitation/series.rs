//! Motion as a finite Fourier series.

use core::f64::consts::TAU;

use didim_dynamics::MAX_JOINTS;
use didim_dynamics::trajectory::Reference;

/// Series of one joint: mean + Σ sine_k sin(k ω t) + cosine_k cos(k ω t), k from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSeries {
    /// Mean position \[rad or m\].
    pub mean: f64,
    /// Coefficients of the sines \[rad or m\].
    pub sine: Vec<f64>,
    /// Coefficients of the cosines \[rad or m\].
    pub cosine: Vec<f64>,
}

/// Motion of a given duration, with one series per joint and ω = 2π / duration. A designed motion
/// begins and ends in the same position, at rest and without acceleration.
#[derive(Clone, Debug, PartialEq)]
pub struct FourierSeries {
    /// Duration \[s\].
    pub duration_s: f64,
    /// One series per joint.
    pub joints: Vec<JointSeries>,
}

/// Motion of a given duration, with its derivatives at every time.
pub trait Course: Reference {
    /// Returns the duration of the motion \[s\].
    fn duration_s(&self) -> f64;

    /// Returns the state at a given time. Before the start and after the end, the arm is at rest in
    /// the first or last position.
    fn state(&self, time_s: f64) -> State;

    /// Returns the Fourier series; `None` if the motion is not a series.
    fn series(&self) -> Option<&FourierSeries> {
        None
    }
}

/// Position and its first three derivatives of every joint; 0 beyond the number of joints.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Position \[rad or m\].
    pub position: [f64; MAX_JOINTS],
    /// Velocity \[rad/s or m/s\].
    pub velocity: [f64; MAX_JOINTS],
    /// Acceleration \[rad/s² or m/s²\].
    pub acceleration: [f64; MAX_JOINTS],
    /// Jerk \[rad/s³ or m/s³\].
    pub jerk: [f64; MAX_JOINTS],
}

impl State {
    /// Copies the values of a [`Reference`] with this number of joints.
    pub fn copy_to(
        &self,
        joints: usize,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        position[..joints].copy_from_slice(&self.position[..joints]);
        velocity[..joints].copy_from_slice(&self.velocity[..joints]);
        acceleration[..joints].copy_from_slice(&self.acceleration[..joints]);
    }
}

impl FourierSeries {
    /// Returns the state at a given time. Before the start and after the end, the arm is at rest in
    /// the first or last position.
    pub fn state(&self, time_s: f64) -> State {
        let mut state = State::default();
        let inside = time_s > 0.0 && time_s < self.duration_s;
        let omega = TAU / self.duration_s;
        let phase = if inside { omega * time_s } else { 0.0 };
        for (j, joint) in self.joints.iter().enumerate() {
            state.position[j] = joint.mean;
        }
        let harmonics = self.joints.iter().map(|joint| joint.sine.len()).max().unwrap_or(0);
        let first = phase.sin_cos();
        let (mut sin, mut cos) = first;
        for k in 0..harmonics {
            let w = (1.0 + k as f64) * omega;
            for (j, joint) in self.joints.iter().enumerate() {
                let (a, b) = (joint.sine[k], joint.cosine[k]);
                let (own, quadrature) = (a * sin + b * cos, a * cos - b * sin);
                state.position[j] += own;
                state.velocity[j] += w * quadrature;
                state.acceleration[j] -= w * w * own;
                state.jerk[j] -= w * w * w * quadrature;
            }
            // The angle of the next harmonic, by addition of the first.
            (sin, cos) = (sin * first.1 + cos * first.0, cos * first.1 - sin * first.0);
        }
        if !inside {
            state.velocity = [0.0; MAX_JOINTS];
            state.acceleration = [0.0; MAX_JOINTS];
            state.jerk = [0.0; MAX_JOINTS];
        }
        state
    }

    /// Returns the motion with all amplitudes scaled about its start position.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            duration_s: self.duration_s,
            joints: self
                .joints
                .iter()
                .map(|joint: &JointSeries| {
                    let start = joint.mean + joint.cosine.iter().sum::<f64>();
                    JointSeries {
                        mean: start + factor * (joint.mean - start),
                        sine: joint.sine.iter().map(|a| factor * a).collect(),
                        cosine: joint.cosine.iter().map(|b| factor * b).collect(),
                    }
                })
                .collect(),
        }
    }
}

impl Course for FourierSeries {
    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn state(&self, time_s: f64) -> State {
        self.state(time_s)
    }

    fn series(&self) -> Option<&FourierSeries> {
        Some(self)
    }
}

impl Reference for FourierSeries {
    fn joints(&self) -> usize {
        self.joints.len()
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
