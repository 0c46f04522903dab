//! What a designed motion is foretold to tell, and what an identification of it finds: docs/excitation.md.
//! By hand: `cargo test --release -p didim-sim --test tests -- --ignored --nocapture excitation`.

use didim_core::dynamics::{BaseParameters, Model};
use didim_core::excitation::{Aim, Bounds, Margins, Noise, Task, design, predicted};
use didim_core::identification::{Estimate, Method, identify};
use didim_core::trajectory::SampledReference;
use didim_sim::{Motion, Scenario, tx40_paper};
use nalgebra::DMatrix;

use crate::common::experiment::{experiment, listed, regression};
use crate::common::parallel::in_parallel;

const RATE_HZ: f64 = 5000.0;

fn identified(scenario: &Scenario, base: &BaseParameters) -> Estimate {
    let options = regression(Some(listed(scenario)), 200.0);
    let experiment = experiment(scenario);
    identify(Method::IdimLs, scenario.robot(), base, &experiment, &options).unwrap().estimate
}

/// A result of the shipped motion says what its noise is; the motion that is designed with it is as good as was foretold.
fn study(duration_s: f64, steps: u32, seeds: usize) -> f64 {
    let first = tx40_paper().unwrap();
    let robot = first.robot();
    let model = Model::new(robot);
    let base = BaseParameters::compute(&model).unwrap();
    let result = identified(&first, &base);
    let mut colours: Vec<f64> = (result.parameters.iter())
        .map(|of| of.standard_deviation / of.classical_standard_deviation)
        .collect();
    colours.sort_by(f64::total_cmp);
    let colour = colours[colours.len() / 2];
    let columns: Vec<usize> =
        (result.parameters.iter()).map(|of| base.columns()[base.find(&of.name).unwrap()]).collect();
    let nominal = robot.nominal().unwrap().standard().to_vec();
    let count = columns.len();
    let task = Task {
        bounds: Bounds::new(robot, Margins::default(), None, Some(nominal)).unwrap(),
        model,
        duration_s,
        columns,
        before: DMatrix::zeros(count, count),
        noise: Noise {
            levels: result.rms_error_per_joint_nm.iter().map(|rms| colour * rms).collect(),
            rows_per_s: RATE_HZ / 125.0,
        },
        aim: Aim::Deviations((0..count).map(|k| (k, 0.0)).collect()),
    };
    let series = design(&task, 1, steps, |_| ()).unwrap().series;
    let foretold = predicted(&task, &series).unwrap().deviations;

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds")]
    let samples = (duration_s * RATE_HZ) as usize + 1;
    let positions = DMatrix::from_fn(samples, robot.joints(), |k, j| {
        series.state(k as f64 / RATE_HZ).position[j]
    });
    let motion = SampledReference::new(RATE_HZ, &positions).unwrap();
    let moved = first.clone().with_recorded_motion(motion).unwrap();
    assert!(matches!(moved.trajectory(), Motion::Recorded(_)));
    assert_eq!(moved.samples(), samples - 1);
    let estimates =
        in_parallel(seeds, |seed| identified(&moved.clone().with_seed(1 + seed as u64), &base));
    let rms = |values: &[f64]| {
        (values.iter().map(|of| of * of).sum::<f64>() / values.len() as f64).sqrt()
    };
    // In units of what was foretold: what each result says of itself, and how far its values scatter about the truth.
    let said: Vec<f64> = (estimates.iter())
        .flat_map(|of| of.parameters.iter().zip(&foretold).map(|(p, s)| p.standard_deviation / s))
        .collect();
    let away: Vec<f64> = (estimates.iter())
        .flat_map(|of| {
            of.parameters
                .iter()
                .zip(&foretold)
                .map(|(p, s)| (p.value - first.truth_of(&p.name).unwrap()) / s)
        })
        .collect();
    let before: Vec<f64> =
        (result.parameters.iter().zip(&foretold)).map(|(p, s)| p.standard_deviation / s).collect();
    println!(
        "{duration_s} s, {seeds} seeds: σ said/foretold {:.2} (rms), deviation from the truth/foretold {:.2} (rms), \
         σ of the shipped motion/foretold {:.2} (rms), condition {:.0} against {:.0}",
        rms(&said),
        rms(&away),
        rms(&before),
        estimates[0].condition_number,
        result.condition_number
    );
    rms(&said)
}

/// A short one, so that it holds in every run of the tests.
#[test]
fn a_designed_motion_tells_about_what_was_foretold() {
    let ratio = study(3.0, 40, 1);
    assert!((ratio - 1.0).abs() < 0.3, "{ratio}");
}

#[test]
#[ignore = "a study of minutes, run by hand"]
fn designed_motions_tell_what_was_foretold() {
    for duration_s in [10.0, 20.0] {
        let ratio = study(duration_s, 600, 20);
        assert!((ratio - 1.0).abs() < 0.2, "{ratio}");
    }
}
