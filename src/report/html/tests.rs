use std::path::Path;

use didim_core::identification::{
    ConvergenceStep, Estimate, Fit, FitMotion, Freedom, FreedomEstimate, Information, Note,
    ParameterEstimate, Quantity, Reached, Reason, TorqueDelay, Uses, Verdict,
};
use didim_core::regression::NoiseAutocorrelation;

use super::*;
use crate::cell::Library;
use crate::window::DriveReadings;

pub(super) const HOSTILE: &str = "<script>alert('&amp;\"')</script>";

fn parameter(name: &str, value: f64, deviation: f64) -> ParameterEstimate {
    ParameterEstimate {
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

/// A result with everything in it that a result can have, what is no number among it.
pub(super) fn identification() -> Identification {
    let numbers = vec![0.05, 0.1, f64::NAN, f64::INFINITY, 0.2, 0.0];
    let step = |simulation, parameter_change| ConvergenceStep {
        simulation,
        relative_error: 0.05,
        relative_error_change: None,
        parameter_change,
        halvings: 0,
    };
    let freedom = |freedom, relative_torque, quantity| FreedomEstimate {
        freedom,
        torque_nm: 0.1,
        joint: 2,
        relative_torque,
        quantity,
    };
    let zero = Quantity { value: 3.0, standard_deviation: f64::NAN, stated: 0.5, unit: "deg" };
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
        freedoms: vec![
            freedom(Freedom::JointFriction(1), 0.1, None),
            freedom(Freedom::Zero(2), f64::NAN, Some(zero)),
            freedom(Freedom::Twist(3), 1e-5, None),
        ],
        iterations: 4,
        simulations: 3,
        convergence: vec![step(1, 1e5), step(2, f64::NAN), step(3, 0.01)],
        verdict: Verdict {
            applicable: false,
            reasons: vec![Reason::OtherParameters { name: HOSTILE.to_owned(), deviations: 5.0 }],
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

pub(super) fn cell() -> Cell {
    Cell::from_library(Library::Shipped, Path::new("config/cells/tx40-packed-fd.toml")).unwrap()
}

pub(super) fn origin() -> Origin {
    let input = InputFile { name: format!("{HOSTILE}.log"), sha256: "c0ffee".to_owned() };
    Origin {
        input: Some(input),
        samples: SampleRange::Measurement {
            counted: 100..900,
            rate_hz: 1000.0,
            begins_s: 0.0,
            recorded: None,
            readings: DriveReadings::default(),
        },
        further: Vec::new(),
        note: None,
    }
}

fn html() -> String {
    let (mut cell, mut identification) = (cell(), identification());
    cell.name = HOSTILE.to_owned();
    identification.estimate.robot = HOSTILE.to_owned();
    Report::new(&cell, &identification, &origin()).to_html()
}

/// The tags of a page, `/p` for the end of a `p`; what is in a style is none.
fn tags(html: &str) -> Vec<String> {
    let (before, style) = html.split_once("<style>").unwrap();
    let after = style.split_once("</style>").unwrap().1;
    let text = format!("{before}{after}");
    let tags = text.split('<').skip(1).map(|tag| tag.split_once('>').unwrap().0.to_owned());
    tags.collect()
}

#[test]
fn the_motion_and_the_names_are_in_it() {
    let html = html();
    let motion = html.split_once("<section id=\"motion\">").unwrap().1;
    let motion = motion.split_once("</section>").unwrap().0;
    assert_eq!(motion.matches("<svg class=\"panel\"").count(), 6);
    // Two curves each, but where nothing is a number.
    assert_eq!(motion.matches("<path").count(), 8, "{motion}");
    assert!(motion.contains("velocity [rad/s]") && motion.contains(">rad</text>"), "{motion}");
    assert!(html.contains("<a href=\"#names-of-parameters\">"));
    assert!(html.contains("<section id=\"names-of-parameters\">"));
}

#[test]
fn what_comes_from_files_is_text() {
    let html = html();
    assert!(!html.contains("<script") && !html.contains("alert('&amp;\""));
    // Name of the robot twice (title and heading), of the cell twice, of the input, in the reason.
    assert_eq!(html.matches("&lt;script&gt;alert").count(), 6, "{html}");
}

#[test]
fn it_stands_by_itself() {
    assert_stands_by_itself(&html());
}

pub(super) fn assert_stands_by_itself(html: &str) {
    // To places of the page itself.
    let inside = html.matches("href=\"#").count();
    assert_eq!(html.matches("href=").count(), inside);
    for outside in ["http", "//", "src=", "url(", "@import", "<script", "<link", "<img"] {
        assert!(!html.contains(outside), "{outside}");
    }
}

#[test]
fn what_is_no_number_is_a_dash_and_draws_nothing() {
    let html = html();
    assert_numbers_only(&html);
    assert!(html.contains("<td class=\"number value\">–</td>"), "{html}");
}

pub(super) fn assert_numbers_only(html: &str) {
    for bad in ["NaN", "inf\"", "inf ", ">inf", "-inf", "∞"] {
        let at = html.find(bad).map(|at| html[..at].chars().rev().take(80).collect::<String>());
        assert_eq!(at, None, "{bad}");
    }
}

#[test]
fn every_tag_is_closed_in_turn() {
    assert_closed(&html());
}

pub(super) fn assert_closed(html: &str) {
    let mut open: Vec<String> = Vec::new();
    for tag in tags(html) {
        let name = tag.split_whitespace().next().unwrap().to_owned();
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
        } else if !tag.ends_with('/') && !["!DOCTYPE", "meta"].contains(&name.as_str()) {
            open.push(name);
        }
    }
    assert_eq!(open, [""; 0]);
}

/// One heading of the page, then those of its sections; headers for every row and column.
#[test]
fn headings_and_headers() {
    let html = html();
    let count = |what: &str| html.matches(what).count();
    assert_eq!((count("<h1>"), count("<title>"), count("<main>")), (1, 1, 1));
    assert_eq!(count("<h2>"), count("<section"));
    for table in html.split("<table").skip(1) {
        let table = table.split_once("</table>").unwrap().0;
        let (head, body) = table.split_once("</thead>").unwrap();
        let columns = head.matches("scope=\"col\"").count();
        assert!(columns >= 2, "{head}");
        for row in body.split("<tr").skip(1) {
            let (header, cells) = (row.matches("<th").count(), row.matches("<td").count());
            assert_eq!(header, 1, "{row}");
            let whole = row.contains("colspan=\"10\"");
            assert!(whole || header + cells == columns, "{columns} columns: {row}");
        }
    }
    for svg in html.split("<svg").skip(1) {
        let tag = svg.split_once('>').unwrap().0;
        assert!(tag.contains("aria-label") || tag.contains("aria-hidden") || tag.contains("20 6"));
    }
}

#[test]
fn the_contents_lead_to_every_section() {
    let html = html();
    let contents = html.split_once("<nav").unwrap().1.split_once("</nav>").unwrap().0;
    let ids: Vec<&str> = html.split("<section id=\"").skip(1).collect();
    assert!(ids.len() >= 6, "{ids:?}");
    assert_eq!(contents.matches("href=").count(), ids.len());
    for id in ids.iter().map(|rest| rest.split_once('"').unwrap().0) {
        assert!(contents.contains(&format!("href=\"#{id}\"")), "{id}: {contents}");
    }
}

#[test]
fn robust_weights_are_named_with_the_rows_weighted_down() {
    assert!(!html().contains("Weighted down"), "the cell asks for none");
    let (mut cell, identification) = (cell(), identification());
    cell.options.robust = Some(didim_core::regression::RobustLoss::bisquare());
    let html = Report::new(&cell, &identification, &origin()).to_html();
    for part in ["Weighted down", "2 of 10", "bisquare, tuning constant 4.685"] {
        assert!(html.contains(part), "{part}: {html}");
    }
}

#[test]
fn parameters_stand_by_joint_with_unit_and_nominal_value() {
    let html = html();
    let joints: Vec<&str> = html.split("scope=\"rowgroup\"").skip(1).collect();
    let names = |joint: &str| -> Vec<String> {
        let rows = joint.split("<th scope=\"row\">").skip(1);
        rows.map(|row| row.split_once('<').unwrap().0.to_owned()).collect()
    };
    assert_eq!(joints.len(), 3, "joints without parameters have no group");
    assert_eq!(names(joints[0]), ["zz1r", "fv1"]);
    assert_eq!(names(joints[1]), ["mx2r"]);
    assert_eq!(names(joints[2])[..2], ["fc6", "fc_m6"]);
    assert!(joints[0].contains("kg·m²") && joints[0].contains("N·m·s/rad"));
    // The file of the robot has zz1r = 1.24.
    assert!(joints[0].contains("<td class=\"number nominal\">1.240</td>"), "{}", joints[0]);
    // 1.28 for 1.24.
    assert!(joints[0].contains("<td class=\"number off\">+3.2 %</td>"), "{}", joints[0]);
    assert!(html.contains("zz1 + ia1 + yy2 + yy3"), "{html}");
}

#[test]
fn what_is_taken_for_known_is_listed_with_what_the_data_say_of_it() {
    let html = html();
    let freedoms = html.split_once("<h2>What the model takes for known").unwrap().1;
    let freedoms = freedoms.split_once("</table>").unwrap().0;
    let [first, second] =
        ["friction law of joint 1", "zero of joint 2"].map(|of| freedoms.find(of).unwrap());
    assert!(first < second);
    assert!(freedoms.contains("3.0 ± – deg") && freedoms.contains("0.50 deg"), "{freedoms}");
}

#[test]
fn each_use_has_its_verdict() {
    let html = html();
    let uses = html.split_once("table class=\"uses\"").unwrap().1;
    let uses = uses.split_once("</table>").unwrap().0;
    for of in didim_core::identification::Use::ALL {
        assert!(uses.contains(of.name()), "{of}: {uses}");
    }
}

/// Which joints hardly moved, where a use is refused and noise leaves a parameter uncertain.
#[test]
fn what_noise_leaves_uncertain_is_said_where_a_use_is_refused() {
    let (cell, mut identification, origin) = (cell(), identification(), origin());
    let reached = |speed: f64| Reached {
        position: [0.0, 0.1],
        velocity: [-speed, 0.01],
        acceleration: [-1.0, 1.0],
    };
    let speeds = [1.0, 1.0, 1.0, 0.2, 0.2, 1.5];
    identification.estimate.reached_per_joint = speeds.map(reached).into();
    let page =
        |identification: &Identification| Report::new(&cell, identification, &origin).to_html();
    identification.estimate.verdict.uses = Uses::default();
    assert!(!page(&identification).contains("didim advise"));
    identification.estimate.verdict.uses.prediction.applicable = Some(false);
    let html = page(&identification);
    for part in ["more than 10 %: mx2r, fc6, fc_m6.", "highest speed: 4, 5.", "didim advise"] {
        assert!(html.contains(part), "{part}");
    }
}

#[test]
fn a_robot_without_nominal_values_has_no_such_column() {
    let (mut cell, identification) = (cell(), identification());
    let text = Library::Shipped.read(Path::new("config/robots/tx40.toml")).unwrap();
    let without = text.split_once("[nominal").unwrap().0;
    cell.robot = didim_core::robot::Robot::from_toml(without).unwrap();
    let origin = origin();
    let html = Report::new(&cell, &identification, &origin).to_html();
    assert!(!html.contains("Nominal") && html.contains("colspan=\"8\""));
}

#[test]
fn numbers_as_people_write_them() {
    let cases =
        [(-0.4943, "−0.494"), (6.9e-6, "6.90·10⁻⁶"), (-1.25e12, "−1.25·10¹²"), (f64::NAN, "–")];
    for (value, text) in cases {
        assert_eq!(number(value, 3), text);
    }
    assert_eq!((percent(0.0564, 3), probability(0.0)), ("5.64 %".into(), "< 0.0001".into()));
}
