//! The sensitivities of the simulated signals.

use didim_dynamics::control::{ControlLaw, ControlTiming};
use didim_dynamics::simulation::{Integrator, SimulationConfig};
use nalgebra::DMatrix;

use super::loops::{cascade, differences, exact, pid};
use crate::common::looped::{Looped, PERIOD_S, pd, sampled};

type Law = fn(f64) -> ControlLaw;

/// Of 0.4 s.
const SAMPLES: usize = 400;

/// Largest relative difference of two columns.
fn difference(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    let columns = a.column_iter().zip(b.column_iter());
    columns.map(|(a, b)| (a - b).norm() / a.norm()).fold(0.0, f64::max)
}

/// The exact derivatives of the discrete loop against central differences of the same loop.
///
/// What differs is the differences' own error. It grows tenfold when h falls tenfold, from 5e-8 at
/// h = 1e-3 to 5e-5 at 1e-6: rounding of the signals over h. At 1e-3 the truncation, h² θ²/6 of the
/// third derivative, is as small. Ten times that is allowed.
#[test]
fn the_variational_equation_gives_the_derivatives_of_the_discrete_loop() {
    let delayed = |periods: f64| sampled(periods * PERIOD_S);
    let continuous = ControlTiming::Continuous { sample_period_s: PERIOD_S };
    let laws: [(&str, ControlTiming, Law); 7] = [
        ("PD", sampled(0.0), pd),
        ("PD, 0.4 periods late", delayed(0.4), pd),
        ("PD, 1.7 periods late", delayed(1.7), pd),
        ("PID", sampled(0.0), pid),
        ("cascade", sampled(0.0), cascade),
        ("continuous PD", continuous, pd),
        ("continuous cascade", continuous, cascade),
    ];
    let looped = |(seed, (name, timing, law))| (name, Looped::random(seed, 3, timing, law));
    let loaded = ("friction by load", Looped::with_load_friction(7, 3));
    let lagging = [("hysteresis", sampled(0.0)), ("hysteresis, continuous", continuous)]
        .map(|(name, timing)| (name, Looped::with_hysteresis(8, 3, timing)));
    for (name, looped) in (0..).zip(laws).map(looped).chain([loaded]).chain(lagging) {
        for (integrator, substeps) in [(Integrator::Ode3, 1), (Integrator::Rk4, 2)] {
            let config = SimulationConfig { integrator, substeps, ..SimulationConfig::default() };
            let exact = exact(&looped, &config, SAMPLES);
            let approximate = differences(&looped, &config, SAMPLES, 1e-3);
            let position = difference(&exact.position, &approximate.position);
            let torque = difference(&exact.torque, &approximate.torque);
            println!("{name}, {integrator:?}: {position:.1e}, {torque:.1e}");
            assert!(position < 1e-6 && torque < 1e-6, "{name} {integrator:?}: {position} {torque}");
        }
    }
}

/// Equation 23, with the sampled controller in place of C: δτ_k = −K_τ (Kp δq_k + Kd (δq_k −
/// δq_{k−1})/T) for every parameter, with the derivatives of position and torque by differences,
/// each from its own signal, and exactly. The differences have their own rounding, as above.
#[test]
fn input_sensitivities_are_output_sensitivities_behind_the_controller() {
    let looped = Looped::random(11, 3, sampled(0.0), pd);
    let config = SimulationConfig::default();
    let exact = exact(&looped, &config, SAMPLES);
    let approximate = differences(&looped, &config, SAMPLES, 1e-3);
    for (found, tolerance) in [(exact, 1e-12), (approximate, 1e-6)] {
        let filtered = -(controller(&looped, SAMPLES) * &found.position);
        let difference = difference(&found.torque, &filtered);
        println!("{difference:.1e}");
        assert!(difference < tolerance, "{difference}");
    }
}

/// Equations 31 and 32: where the noise of the torque is that of the position behind the
/// controller, Ω_v = C̄ Ω_q C̄ᵀ, both methods have one covariance, and equation 27 one estimate.
#[test]
fn both_outputs_have_one_covariance_where_their_noises_correspond() {
    let looped = Looped::random(12, 2, sampled(0.0), pd);
    let samples = 200;
    let sensitivities = exact(&looped, &SimulationConfig::default(), samples);
    let joints = looped.arm.robot.joints();
    // Different noise of each joint, and the parameters that 0.2 s tell apart well.
    let omega_q = DMatrix::from_fn(joints * samples, joints * samples, |i, j| {
        if i == j { 1e-10 * (1.0 + (i / samples) as f64) } else { 0.0 }
    });
    let c = controller(&looped, samples);
    let omega_v = &c * &omega_q * c.transpose();
    let chosen: Vec<usize> = (0..looped.arm.base.names().len())
        .filter(|&k| looped.arm.base.names()[k].starts_with('f'))
        .collect();
    fn covariance(
        jacobian: &DMatrix<f64>,
        omega: DMatrix<f64>,
        chosen: &[usize],
    ) -> nalgebra::DMatrix<f64> {
        let jacobian = jacobian.select_columns(chosen);
        let weighted = omega.cholesky().unwrap().solve(&jacobian);
        (jacobian.transpose() * weighted).try_inverse().unwrap()
    }
    let position = covariance(&sensitivities.position, omega_q, &chosen);
    let torque = covariance(&sensitivities.torque, omega_v, &chosen);
    for (a, b) in position.diagonal().iter().zip(torque.diagonal().iter()) {
        // Rounding of the inverses, whose condition number is some 1e6.
        assert!((a - b).abs() < 1e-7 * a, "{a} {b}");
    }
}

/// G C of a sampled PD over the whole record: rows of joint 1, then of joint 2, ….
fn controller(looped: &Looped, samples: usize) -> DMatrix<f64> {
    let joints = &looped.controller.joints;
    let mut matrix = DMatrix::zeros(joints.len() * samples, joints.len() * samples);
    for (j, joint) in joints.iter().enumerate() {
        let ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm } = joint.law else {
            panic!("a PD is needed");
        };
        for k in 0..samples {
            let row = j * samples + k;
            matrix[(row, row)] = k_tau_nm * kp_per_rad;
            // The first sample has no difference.
            if k > 0 {
                matrix[(row, row)] += k_tau_nm * kd_s_per_rad / PERIOD_S;
                matrix[(row, row - 1)] = -k_tau_nm * kd_s_per_rad / PERIOD_S;
            }
        }
    }
    matrix
}
