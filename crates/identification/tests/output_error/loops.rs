//! Loops with their sensitivities, exact and by differences.

use didim_dynamics::control::ControlLaw;
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationConfig};
use didim_dynamics::trajectory::SampledReference;
use didim_identification::identification::{Method, Options};
use nalgebra::DMatrix;

use crate::common::looped::{Looped, RATE_HZ};

pub(crate) const METHODS: [(&str, Method); 2] = [("clie", Method::Clie), ("cloe", Method::Cloe)];

/// The cabinet's fixed gains, and the paper's start.
pub(crate) fn options(looped: &Looped) -> Options {
    looped.options()
}

/// Derivatives of position and torque at the samples of a loop: rows are the samples of joint 1,
/// then of joint 2, …; a column per parameter.
pub(crate) struct Derivatives {
    pub(crate) position: DMatrix<f64>,
    pub(crate) torque: DMatrix<f64>,
}

/// Position and acting torque of one loop, in the same rows.
fn outputs(
    looped: &Looped,
    config: &SimulationConfig,
    standard: &[f64],
    samples: usize,
) -> [Vec<f64>; 2] {
    let reference = SampledReference::new(RATE_HZ, &looped.reference).unwrap();
    let mut closed_loop = build(looped, config, standard, &reference);
    let joints = looped.arm.robot.joints();
    let (mut position, mut torque) = (vec![0.0; joints * samples], vec![0.0; joints * samples]);
    for k in 0..samples {
        let sample = closed_loop.step().unwrap();
        for joint in 0..joints {
            position[joint * samples + k] = sample.true_position_rad[joint];
            torque[joint * samples + k] = sample.true_torque_nm[joint];
        }
    }
    [position, torque]
}

fn build<'a>(
    looped: &Looped,
    config: &SimulationConfig,
    standard: &[f64],
    reference: &'a SampledReference,
) -> ClosedLoop<&'a SampledReference> {
    let (robot, controller) = (&looped.arm.robot, &looped.controller);
    let start = InitialState::OnReference;
    ClosedLoop::new(robot, standard, controller, reference, config, start).unwrap()
}

/// By the variational equation.
pub(crate) fn exact(looped: &Looped, config: &SimulationConfig, samples: usize) -> Derivatives {
    let columns = looped.arm.base.columns();
    let reference = SampledReference::new(RATE_HZ, &looped.reference).unwrap();
    let closed_loop = build(looped, config, &looped.arm.truth, &reference);
    let mut closed_loop = closed_loop.with_sensitivities(columns).unwrap();
    let (joints, width) = (looped.arm.robot.joints(), columns.len());
    let zeros = || DMatrix::zeros(joints * samples, width);
    let mut derivatives = Derivatives { position: zeros(), torque: zeros() };
    for k in 0..samples {
        closed_loop.step().unwrap();
        let sensitivities = closed_loop.sensitivities().unwrap();
        for (entry, (q, tau)) in sensitivities.position.iter().zip(sensitivities.torque).enumerate()
        {
            let place = (entry / width * samples + k, entry % width);
            derivatives.position[place] = *q;
            derivatives.torque[place] = *tau;
        }
    }
    derivatives
}

/// By central differences of two simulations per parameter, `step` of each parameter or of 0.1.
pub(crate) fn differences(
    looped: &Looped,
    config: &SimulationConfig,
    samples: usize,
    step: f64,
) -> Derivatives {
    let columns = looped.arm.base.columns();
    let rows = looped.arm.robot.joints() * samples;
    let zeros = || DMatrix::zeros(rows, columns.len());
    let mut derivatives = Derivatives { position: zeros(), torque: zeros() };
    for (k, &column) in columns.iter().enumerate() {
        let value = looped.arm.truth[column];
        let h = step * value.abs().max(0.1);
        let outputs_at = |value: f64| {
            let mut standard = looped.arm.truth.clone();
            standard[column] = value;
            outputs(looped, config, &standard, samples)
        };
        let (above, below) = (outputs_at(value + h), outputs_at(value - h));
        for (to, signal) in [(&mut derivatives.position, 0), (&mut derivatives.torque, 1)] {
            for (row, (a, b)) in above[signal].iter().zip(&below[signal]).enumerate() {
                to[(row, k)] = (a - b) / (2.0 * h);
            }
        }
    }
    derivatives
}

/// Two loops that a joint's inertia is put under.
pub(crate) fn pid(inertia: f64) -> ControlLaw {
    ControlLaw::Pid {
        kp_per_rad: 3000.0,
        kd_s_per_rad: 80.0,
        ki_per_rad_s: 20_000.0,
        k_tau_nm: inertia,
        integral_dead_zone_rad: 2e-3,
    }
}

pub(crate) fn cascade(inertia: f64) -> ControlLaw {
    ControlLaw::CascadedPPi {
        kv_per_s: 20.0,
        kp_s_per_rad: 100.0,
        ki_per_rad: 2000.0,
        k_tau_nm: inertia,
    }
}
