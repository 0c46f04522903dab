//! IDIM-LS on 45,000 samples of six joints, 28 parameters: the paper's arm, simulated.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use didim_core::dynamics::{BaseParameters, Model};
use didim_core::identification::{
    DecimationFilter, Experiment, IdimLsOptions, PositionFilter, SignalTiming, Signals, idim_ls,
};
use didim_sim::{PlaybackConfig, Scenario};
use nalgebra::DMatrix;

const SAMPLES: usize = 45_000;

fn columns(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.column_iter().map(|column| column.iter().copied().collect()).collect()
}

/// 9 s at 5 kHz: rest, the motion, which is what counts, and rest.
fn experiment(scenario: &Scenario) -> Experiment {
    let lead_in_s = 0.5;
    let playback = PlaybackConfig { lead_in_s, tail_s: 2.0, cycles: Some(1) };
    let record =
        scenario.clone().with_playback(playback).unwrap().played_loop().unwrap().run(SAMPLES);
    let record = record.unwrap();
    let signals = Signals {
        sample_rate_hz: record.sample_rate_hz,
        position_rad: columns(&record.motor_position_rad),
        torque_nm: columns(&record.motor_torque_nm),
        reference_rad: None,
    };
    let hold_s = scenario.controller().timing.sample_period_s();
    Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
        .with_counted(2500..2500 + scenario.samples())
        .unwrap()
}

fn identification(criterion: &mut Criterion) {
    let scenario = didim_sim::tx40_paper().unwrap();
    let robot = scenario.robot();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    let experiment = experiment(&scenario);
    let essential = robot.nominal().unwrap().listed();
    let options = IdimLsOptions {
        position_filter: PositionFilter { order: 4, cutoff_hz: 50.0 },
        decimation_filter: DecimationFilter {
            order: 8,
            ripple_db: 0.05,
            cutoff_ratio: 0.8,
            factor: 100,
        },
        parameters: Some(essential.iter().map(|(name, _)| name.clone()).collect()),
        limits: Default::default(),
    };
    let found = idim_ls(robot, &base, &experiment, &options).unwrap().estimate;
    assert_eq!((found.samples, found.parameters.len()), (SAMPLES, 28));
    assert!(found.verdict.applicable, "{:?}", found.verdict.reasons);

    let mut group = criterion.benchmark_group("idim_ls_45000x6");
    group.sample_size(10).warm_up_time(Duration::from_millis(500));
    group.bench_function("28_parameters", |bencher| {
        bencher.iter(|| idim_ls(robot, &base, &experiment, &options).unwrap());
    });
    group.finish();
}

criterion_group!(benches, identification);
criterion_main!(benches);
