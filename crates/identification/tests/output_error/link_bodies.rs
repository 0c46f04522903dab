//! Steps that are held to bodies which can be.

use didim_dynamics::robot::ParameterKind;
use didim_identification::feasibility::{
    Estimate, FeasibilityLimits, Outcome, Prior, fit_consistent,
};
use didim_identification::identification::{
    BodiesFrom, Experiment, Identification, IdentificationError, KeptParameters, Method, Options,
    Start, identify,
};
use nalgebra::{DMatrix, DVector};

use crate::common::arm::Random;
use crate::common::looped::{Looped, ZERO_ORDER_HOLD, pd, sampled};

const METHODS: [Method; 3] = [Method::Didim, Method::Clie, Method::Cloe];

/// What moves \[kg\].
fn mass(looped: &Looped) -> f64 {
    let table = looped.arm.robot.parameters().parameters();
    let masses = table.iter().zip(&looped.arm.truth);
    masses.filter(|(parameter, _)| parameter.kind == ParameterKind::M).map(|(_, m)| m).sum()
}

/// White noise of the torques, relative to each joint's, and of the positions \[rad\].
fn noisy(looped: &Looped, torque: f64, position_rad: f64, samples: usize) -> Experiment {
    let experiment = looped.record_with(ZERO_ORDER_HOLD, |signals| {
        let mut random = Random(11);
        for own in &mut signals.torque_nm {
            let rms = (own.iter().map(|t| t * t).sum::<f64>() / own.len() as f64).sqrt();
            own.iter_mut().for_each(|value| *value += torque * rms * random.normal());
        }
        let positions = signals.position_rad.iter_mut().flatten();
        positions.for_each(|q| *q += position_rad * random.normal());
    });
    experiment.with_counted(2000..2000 + samples).unwrap()
}

fn identify_with(
    looped: &Looped,
    method: Method,
    experiment: &Experiment,
    options: &Options,
) -> Result<Identification, IdentificationError> {
    identify(method, &looped.arm.robot, &looped.arm.base, experiment, options)
}

/// The bodies nearest to values of all base parameters.
fn link_bodies(looped: &Looped, values: &[f64], covariance: &DMatrix<f64>) -> Outcome {
    let names = looped.arm.base.names();
    let estimate = Estimate { names, values, covariance, fixed: &[] };
    let prior = Prior::geometric(&looped.arm.robot, mass(looped)).unwrap();
    fit_consistent(
        &looped.arm.robot,
        &looped.arm.base,
        &estimate,
        &prior,
        0.03,
        &FeasibilityLimits::default(),
    )
    .unwrap()
}

/// The bodies nearest to an estimate, by its covariance.
fn nearest(looped: &Looped, found: &Identification) -> Outcome {
    let parameters = found.estimate.parameters.iter();
    let values: Vec<f64> = parameters.map(|parameter| parameter.value).collect();
    let stored = found.estimate.covariance.as_ref().unwrap();
    link_bodies(looped, &values, &stored.matrix(values.len()).unwrap())
}

/// Arms whose random parameters bodies have: a percent of each off costs them next to nothing.
fn arms() -> impl Iterator<Item = Looped> {
    (0..).map(|seed| Looped::random(seed, 3, sampled(0.0), pd)).filter(|looped| {
        let truth = looped.arm.true_base();
        let deviations = truth.iter().map(|value| (0.01 * value.abs().max(0.1)).powi(2));
        let deviations = DVector::from_iterator(truth.len(), deviations);
        link_bodies(looped, &truth, &DMatrix::from_diagonal(&deviations)).least_cost < 0.5
    })
}

/// Squared distance of an estimate from the truth in its standard deviations.
fn off(looped: &Looped, found: &Identification) -> f64 {
    let truth = looped.arm.true_base();
    let parameters = found.estimate.parameters.iter();
    parameters
        .map(|parameter| {
            let truth = truth[looped.arm.base.find(&parameter.name).unwrap()];
            ((parameter.value - truth) / parameter.standard_deviation).powi(2)
        })
        .sum()
}

/// A short, noisy record: least squares gives sums that no bodies have, and steps that are held to
/// bodies do not, whatever the method, and are nearer to the truth.
#[test]
fn a_short_record_gives_bodies_that_can_be_and_are_nearer_to_the_truth() {
    for method in METHODS {
        let (mut plain_off, mut held_off, mut impossible) = (0.0, 0.0, 0);
        for (arm, looped) in arms().take(3).enumerate() {
            let experiment = noisy(&looped, 0.2, 1e-4, 1000);
            let mut options = looped.options();
            options.simulation.start = Start::IdimLs;
            let plain = identify_with(&looped, method, &experiment, &options).unwrap();
            options.simulation.consistent_parameters = Some(BodiesFrom::TotalMassKg(mass(&looped)));
            let consistent = identify_with(&looped, method, &experiment, &options).unwrap();
            let (of_plain, of_held) = (nearest(&looped, &plain), nearest(&looped, &consistent));
            println!(
                "{method} {arm}: {:.3} -> {:.3} nearest bodies, {:.1} -> {:.1} from the truth",
                of_plain.least_cost,
                of_held.least_cost,
                off(&looped, &plain),
                off(&looped, &consistent)
            );
            impossible += usize::from(of_plain.least_cost > 1.0);
            assert!(of_held.least_cost < 0.5, "{method} {arm}: {}", of_held.least_cost);
            plain_off += off(&looped, &plain);
            held_off += off(&looped, &consistent);
        }
        assert!(impossible > 0, "{method}");
        assert!(held_off < plain_off, "{method}: {held_off} {plain_off}");
    }
}

/// Bodies that are known take nothing from an exact record. What is left comes of the sizes of
/// friction and drive inertias, which are those that IDIM-LS finds behind its filters.
#[test]
fn exact_records_of_known_bodies_give_the_truth_back() {
    let mut candidates = (0..).map(|seed| Looped::with_known_torques(seed, 3, pd));
    let looped = candidates.find(|looped| Prior::nominal(&looped.arm.robot).is_ok()).unwrap();
    let experiment = looped.record(ZERO_ORDER_HOLD);
    let mut options = looped.options();
    options.simulation.start = Start::IdimLs;
    options.simulation.consistent_parameters = Some(BodiesFrom::Nominal);
    let filtered = identify_with(&looped, Method::IdimLs, &experiment, &options).unwrap();
    let filtered = looped.deviation(&filtered);
    for method in METHODS {
        let identified = identify_with(&looped, method, &experiment, &options).unwrap();
        let deviation = looped.deviation(&identified);
        println!("{method}: {deviation:.1e}, IDIM-LS {filtered:.1e}");
        assert!(deviation < 0.1 * filtered, "{method}: {deviation} {filtered}");
    }
}

#[test]
fn bodies_of_parameters_that_are_not_identified_are_refused_with_what_to_do() {
    let looped = Looped::random(0, 3, sampled(0.0), pd);
    let experiment = looped.record(ZERO_ORDER_HOLD);
    let mut options = looped.options();
    options.simulation.consistent_parameters = Some(BodiesFrom::Nominal);
    let why = |options: &Options| {
        identify_with(&looped, Method::Didim, &experiment, options).unwrap_err().to_string()
    };
    assert!(why(&options).contains("has no [nominal] parameters"), "{}", why(&options));
    options.simulation.consistent_parameters = Some(BodiesFrom::TotalMassKg(-1.0));
    assert!(why(&options).contains("the total mass of the moving links is -1 kg"));
    options.simulation.consistent_parameters = Some(BodiesFrom::TotalMassKg(5.0));
    let names = looped.arm.base.names();
    let link = names.iter().find(|name| name.starts_with("zz")).unwrap();
    let others = names.iter().filter(|name| *name != link).cloned().collect();
    options.parameters = Some(others);
    assert!(why(&options).contains(&format!("{link} are not identified")), "{}", why(&options));
    // Nor may they be kept: what is simulated would have other bodies.
    let looped = Looped::with_known_torques(0, 3, pd);
    let experiment = looped.record(ZERO_ORDER_HOLD);
    let mut options = Options { parameters: options.parameters, ..looped.options() };
    options.parameters.as_mut().unwrap().retain(|name| looped.arm.base.find(name).is_some());
    options.keep_nominal = Some(KeptParameters::All);
    options.simulation.consistent_parameters = Some(BodiesFrom::TotalMassKg(5.0));
    let refused =
        identify_with(&looped, Method::Didim, &experiment, &options).unwrap_err().to_string();
    assert!(refused.contains("are not identified"), "{refused}");
}
