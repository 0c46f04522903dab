//! How the cost of IDIM-LS grows with samples and with parameters: the paper's arm, which repeats
//! its motion.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use didim_dynamics::SignalTiming;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_identification::identification::{
    DecimationFilter, Experiment, Method, Options, PositionFilter, identify,
};
use didim_sim::{PlaybackConfig, Scenario};

/// At 5 kHz: one second to a minute.
const SAMPLES: [usize; 4] = [5_000, 20_000, 80_000, 320_000];

/// The first parameters of the paper's 28; beyond 28, every base parameter.
const PARAMETERS: [usize; 3] = [12, 20, 28];

/// The record in which parameters grow.
const RECORD: usize = 80_000;

fn experiment(scenario: &Scenario, samples: usize) -> Experiment {
    let hold_s = scenario.controller().timing.sample_period_s();
    let playback = PlaybackConfig { lead_in_s: 0.0, tail_s: 0.1, cycles: None };
    let repeated = scenario.clone().with_playback(playback).unwrap();
    let record = repeated.played_loop().unwrap().run(samples).unwrap();
    let signals = record.motor_signals();
    Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
}

fn options(parameters: Option<&[String]>) -> Options {
    let mut options = Options::new(
        PositionFilter { order: 4, cutoff_hz: 200.0 },
        DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio: 0.8, factor: 100 },
    );
    options.parameters = parameters.map(<[String]>::to_vec);
    options
}

fn growing(criterion: &mut Criterion) {
    let scenario = didim_sim::tx40_paper().unwrap();
    let robot = scenario.robot();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    let listed = robot.nominal().unwrap().given_values();
    let essential: Vec<String> = listed.iter().map(|(name, _)| name.clone()).collect();

    let mut group = criterion.benchmark_group("idim_ls_samples");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(200));
    for samples in SAMPLES {
        let (experiment, options) = (experiment(&scenario, samples), options(Some(&essential)));
        group.bench_function(BenchmarkId::from_parameter(samples), |bencher| {
            bencher.iter(|| identify(Method::IdimLs, robot, &base, &experiment, &options).unwrap());
        });
    }
    group.finish();

    let mut group = criterion.benchmark_group("idim_ls_parameters");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(200));
    let experiment = experiment(&scenario, RECORD);
    let some = PARAMETERS.iter().map(|&count| (count, options(Some(&essential[..count]))));
    for (count, options) in some.chain([(base.names().len(), options(None))]) {
        group.bench_function(BenchmarkId::from_parameter(count), |bencher| {
            bencher.iter(|| identify(Method::IdimLs, robot, &base, &experiment, &options).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, growing);
criterion_main!(benches);
