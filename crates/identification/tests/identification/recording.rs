//! The real recording of a TX40, against an independent implementation of the same recipe.

use std::ops::Range;
use std::path::Path;

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{Robot, SignModel};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{
    self, DecimationFilter, Experiment, Identification, Method, Options, PositionFilter,
};

use crate::common::dataset::{columns, datasets};

const TX40: &str = include_str!("../../../../config/robots/tx40.toml");

/// Name, value and σ with the dead band, value and σ with tanh.
const EXPECTED: [(&str, f64, f64, f64, f64); 28] = [
    ("zz1r", 1.2804337, 0.00649, 1.2801374, 0.00615),
    ("fv1", 8.0486412, 0.0541, 7.9436151, 0.0528),
    ("fc1", 7.1494896, 0.155, 7.5159754, 0.153),
    ("xx2r", -0.49434967, 0.00983, -0.49250881, 0.00931),
    ("xz2r", -0.15935418, 0.00619, -0.15966821, 0.00587),
    ("zz2r", 1.0779967, 0.00642, 1.078535, 0.0061),
    ("mx2r", 2.170115, 0.0114, 2.1662604, 0.0109),
    ("fv2", 5.5307506, 0.061, 5.3938856, 0.0597),
    ("fc2", 8.1900772, 0.146, 8.6023058, 0.145),
    ("xx3r", 0.091103967, 0.00955, 0.090378978, 0.00906),
    ("zz3r", 0.13154334, 0.00534, 0.13216549, 0.00507),
    ("my3r", -0.58740908, 0.00911, -0.58862429, 0.00865),
    ("ia3", 0.078796639, 0.00375, 0.078569256, 0.00356),
    ("fv3", 1.9831916, 0.0309, 1.9321061, 0.0298),
    ("fc3", 6.3044889, 0.102, 6.5147179, 0.0988),
    ("mx4", -0.01759345, 0.00299, -0.017512998, 0.00293),
    ("ia4", 0.034189034, 0.00128, 0.034229065, 0.0013),
    ("fv4", 1.1014173, 0.0142, 1.0862491, 0.0146),
    ("fc4", 2.5195104, 0.0524, 2.5861569, 0.0543),
    ("my5r", -0.037716729, 0.00317, -0.036645227, 0.0031),
    ("ia5", 0.048901554, 0.00313, 0.048972611, 0.00313),
    ("fv5", 1.8534065, 0.0346, 1.8239627, 0.0353),
    ("fc5", 3.0510731, 0.0907, 3.136382, 0.0937),
    ("ia6", 0.011926916, 0.00069, 0.011909118, 0.000675),
    ("fv6", 0.66169559, 0.00933, 0.651209, 0.00924),
    ("fc6", 0.25829109, 0.0761, 0.26077188, 0.0767),
    ("fv_m6", 0.62596938, 0.00949, 0.61858346, 0.00939),
    ("fc_m6", 1.9010842, 0.0659, 1.965221, 0.0669),
];

fn options() -> Options {
    let mut options = Options::new(
        PositionFilter { order: 4, cutoff_hz: 50.0 },
        DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio: 0.8, factor: 100 },
    );
    options.parameters = Some(EXPECTED.iter().map(|row| row.0.to_owned()).collect());
    options
}

fn identify(folder: &Path, sign_model: SignModel) -> Identification {
    identify_part(folder, sign_model, 300..37_401, SignalTiming::INSTANTANEOUS)
}

fn identify_part(
    folder: &Path,
    sign_model: SignModel,
    counted: Range<usize>,
    torque_timing: SignalTiming,
) -> Identification {
    let robot = Robot::from_toml(TX40).unwrap().with_sign_model(sign_model);
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let signals = Signals {
        sample_rate_hz: 5000.0,
        position_rad: columns(&folder.join("tx40/motor_position.csv")),
        torque_nm: columns(&folder.join("tx40/motor_torque.csv")),
        reference_rad: None,
    };
    let experiment = Experiment::motor_side(&signals, robot.transmission())
        .unwrap()
        .with_counted(counted)
        .unwrap()
        .with_torque_timing(torque_timing)
        .unwrap();
    identification::identify(Method::IdimLs, &robot, &base, &experiment, &options()).unwrap()
}

/// Half a unit of the last printed digit, or less.
fn close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((actual - expected).abs() <= tolerance, "{what}: {actual} instead of {expected}");
}

struct Figures {
    condition_numbers: (f64, f64),
    relative_error_percent: f64,
    per_joint_percent: [f64; 6],
    durbin_watson: [f64; 6],
}

fn check(found: &Identification, values: impl Fn(usize) -> (f64, f64), figures: &Figures) {
    let estimate = &found.estimate;
    assert_eq!(estimate.samples, 45_000);
    assert_eq!(estimate.rows, 2232);
    assert_eq!(estimate.parameters.len(), EXPECTED.len());
    for (index, parameter) in estimate.parameters.iter().enumerate() {
        let (value, sigma) = values(index);
        assert_eq!(parameter.name, EXPECTED[index].0);
        close(parameter.value, value, 1e-6 * value.abs(), &parameter.name);
        close(parameter.classical_standard_deviation, sigma, 6e-3 * sigma, &parameter.name);
        // Two halves of the record differ by two to four classical σ.
        let correction = parameter.standard_deviation / parameter.classical_standard_deviation;
        assert!((1.5..3.0).contains(&correction), "{}: {correction}", parameter.name);
    }
    close(estimate.unweighted_condition_number, figures.condition_numbers.0, 0.051, "condition");
    close(estimate.condition_number, figures.condition_numbers.1, 0.051, "weighted condition");
    close(100.0 * estimate.relative_error, figures.relative_error_percent, 5.1e-5, "error");
    for joint in 0..6 {
        let error = 100.0 * estimate.relative_error_per_joint[joint];
        close(error, figures.per_joint_percent[joint], 5.1e-3, "error of a joint");
        let durbin_watson = estimate.durbin_watson_per_joint[joint];
        close(durbin_watson, figures.durbin_watson[joint], 5.1e-3, "Durbin–Watson");
    }
    // Coulomb friction depends on the sign model by 5 %, which its standard deviation does not say
    // and its combined uncertainty does.
    assert!(estimate.verdict.applicable, "{:?}", estimate.verdict.reasons);
    let fc1 = estimate.parameters.iter().find(|parameter| parameter.name == "fc1").unwrap();
    assert!((0.05..0.2).contains(&(fc1.combined_standard_deviation / fc1.value)), "{fc1:?}");
    assert!(estimate.nuisance_parameters[0].nuisance.to_string().contains("friction law"));
    // Kept samples 300, 400, …, 37,400.
    assert_eq!(found.fit.time_s.len(), 372);
    close(found.fit.time_s[371], 7.48, 1e-12, "time of the last row");
}

#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn dead_band_agrees_with_the_independent_implementation() {
    let folder = datasets();
    let figures_found = identify(&folder, SignModel::DeadBand { threshold_rad_s: 0.01 });
    let figures = Figures {
        condition_numbers: (114.4, 234.6),
        relative_error_percent: 5.5800,
        per_joint_percent: [4.83, 4.86, 8.35, 8.25, 11.21, 9.56],
        durbin_watson: [0.78, 0.84, 0.69, 0.87, 0.76, 0.74],
    };
    check(&figures_found, |index| (EXPECTED[index].1, EXPECTED[index].2), &figures);
}

#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn tanh_agrees_with_the_independent_implementation() {
    let folder = datasets();
    let figures_found = identify(&folder, SignModel::Tanh { width_rad_s: 0.05 });
    let figures = Figures {
        condition_numbers: (116.8, 236.6),
        relative_error_percent: 5.3488,
        per_joint_percent: [4.58, 4.63, 7.90, 8.34, 11.25, 9.26],
        durbin_watson: [0.76, 0.79, 0.59, 0.90, 0.78, 0.72],
    };
    check(&figures_found, |index| (EXPECTED[index].3, EXPECTED[index].4), &figures);
}

/// What the recording is known to do to those who are careless.
#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn careless_choices_show_as_they_are_known_to() {
    let folder = datasets();
    let fc1 = |found: &Identification| found.estimate.parameters[2].value;
    // The sign of noise while the arm stands still.
    let idle = identify_part(&folder, SignModel::Sign, 0..45_000, SignalTiming::INSTANTANEOUS);
    close(fc1(&idle), 5.77, 5e-3, "fc1 with the idle parts");
    assert!(idle.estimate.relative_error > 0.08);
    // A torque that is taken to act 4 ms away from where it does.
    for delay_s in [-0.004, 0.004] {
        let timing = SignalTiming { hold_s: 0.0, delay_s };
        let dead_band = SignModel::DeadBand { threshold_rad_s: 0.01 };
        let shifted = identify_part(&folder, dead_band, 300..37_401, timing);
        assert!(shifted.estimate.relative_error > 0.0558 + 0.003, "{delay_s}");
        assert!((fc1(&shifted) - EXPECTED[2].1).abs() > 0.9, "{delay_s}");
    }
}
