//! A result with every possible part, and checks of a page. Both are for the tests of reports.

use didim_dynamics::robot::JointIndex;
use std::path::Path;

use didim::cell::{Cell, Library};
use didim::report::html::{InputFile, Origin, SampleRange};
use didim::window::DriveReadings;
use didim_identification::identification::{
    ConvergenceStep, Estimate, Fit, FitMotion, Identification, Information, Note, NuisanceEstimate,
    NuisanceParameter, ParameterEstimate, Quantity, Reason, TorqueDelay, Verdict,
};
use didim_identification::regression::NoiseAutocorrelation;

pub(crate) const HOSTILE: &str = "<script>alert('&amp;\"')</script>";

fn parameter(name: &str, value: f64, deviation: f64) -> ParameterEstimate {
    ParameterEstimate {
        joint_name: None,
        description: None,
        name: name.to_owned(),
        regrouped: name.ends_with('r'),
        value,
        standard_deviation: deviation,
        unit: "N·m",
        combined_standard_deviation: 2.0,
        classical_standard_deviation: 0.5 * deviation,
        relative_standard_deviation: deviation / value.abs(),
    }
}

/// Creates a result with every possible part, including values that are not numbers.
pub(crate) fn identification() -> Identification {
    let numbers = vec![0.05, 0.1, f64::NAN, f64::INFINITY, 0.2, 0.0];
    let step = |simulation, parameter_change| ConvergenceStep {
        simulation,
        relative_error: 0.05,
        relative_error_change: None,
        parameter_change,
        halvings: 0,
    };
    let nuisance = |nuisance, relative_torque, quantity| NuisanceEstimate {
        probability: 1e-9,
        nuisance,
        torque_nm: 0.1,
        joint: JointIndex::new(1),
        relative_torque,
        quantity,
    };
    let zero = Quantity { value: 3.0, standard_deviation: f64::NAN, configured: 0.5, unit: "deg" };
    let delay = TorqueDelay { delay_s: 3e-5, standard_deviation_s: 1e-5 };
    let estimate = Estimate {
        method: "didim".to_owned(),
        robot: "tx40".to_owned(),
        samples: 1000,
        rows: 60,
        parameters: vec![
            parameter("zz1r", 1.28, 0.0065),
            parameter("fv1", f64::NAN, f64::NAN),
            parameter("mx2r", 0.0, 0.1),
            parameter("fc6", -0.26, 0.14),
            parameter("fc_m6", 1.9, f64::INFINITY),
        ],
        condition_number: f64::INFINITY,
        relative_error: f64::NAN,
        relative_error_per_joint: numbers.clone(),
        rms_error_per_joint_nm: numbers.clone(),
        relative_prediction_deviation_per_joint: numbers.clone(),
        durbin_watson_per_joint: numbers.clone(),
        durbin_watson_expected: 1.64,
        whiteness_per_joint: numbers.clone(),
        effective_rows_per_joint: numbers.clone(),
        torque_delay_per_joint: vec![
            Some(delay),
            None,
            Some(TorqueDelay { standard_deviation_s: f64::NAN, ..delay }),
        ],
        nuisance_parameters: vec![
            nuisance(NuisanceParameter::JointFriction(JointIndex::new(0)), 0.1, None),
            nuisance(NuisanceParameter::Zero(JointIndex::new(1)), f64::NAN, Some(zero)),
            nuisance(NuisanceParameter::Twist(JointIndex::new(2)), 1e-5, None),
        ],
        iterations: 4,
        simulations: 3,
        convergence: vec![step(1, 1e5), step(2, f64::NAN), step(3, 0.01)],
        verdict: Verdict {
            applicable: false,
            reasons: vec![Reason::OtherParameters {
                name: HOSTILE.to_owned(),
                deviations: 5.0,
                tests: 1,
            }],
            notes: vec![Note::NoReference],
            ..Verdict::default()
        },
        ..Estimate::default()
    };
    let curve: Vec<f64> = (0..10).map(|k| f64::from(k * k % 7) - 3.0).collect();
    let broken = vec![f64::NAN; 10];
    let measured = vec![curve.clone(), broken.clone(), curve.clone(), curve.clone(), broken, curve];
    let predicted: Vec<Vec<f64>> =
        measured.iter().map(|of| of.iter().map(|value| 0.9 * value).collect()).collect();
    let residual = |(m, p): (&Vec<f64>, &Vec<f64>)| m.iter().zip(p).map(|(m, p)| m - p).collect();
    let equation_residuals = measured.iter().zip(&predicted).map(residual).collect();
    let motion = FitMotion {
        time_s: (0..10).map(|k| f64::from(k) / 50.0).collect(),
        position: measured.clone(),
        velocity: predicted.clone(),
    };
    let fit = Fit {
        motion,
        time_s: (0..10).map(|k| f64::from(k) / 50.0).collect(),
        measured,
        predicted,
        equation_residuals,
        downweighted: vec![vec![2, 3], vec![99]],
        information: Information {
            moves_s: vec![0.0..1.5, 1.5..3.0, 3.0..4.0],
            between_rests: true,
            shares: vec![vec![0.25, 0.5, 0.25], vec![f64::NAN; 3], vec![0.004, 0.996, 0.0]],
        },
        white_noise: vec![
            NoiseAutocorrelation { mean: 0.18, deviation: 0.3 },
            NoiseAutocorrelation { mean: 0.0, deviation: 0.32 },
        ],
    };
    Identification { estimate, fit }
}

pub(crate) fn cell() -> Cell {
    Cell::from_library(Library::SHIPPED, Path::new("config/cells/tx40-packed-fd.toml")).unwrap()
}

pub(crate) fn origin() -> Origin {
    let (name, sha256) = (format!("{HOSTILE}.log"), "c0ffee".to_owned());
    let input = InputFile { name, sha256, written: None };
    Origin {
        input: Some(input),
        samples: SampleRange::Measurement {
            counted: 100..900,
            rate_hz: 1000.0,
            begins_s: 0.0,
            recorded: None,
            readings: DriveReadings::default(),
        },
        further_files: Vec::new(),
        note: None,
    }
}

/// Returns the tags of a page, with `/p` for the end of a `p`. Style content is excluded.
fn tags(html: &str) -> Vec<String> {
    let (before, style) = html.split_once("<style>").unwrap();
    let after = style.split_once("</style>").unwrap().1;
    let text = format!("{before}{after}");
    let tags = text.split('<').skip(1).map(|tag| tag.split_once('>').unwrap().0.to_owned());
    tags.collect()
}

pub(crate) fn assert_stands_by_itself(html: &str) {
    // Links to places in the same page.
    let inside = html.matches("href=\"#").count();
    assert_eq!(html.matches("href=").count(), inside);
    for outside in ["http", "//", "src=", "url(", "@import", "<script", "<link", "<img"] {
        assert!(!html.contains(outside), "{outside}");
    }
}

pub(crate) fn assert_numbers_only(html: &str) {
    for bad in ["NaN", "inf\"", "inf ", ">inf", "-inf", "∞"] {
        let place = html.find(bad).map(|at| html[..at].chars().rev().take(80).collect::<String>());
        assert_eq!(place, None, "{bad}");
    }
}

pub(crate) fn assert_closed(html: &str) {
    let mut open_tags: Vec<String> = Vec::new();
    for tag in tags(html) {
        let name = tag.split_whitespace().next().unwrap().to_owned();
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open_tags.pop().as_deref(), Some(name));
        } else if !tag.ends_with('/') && !["!DOCTYPE", "meta"].contains(&name.as_str()) {
            open_tags.push(name);
        }
    }
    assert_eq!(open_tags, [""; 0]);
}
