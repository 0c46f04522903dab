//! The parameters without a verdict, which are those with one.

use didim_identification::identification::{
    Experiment, Method, Options, identify, idim_ls_unchecked,
};
use didim_identification::regression::RobustLoss;

use crate::common::arm::{Arm, Random, options, signals};

/// Also where a parameter is left out and an outlier is weighted down: everything but the verdict.
#[test]
fn unchecked_parameters_are_those_of_the_result_to_the_bit() {
    let mut random = Random(5);
    let arm = Arm::random(&mut random, 3);
    let motion = arm.motion(&mut random, 4000, 400.0, 2.0);
    let mut torques = arm.torques(&motion);
    torques.iter_mut().flatten().for_each(|torque| *torque += 0.2 * random.normal());
    torques[1][2000] += 200.0;
    let positions = motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    let experiment = Experiment::joint_side(signals(400.0, positions, torques)).unwrap();
    let experiment = experiment.with_counted(200..3800).unwrap();
    let mut essential = arm.base.names().to_vec();
    essential.remove(3);
    for parameters in [None, Some(essential)] {
        for robust in [None, Some(RobustLoss::Huber { tuning: 1.345 })] {
            let parameters = parameters.clone();
            let options = Options { parameters, robust, ..options(40.0, 0.8, 10) };
            let unchecked =
                idim_ls_unchecked(&arm.robot, &arm.base, &experiment, &options).unwrap();
            let checked = identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options)
                .unwrap()
                .estimate;
            assert_eq!(unchecked.parameters.len(), checked.parameters.len());
            for (found, checked) in unchecked.parameters.iter().zip(&checked.parameters) {
                assert_eq!(found.name, checked.name);
                assert_eq!(found.value.to_bits(), checked.value.to_bits());
                let deviations = [found.standard_deviation, checked.standard_deviation];
                assert_eq!(deviations[0].to_bits(), deviations[1].to_bits());
            }
            assert_eq!(unchecked.condition_number.to_bits(), checked.condition_number.to_bits());
            let residuals = &unchecked.residuals;
            assert_eq!(residuals.relative_error.to_bits(), checked.relative_error.to_bits());
            assert_eq!(residuals.relative_error_per_joint, checked.relative_error_per_joint);
            assert_eq!(residuals.rms_per_joint, checked.rms_error_per_joint_nm);
        }
    }
}

#[test]
fn what_cannot_be_identified_is_refused_without_checks_too() {
    let mut random = Random(5);
    let (arm, other) = (Arm::random(&mut random, 3), Arm::random(&mut random, 2));
    let signal = arm.positions(&mut random, 2000, 400.0, 2.0);
    let experiment = Experiment::joint_side(signals(400.0, signal.clone(), signal)).unwrap();
    let mut options = options(40.0, 0.8, 10);
    let refused = idim_ls_unchecked(&other.robot, &other.base, &experiment, &options).unwrap_err();
    assert!(refused.to_string().contains("joints"), "{refused}");
    options.limits.condition_number = f64::NAN;
    let refused = idim_ls_unchecked(&arm.robot, &arm.base, &experiment, &options).unwrap_err();
    assert!(refused.to_string().contains("condition_number"), "{refused}");
}
