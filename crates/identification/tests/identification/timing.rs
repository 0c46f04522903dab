//! A controller that holds its torque: the identification must know it.

use didim_dynamics::SignalTiming;
use didim_dynamics::dynamics::Workspace;
use didim_dynamics::robot::ParameterKind;
use didim_identification::identification::{Experiment, Method, identify};

use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 500.0;
const SUBSTEPS: usize = 8;

/// Joint positions at the sampling instants and the torque commanded there and held until the
/// next, of a sampled PD controller that follows smooth references.
fn held_torque_run(arm: &Arm, random: &mut Random, samples: usize) -> [Vec<Vec<f64>>; 2] {
    let n = arm.robot.joints();
    let period = 1.0 / RATE_HZ;
    let references = arm.positions(random, samples, RATE_HZ, 4.0);
    let mut q: Vec<f64> = references.iter().map(|r| r[0]).collect();
    let mut dq = vec![0.0; n];
    let mut workspace = Workspace::new();
    let mut log = [vec![vec![0.0; samples]; n], vec![vec![0.0; samples]; n]];
    let mut last = q.clone();
    for k in 0..samples {
        let tau: Vec<f64> = (0..n)
            .map(|j| 300.0 * (references[j][k] - q[j]) - 15.0 * (q[j] - last[j]) / period)
            .collect();
        last.clone_from(&q);
        for j in 0..n {
            log[0][j][k] = q[j];
            log[1][j][k] = tau[j];
        }
        // Runge and Kutta's fourth order over the period, with the torque constant.
        let step = period / SUBSTEPS as f64;
        let mut slope = |q: &[f64], dq: &[f64]| {
            let mut ddq = vec![0.0; n];
            arm.model.direct_dynamics(&mut workspace, &arm.truth, q, dq, &tau, &mut ddq).unwrap();
            ddq
        };
        let step_from = |x: &[f64], v: &[f64], h: f64| -> Vec<f64> {
            x.iter().zip(v).map(|(x, v)| x + h * v).collect()
        };
        for _ in 0..SUBSTEPS {
            let a1 = slope(&q, &dq);
            let v2 = step_from(&dq, &a1, 0.5 * step);
            let a2 = slope(&step_from(&q, &dq, 0.5 * step), &v2);
            let v3 = step_from(&dq, &a2, 0.5 * step);
            let a3 = slope(&step_from(&q, &v2, 0.5 * step), &v3);
            let v4 = step_from(&dq, &a3, step);
            let a4 = slope(&step_from(&q, &v3, step), &v4);
            for j in 0..n {
                q[j] += step / 6.0 * (dq[j] + 2.0 * v2[j] + 2.0 * v3[j] + v4[j]);
                dq[j] += step / 6.0 * (a1[j] + 2.0 * a2[j] + 2.0 * a3[j] + a4[j]);
            }
        }
    }
    log
}

#[test]
fn ignoring_a_hold_biases_the_drive_inertia_and_honouring_it_does_not() {
    let mut random = Random(8);
    let mut arm = Arm::random(&mut random, 2);
    // Viscous friction, so that a torque that is half a period off looks like inertia: the bias is
    // fv T/2. No Coulomb friction, whose jumps differences resolve badly.
    for (value, parameter) in arm.truth.iter_mut().zip(arm.robot.parameters().parameters()) {
        match parameter.kind {
            ParameterKind::Fv => *value = 6.0,
            ParameterKind::Fc | ParameterKind::FcMotor => *value = 0.0,
            _ => {}
        }
    }
    let [position, torque] = held_torque_run(&arm, &mut random, 12_000);
    let experiment = Experiment::joint_side(signals(RATE_HZ, position, torque))
        .unwrap()
        .with_counted(500..11_500)
        .unwrap();
    let truth = arm.true_base();
    let inertia = arm.base.find("ia2").or_else(|| arm.base.find("ia2r")).unwrap();
    fn relative_bias(
        timing: SignalTiming,
        experiment: &Experiment,
        inertia: &usize,
        truth: &[f64],
        arm_robot: &didim_dynamics::robot::Robot,
        arm_base: &didim_dynamics::dynamics::BaseParameters,
    ) -> f64 {
        let experiment = experiment.clone().with_torque_timing(timing).unwrap();
        let options = options(100.0, 0.8, 10);
        let identified =
            identify(Method::IdimLs, arm_robot, arm_base, &experiment, &options).unwrap();
        identified.estimate.parameters[*inertia].value / truth[*inertia] - 1.0
    }
    let hold_s = 1.0 / RATE_HZ;
    let ignored = relative_bias(
        SignalTiming::INSTANTANEOUS,
        &experiment,
        &inertia,
        &truth,
        &arm.robot,
        &arm.base,
    );
    let honoured = relative_bias(
        SignalTiming { hold_s, delay_s: 0.0 },
        &experiment,
        &inertia,
        &truth,
        &arm.robot,
        &arm.base,
    );
    assert!(ignored < -0.02, "ignoring the hold should show: {ignored}");
    assert!(honoured.abs() < 5e-4, "honouring the hold leaves a bias of {honoured}");

    // A delay of half a period without a hold is the same shift.
    let delayed = relative_bias(
        SignalTiming { hold_s: 0.0, delay_s: 0.5 * hold_s },
        &experiment,
        &inertia,
        &truth,
        &arm.robot,
        &arm.base,
    );
    assert!((delayed - honoured).abs() < 1e-12);
}
