//! What is stated of the arm, and wrong by a draw from its tolerance.

use didim_dynamics::Signals;
use didim_dynamics::robot::{Robot, Transmission};
use didim_identification::identification::Tolerances;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};

/// Errors of what is stated, joint by joint.
#[derive(Clone)]
pub(crate) struct Statements {
    /// Recorded over true torque, less 1, of each motor.
    gain: Vec<f64>,
    /// By how much the torque of each motor is recorded late \[s\].
    delay_s: Vec<f64>,
    /// Recorded less true position of each joint \[rad\].
    zero_rad: Vec<f64>,
    /// By how much the true geometry of each joint differs from the robot file: twist \[degrees\],
    /// then axis distance and link offset \[m\].
    geometry: Vec<[f64; 3]>,
}

impl Statements {
    /// Normal, one standard deviation being the tolerance. The same seed gives the same errors on
    /// every machine.
    pub(crate) fn draw(tolerances: &Tolerances, joints: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal =
            |deviation: f64| -> f64 { Normal::new(0.0, deviation).unwrap().sample(&mut random) };
        let common = normal(tolerances.torque_gain);
        let draw_each = |normal: &mut dyn FnMut(f64) -> f64, deviation: f64| -> Vec<f64> {
            (0..joints).map(|_| normal(deviation)).collect()
        };
        let gain = draw_each(&mut normal, tolerances.torque_gain);
        Self {
            gain: gain.into_iter().map(|own| common + own).collect(),
            delay_s: draw_each(&mut normal, tolerances.torque_delay_s),
            zero_rad: draw_each(&mut normal, tolerances.zero_deg.to_radians()),
            geometry: (0..joints)
                .map(|_| {
                    [tolerances.twist_deg, tolerances.length_m, tolerances.length_m]
                        .map(&mut normal)
                })
                .collect(),
        }
    }

    /// The arm that a robot file describes with these errors. The file's own parameters mean the
    /// same in it: the truth stays the truth.
    pub(crate) fn arm(&self, file: &str) -> Robot {
        let mut file: toml::Table = file.parse().unwrap();
        let joints = file["joint"].as_array_mut().unwrap();
        for (joint, geometry) in joints.iter_mut().zip(&self.geometry) {
            for (key, error) in ["alpha_deg", "d_m", "r_m"].into_iter().zip(geometry) {
                let value = joint[key].as_float().unwrap();
                joint[key] = toml::Value::Float(value + error);
            }
        }
        Robot::from_toml(&toml::to_string(&file).unwrap()).unwrap()
    }

    /// The signals of the motors as they are recorded.
    pub(crate) fn record(&self, signals: &mut Signals, transmission: &Transmission) {
        let mut zero = vec![0.0; self.zero_rad.len()];
        transmission.motor_position(&self.zero_rad, &mut zero);
        // The controller works with the encoders that it has: the reference is off as the position
        // is.
        let reference = signals.reference_rad.iter_mut().flatten();
        for (position, zero) in signals.position_rad.iter_mut().zip(&zero) {
            position.iter_mut().for_each(|position| *position += zero);
        }
        for (reference, zero) in reference.zip(&zero) {
            reference.iter_mut().for_each(|reference| *reference += zero);
        }
        let motors = signals.torque_nm.iter_mut().zip(self.gain.iter().zip(&self.delay_s));
        for (torque, (gain, delay_s)) in motors {
            let late = later(torque, delay_s * signals.sample_rate_hz);
            *torque = late.into_iter().map(|torque| (1.0 + gain) * torque).collect();
        }
    }
}

/// A signal so many samples later, linear between them; its ends stay.
fn later(signal: &[f64], samples: f64) -> Vec<f64> {
    let last = signal.len() - 1;
    (0..signal.len())
        .map(|k: usize| {
            let place = (k as f64 - samples).clamp(0.0, last as f64);
            #[allow(clippy::cast_possible_truncation, reason = "within the signal")]
            let before = place as usize;
            let next = signal[(before + 1).min(last)];
            signal[before] + (place - before as f64) * (next - signal[before])
        })
        .collect()
}

#[test]
fn a_signal_comes_later_by_what_is_said() {
    let signal = [0.0, 1.0, 4.0, 9.0];
    assert_eq!(later(&signal, 0.25), [0.0, 0.75, 3.25, 7.75]);
    assert_eq!(later(&signal, -1.0), [1.0, 4.0, 9.0, 9.0]);
}
