//! Arms with an error of their own, whose statements are wrong by a draw as well.

use didim_dynamics::robot::Robot;
use didim_dynamics::simulation::{
    Cogging, FlexibleMode, MaxwellSlip, NoiseConfig, Stribeck, Unmodelled,
};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{Experiment, Tolerances};
use didim_sim::{PlaybackConfig, Scenario, tx40_paper};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};

use super::statements::Statements;
use crate::common::experiment::{MOTIONS, REST, on_random_moves};

const SCENARIO: &str = include_str!("../../scenarios/tx40-paper.toml");
const FILE: &str = include_str!("../../../config/robots/tx40.toml");

/// The row of motor 6 in the robot file, and as someone has it who knows of no coupling.
const COUPLED: &str = "[0.0, 0.0, 0.0, 0.0, 32.0, 32.0]";
const UNCOUPLED: &str = "[0.0, 0.0, 0.0, 0.0, 0.0, 32.0]";

/// Coulomb friction grows by some such share of the load in a joint of an industrial robot:
/// Bittencourt, Wernholt, Sander-Tavallaey and Brogårdh, *An extended friction model to capture
/// load and temperature effects in robot joints*, 2010.
const LOAD_SHARE: f64 = 0.0234;

/// Of Coulomb friction, what lags at reversals, and F_max/k \[rad\]: twice that way turns it, at 20
/// rad/s² 20 ms after the joint.
const LAGGING: f64 = 0.5;
const WAY_RAD: f64 = 0.002;

/// Ripple of each motor over the rms of its torque.
const RIPPLE: f64 = 0.05;

/// One sample in so many is recorded where the bus is slow: 500 Hz.
const SLOW: usize = 10;

/// Random moves of these seeds where there are 50 times the data, and of this one where a model is
/// tried on another motion.
const LONG_MOTIONS: [u64; 3] = [1, 9, 21];
const OTHER_MOTION: u64 = 33;

/// How much is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Length {
    /// The study's 6.9 s.
    Study,
    /// 50 times as long, none of it twice.
    FiftyTimes,
}

/// What the arm has that its model has not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Own {
    Nothing,
    Width,
    Stribeck,
    Load,
    Coupling,
    WidthDrawn,
    Cogging,
    Flexible,
    Rate,
    Hysteresis,
}

impl Own {
    pub(crate) const ALL: [Self; 10] = [
        Self::Nothing,
        Self::Width,
        Self::Stribeck,
        Self::Load,
        Self::Coupling,
        Self::WidthDrawn,
        Self::Cogging,
        Self::Flexible,
        Self::Rate,
        Self::Hysteresis,
    ];

    pub(crate) fn description(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Width => "Coulomb friction of width 0.2 in place of 0.05 rad/s",
            Self::Stribeck => "Stribeck friction, fs = 0.1 fc, vs = 0.1 rad/s",
            Self::Load => "Coulomb friction that grows by 2.34 % of the load",
            Self::Coupling => "the coupling of the wrist, which the robot file leaves out",
            Self::WidthDrawn => "a width of Coulomb friction drawn from 0.02 to 0.2 rad/s",
            Self::Cogging => "ripple of 5 % of each motor's torque, six periods a turn",
            Self::Flexible => "flexible joints, 60 to 120 Hz",
            Self::Rate => "nothing; recorded at 500 Hz",
            Self::Hysteresis => "half of Coulomb friction turning within 4 mrad",
        }
    }

    /// The robot file that is identified with.
    pub(crate) fn file(self) -> String {
        if self != Self::Coupling {
            return FILE.to_owned();
        }
        // Such an arm has no friction of a coupled motor.
        let file = FILE.replace(COUPLED, UNCOUPLED);
        file.replace("fv_m6", "# fv_m6").replace("fc_m6", "# fc_m6")
    }

    /// The true value of a parameter: the coefficient in the arm's own law, at speed and load zero.
    /// With the coupling left out, joint 6 is motor 6, and a parameter is what a joint has when it
    /// moves alone in these coordinates. A joint's viscous friction contains that of its motor, see
    /// crates/dynamics/src/dynamics/drives.rs.
    pub(crate) fn truth(self, name: &str) -> f64 {
        let truth_of = |name: &str| tx40_paper().unwrap().truth_of(name).unwrap();
        match (self, name) {
            (Self::Coupling, "ia5") => truth_of("ia5") - truth_of("ia6"),
            (Self::Coupling, "fv5") => truth_of("fv5") + truth_of("fv6") - 2.0 * truth_of("fv_m6"),
            (Self::Coupling, "fc5") => truth_of("fc5") + truth_of("fc6"),
            (Self::Coupling, "fc6") => truth_of("fc6") + truth_of("fc_m6"),
            _ => truth_of(name),
        }
    }

    /// What is put into the simulated arm.
    fn unmodelled(self, seed: u64) -> Option<Unmodelled> {
        let paper = tx40_paper().unwrap();
        let coulomb = (1..=6).map(|joint| paper.truth_of(&format!("fc{joint}")).unwrap());
        let none = Unmodelled::default();
        Some(match self {
            Self::Nothing | Self::Coupling | Self::Rate => return None,
            Self::Width => Unmodelled { coulomb_width_rad_s: Some(0.2), ..none },
            Self::WidthDrawn => {
                let exponent = Uniform::new(0.02_f64.ln(), 0.2_f64.ln()).unwrap();
                // Another stream than that of the statements.
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream(1);
                let width = exponent.sample(&mut random).exp();
                Unmodelled { coulomb_width_rad_s: Some(width), ..none }
            }
            Self::Stribeck => {
                let of_joint = |fc: f64| Stribeck {
                    torque_nm: 0.1 * fc,
                    velocity_rad_s: 0.1,
                    sign_width_rad_s: 0.05,
                };
                Unmodelled { stribeck: Some(coulomb.map(of_joint).collect()), ..none }
            }
            Self::Load => Unmodelled { load_friction: Some(vec![LOAD_SHARE; 6]), ..none },
            Self::Hysteresis => {
                let of_joint = |fc: f64| MaxwellSlip {
                    torque_nm: LAGGING * fc,
                    stiffness_nm_rad: LAGGING * fc / WAY_RAD,
                };
                Unmodelled { hysteresis: Some(coulomb.map(of_joint).collect()), ..none }
            }
            Self::Cogging => {
                let record = paper.closed_loop().unwrap().run(paper.samples()).unwrap();
                let of_motor = |torque: nalgebra::DVectorView<'_, f64>| Cogging {
                    torque_nm: RIPPLE * torque.norm() / (torque.len() as f64).sqrt(),
                    periods_per_turn: 6,
                    phase_rad: 0.0,
                };
                let cogging = record.motor_torque_nm.column_iter().map(of_motor).collect();
                Unmodelled { cogging: Some(cogging), ..none }
            }
            Self::Flexible => {
                let modes = [(60.0, 0.4), (60.0, 0.3), (80.0, 0.04), (100.0, 0.01), (120.0, 0.01)];
                let modes = modes.into_iter().chain([(120.0, 0.003)]);
                let mode = |(frequency_hz, inertia_kg_m2)| FlexibleMode {
                    frequency_hz,
                    damping_ratio: 0.05,
                    inertia_kg_m2,
                };
                Unmodelled { flexible: Some(modes.map(mode).collect()), ..none }
            }
        })
    }
}

/// One run: an arm with its own error whose statements are wrong.
pub(crate) struct Arm {
    own: Own,
    statements: Statements,
    scenario: Scenario,
    seed: u64,
}

impl Arm {
    pub(crate) fn new(own: Own, seed: u64) -> Self {
        let statements = Statements::draw(&Tolerances::default(), 6, seed);
        // What lags is a part of Coulomb friction.
        let robot = statements.arm(FILE).with_scaled_nominal(|name: &str| {
            let of_joint = name.starts_with("fc") && name != "fc_m6";
            if own == Own::Hysteresis && of_joint { 1.0 - LAGGING } else { 1.0 }
        });
        let mut scenario = Scenario::from_toml(SCENARIO, robot).unwrap().with_seed(seed);
        if let Some(unmodelled) = own.unmodelled(seed) {
            scenario = scenario.with_unmodelled(unmodelled).unwrap();
        }
        Self { own, statements, scenario, seed }
    }

    /// The same arm with the same wrong statements, recorded with other noise.
    pub(crate) fn with_noise_of(&self, seed: u64) -> Self {
        let (own, statements) = (self.own, self.statements.clone());
        Self { own, statements, scenario: self.scenario.clone().with_seed(seed), seed }
    }

    /// What is recorded of it on one of three motions, as the robot file has it.
    pub(crate) fn experiment(&self, robot: &Robot, motion: usize, length: Length) -> Experiment {
        let scenario = self.scenario.clone();
        let length_of_one = scenario.samples();
        let (scenario, samples) = match (length, MOTIONS[motion]) {
            (Length::Study, None) => (scenario, length_of_one),
            (Length::Study, Some(seed)) => (on_random_moves(scenario, seed, 14), length_of_one),
            (Length::FiftyTimes, _) => {
                (on_random_moves(scenario, LONG_MOTIONS[motion], 50 * 14), 50 * length_of_one)
            }
        };
        self.recorded(scenario, robot, samples)
    }

    /// The same arm without noise on another motion.
    pub(crate) fn other_motion(&self, robot: &Robot) -> Experiment {
        let quiet = self.scenario.clone().with_noise(NoiseConfig::with_seed(self.seed)).unwrap();
        let samples = quiet.samples();
        self.recorded(on_random_moves(quiet, OTHER_MOTION, 14), robot, samples)
    }

    /// The motion with a rest before and after it, as
    /// [`experiment`](crate::common::experiment::experiment) has it, recorded with what is stated
    /// wrongly.
    fn recorded(&self, scenario: Scenario, robot: &Robot, samples: usize) -> Experiment {
        let hold_s = scenario.controller().timing.sample_period_s();
        let rest_s = REST as f64 * hold_s;
        let rests = PlaybackConfig { lead_in_s: rest_s, tail_s: rest_s, cycles: Some(1) };
        let scenario = scenario.with_playback(rests).unwrap();
        let record = scenario.played_loop().unwrap().run(REST + samples + REST).unwrap();
        let mut signals = record.motor_signals();
        drop(record);
        self.statements.record(&mut signals, scenario.robot().transmission());
        let every = if self.own == Own::Rate { SLOW } else { 1 };
        if every > 1 {
            signals.sample_rate_hz /= every as f64;
            let Signals { position_rad, torque_nm, reference_rad, .. } = &mut signals;
            for signal in [position_rad, torque_nm].into_iter().chain(reference_rad).flatten() {
                *signal = signal.iter().step_by(every).copied().collect();
            }
        }
        Experiment::motor_side(&signals, robot.transmission())
            .unwrap()
            .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
            .unwrap()
            .with_counted(REST / every..(REST + samples) / every)
            .unwrap()
    }

    /// One row in so many samples, 40 or 42 a second.
    pub(crate) fn decimation(&self) -> usize {
        if self.own == Own::Rate { 12 } else { 125 }
    }
}
