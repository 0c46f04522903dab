//! Outliers in the record: what they do to least squares, and not to the M-estimate.

use didim_identification::identification::{
    self, Estimate, Experiment, IdentificationError, Method, Note, Options, VerdictLimits,
};
use didim_identification::regression::RobustLoss;

use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 400.0;
const SAMPLES: usize = 8000;

/// A random arm with 0.2 N·m of noise on its torques, and what goes wrong in its record.
fn identify(
    spoil: impl Fn(&mut [Vec<f64>], &mut [Vec<f64>]),
    losses: &[Option<RobustLoss>],
) -> (Vec<Estimate>, Vec<f64>) {
    let mut random = Random(3);
    let arm = Arm::random(&mut random, 3);
    let motion = arm.motion(&mut random, SAMPLES, RATE_HZ, 2.0);
    let mut torques = arm.torques(&motion);
    torques.iter_mut().flatten().for_each(|t| *t += 0.2 * random.normal());
    let mut positions: Vec<Vec<f64>> =
        motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    spoil(&mut positions, &mut torques);
    let experiment = Experiment::joint_side(signals(RATE_HZ, positions, torques))
        .unwrap()
        .with_counted(200..SAMPLES - 200)
        .unwrap();
    let estimates = losses.iter().map(|&robust| {
        let options = Options { robust, ..options(40.0, 0.8, 10) };
        identification::identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options)
            .unwrap()
            .estimate
    });
    (estimates.collect(), arm.true_base())
}

/// Deviations from the truth, in the standard deviations of `of`: the largest, and the rms.
fn deviations(estimate: &Estimate, of: &Estimate, truth: &[f64]) -> (f64, f64) {
    let pairs = estimate.parameters.iter().zip(&of.parameters).zip(truth);
    let z: Vec<f64> =
        pairs.map(|((p, of), t)| (p.value - t).abs() / of.standard_deviation).collect();
    let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
    (z.into_iter().fold(0.0, f64::max), rms)
}

/// The notes in words.
fn noted(estimate: &Estimate) -> String {
    let notes: Vec<String> = estimate.verdict.notes.iter().map(ToString::to_string).collect();
    notes.join("\n")
}

const LOSSES: [Option<RobustLoss>; 3] =
    [None, Some(RobustLoss::Huber { tuning: 1.345 }), Some(RobustLoss::Bisquare { tuning: 4.685 })];

#[test]
fn without_outliers_nothing_changes() {
    let (found, truth) = identify(|_, _| {}, &LOSSES);
    for estimate in &found {
        let (largest, rms) = deviations(estimate, &found[0], &truth);
        println!("{largest:.2} {rms:.2} {:?}", estimate.downweighted_rows_per_joint);
        // Deviations that are normal, and 23 % more.
        assert!(largest < 4.0 && (0.6..1.4).contains(&rms), "{largest} {rms}");
        for (robust, plain) in estimate.parameters.iter().zip(&found[0].parameters) {
            let ratio = robust.standard_deviation / plain.standard_deviation;
            assert!((0.85..1.2).contains(&ratio), "{ratio}");
        }
    }
    assert!(found[0].downweighted_rows_per_joint.is_none());
    let downweighted = found[2].downweighted_rows_per_joint.as_ref().unwrap();
    // One in a hundred of 760 rows.
    assert!(downweighted.iter().all(|rows| *rows < 30), "{downweighted:?}");
}

/// A loose connector: a torque of 40 N·m for a sample, on every joint, eight times in 20 s. Behind
/// the decimation filter a spike is two or three rows.
#[test]
fn spikes_of_the_torque() {
    let (found, truth) = identify(
        |_: &mut [Vec<f64>], torques: &mut [Vec<f64>]| {
            for (joint, torque) in torques.iter_mut().enumerate() {
                torque.iter_mut().skip(300 + 230 * joint).step_by(997).for_each(|t| *t += 40.0);
            }
        },
        &LOSSES,
    );
    let notes = noted(&found[2]);
    for text in ["downweighted, at 0.", "more times", "a connector"] {
        assert!(notes.contains(text), "{notes}");
    }
    assert!(!notes.contains("throughout the motion"), "{notes}");
    check("spikes", (found, truth), 5.0);
}

/// A torque that the model has not, in a tenth of the time and again and again, is no outlier.
#[test]
fn a_model_that_is_wrong_is_not_called_outliers() {
    let (found, _) = identify(
        |_: &mut [Vec<f64>], torques: &mut [Vec<f64>]| {
            let often = torques[1].iter_mut().enumerate().filter(|(k, _)| k % 300 < 30);
            often.for_each(|(_, torque)| *torque += 3.0);
        },
        &LOSSES,
    );
    for estimate in &found[1..] {
        let notes = noted(estimate);
        let says = ["% of the rows of joint 2 were downweighted throughout the motion", "model"];
        assert!(says.iter().all(|text| notes.contains(text)), "{notes}");
    }
}

/// An encoder that is 0.02 rad off for three samples, five times: its accelerations are in the
/// regressor.
#[test]
fn glitches_of_an_encoder() {
    let (found, truth) = identify(
        |positions: &mut [Vec<f64>], _: &mut [Vec<f64>]| {
            for start in (350..SAMPLES - 350).step_by(1801) {
                positions[1][start..start + 3].iter_mut().for_each(|q| *q += 0.02);
            }
        },
        &LOSSES,
    );
    assert!(found[2].verdict.notes.iter().any(|note| matches!(note, Note::Outliers { .. })));
    check("glitches", (found, truth), 5.0);
}

/// What the estimate does not follow, the check of the position filter does not either: not a
/// glitch of 0.5 rad, whose accelerations a wider filter multiplies.
#[test]
fn a_glitch_is_no_motion_that_the_filter_distorts() {
    let (clean, _) = identify(|_, _| {}, &LOSSES);
    let (found, _) = identify(
        |positions: &mut [Vec<f64>], _: &mut [Vec<f64>]| {
            for start in [2000, 5500] {
                positions[1][start] += 0.5;
            }
        },
        &LOSSES,
    );
    let limit = VerdictLimits::default().position_filter_deviations;
    for (clean, found) in clean.iter().zip(&found).skip(1) {
        let [before, after] =
            [clean, found].map(|of| of.position_bias.as_ref().unwrap().deviations.abs());
        println!("position filter: {before:.2} σ, with glitches {after:.2} σ");
        assert!(before < limit && after < limit, "{before} {after}");
        let blames = |note: &Note| matches!(note, Note::PositionBias { .. });
        assert!(!found.verdict.notes.iter().any(blames), "{:?}", found.verdict.notes);
    }
}

fn check(what: &str, (found, truth): (Vec<Estimate>, Vec<f64>), least: f64) {
    // In the standard deviations of an undisturbed record.
    let (clean, _) = identify(|_, _| {}, &[None]);
    for estimate in &found {
        let (largest, rms) = deviations(estimate, &clean[0], &truth);
        let (own, own_rms) = deviations(estimate, estimate, &truth);
        println!(
            "{what}: {largest:.2} {rms:.2}, in its own {own:.2} {own_rms:.2}, {:?}",
            estimate.downweighted_rows_per_joint
        );
    }
    let (plain, _) = deviations(&found[0], &clean[0], &truth);
    let (bisquare, rms) = deviations(&found[2], &clean[0], &truth);
    assert!(plain > least, "{what}: least squares is off by {plain}");
    // It has fewer rows than the undisturbed record.
    assert!(bisquare < 4.0 && rms < 1.5, "{what}: the bisquare is off by {bisquare}, {rms}");
    let (own, _) = deviations(&found[2], &found[2], &truth);
    assert!(own < 3.0, "{what}: {own}");
    assert!(found[2].downweighted_rows_per_joint.iter().flatten().sum::<usize>() > 20);
}

/// What is no M-estimate does not pretend to be one.
#[test]
fn an_impossible_tuning_is_refused() {
    let mut random = Random(3);
    let arm = Arm::random(&mut random, 2);
    let motion = arm.motion(&mut random, 2000, RATE_HZ, 2.0);
    let positions = motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    let experiment =
        Experiment::joint_side(signals(RATE_HZ, positions, arm.torques(&motion))).unwrap();
    let robust = Some(RobustLoss::Huber { tuning: -1.0 });
    let options = Options { robust, ..options(40.0, 0.8, 10) };
    let error =
        identification::identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options)
            .unwrap_err();
    assert!(matches!(error, IdentificationError::Regression(_)), "{error}");
    assert!(error.to_string().contains("tuning = -1"), "{error}");
}
