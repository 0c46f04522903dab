//! How the cost of the kernels grows with the number of axes: arms of one to sixteen revolute
//! joints, each the beginning of the next, with every parameter.
//!
//! Two kinds of arm: axes at right angles or parallel, as industrial arms have them, half of whose
//! rotations are permutations; and axes at any angle, of which nothing is known beforehand.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark fails by panicking")]

#[path = "../crates/dynamics/tests/dynamics/arms.rs"]
#[allow(dead_code, reason = "the tests need more of it")]
mod arms;

use std::hint::black_box;
use std::time::Duration;

use arms::{Design, Random, physical_parameters};
use criterion::{BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};

/// Taken one after the other, so that no branch is learnt.
const STATES: usize = 256;

/// Gear ratio of every drive; the cost does not depend on it.
const RATIO: f64 = 50.0;

/// An arm of as many axes as there can be.
fn longest(random: &mut Random, twist_deg: impl Fn(&mut Random) -> f64) -> Design {
    let joints = (0..MAX_JOINTS)
        .map(|_| {
            let (twist, angle) = (twist_deg(random), twist_deg(random));
            let [d, r] = [(); 2].map(|()| random.uniform(-0.5, 0.5));
            (false, [twist, d, angle, r], true)
        })
        .collect();
    Design {
        gravity: [0.0, 0.0, -9.81],
        joints,
        rows: Vec::new(),
        friction: [true; 3],
        sign: "{ model = \"tanh\", width_rad_s = 0.05 }",
        own_friction: Vec::new(),
        known_torques: false,
    }
}

/// The first `axes` axes of an arm, not coupled.
fn shortened(design: &Design, axes: usize) -> Design {
    let entry = |row, column| if row == column { RATIO } else { 0.0 };
    let rows = (0..axes).map(|row| (0..axes).map(|column| entry(row, column)).collect());
    Design { joints: design.joints[..axes].to_vec(), rows: rows.collect(), ..design.clone() }
}

fn axes(criterion: &mut Criterion, kind: &str, design: &Design) {
    let mut group = criterion.benchmark_group(format!("axes_{kind}"));
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(100)).measurement_time(Duration::from_millis(300));
    for n in 1..=MAX_JOINTS {
        let robot = shortened(design, n).robot();
        let model = Model::new(&robot);
        let mut random = Random(n as u64);
        let parameters = physical_parameters(&mut random, &robot);
        let states: Vec<_> = (0..STATES)
            .map(|_| [3.0, 5.0, 20.0, 20.0].map(|size| random.vector(n, size)))
            .collect();
        let mut ws = Workspace::new();
        let mut bench = |name: &str, kernel: &mut dyn FnMut(&[Vec<f64>; 4])| {
            let mut next = states.iter().cycle();
            group.bench_function(BenchmarkId::new(name, n), |bencher| {
                bencher.iter(|| kernel(black_box(next.next().unwrap())));
            });
        };
        let mut out = vec![0.0; n];
        bench("inverse_dynamics", &mut |[q, dq, ddq, _]| {
            model.inverse_dynamics(&mut ws, &parameters, q, dq, ddq, &mut out);
            black_box(&out);
        });
        let mut mass = vec![0.0; n * n];
        bench("mass_matrix", &mut |[q, ..]| {
            model.mass_matrix(&mut ws, &parameters, q, &mut mass);
            black_box(&mass);
        });
        bench("direct_dynamics", &mut |[q, dq, _, tau]| {
            model.direct_dynamics(&mut ws, &parameters, q, dq, tau, &mut out).unwrap();
            black_box(&out);
        });
        let mut regressor = vec![0.0; n * model.parameter_names().len()];
        bench("regressor", &mut |[q, dq, ddq, _]| {
            model.regressor(&mut ws, q, dq, ddq, &mut regressor);
            black_box(&regressor);
        });
    }
    group.finish();
}

fn kinds(criterion: &mut Criterion) {
    let right = |random: &mut Random| [-90.0, 0.0, 90.0][random.below(3)];
    axes(criterion, "at_right_angles", &longest(&mut Random(1), right));
    let any = |random: &mut Random| random.uniform(-180.0, 180.0);
    axes(criterion, "at_any_angle", &longest(&mut Random(2), any));
}

criterion_group!(benches, kinds);
criterion_main!(benches);
