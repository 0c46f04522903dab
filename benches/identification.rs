//! IDIM-LS on 45,000 samples of six joints, DIDIM, CLIE and CLOE on 34,500, 28 parameters: the
//! paper's arm, simulated.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and fails by panicking"
)]

use std::time::Duration;

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use didim_dynamics::SignalTiming;
use didim_dynamics::control::SimulatedController;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_identification::identification::{
    DecimationFilter, Experiment, Method, Options, PositionFilter, Start, identify,
    idim_ls_unchecked,
};
use didim_sim::{PlaybackConfig, Scenario};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

const SAMPLES: usize = 45_000;

/// So many samples at 5 kHz: rest, the motion, which is what counts, and rest.
fn experiment_of(scenario: &Scenario, samples: usize, rest: usize) -> Experiment {
    let hold_s = scenario.controller().timing.sample_period_s();
    let lead_in_s = rest as f64 * hold_s;
    let playback = PlaybackConfig { lead_in_s, tail_s: 2.0, cycles: Some(1) };
    let record =
        scenario.clone().with_playback(playback).unwrap().played_loop().unwrap().run(samples);
    let record = record.unwrap();
    let signals = record.motor_signals();
    Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
        .with_counted(rest..rest + scenario.samples())
        .unwrap()
}

fn regression(scenario: &Scenario, cutoff_hz: f64, factor: usize) -> Options {
    let essential = scenario.robot().nominal().unwrap().given_values();
    let mut options = Options::new(
        PositionFilter { order: 4, cutoff_hz },
        DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio: 0.8, factor },
    );
    options.parameters = Some(essential.iter().map(|(name, _)| name.clone()).collect());
    options
}

fn identification(criterion: &mut Criterion) {
    let scenario = didim_sim::tx40_paper().unwrap();
    let robot = scenario.robot();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    let experiment = experiment_of(&scenario, SAMPLES, 2500);
    let options = regression(&scenario, 200.0, 100);
    let identified =
        identify(Method::IdimLs, robot, &base, &experiment, &options).unwrap().estimate;
    assert_eq!((identified.samples, identified.parameters.len()), (SAMPLES, 28));
    assert!(identified.verdict.applicable, "{:?}", identified.verdict.reasons);

    let mut group = criterion.benchmark_group("idim_ls_45000x6");
    group.sample_size(10).warm_up_time(Duration::from_millis(500));
    group.bench_function("28_parameters", |bencher| {
        bencher.iter(|| identify(Method::IdimLs, robot, &base, &experiment, &options).unwrap());
    });
    // The computation of benches/numpy_idim_ls.py, and the correction of the standard deviations.
    let fit = idim_ls_unchecked(robot, &base, &experiment, &options).unwrap();
    let values = fit.parameters.iter().map(|parameter| parameter.value);
    assert!(values.eq(identified.parameters.iter().map(|parameter| parameter.value)));
    group.bench_function("28_parameters_without_checks", |bencher| {
        bencher.iter(|| idim_ls_unchecked(robot, &base, &experiment, &options).unwrap());
    });
    group.finish();
}

/// The paper's case: 34,500 samples, fixed gains, from every drive inertia 1 and everything else 0.
fn paper_options(scenario: &Scenario) -> Options {
    let mut options = regression(scenario, 200.0, 125);
    options.controller = Some(SimulatedController::Cabinet {
        timing: scenario.controller().timing,
        joints: scenario.controller().joints.clone(),
        rescale_to_inertia_kg_m2: None,
    });
    options.simulation.integrator = scenario.simulation().integrator;
    options.simulation.substeps = scenario.simulation().substeps;
    options.simulation.start = Start::UnitDriveInertias;
    options
}

fn simulated(criterion: &mut Criterion) {
    let scenario = didim_sim::tx40_paper().unwrap();
    let robot = scenario.robot();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    let experiment = experiment_of(&scenario, scenario.samples(), 0);
    let options = paper_options(&scenario);
    let identified = identify(Method::Didim, robot, &base, &experiment, &options).unwrap().estimate;
    assert_eq!((identified.samples, identified.parameters.len()), (34_500, 28));
    println!("didim_34500x6: {} simulations", identified.simulations);

    let mut group = criterion.benchmark_group("didim_34500x6");
    group.sample_size(10).warm_up_time(Duration::from_millis(500));
    group.bench_function("28_parameters", |bencher| {
        bencher.iter(|| identify(Method::Didim, robot, &base, &experiment, &options).unwrap());
    });
    // The same answer from the start that is the default.
    let mut near = options.clone();
    near.simulation.start = Start::IdimLs;
    let same = identify(Method::Didim, robot, &base, &experiment, &near).unwrap().estimate;
    for (a, b) in identified.parameters.iter().zip(&same.parameters) {
        assert!((a.value - b.value).abs() < 0.1 * a.standard_deviation, "{}", a.name);
    }
    println!("didim_34500x6 from idim-ls: {} simulations", same.simulations);
    group.bench_function("28_parameters_from_idim_ls", |bencher| {
        bencher.iter(|| identify(Method::Didim, robot, &base, &experiment, &near).unwrap());
    });
    group.finish();
}

/// CLIE and CLOE on the same samples from parameters that are each 15 % larger or smaller than the
/// true ones, with exact sensitivities.
fn output_error(criterion: &mut Criterion) {
    let scenario = didim_sim::tx40_paper().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let factor = move |_: &str| if random.next_u32() & 1 == 1 { 1.15 } else { 0.85 };
    let robot = scenario.robot().clone().with_scaled_nominal(factor);
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let experiment = experiment_of(&scenario, scenario.samples(), 0);
    let mut options = paper_options(&scenario);
    options.simulation.start = Start::Nominal;

    let mut group = criterion.benchmark_group("output_error_34500x6");
    group
        .sample_size(10)
        .sampling_mode(SamplingMode::Flat)
        .warm_up_time(Duration::from_millis(500));
    for (name, method) in [("clie", Method::Clie), ("cloe", Method::Cloe)] {
        let mut simulations = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let identified =
                    identify(method, &robot, &base, &experiment, &options).unwrap().estimate;
                assert!(identified.verdict.failure.is_none(), "{:?}", identified.verdict.reasons);
                simulations = identified.simulations;
            });
        });
        println!("output_error_34500x6/{name}: {simulations} simulations");
    }
    group.finish();
}

criterion_group!(benches, identification, simulated, output_error);
criterion_main!(benches);
