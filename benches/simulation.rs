//! One closed loop over 34,500 steps of ode3 at 5 kHz: what an output-error method does again and
//! again.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use didim_dynamics::control::{
    ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
};
use didim_dynamics::robot::Robot;
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationConfig};
use didim_dynamics::trajectory::Reference;

const STEPS: usize = 34_500;
const N: usize = 6;

/// q_r = a (1 − cos 2πft), one frequency per joint.
struct Sines;

impl Reference for Sines {
    fn joints(&self) -> usize {
        N
    }

    fn evaluate(&self, time_s: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
        for (joint, ((q, dq), ddq)) in q.iter_mut().zip(dq).zip(ddq).enumerate().take(N) {
            let w = TAU * (0.3 + 0.1 * joint as f64);
            let amplitude = 0.8 / (1 + joint) as f64;
            let (sin, cos) = (w * time_s).sin_cos();
            *q = amplitude * (1.0 - cos);
            *dq = amplitude * w * sin;
            *ddq = amplitude * w * w * cos;
        }
    }
}

/// PD with acceleration feed-forward, evaluated at every stage; 20 Hz, a damping ratio of 0.7.
fn continuous_controller() -> ControllerConfig {
    let w = 2.0 * PI * 20.0;
    let joint = |inertia| JointController {
        law: ControlLaw::Pd { kp_per_rad: w * w, kd_s_per_rad: 1.4 * w, k_tau_nm: inertia },
        feed_forward: FeedForward { acceleration_kg_m2: inertia, ..FeedForward::default() },
        torque_limit_nm: None,
    };
    ControllerConfig {
        timing: ControlTiming::Continuous { sample_period_s: 1.0 / 5000.0 },
        joints: [1.5, 1.2, 0.25, 0.05, 0.08, 0.03].map(joint).to_vec(),
    }
}

fn closed_loops(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("closed_loop_34500_ode3");
    group.sample_size(10).warm_up_time(Duration::from_millis(500));

    let robot = Robot::from_toml(include_str!("../config/robots/tx40-physical.toml")).unwrap();
    let parameters = robot.nominal().unwrap().standard_parameters();
    let config = SimulationConfig::default();
    let start = InitialState::OnReference;
    let controller = continuous_controller();
    let mut continuous =
        ClosedLoop::new(&robot, parameters, &controller, Sines, &config, start).unwrap();
    group.bench_function("continuous", |bencher| {
        bencher.iter(|| {
            continuous.restart(parameters).unwrap();
            for _ in 0..STEPS {
                black_box(continuous.step().unwrap());
            }
        });
    });

    // The shipped experiment: sampled controller, encoder counts, noise, and the record written.
    let scenario = didim_sim::tx40_paper().unwrap();
    let mut sampled = scenario.closed_loop().unwrap();
    group.bench_function("sampled_recorded", |bencher| {
        bencher.iter(|| {
            sampled.restart(scenario.standard_parameters()).unwrap();
            sampled.run(STEPS).unwrap()
        });
    });
    group.finish();
}

criterion_group!(benches, closed_loops);
criterion_main!(benches);
