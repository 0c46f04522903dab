//! Predicted deviations of a designed motion, and those of an identification from it:
//! docs/evidence/excitation.md. By hand:
//! `cargo test --release -p didim-sim --test tests -- --ignored --nocapture excitation`.

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_dynamics::trajectory::SampledReference;
use didim_identification::excitation::{
    Bounds, DesignObjective, FourierSeries, JointExcitation, JointExcitations, Margins, Noise,
    Task, advise, design, information, predict_result,
};
use didim_identification::identification::{Estimate, Experiment, Method, identify};
use didim_identification::parallel::Serial;
use didim_sim::{Motion, Scenario, tx40_paper};
use nalgebra::DMatrix;

use crate::common::experiment::{experiment_after, listed, regression};
use crate::common::parallel::in_parallel;

const RATE_HZ: f64 = 5000.0;
/// Rest before and after a motion, in samples: 1 s, for a designed one begins where gravity pulls,
/// and the loop, which has no integral, first sags there.
const REST: usize = 5000;

fn experiment(scenario: &Scenario) -> Experiment {
    experiment_after(scenario, REST)
}

fn identified(scenario: &Scenario, base: &BaseParameters) -> Estimate {
    identified_from(scenario, base, &experiment(scenario))
}

fn identified_from(
    scenario: &Scenario,
    base: &BaseParameters,
    experiment: &Experiment,
) -> Estimate {
    let options = regression(Some(listed(scenario)), 200.0);
    identify(Method::IdimLs, scenario.robot(), base, experiment, &options).unwrap().estimate
}

/// What a motion is designed with, when this result is all that is known of its noise.
fn task_of(robot: &Robot, base: &BaseParameters, result: &Estimate, duration_s: f64) -> Task {
    let mut colours: Vec<f64> = (result.parameters.iter())
        .map(|of| of.standard_deviation / of.classical_standard_deviation)
        .collect();
    colours.sort_by(f64::total_cmp);
    let colour = colours[colours.len() / 2];
    let columns: Vec<usize> =
        (result.parameters.iter()).map(|of| base.columns()[base.find(&of.name).unwrap()]).collect();
    let nominal = robot.nominal().unwrap().standard_parameters().to_vec();
    let count = columns.len();
    Task {
        bounds: Bounds::new(robot, Margins::default(), None, Some(nominal)).unwrap(),
        model: Model::new(robot),
        duration_s,
        first_posture: None,
        moving_joints: vec![true; robot.joints()],
        columns,
        prior_information: DMatrix::zeros(count, count),
        noise: Noise {
            deviations: result.rms_error_per_joint_nm.iter().map(|rms| colour * rms).collect(),
            rows_per_s: RATE_HZ / 125.0,
        },
        objective: DesignObjective::Deviations((0..count).map(|k| (k, 0.0)).collect()),
    }
}

/// The arm on a motion.
fn along_series(scenario: &Scenario, series: &FourierSeries) -> Scenario {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds")]
    let samples = (series.duration_s * RATE_HZ) as usize + 1;
    let positions = DMatrix::from_fn(samples, scenario.robot().joints(), |k, j| {
        series.state(k as f64 / RATE_HZ).position[j]
    });
    let motion = SampledReference::new(RATE_HZ, &positions).unwrap();
    let along = scenario.clone().with_recorded_motion(motion).unwrap();
    assert!(matches!(along.trajectory(), Motion::Recorded(_)));
    assert_eq!(along.samples(), samples - 1);
    along
}

/// Of a parameter over the recordings, in units of the predicted standard deviation.
struct Came {
    name: String,
    scatter: f64,
    /// Root mean square of the standard deviations that the results say.
    said: f64,
    /// Of the mean from the truth.
    bias: f64,
}

fn came(estimates: &[Estimate], predicted: &[f64], arm: &Scenario) -> Vec<Came> {
    let count = estimates.len() as f64;
    predicted
        .iter()
        .enumerate()
        .map(|(k, predicted_deviation): (usize, &f64)| {
            let name = estimates[0].parameters[k].name.clone();
            let mean_of =
                |of: &dyn Fn(&Estimate) -> f64| estimates.iter().map(of).sum::<f64>() / count;
            let mean = mean_of(&|of| of.parameters[k].value);
            let variance = mean_of(&|of| (of.parameters[k].value - mean).powi(2));
            Came {
                scatter: (variance * count / (count - 1.0).max(1.0)).sqrt() / predicted_deviation,
                said: mean_of(&|of| of.parameters[k].standard_deviation.powi(2)).sqrt()
                    / predicted_deviation,
                bias: (mean - arm.truth_of(&name).unwrap()) / predicted_deviation,
                name,
            }
        })
        .collect()
}

/// A result of the shipped motion gives its noise. The motion designed with it is as good as
/// predicted.
fn study(duration_s: f64, steps: u32, seeds: usize) -> Vec<Came> {
    let first = tx40_paper().unwrap();
    let base = BaseParameters::compute(&Model::new(first.robot())).unwrap();
    let result = identified(&first, &base);
    let task = task_of(first.robot(), &base, &result, duration_s);
    let series = design(&task, 1, steps, |_| ()).unwrap().series;
    let predicted = predict_result(&task, &series).unwrap().deviations;

    let scenario = along_series(&first, &series);
    let estimates =
        in_parallel(seeds, |seed| identified(&scenario.clone().with_seed(1 + seed as u64), &base));
    let came = came(&estimates, &predicted, &first);
    for Came { name, scatter, said, bias } in &came {
        println!(
            "{duration_s} s {name}: scatter {scatter:.2}, said {said:.2}, mean from the truth \
            {bias:.2}"
        );
    }
    came
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|of| of * of).sum::<f64>() / count).sqrt()
}

/// A short one, so that it holds in every run of the tests.
#[test]
fn a_designed_motion_shows_about_what_was_predicted() {
    let ratio = rms(study(3.0, 40, 1).iter().map(|of| of.said));
    assert!((ratio - 1.0).abs() < 0.3, "{ratio}");
}

/// Each parameter scatters about as predicted, at 10 s and at 20 s: 200 recordings determine its
/// scatter to 0.05.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn designed_motions_show_what_was_predicted() {
    let mut off = Vec::new();
    for duration_s in [10.0, 20.0] {
        let came = study(duration_s, 600, 200);
        let ratio = rms(came.iter().map(|of| of.said));
        assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
        let beyond = came.into_iter().filter(|of| (of.scatter - 1.0).abs() > 0.35);
        off.extend(beyond.map(|of| format!("{duration_s} s, {}: {}", of.name, of.scatter)));
    }
    assert!(off.is_empty(), "{off:?}");
}

/// Two motions of 10 s, the second for what the first left, against one of 20 s.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn two_short_motions_against_a_long_one() {
    let arm = tx40_paper().unwrap();
    let base = BaseParameters::compute(&Model::new(arm.robot())).unwrap();
    let result = identified(&arm, &base);
    fn deviations(task: &Task) -> (Vec<f64>, FourierSeries) {
        let best = |seed| design(task, seed, 600, |_| ()).unwrap();
        let [a, b] = [best(1), best(2)];
        let series = if a.value < b.value { a.series } else { b.series };
        (predict_result(task, &series).unwrap().deviations, series)
    }
    let short = task_of(arm.robot(), &base, &result, 10.0);
    let (_, series) = deviations(&short);
    let before = information(&short, &series);
    let (twice, _) = deviations(&Task { prior_information: before, ..short });
    let (once, _) = deviations(&task_of(arm.robot(), &base, &result, 20.0));
    let ratios: Vec<f64> = twice.iter().zip(&once).map(|(twice, once)| twice / once).collect();
    let mean = (ratios.iter().map(|of| of.ln()).sum::<f64>() / ratios.len() as f64).exp();
    let worst = ratios.iter().copied().fold(0.0, f64::max);
    println!(
        "two motions of 10 s: σ {mean:.3} times that of one of 20 s (geometric mean), the worst \
        {worst:.2}"
    );
    assert!(mean < 1.2);
}

/// A production that hardly moves the wrist: what is advised is followed, and with the first record
/// brings what was promised.
#[test]
fn advice_that_is_followed_brings_what_was_promised() {
    let arm = tx40_paper().unwrap();
    let base = BaseParameters::compute(&Model::new(arm.robot())).unwrap();
    let excitation = |joint, to, times| JointExcitation {
        joint: JointIndex::new(joint),
        reversal_position: to,
        repetitions: times,
    };
    let production = JointExcitations {
        duration_s: 6.0,
        posture: vec![0.0, 0.2, 0.5, 0.0, 0.3, 0.0],
        excitations: vec![
            excitation(0, 1.2, 5),
            excitation(1, -0.6, 4),
            excitation(2, 1.4, 7),
            excitation(3, 0.06, 1),
            excitation(4, 0.36, 2),
            excitation(5, 0.06, 3),
        ],
    };
    let first = along_series(&arm, &production.series());
    let record = experiment(&first);
    let result = identified_from(&first, &base, &record);
    let covariance = result.covariance.as_ref().unwrap().matrix(result.parameters.len()).unwrap();
    let before = covariance.cholesky().unwrap().inverse();
    let task = Task { prior_information: before, ..task_of(arm.robot(), &base, &result, 1.0) };
    let values: Vec<f64> = result.parameters.iter().map(|of| of.value).collect();
    let enough = 0.01;
    let advice = advise(arm.robot(), &task, &values, enough, &Serial).unwrap();
    let name = |k: &usize| result.parameters[*k].name.as_str();
    let missing: Vec<&str> = advice.missing_parameters.iter().map(name).collect();
    // Of the wrist alone.
    assert!(
        ["ia4", "fv4", "ia5", "fv5", "ia6"].iter().all(|of| missing.contains(of)),
        "{missing:?}"
    );
    assert!(missing.iter().all(|of| of.ends_with(['4', '5', '6'])), "{missing:?}");
    assert!((1..=4).contains(&advice.motions.len()));
    assert!(advice.torque[1] < 0.5 * advice.torque[0], "{:?}", advice.torque);
    let mut records = vec![record];
    for (seed, piece) in (1..).zip(&advice.motions) {
        assert!(piece.design.used.iter().all(|used| used.used_share <= 1.0));
        records.push(experiment(&along_series(&arm, &piece.design.series).with_seed(seed)));
    }
    let then = identified_from(&arm, &base, &Experiment::join(&records).unwrap());
    let promised = &advice.motions.last().unwrap().deviations;
    for &k in &advice.missing_parameters {
        let achieved = then.parameters[k].standard_deviation;
        println!(
            "{}: σ {:.2e}, promised {:.2e}, found {achieved:.2e}",
            name(&k),
            advice.deviations[k],
            promised[k]
        );
        assert!((achieved / promised[k] - 1.0).abs() < 0.25, "{}", name(&k));
        assert!(
            promised[k] <= enough * values[k].abs() && promised[k] < 0.5 * advice.deviations[k]
        );
    }
}
