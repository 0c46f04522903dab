//! Random arms with possible truths: couplings of any kind, sliding joints, friction laws of their
//! own.

use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::{JointIndex, ParameterKind, SignModel};
use didim_identification::feasibility::{Judgement, Prior};
use nalgebra::DMatrix;

use super::estimates::{Example, states, torques};
use crate::arms::{inverse, mass_matrix, physical_parameters, random_robots};

/// Noise that is 1e-4 of the torques leaves nothing to the prior but what no torque depends on.
#[test]
fn what_the_data_know_is_kept_and_every_link_is_a_body() {
    let (mut coupled, mut most_steps, mut worst) = (0, 0, 0.0_f64);
    for (mut random, robot) in random_robots(30) {
        // Of a law that is 0 at low speeds, or of equal speeds of several joints, motions show
        // little.
        let robot = robot.with_sign_model(SignModel::Tanh { width_rad_s: 0.5 });
        let n = robot.joints();
        coupled += usize::from((0..n).any(|motor| robot.transmission().is_coupled(motor)));
        let truth = physical_parameters(&mut random, &robot);
        let table = robot.parameters().clone();
        let mass = (0..n)
            .map(|link| truth[table.column(ParameterKind::M, JointIndex::new(link)).unwrap()])
            .sum();
        let seen = states(&mut random, n, 200);
        let measured = torques(&robot, &truth, &seen);
        let size = measured.norm() / (measured.len() as f64).sqrt();
        let case = Example::fit(robot, &seen, &measured, 1e-4 * size);
        let prior = Prior::geometric(&case.robot, mass).unwrap();
        let outcome = case.consistent(&prior, 2.0).unwrap();

        for (body, eigenvalue) in outcome.link_bodies.iter().zip(&outcome.smallest_eigenvalues) {
            assert!(body.is_possible() && *eigenvalue > 0.0, "{body:?}");
        }
        for (column, parameter) in table.parameters().iter().enumerate() {
            let found_parameter = &outcome.parameters[column];
            use ParameterKind::{Fc, FcMotor, Fv, Ia};
            if matches!(parameter.kind, Fc | FcMotor | Fv | Ia) {
                assert!(found_parameter.value > 0.0, "{found_parameter:?}");
            }
            assert!((0.0..=1.0).contains(&found_parameter.share_of_data), "{found_parameter:?}");
        }
        // Cauchy and Schwarz: no row is farther from the estimate than all of them.
        for shift in &outcome.shifts {
            assert!(shift.deviations.powi(2) < outcome.cost * (1.0 + 1e-6) + 1e-9, "{shift:?}");
        }
        // What the arm as a whole has of it: a mass matrix that is positive definite, couplings and
        // drives included, and viscous friction that takes power.
        let (model, standard) = (Model::new(&case.robot), outcome.standard_values());
        for [q, dq, _] in &seen[..10] {
            let mass = mass_matrix(&model, &standard, q);
            assert!(DMatrix::from_row_slice(n, n, &mass).cholesky().is_some());
            let mut viscous = standard.clone();
            for (value, parameter) in viscous.iter_mut().zip(table.parameters()) {
                if !matches!(parameter.kind, ParameterKind::Fv | ParameterKind::FvMotor) {
                    *value = 0.0;
                }
            }
            let torque = inverse(&model, &viscous, q, dq, &vec![0.0; n]);
            assert!(torque.iter().zip(dq).map(|(tau, dq)| tau * dq).sum::<f64>() >= 0.0);
        }
        assert!(
            outcome.least_cost < 0.03 * 10.0 * n as f64 && outcome.negative_parameters.is_empty()
        );
        assert_ne!(outcome.judgement, Judgement::Infeasible);
        let others = states(&mut random, n, 50);
        let expected = torques(&case.robot, &truth, &others);
        let off = (torques(&case.robot, &outcome.standard_values(), &others) - &expected).norm();
        worst = worst.max(off / expected.norm());
        most_steps = most_steps.max(outcome.steps);
    }
    println!("{coupled} coupled, at most {most_steps} steps, torques within {worst:.1e}");
    assert!(coupled > 10 && most_steps < 300 && worst < 1e-3);
}
