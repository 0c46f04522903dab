//! Torque gains from records without and with a known load.

use didim_dynamics::robot::{JointIndex, ParameterKind};
use didim_identification::identification::{
    Experiment, Gains, GainsError, KnownLoad, PayloadLimits, Scale, UncertainValue,
    filtered_motion, find_gains,
};

use crate::arms::TX40;
use crate::common::arm::{Arm, Random, options, signals};

const PIPER: &str = include_str!("../../../config/robots/piper.toml");
/// Its nominal parameters are those of its scenario.
const PIPER_SCENARIO: &str = include_str!("../../../sim-fixtures/scenarios/piper.toml");
const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 3000;
/// Of each motor's torque.
const NOISE: f64 = 0.02;

/// A load 15 cm before the flange and off its axis, with own inertias that nobody configures.
const LOAD: KnownLoad = KnownLoad { mass_kg: 1.5, centre_m: [0.05, -0.03, 0.15] };
const INERTIA: [f64; 6] = [0.01, 0.001, -0.002, 0.012, 0.0, 0.008];

struct Study {
    arm: Arm,
    random: Random,
    /// True over stated gains.
    factors: Vec<f64>,
    /// Noise of each motor, of its torque.
    noise: [f64; 6],
}

impl Study {
    /// Stated gains that are wrong by factors from 1/4 to 4.
    fn new(file: &str, seed: u64) -> Self {
        let (_, of_piper) = PIPER_SCENARIO.split_once("[nominal]").unwrap();
        let nominal = if file == PIPER { format!("\n[nominal]{of_piper}") } else { String::new() };
        let (arm, mut random) = (Arm::nominal(&(file.to_owned() + &nominal)), Random(seed));
        let factors = (0..arm.robot.joints()).map(|_| 4_f64.powf(random.uniform(-1.0, 1.0)));
        let factors = factors.collect();
        Self { arm, random, factors, noise: [NOISE; 6] }
    }

    fn standard_with(&self, load: KnownLoad, inertia: [f64; 6]) -> Vec<f64> {
        let KnownLoad { mass_kg: m, centre_m: [x, y, z] } = load;
        let of_point =
            [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y].map(|of| m * of);
        let inertias = of_point.iter().zip(inertia).map(|(point, own)| point + own);
        let mut standard = self.arm.truth.clone();
        let last = self.arm.robot.joints() - 1;
        for (kind, value) in
            ParameterKind::LINK.iter().zip(inertias.chain([m * x, m * y, m * z, m]))
        {
            standard[self.arm.robot.parameters().column(*kind, JointIndex::new(last)).unwrap()] +=
                value;
        }
        standard
    }

    /// What motors measure by their stated gains.
    fn record(&mut self, standard: &[f64]) -> Experiment {
        let Self { arm, random, factors, noise } = self;
        let position = arm.positions(random, SAMPLES, RATE_HZ, 2.0);
        let silent = signals(RATE_HZ, position.clone(), position.clone());
        let silent = Experiment::joint_side(&silent).unwrap();
        let motion =
            filtered_motion(&arm.robot, &silent, &options(20.0, 0.8, 10).position_filter).unwrap();
        let torques = arm.torques_of(standard, &motion);
        let transmission = arm.robot.transmission();
        let (mut motors, mut of_motors) = (position.clone(), torques.clone());
        let (mut from, mut to) = (vec![0.0; position.len()], vec![0.0; position.len()]);
        for k in 0..SAMPLES {
            from.iter_mut().zip(&position).for_each(|(value, of)| *value = of[k]);
            transmission.motor_position(&from, &mut to);
            motors.iter_mut().zip(&to).for_each(|(of, value)| of[k] = *value);
            from.iter_mut().zip(&torques).for_each(|(value, of)| *value = of[k]);
            transmission.motor_torque(&from, &mut to);
            of_motors.iter_mut().zip(&to).for_each(|(of, value)| of[k] = *value);
        }
        for ((torque, factor), noise) in of_motors.iter_mut().zip(factors.iter()).zip(noise) {
            let square: f64 = torque.iter().map(|tau| tau * tau).sum();
            let level = *noise * (square / SAMPLES as f64).sqrt();
            torque.iter_mut().for_each(|tau| *tau = (*tau + level * random.normal()) / factor);
        }
        let signals = signals(RATE_HZ, motors, of_motors);
        Experiment::motor_side(signals, transmission).unwrap()
    }

    fn find(
        &self,
        [empty, loaded]: [&Experiment; 2],
        load: KnownLoad,
    ) -> Result<Gains, GainsError> {
        self.find_by(empty, Some((loaded, load)))
    }

    fn find_by(
        &self,
        empty: &Experiment,
        loaded: Option<(&Experiment, KnownLoad)>,
    ) -> Result<Gains, GainsError> {
        let Arm { robot, base, .. } = &self.arm;
        let transmission = Some(robot.transmission());
        find_gains(robot, base, empty, loaded, transmission, &options(20.0, 0.8, 10))
    }

    fn records(&mut self) -> [Experiment; 2] {
        let (empty, loaded) = (self.arm.truth.clone(), self.standard_with(LOAD, INERTIA));
        [self.record(&empty), self.record(&loaded)]
    }

    fn find_gains(&mut self) -> Gains {
        let [empty, loaded] = self.records();
        self.find([&empty, &loaded], LOAD).unwrap()
    }

    /// Deviations of the gains and of the parameters, in their standard deviations.
    fn deviations(&self, found: &Gains) -> [Vec<f64>; 2] {
        let of_gain = found.gains.iter().zip(&self.factors);
        let gains = of_gain.filter_map(|(gain, truth)| Some(gain.factor?.deviations_from(*truth)));
        let truth = self.arm.true_base();
        let parameters = found.parameters.iter().zip(&truth);
        [gains.collect(), parameters.map(|(of, truth)| of.found.deviations_from(*truth)).collect()]
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|z| z * z).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn gains_and_parameters_are_found_within_their_uncertainty() {
    for (file, seed) in [(TX40, 1), (TX40, 2), (PIPER, 3)] {
        let mut study = Study::new(file, seed);
        let gains_found = study.find_gains();
        let [gains, parameters] = study.deviations(&gains_found);
        assert_eq!(gains.len(), 6);
        assert!(gains.iter().all(|z| z.abs() < 4.0), "{gains:?}");
        assert!(rms(&parameters) < 1.6, "{parameters:?}");
        assert!(!gains_found.centre.unwrap().is_significant(&PayloadLimits::default()));
    }
}

#[test]
fn torques_times_a_factor_have_a_gain_as_much_smaller_and_the_same_arm() {
    let first = Study::new(TX40, 4).find_gains();
    let mut study = Study::new(TX40, 4);
    study.factors[1] /= 8.0;
    study.factors[4] /= -0.5;
    let other = study.find_gains();
    for (k, by) in [1.0, 8.0, 1.0, 1.0, -0.5, 1.0].into_iter().enumerate() {
        let [a, b] = [&first, &other].map(|of| of.gains[k].factor.unwrap());
        assert!((a.value / b.value / by - 1.0).abs() < 1e-6, "{k}");
        assert!((a.standard_deviation / b.standard_deviation / by.abs() - 1.0).abs() < 1e-3);
    }
    for (a, b) in first.parameters.iter().zip(&other.parameters) {
        assert!((a.found.value - b.found.value).abs() < 1e-4 * a.found.standard_deviation);
    }
}

/// True gains and parameters are these times one number, the true gain of the drive that is taken
/// for right.
#[test]
fn without_a_load_all_is_by_the_gain_of_one_drive() {
    let mut study = Study::new(TX40, 7);
    let [empty, _] = study.records();
    let gains = study.find_by(&empty, None).unwrap();
    let Scale::Reference(reference) = gains.scale else { panic!("{:?}", gains.scale) };
    let scale = study.factors[reference];
    let exact = UncertainValue { value: 1.0, standard_deviation: 0.0 };
    assert_eq!(gains.gains[reference].factor, Some(exact));
    let mut count = 0;
    for (gain, truth) in gains.gains.iter().zip(&study.factors) {
        let Some(factor) = gain.factor.filter(|_| gain.joint != reference) else { continue };
        assert!(factor.deviations_from(truth / scale).abs() < 4.0, "{gain:?} {}", truth / scale);
        count += usize::from(factor.standard_deviation < 0.05 * factor.value);
    }
    assert!(count >= 3, "{:?}", gains.gains);
    let truth = study.arm.true_base();
    let off = gains.parameters.iter().zip(&truth);
    let off: Vec<f64> = off.map(|(of, truth)| of.found.deviations_from(truth / scale)).collect();
    assert!(rms(&off) < 1.6, "{off:?}");
}

#[test]
fn a_drive_that_is_all_noise_keeps_its_gain_and_spoils_no_other() {
    let mut study = Study::new(TX40, 5);
    study.noise[5] = 50.0;
    let gains = study.find_gains();
    let joints: Vec<usize> = gains
        .gains
        .iter()
        .filter(|gain| gain.factor.is_some())
        .map(|gain| gain.joint.number())
        .collect();
    assert_eq!(joints, [1, 2, 3, 4, 5]);
    assert!(study.deviations(&gains)[0].iter().all(|z| z.abs() < 4.0));
}

#[test]
fn what_shows_no_gains_is_refused() {
    let mut study = Study::new(TX40, 6);
    let [empty, loaded] = study.records();
    // Nothing was carried.
    let again = study.record(&study.arm.truth.clone());
    let light = KnownLoad { mass_kg: 1e-3, ..LOAD };
    let refused = study.find([&empty, &again], light).unwrap_err();
    assert!(
        matches!(refused, GainsError::NotIdentifiable { .. } | GainsError::NotSettled { .. }),
        "{refused}"
    );
    let without_mass = KnownLoad { mass_kg: 0.0, ..LOAD };
    let refused = study.find([&empty, &loaded], without_mass).unwrap_err();
    assert!(matches!(refused, GainsError::Load { .. }));
    // A centre that is 10 cm off shows.
    let other_load = KnownLoad { centre_m: [0.05, 0.07, 0.15], ..LOAD };
    let gains = study.find([&empty, &loaded], other_load).unwrap();
    assert!(gains.centre.unwrap().is_significant(&PayloadLimits::default()));
}

/// What 40 pairs of records with 2 % of noise tell: by hand, see docs/evidence/models.md.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn gains_study() {
    println!(
        "| arm | σ of gains 1 to 6 | rms z of gains | within 2 σ | of parameters | within 2 σ | \
        identifiable |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (name, file) in [("TX40", TX40), ("PiPER", PIPER)] {
        let (mut gains, mut parameters, mut sigma) = (Vec::new(), Vec::new(), vec![Vec::new(); 6]);
        for seed in 0..40 {
            let mut study = Study::new(file, 1000 + seed);
            let gains_found = study.find_gains();
            for (sigma, gain) in sigma.iter_mut().zip(&gains_found.gains) {
                sigma.extend(gain.factor.map(|of| of.standard_deviation / of.value));
            }
            let [of_gains, of_parameters] = study.deviations(&gains_found);
            gains.extend(of_gains);
            parameters.extend(of_parameters);
        }
        let within = |of: &[f64]| {
            100.0 * of.iter().filter(|z| z.abs() < 2.0).count() as f64 / of.len() as f64
        };
        let sigma: Vec<String> = sigma.iter().map(|of| format!("{:.2}", 100.0 * rms(of))).collect();
        println!(
            "| {name} | {} % | {:.2} | {:.0} % | {:.2} | {:.0} % | {} of 240 |",
            sigma.join(" "),
            rms(&gains),
            within(&gains),
            rms(&parameters),
            within(&parameters),
            gains.len(),
        );
    }
}
