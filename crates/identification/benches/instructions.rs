//! The kernels, each a fixed number of times on fixed states, for `benches/instructions`, which
//! runs this under valgrind and counts what happens inside of [`measured`].
//!
//! Prints one JSON object a line: the instruction set that the kernels could choose from, and then,
//! in order, each kernel with how often it was evaluated.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and fails by panicking"
)]

mod states;

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use didim_dynamics::control::{
    ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
};
use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar};
use didim_dynamics::robot::Robot;
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationConfig};
use didim_dynamics::trajectory::SampledReference;
use didim_identification::signal::ParallelDecimation;
use nalgebra::DMatrix;
use states::{N, in_lanes, states};

const STATES: usize = 256;
const RATE_HZ: f64 = 5000.0;
/// Steps of a loop.
const STEPS: usize = 500;
/// Steps of a loop with sensitivities, which cost many times as much.
const VARIED_STEPS: usize = 50;
/// Decimation factor: one of this many samples is kept,
const FACTOR: usize = 125;
/// so often,
const ROWS: usize = 16;
/// of so many signals: 28 parameters on six joints.
const SIGNALS: usize = 28 * N;

/// The measured kernel. By its name, so that it must stay a function.
#[inline(never)]
fn measured(kernel: &mut dyn FnMut()) {
    kernel();
}

/// Counts a kernel that evaluates itself so often.
fn count(name: &str, evaluations: usize, mut kernel: impl FnMut()) {
    measured(&mut kernel);
    println!(r#"{{"kernel": "{name}", "evaluations": {evaluations}}}"#);
}

fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        return "x86_64 with AVX2";
    }
    std::env::consts::ARCH
}

fn dynamics(robot: &Robot) {
    let model = Model::new(robot);
    let parameters = robot.nominal().unwrap().standard_parameters();
    let states = states(STATES);
    let mut ws = Workspace::new();
    let mut out = [0.0; N];
    count("inverse_dynamics", STATES, || {
        for [q, dq, ddq, _] in &states {
            model.inverse_dynamics(&mut ws, parameters, q, dq, ddq, &mut out);
            black_box(&out);
        }
    });
    let mut mass = [0.0; N * N];
    count("mass_matrix", STATES, || {
        for [q, ..] in &states {
            model.mass_matrix(&mut ws, parameters, q, &mut mass);
            black_box(&mass);
        }
    });
    count("direct_dynamics", STATES, || {
        for [q, dq, _, tau] in &states {
            model.direct_dynamics(&mut ws, parameters, q, dq, tau, &mut out).unwrap();
            black_box(&out);
        }
    });
    let wide: Vec<_> = parameters.iter().map(|&value| Lanes::constant(value)).collect();
    let side_by_side = in_lanes(&states);
    let (mut wide_ws, mut wide_out) = (Workspace::new(), [Lanes::constant(0.0); N]);
    count("direct_dynamics_many", STATES, || {
        for [q, dq, _, tau] in &side_by_side {
            model.direct_dynamics(&mut wide_ws, &wide, q, dq, tau, &mut wide_out).unwrap();
            black_box(&wide_out);
        }
    });
    let mut regressor = vec![0.0; N * model.parameter_names().len()];
    count("regressor", STATES, || {
        for [q, dq, ddq, _] in &states {
            model.regressor(&mut ws, q, dq, ddq, &mut regressor);
            black_box(&regressor);
        }
    });
    let essential = model.regressor_columns(&essential_columns(&model));
    let mut regressor = vec![0.0; N * essential.width()];
    count("regressor_of_essential_parameters", STATES, || {
        for [q, dq, ddq, _] in &states {
            model.selected_regressor(&mut ws, &essential, q, dq, ddq, &mut regressor);
            black_box(&regressor);
        }
    });
}

/// The columns of the paper's 28 parameters.
fn essential_columns(model: &Model) -> Vec<usize> {
    let robot = Robot::from_toml(include_str!("../../../config/robots/tx40.toml")).unwrap();
    let base = BaseParameters::compute(model).unwrap();
    let listed = robot.nominal().unwrap().given_values();
    let column = |name: &String| {
        let place = base.names().iter().position(|own| own == name).unwrap();
        base.columns()[place]
    };
    listed.iter().map(|(name, _)| column(name)).collect()
}

/// One joint after the other swings, the outer ones faster.
fn reference() -> SampledReference {
    let position = DMatrix::from_fn(STEPS + 2, N, |k, joint| {
        let frequency_hz = 0.3 + 0.1 * joint as f64;
        let phase = TAU * frequency_hz * k as f64 / RATE_HZ;
        0.8 / (1 + joint) as f64 * (1.0 - phase.cos())
    });
    SampledReference::new(RATE_HZ, &position).unwrap()
}

/// Sampled PD with acceleration feed-forward; 20 Hz, a damping ratio of 0.7.
fn controller() -> ControllerConfig {
    let w = 2.0 * PI * 20.0;
    let joint = |inertia| JointController {
        law: ControlLaw::Pd { kp_per_rad: w * w, kd_s_per_rad: 1.4 * w, k_tau_nm: inertia },
        feed_forward: FeedForward { acceleration_kg_m2: inertia, ..FeedForward::default() },
        torque_limit_nm: None,
    };
    let timing =
        ControlTiming::Sampled { sample_period_s: 1.0 / RATE_HZ, computation_delay_s: 0.0 };
    ControllerConfig { timing, joints: [1.5, 1.2, 0.25, 0.05, 0.08, 0.03].map(joint).to_vec() }
}

fn closed_loops(robot: &Robot) {
    let parameters = robot.nominal().unwrap().standard_parameters();
    let (reference, controller) = (reference(), controller());
    let config = SimulationConfig::default();
    let build = || {
        let start = InitialState::OnReference;
        ClosedLoop::new(robot, parameters, &controller, &reference, &config, start).unwrap()
    };
    let mut plain = build();
    count("closed_loop_step", STEPS, || {
        for _ in 0..STEPS {
            black_box(plain.step().unwrap());
        }
    });
    let mut varied = build().with_sensitivities(&essential_columns(&Model::new(robot))).unwrap();
    count("closed_loop_step_with_sensitivities", VARIED_STEPS, || {
        for _ in 0..VARIED_STEPS {
            black_box(varied.step().unwrap());
        }
    });
}

fn decimation() {
    let filter = ParallelDecimation::chebyshev1(8, 0.05, 0.8, FACTOR).unwrap();
    let samples = ROWS * FACTOR;
    let signals = DMatrix::from_fn(samples, SIGNALS, |k, signal| {
        (0.001 * (1 + signal) as f64 * k as f64).sin()
    });
    count("decimation_row", ROWS, || {
        black_box(filter.decimate_columns(&signals, 0..samples).unwrap());
    });
}

fn main() {
    println!(r#"{{"instruction_set": "{}"}}"#, instruction_set());
    let robot =
        Robot::from_toml(include_str!("../../../config/robots/tx40-physical.toml")).unwrap();
    dynamics(&robot);
    closed_loops(&robot);
    decimation();
}
