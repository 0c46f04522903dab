//! The simulated experiment is one: least squares finds the truth in it.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use didim_core::dynamics::{BaseParameters, Model};
use didim_core::identification::{
    DecimationFilter, Experiment, IdimLsOptions, ParameterEstimate, PositionFilter, SignalTiming,
    Signals, idim_ls,
};
use didim_core::simulation::Record;
use didim_sim::{Scenario, tx40_paper, tx40_physical};
use nalgebra::DMatrix;

fn columns(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.column_iter().map(|column| column.iter().copied().collect()).collect()
}

fn experiment(scenario: &Scenario, record: &Record, hold_s: f64) -> Experiment {
    let signals = Signals {
        sample_rate_hz: record.sample_rate_hz,
        position_rad: columns(&record.motor_position_rad),
        torque_nm: columns(&record.motor_torque_nm),
        reference_rad: Some(columns(&record.motor_reference_rad)),
    };
    Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
}

/// Deviation of every named base parameter from the truth, in standard deviations; of every one
/// without names.
fn deviations(scenario: &Scenario, names: Option<Vec<String>>, hold_s: f64) -> Vec<(String, f64)> {
    let record = scenario.closed_loop().unwrap().run(scenario.samples()).unwrap();
    let options = IdimLsOptions {
        position_filter: PositionFilter { order: 4, cutoff_hz: 50.0 },
        decimation_filter: DecimationFilter {
            order: 8,
            ripple_db: 0.05,
            cutoff_ratio: 0.8,
            factor: 125,
        },
        parameters: names,
        limits: Default::default(),
    };
    let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
    let experiment = experiment(scenario, &record, hold_s);
    let found = idim_ls(scenario.robot(), &base, &experiment, &options).unwrap();
    let deviation = |p: &ParameterEstimate| {
        let truth = scenario.truth_of(&p.name).unwrap();
        (p.name.clone(), (p.value - truth) / p.standard_deviation)
    };
    found.estimate.parameters.iter().map(deviation).collect()
}

fn rms(deviations: &[(String, f64)]) -> f64 {
    let sum: f64 = deviations.iter().map(|(_, deviation)| deviation * deviation).sum();
    (sum / deviations.len() as f64).sqrt()
}

fn essential() -> Option<Vec<String>> {
    let scenario = tx40_paper().unwrap();
    let listed = scenario.robot().nominal().unwrap().listed();
    Some(listed.iter().map(|(name, _)| name.clone()).collect())
}

/// The filters smooth the jumps of the acceleration, which costs a little more than the noise does:
/// σ is that of the noise alone and this small because the shipped noise is.
#[test]
fn least_squares_finds_the_paper_s_truth_and_needs_the_torque_s_hold() {
    let scenario = tx40_paper().unwrap();
    let held = deviations(&scenario, essential(), scenario.controller().timing.sample_period_s());
    assert_eq!(held.len(), 28);
    for (name, deviation) in &held {
        assert!(deviation.abs() < 4.0, "{name} is {deviation:.1} standard deviations off");
    }
    // Taking the logged command for the torque at its instant is half a period wrong.
    let instant = deviations(&scenario, essential(), 0.0);
    println!("rms of the deviations: {:.2} held, {:.2} instant", rms(&held), rms(&instant));
    assert!(rms(&held) < 1.8 && rms(&instant) > 1.5 * rms(&held));
}

#[test]
fn least_squares_finds_the_physical_truth() {
    let scenario = tx40_physical().unwrap();
    let all = deviations(&scenario, None, scenario.controller().timing.sample_period_s());
    assert_eq!(all.len(), 60);
    println!("rms of the deviations: {:.2}", rms(&all));
    for (name, deviation) in &all {
        assert!(deviation.abs() < 5.0, "{name} is {deviation:.1} standard deviations off");
    }
}
