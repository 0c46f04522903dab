//! A load on the last link of arms that are known as well as an identification knows them.

use didim_core::feasibility::Body;
use didim_core::identification::{
    Declared, Experiment, KnownModel, Method, Options, ParameterCovariance, Payload, PayloadError,
    filtered_motion, identify, payload,
};
use didim_core::robot::ParameterKind;
use nalgebra::{DMatrix, Matrix3, Matrix4, Vector3};

use crate::common::arm::{Arm, Random, options, signals};
use crate::dynamics::arms::TX40;

const RATE_HZ: f64 = 200.0;
const SAMPLES: usize = 3000;

/// An arm, as an identification of it without load knows it.
struct Known {
    arm: Arm,
    random: Random,
    options: Options,
    parameters: Vec<(String, f64)>,
    covariance: DMatrix<f64>,
}

/// Torques along a motion are those of these standard parameters, with noise of so much of each joint's.
fn record(arm: &Arm, random: &mut Random, standard: &[f64], noise: f64) -> Experiment {
    let position = arm.positions(random, SAMPLES, RATE_HZ, 2.0);
    let silent = signals(RATE_HZ, position.clone(), position.clone());
    let silent = Experiment::joint_side(&silent).unwrap();
    let motion = filtered_motion(&silent, &options(20.0, 0.8, 10).position_filter).unwrap();
    let mut torques = arm.torques_of(standard, &motion);
    for torque in &mut torques {
        let square: f64 = torque.iter().map(|tau| tau * tau).sum();
        let level = noise * (square / SAMPLES as f64).sqrt();
        torque.iter_mut().for_each(|tau| *tau += level * random.normal());
    }
    Experiment::joint_side(&signals(RATE_HZ, position, torques)).unwrap()
}

impl Known {
    fn identified(arm: Arm, mut random: Random, noise: f64) -> Self {
        let options = options(20.0, 0.8, 10);
        let record = record(&arm, &mut random, &arm.truth, noise);
        let found = identify(Method::IdimLs, &arm.robot, &arm.base, &record, &options).unwrap();
        let estimate = found.estimate;
        let covariance = estimate.covariance.unwrap().matrix(estimate.parameters.len()).unwrap();
        let parameters = estimate.parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
        Self { arm, random, options, parameters, covariance }
    }

    /// The arm with this body on its last link.
    fn with(&self, body: &Body) -> Vec<f64> {
        let mut standard = self.arm.truth.clone();
        let last = self.arm.robot.joints() - 1;
        for (kind, value) in ParameterKind::LINK.iter().zip(body.parameters()) {
            standard[self.arm.robot.parameters().column(*kind, last).unwrap()] += value;
        }
        standard
    }

    fn try_find(&self, record: &Experiment, declared: Declared) -> Result<Payload, PayloadError> {
        let Self { arm, options, parameters, covariance, .. } = self;
        let parameters: Vec<(&str, f64)> =
            parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let model = KnownModel { parameters: &parameters, kept: &[], uncertainty: None };
        let covariance = ParameterCovariance::of(covariance);
        payload(&arm.robot, &arm.base, record, options, model, &covariance, declared)
    }

    fn find(&self, record: &Experiment) -> Payload {
        self.try_find(record, Declared::default()).unwrap()
    }

    /// A record with this body, 2 % of the torque noise.
    fn record(&mut self, body: &Body) -> Experiment {
        let standard = self.with(body);
        record(&self.arm, &mut self.random, &standard, 0.02)
    }
}

fn tx40(seed: u64) -> Known {
    Known::identified(Arm::nominal(TX40), Random(seed), 0.02)
}

fn seven(seed: u64) -> Known {
    let mut random = Random(seed);
    let arm = Arm::random(&mut random, 7);
    Known::identified(arm, random, 0.02)
}

/// A body of 0.1 m to 0.3 m somewhere before the flange.
fn block(random: &mut Random, mass_kg: f64) -> Body {
    let c = Vector3::from_fn(|_, _| random.uniform(-0.1, 0.1)) + Vector3::z() * 0.1;
    let extent = Vector3::from_fn(|_, _| random.uniform(0.1, 0.3).powi(2) / 12.0);
    let second = Matrix3::from_diagonal(&extent) + c * c.transpose();
    let mut pseudo = Matrix4::zeros();
    pseudo.fixed_view_mut::<3, 3>(0, 0).copy_from(&second);
    pseudo.fixed_view_mut::<3, 1>(0, 3).copy_from(&c);
    pseudo.fixed_view_mut::<1, 3>(3, 0).copy_from(&c.transpose());
    pseudo[(3, 3)] = 1.0;
    Body::from_pseudo_inertia(&(pseudo * mass_kg))
}

/// The mass whose torques are this share of the arm's \[kg\].
fn mass_of_share(known: &Known, share: f64) -> f64 {
    let mut random = Random(1);
    let motion = known.arm.motion(&mut random, 500, RATE_HZ, 2.0);
    let square = |standard: &[f64]| {
        let torques = known.arm.torques_of(standard, &motion);
        torques.iter().flatten().map(|tau| tau * tau).sum::<f64>()
    };
    let mut alone = known.with(&block(&mut random, 1.0));
    alone.iter_mut().zip(&known.arm.truth).for_each(|(of, arm)| *of -= arm);
    share * (square(&known.arm.truth) / square(&alone)).sqrt()
}

/// How far what is found is from the body, in its standard deviations: of mass, centre, inertia and the parameters.
fn deviations(found: &Payload, body: &Body) -> Vec<f64> {
    let (c, i) = (body.centre_of_mass_m().unwrap(), body.inertia_about_centre().unwrap());
    let i = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| i[at]);
    let load = &found.load;
    let mass = [(load.mass_kg, body.mass_kg)];
    let centre = load.centre_m.into_iter().zip(c.iter().copied());
    let all = mass.into_iter().chain(centre).chain(load.inertia_kg_m2.into_iter().zip(i));
    all.filter_map(|(found, truth)| Some(found?.deviations_from(truth))).collect()
}

#[test]
fn a_payload_comes_back_within_its_uncertainty() {
    for mut known in [tx40(1), seven(2)] {
        for share in [0.001, 0.01, 0.1] {
            let mass = mass_of_share(&known, share);
            let body = block(&mut known.random, mass);
            let record = known.record(&body);
            let found = known.find(&record);
            let off = deviations(&found, &body);
            assert!(off.iter().all(|of| of.abs() < 4.5), "{off:?}");
            assert_eq!(found.parameters.len(), 10);
            assert!(found.after.relative_error <= found.before.relative_error);
            if share > 0.05 {
                let Payload { presence, body: Some(possible), .. } = &found else { panic!() };
                assert!(presence.mass_deviations.unwrap() > 10.0 && presence.probability < 1e-9);
                assert!((possible.mass_kg / mass - 1.0).abs() < 0.2, "{possible:?}");
            }
        }
    }
}
