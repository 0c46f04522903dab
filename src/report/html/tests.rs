use std::path::Path;

use didim_identification::identification::{ReachedRange, Reason, UseVerdict, Uses};

use super::specimen::*;
use super::*;
use crate::cell::Library;

fn html() -> String {
    let (mut cell, mut identification) = (cell(), identification());
    cell.name = HOSTILE.to_owned();
    identification.estimate.robot = HOSTILE.to_owned();
    Report::new(&cell, &identification, &origin()).to_html()
}

#[test]
fn the_motion_and_the_names_are_in_it() {
    let html = html();
    let motion = html.split_once("<section id=\"motion\">").unwrap().1;
    let motion = motion.split_once("</section>").unwrap().0;
    assert_eq!(motion.matches("<svg class=\"panel\"").count(), 6);
    // Two curves each, except where no value is a number.
    assert_eq!(motion.matches("<path").count(), 8, "{motion}");
    assert!(motion.contains("velocity [rad/s]") && motion.contains(">rad</text>"), "{motion}");
    assert!(html.contains("<a href=\"#names-of-parameters\">"));
    assert!(html.contains("<section id=\"names-of-parameters\">"));
}

#[test]
fn what_comes_from_files_is_text() {
    let html = html();
    assert!(!html.contains("<script") && !html.contains("alert('&amp;\""));
    // Twice the robot's name (title and heading), twice the cell's, the input's once, and once in
    // the reason.
    assert_eq!(html.matches("&lt;script&gt;alert").count(), 6, "{html}");
}

#[test]
fn it_stands_by_itself() {
    assert_stands_by_itself(&html());
}

#[test]
fn what_is_no_number_is_a_dash_and_draws_nothing() {
    let html = html();
    assert_numbers_only(&html);
    assert!(html.contains("<td class=\"number value\">–</td>"), "{html}");
}

#[test]
fn every_tag_is_closed_in_turn() {
    assert_closed(&html());
}

/// One heading of the page, then those of its sections. Every row and column has a header.
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
            let is_full = row.contains("colspan=\"10\"");
            assert!(is_full || header + cells == columns, "{columns} columns: {row}");
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
    assert!(!html().contains("Downweighted"), "the cell asks for none");
    let (mut cell, identification) = (cell(), identification());
    cell.options.robust = Some(didim_identification::regression::RobustLoss::default_bisquare());
    let html = Report::new(&cell, &identification, &origin()).to_html();
    for part in ["Downweighted", "2 of 10", "bisquare, tuning constant 4.685"] {
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
    // The robot file has zz1r = 1.24.
    assert!(joints[0].contains("<td class=\"number nominal\">1.240</td>"), "{}", joints[0]);
    // 1.28 for 1.24.
    assert!(joints[0].contains("<td class=\"number off\">+3.2 %</td>"), "{}", joints[0]);
    assert!(html.contains("zz1 + ia1 + yy2 + yy3"), "{html}");
}

#[test]
fn what_is_taken_for_known_is_listed_with_what_the_data_say_of_it() {
    let html = html();
    let nuisance_parameters = html.split_once("<h2>Nuisance parameters").unwrap().1;
    let nuisance_section = nuisance_parameters.split_once("</table>").unwrap().0;
    let [first, second] =
        ["friction law of joint 1", "zero of joint 2"].map(|of| nuisance_section.find(of).unwrap());
    assert!(first < second);
    assert!(
        nuisance_section.contains("3.0 ± – deg") && nuisance_section.contains("0.50 deg"),
        "{nuisance_section}"
    );
}

#[test]
fn each_use_has_its_verdict() {
    let html = html();
    let uses = html.split_once("table class=\"uses\"").unwrap().1;
    let uses = uses.split_once("</table>").unwrap().0;
    for of in didim_identification::identification::Use::ALL {
        assert!(uses.contains(of.name()), "{of}: {uses}");
    }
}

/// The report names the joints that barely moved if a use is refused and noise leaves a parameter
/// uncertain.
#[test]
fn what_noise_leaves_uncertain_is_said_where_a_use_is_refused() {
    let (cell, mut identification, origin) = (cell(), identification(), origin());
    let reached = |speed: f64| ReachedRange {
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

/// The deciding figure may be within its limit where another one refuses the use.
#[test]
fn a_refused_use_has_its_cause_in_its_row() {
    let (cell, mut identification, origin) = (cell(), identification(), origin());
    let stored = serde_json::from_str("\"the torque of joint 2 is late: check it\"").unwrap();
    for (reason, cause) in [
        (
            Reason::HeldOut { error: 0.21, limit: 0.15 },
            "cross-validation error 21.0 % (limit 15.0 %)",
        ),
        (stored, "the torque of joint 2 is late"),
    ] {
        identification.estimate.verdict.uses.prediction = UseVerdict {
            applicable: Some(false),
            figure: Some(0.05),
            unit: "1",
            limit: Some(0.15),
            reasons: vec![reason],
            ..UseVerdict::default()
        };
        let html = Report::new(&cell, &identification, &origin).to_html();
        let (_, rows) = html.split_once("table class=\"uses\"").unwrap();
        let (_, row) = rows.split_once("prediction").unwrap();
        let (row, _) = row.split_once("</tr>").unwrap();
        assert!(row.contains(">no<") && row.contains(cause), "{row}");
    }
}

#[test]
fn a_robot_without_nominal_values_has_no_such_column() {
    let (mut cell, identification) = (cell(), identification());
    let text = Library::SHIPPED.read(Path::new("config/robots/tx40.toml")).unwrap();
    let without = text.split_once("[nominal").unwrap().0;
    cell.robot = didim_dynamics::robot::Robot::from_toml(without).unwrap();
    let origin = origin();
    let html = Report::new(&cell, &identification, &origin).to_html();
    assert!(!html.contains("Nominal") && html.contains("colspan=\"8\""));
}

#[test]
fn numbers_as_people_write_them() {
    let cases =
        [(-0.4943, "−0.494"), (6.9e-6, "6.90·10⁻⁶"), (-1.25e12, "−1.25·10¹²"), (f64::NAN, "–")];
    for (value, text) in cases {
        assert_eq!(number_text(value, 3), text);
    }
    assert_eq!((percent_text(0.0564, 3), probability(0.0)), ("5.64 %".into(), "< 0.0001".into()));
}

/// The section of the verdict, with these verdicts and findings.
fn verdict_section(uses: &serde_json::Value, findings: &serde_json::Value) -> String {
    let (cell, mut identification) = (cell(), identification());
    let verdict = serde_json::json!({ "applicable": true, "reasons": [], "uses": uses,
        "findings": findings });
    identification.estimate.verdict = serde_json::from_value(verdict).unwrap();
    let html = Report::new(&cell, &identification, &origin()).to_html();
    let section = html.split_once("<section class=\"verdict").unwrap().1;
    section.split_once("</section>").unwrap().0.to_owned()
}

#[test]
fn a_refused_use_names_the_worst_parameter_and_counts_the_others() {
    let names: Vec<String> = (1..=28).map(|k| format!("fc{k}")).collect();
    let uses = serde_json::json!({
        "monitoring": { "applicable": true, "figure": 0.02, "unit": "1", "limit": 0.1 },
        "physical-values": { "applicable": false, "reasons": ["too uncertain"] },
    });
    let findings = serde_json::json!([{ "code": "parameter-uncertainty", "severity": "blocking",
        "uses": ["physical-values"], "subject": { "parameters": names }, "figure": 0.5,
        "limit": 0.1, "unit": "1", "message": "too uncertain" }]);
    let section = verdict_section(&uses, &findings);
    assert!(section.starts_with(" partly\""), "not green: {section}");
    assert!(section.contains("Usable for monitoring</h2>"), "{section}");
    assert!(section.contains("Not for physical values: fc1 ± 50.0 % and 27 more."), "{section}");
    assert!(section.contains("torque ± 2.00 % along the motion (limit 10.0 %)"), "{section}");
    assert!(!section.contains("fc28"), "{section}");
}

#[test]
fn a_refused_use_names_the_worst_joint_and_the_probable_cause() {
    let error = |joint: usize, figure: f64| {
        serde_json::json!({ "code": "joint-error", "severity": "blocking", "limit": 0.25,
            "uses": ["prediction"], "subject": { "joints": [joint] }, "figure": figure,
            "unit": "1", "message": format!("joint {joint}") })
    };
    let gain = serde_json::json!({ "code": "torque-gain", "severity": "explanatory",
        "uses": ["prediction"], "subject": { "joints": [6] }, "figure": 0.83, "unit": "1",
        "message": "gain" });
    let uses = serde_json::json!({ "prediction": { "applicable": false,
        "reasons": ["gain", "joint 2", "joint 6"] } });
    let findings = serde_json::json!([gain, error(2, 0.26), error(6, 0.5)]);
    let section = verdict_section(&uses, &findings);
    assert!(section.contains("Not usable</h2>"), "{section}");
    assert!(section.contains("Not for prediction: relative error 50.0 % of joint 6."), "{section}");
    let line = "relative error 50.0 % of joint 6 (limit 25.0 %); 1 more; perhaps: torque gain of \
                joint 6 fits at 0.830 times its value";
    assert!(section.contains(line), "{section}");
}

#[test]
fn the_comparison_with_the_baseline_has_its_alarms_and_the_largest_changes() {
    let parameter = |k: u32| {
        serde_json::json!({ "parameter": format!("p{k}"), "relative_change": 0.1,
            "deviation_sigma": 3.0, "band_share": f64::from(k) / 10.0 })
    };
    let parameters: Vec<_> = (1..=12).map(parameter).collect();
    let drift = serde_json::json!({ "baseline": 4, "time": "2026-11-22T07:17:29Z",
        "compared": true, "parameters": parameters, "alarms": [{ "parameter": "p12",
        "relative_change": 0.1, "deviation_sigma": 3.0, "slope_per_day": null, "slope_sd": null,
        "since": "2026-11-23T07:17:29Z", "text": "p12 has grown" }] });
    let html = baseline_section(&serde_json::from_value(drift).unwrap());
    assert_closed(&document("", "", &maud::PreEscaped(html.clone())));
    assert!(html.contains("Alarm: </strong>p12 has grown."), "{html}");
    assert_eq!(html.matches("<td class=\"number refused\">").count(), 2, "{html}");
    assert!(html.contains(">p3<") && !html.contains(">p2<"), "{html}");
    assert!(html.contains("The other 2 parameters"), "{html}");
}
