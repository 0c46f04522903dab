//! Models that are right, too large and too small, by what they predict.

use didim_identification::identification::{
    CrossValidation, Experiment, IdentificationError, Method, Options, VerdictLimits,
    cross_validate,
};

use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 400.0;
const NOISE_NM: f64 = 0.5;
const BLOCKS: usize = 4;

/// Of a random arm of 3 joints; `parameters` of its base parameters, by name.
struct Case {
    arm: Arm,
    experiment: Experiment,
    /// ‖ε‖/‖τ‖ behind the filter.
    noise: f64,
}

fn case(samples: usize) -> Case {
    let mut random = Random(3);
    let arm = Arm::random(&mut random, 3);
    let motion = arm.motion(&mut random, samples, RATE_HZ, 2.0);
    let mut torques = arm.torques(&motion);
    let power = torques.iter().flatten().map(|t| t * t).sum::<f64>() / (3 * samples) as f64;
    torques.iter_mut().flatten().for_each(|t| *t += NOISE_NM * random.normal());
    let positions = motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    let experiment = Experiment::joint_side(signals(RATE_HZ, positions, torques))
        .unwrap()
        .with_counted(100..samples - 100)
        .unwrap();
    // The filter passes a tenth of the band, with soft edges.
    Case { arm, experiment, noise: NOISE_NM * 0.08_f64.sqrt() / power.sqrt() }
}

fn validate(case: &Case, parameters: Option<Vec<String>>) -> CrossValidation {
    let limits = VerdictLimits { condition_number: 1e9, ..VerdictLimits::default() };
    let options = Options { parameters, limits, ..options(40.0, 0.8, 10) };
    let (robot, base) = (&case.arm.robot, &case.arm.base);
    let validation =
        cross_validate(Method::IdimLs, robot, base, &case.experiment, &options, BLOCKS).unwrap();
    println!(
        "held out {:.4}, in sample {:.4}, noise {:.4}",
        validation.held_out.relative_error, validation.in_sample.relative_error, case.noise
    );
    validation
}

#[test]
fn the_right_model_predicts_as_well_as_it_fits() {
    let case = case(12_000);
    let validation = validate(&case, None);
    for error in [&validation.held_out, &validation.in_sample] {
        let ratio = error.relative_error / case.noise;
        assert!((0.95..1.1).contains(&ratio), "{ratio}");
        assert_eq!(error.relative_error_per_joint.len(), 3);
    }
    let ratio = validation.held_out.relative_error / validation.in_sample.relative_error;
    assert!((1.0..1.1).contains(&ratio), "{ratio}");
    assert_eq!((validation.blocks.len(), validation.fold_estimates.len()), (BLOCKS, BLOCKS));
    assert_eq!(validation.blocks[0].start, 100);
    assert_eq!(validation.blocks[BLOCKS - 1].end, 11_900);
    assert!(validation.blocks.windows(2).all(|pair| pair[0].end == pair[1].start));
}

/// Few rows for as many parameters: it fits what is noise.
#[test]
fn too_many_parameters_for_the_rows_predict_badly() {
    let case = case(900);
    let validation = validate(&case, None);
    let ratio = validation.held_out.relative_error / validation.in_sample.relative_error;
    assert!(validation.in_sample.relative_error < 1.1 * case.noise, "{:?}", validation.in_sample);
    assert!(ratio > 1.5, "{ratio}");
}

/// Without inertias and gravity it neither fits nor predicts.
#[test]
fn too_few_parameters_do_both_badly() {
    let case = case(12_000);
    let friction = case.arm.base.names().iter().filter(|name| name.starts_with('f')).cloned();
    let validation = validate(&case, Some(friction.collect()));
    for error in [&validation.held_out, &validation.in_sample] {
        assert!(error.relative_error > 5.0 * case.noise, "{error:?}");
    }
    let ratio = validation.held_out.relative_error / validation.in_sample.relative_error;
    assert!((0.95..1.3).contains(&ratio), "{ratio}");
}

#[test]
fn blocks_that_the_filters_would_mix_are_refused() {
    let case = case(1500);
    let options = options(40.0, 0.8, 10);
    let (robot, base) = (&case.arm.robot, &case.arm.base);
    for blocks in [0, 1, 40] {
        let error = cross_validate(Method::IdimLs, robot, base, &case.experiment, &options, blocks)
            .unwrap_err();
        assert!(matches!(error, IdentificationError::Blocks { .. }), "{error}");
    }
}
