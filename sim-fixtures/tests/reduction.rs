//! From all base parameters of the simulated TX40 to the essential ones.

use crate::common::experiment::regression;
use didim_dynamics::SignalTiming;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::simulation::NoiseConfig;
use didim_identification::identification::{
    Experiment, Method, Options, essential_parameters, identify,
};
use didim_sim::tx40_paper;

/// The truth has 28 parameters; what the noise hides of them may go, and one of twenty of the
/// others may stay.
#[test]
fn what_stays_is_what_the_noise_lets_be_found() {
    let scenario = tx40_paper().unwrap();
    let robot = scenario.robot();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    let options = regression(None, 100.0);
    for (seed, level) in [(1, 1.0), (2, 1.0), (3, 30.0)] {
        let noise = NoiseConfig {
            disturbance_torque_nm: Some(vec![level * 0.05; 6]),
            ..NoiseConfig::with_seed(seed)
        };
        let scenario = scenario.clone().with_noise(noise).unwrap();
        let record = scenario.closed_loop().unwrap().run(scenario.samples()).unwrap();
        let hold_s = scenario.controller().timing.sample_period_s();
        let experiment = Experiment::motor_side(record.motor_signals(), robot.transmission())
            .unwrap()
            .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
            .unwrap();
        let identify = |parameters| {
            let options = Options { parameters, ..options.clone() };
            identify(Method::IdimLs, robot, &base, &experiment, &options).unwrap().estimate
        };
        let reduction = essential_parameters(robot, &base, &experiment, &options, 0.05).unwrap();
        for step in &reduction.left_out {
            let truth = scenario.truth_of(&step.name).unwrap();
            println!(
                "{:6} {:8.1} % F {:.3} p {:.3} truth {truth}",
                step.name,
                100.0 * step.relative_standard_deviation,
                step.f_statistic,
                step.probability
            );
        }
        println!("kept {:?}", reduction.fixed);
        assert_eq!(reduction.left_out.len() + reduction.essential.len(), base.names().len());
        let full = identify(None);
        let reduced = identify(Some(reduction.essential.clone()));
        // Nothing that the full model knows well is left out.
        for step in &reduction.left_out {
            let truth = scenario.truth_of(&step.name).unwrap();
            let parameter = full.parameters.iter().find(|p| p.name == step.name).unwrap();
            assert!(
                truth.abs() < 5.0 * parameter.standard_deviation,
                "{}: {truth}, {parameter:?}",
                step.name
            );
        }
        let zero = |name: &&String| scenario.truth_of(name).unwrap().abs() < 1e-12;
        let needless = reduction.essential.iter().filter(zero).count();
        println!(
            "{} stay, {needless} of them are 0; relative error {:.5} of all, {:.5} reduced",
            reduction.essential.len(),
            full.relative_error,
            reduced.relative_error
        );
        if level <= 1.0 {
            assert!((28..=32).contains(&reduction.essential.len()), "{:?}", reduction.essential);
        } else {
            assert!(!reduction.left_out.is_empty() && reduction.essential.len() < 28 + 4);
        }
        // Of 32 parameters that are 0, no more than a few look as if they were not.
        assert!(needless <= 4, "{:?}", reduction.essential);
        // 32 parameters of 1600 rows take 1 % of noise on themselves.
        let ratio = reduced.relative_error / full.relative_error;
        assert!((1.0..1.02).contains(&ratio), "{ratio}");
    }
}
