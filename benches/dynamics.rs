//! Kernels of the dynamics, on the TX40 with physical links: one evaluation each.
//!
//! The states are 1,024 random ones, taken one after the other, so that no branch is learnt.
//! Friction's sign is a comparison here. `…_tanh` is the law of the shipped file, whose seven
//! hyperbolic tangents take a good part of the time.
//!
//! Each of the ten samples is a tenth of the measuring time, about 0.1 s. On a shared machine,
//! short samples would fall between its interruptions, and a peer that measures longer would look
//! slower.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark fails by panicking")]

#[path = "../crates/identification/benches/states/mod.rs"]
mod states;

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar};
use didim_dynamics::robot::{Robot, SignModel};
use states::{L, N, State, in_lanes, states};

const STATES: usize = 1024;

/// Times `kernel` on one state after the other.
fn over_states(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    states: &[State],
    mut kernel: impl FnMut(&State),
) {
    let mut next = 0;
    group.bench_function(name, |bencher| {
        bencher.iter(|| {
            kernel(black_box(&states[next]));
            next = (next + 1) % STATES;
        });
    });
}

fn kernels(criterion: &mut Criterion) {
    let robot = Robot::from_toml(include_str!("../config/robots/tx40-physical.toml")).unwrap();
    let parameters = robot.nominal().unwrap().standard_parameters();
    let tanh = Model::new(&robot);
    let sign = tanh.clone().with_sign_model(SignModel::Sign);
    let states = states(STATES);
    let mut ws = Workspace::new();

    let mut group = criterion.benchmark_group("dynamics");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    let mut out = [0.0; N];
    for (name, model) in [("inverse_dynamics", &sign), ("inverse_dynamics_tanh", &tanh)] {
        over_states(&mut group, name, &states, |[q, dq, ddq, _]| {
            model.inverse_dynamics(&mut ws, parameters, q, dq, ddq, &mut out);
            black_box(&out);
        });
    }
    for (name, model) in [("direct_dynamics", &sign), ("direct_dynamics_tanh", &tanh)] {
        over_states(&mut group, name, &states, |[q, dq, _, tau]| {
            model.direct_dynamics(&mut ws, parameters, q, dq, tau, &mut out).unwrap();
            black_box(&out);
        });
    }
    let mut mass = [0.0; N * N];
    over_states(&mut group, "mass_matrix", &states, |[q, ..]| {
        sign.mass_matrix(&mut ws, parameters, q, &mut mass);
        black_box(&mass);
    });
    let mut regressor = vec![0.0; N * sign.parameter_names().len()];
    over_states(&mut group, "regressor", &states, |[q, dq, ddq, _]| {
        sign.regressor(&mut ws, q, dq, ddq, &mut regressor);
        black_box(&regressor);
    });
    group.finish();
}

/// Many evaluations at once, with the same parameters; times are of all lanes together.
fn many(criterion: &mut Criterion) {
    let robot = Robot::from_toml(include_str!("../config/robots/tx40-physical.toml")).unwrap();
    let parameters = robot.nominal().unwrap().standard_parameters();
    let parameters: Vec<_> = parameters.iter().map(|&value| Lanes::constant(value)).collect();
    let model = Model::new(&robot).with_sign_model(SignModel::Sign);
    let states = in_lanes(&states(STATES));
    let mut ws = Workspace::new();
    let mut next = 0;
    let mut state = || {
        next = (next + 1) % states.len();
        black_box(&states[next])
    };

    let mut group = criterion.benchmark_group("dynamics");
    group
        .sampling_mode(SamplingMode::Flat)
        .sample_size(10)
        .throughput(Throughput::Elements(L as u64));
    let mut out = [Lanes::constant(0.0); N];
    group.bench_function("inverse_dynamics_many", |bencher| {
        bencher.iter(|| {
            let [q, dq, ddq, _] = state();
            model.inverse_dynamics(&mut ws, &parameters, q, dq, ddq, &mut out);
            black_box(&out);
        });
    });
    group.bench_function("direct_dynamics_many", |bencher| {
        bencher.iter(|| {
            let [q, dq, _, tau] = state();
            model.direct_dynamics(&mut ws, &parameters, q, dq, tau, &mut out).unwrap();
            black_box(&out);
        });
    });
    let mut regressor = vec![Lanes::constant(0.0); N * model.parameter_names().len()];
    group.bench_function("regressor_many", |bencher| {
        bencher.iter(|| {
            let [q, dq, ddq, _] = state();
            model.regressor(&mut ws, q, dq, ddq, &mut regressor);
            black_box(&regressor);
        });
    });
    group.finish();
}

criterion_group!(benches, kernels, many);
criterion_main!(benches);
