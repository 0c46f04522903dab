use didim_formats::{LongFormat, RecordingStart};

use super::*;
use crate::archive::drift::{Baseline, DriftOptions};
use crate::archive::store::{HISTORY_SCHEMA, HistoryLine, ParameterValue, Timestamp};
use crate::report::html::HistoryReport;
use crate::window::{DriveReadings, Note};
use didim_dynamics::{Reading, Readings};

const HOSTILE: &str = "<script>alert('&\"')</script>";

fn line(result: u64, fc3: f64) -> HistoryLine {
    let value = |name: &str, value: f64, standard_deviation: f64| ParameterValue {
        description: None,
        name: name.into(),
        unit: "N·m".into(),
        value,
        standard_deviation,
        combined_standard_deviation: None,
    };
    HistoryLine {
        schema: HISTORY_SCHEMA,
        time: Timestamp::from_unix_s(1_795_331_849 + 86_400 * result),
        recorded: None,
        result,
        cell: String::new(),
        robot: "tx40".into(),
        configuration: "c0ffee".into(),
        regrouping: "r".into(),
        method: "idim-ls".into(),
        applicable: true,
        monitoring: None,
        uses: Default::default(),
        relative_error: Some(0.0564),
        note: None,
        parameters: vec![value("fc3", fc3, 0.01), value("mx4", -0.02, 0.0001)],
        against: None,
        load: None,
        day: None,
        readings: Default::default(),
    }
}

/// A baseline, two results that drift, one that is not usable, one with a payload, and two outside.
fn lines() -> Vec<HistoryLine> {
    let mut lines: Vec<HistoryLine> =
        (0..).zip([6.0, 6.0, 6.3, 6.7, 9.0, 6.2, 6.8, 6.9]).map(|(k, fc3)| line(k, fc3)).collect();
    lines[4].applicable = false;
    lines[4].relative_error = None;
    lines[7].recorded = RecordingStart::of_unix_ns(1_795_291_200_000_000_000);
    lines[5].note =
        Some(Note { payload_kg: Some(2.0), text: Some("new".into()), ..Note::default() });
    let mut warm = Readings::default();
    warm.set(Reading::Temperature, 0, 31.0);
    warm.set(Reading::Temperature, 3, 36.5);
    lines[2].readings = DriveReadings::from_cycles([&warm]);
    lines
}

fn history() -> JudgedHistory {
    JudgedHistory::new(lines(), Some(Baseline::from_result(line(1, 6.0))), DriftOptions::default())
}

/// The table as one text.
fn table_text(history: &JudgedHistory, columns: usize) -> String {
    let mut text = String::new();
    table(history, columns, |line| text += line).unwrap();
    text
}

/// The document for scripts.
fn json(history: &JudgedHistory) -> String {
    serde_json::to_string(&HistoryDocument::new(history, &["fc3"], None)).unwrap()
}

/// The table for databases.
fn csv(history: &JudgedHistory) -> Vec<u8> {
    let mut bytes = Vec::new();
    let rows = LongRows::Parameters;
    write_long_table(history, (LongFormat::Csv, rows), &["fc3"], &mut bytes).unwrap();
    bytes
}

/// What is written of a long history does not depend on what of it is in memory.
#[test]
fn a_long_history_is_written_as_if_it_were_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let lines: Vec<HistoryLine> = (0..3_000)
        .map(|result| {
            let mut line = line(result, 6.0 + 0.001 * (result % 7) as f64);
            line.time = Timestamp::from_unix_s(1_795_331_849 + 400 * result);
            line.applicable = result % 11 != 0;
            line
        })
        .collect();
    let text: Vec<String> = lines.iter().map(|line| serde_json::to_string(line).unwrap()).collect();
    std::fs::write(folder.path().join("history.jsonl"), text.join("\n") + "\n").unwrap();
    let baseline = Some(Baseline::from_result(lines[1].clone()));
    let options = DriftOptions::default();
    for last in [usize::MAX, 2_999, 1_500, 1_000, 7] {
        let mut in_memory = JudgedHistory::new(lines.clone(), baseline.clone(), options);
        let mut read =
            JudgedHistory::read(folder.path(), baseline.clone(), options, &[7, 1_999]).unwrap();
        in_memory.keep_last(last);
        read.keep_last(last);
        // Two weeks have two verdicts each day.
        assert!(read.entries.len() <= 1_000 + 2 * 14, "{}", read.entries.len());
        assert!(read.result_count() >= in_memory.result_count());
        assert!(json(&read) == json(&in_memory), "{last}");
        assert!(table_text(&read, 200) == table_text(&in_memory, 200), "{last}");
        assert!(csv(&read) == csv(&in_memory), "{last}");
        assert_eq!((read.result(7), read.result(1_999)), (lines.get(7), lines.get(1_999)));
        assert_eq!(read.parameters(), in_memory.parameters());
    }
    let in_memory = JudgedHistory::read(folder.path(), baseline, options, &[]).unwrap();
    assert_eq!(in_memory.result_count(), 3_000);
}

#[test]
fn a_compact_table_has_a_row_for_each_result() {
    let mut lines = lines();
    lines[1].parameters[0].unit = "a, \"b\" \\c".to_owned();
    lines[2].parameters[1].value = f64::NAN;
    lines[3].parameters.clear();
    let history = JudgedHistory::new(lines.clone(), None, DriftOptions::default());
    let mut bytes = Vec::new();
    let form = (LongFormat::Csv, LongRows::Results);
    write_long_table(&history, form, &["fc3", "mx4"], &mut bytes).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("compact.csv");
    std::fs::write(&path, &bytes).unwrap();
    let names =
        ["identity", "parameters", "units", "values", "combined_standard_deviations", "note"];
    let mut rows = Vec::new();
    didim_formats::read_long_table(&path, names, |row| rows.push(row)).unwrap();
    let identities: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    let expected: Vec<String> = lines.iter().map(HistoryLine::identity).collect();
    assert_eq!(identities, expected);
    assert_eq!(rows[0][1..5], ["{fc3,mx4}", "{N·m,N·m}", "{6,-0.02}", "{NULL,NULL}"]);
    assert_eq!(rows[1][2], r#"{"a, \"b\" \\c",N·m}"#);
    assert_eq!(rows[2][3], "{6.3,NULL}");
    assert_eq!(rows[3][1..4], ["{}", "{}", "{}"]);
    assert_eq!(rows[5][5], "new");
}

#[test]
fn the_table_says_what_became_of_each_result() {
    let expected = "\
result    recorded (UTC)      stored (UTC)   method  applicable  relative \
        error               drift  noted
0              not known  2026-11-22 07:17  idim-ls         yes          5.64 %                   –
1              not known  2026-11-23 07:17  idim-ls         yes          5.64 %            baseline
2              not known  2026-11-24 07:17  idim-ls         yes          5.64 %             in \
        band  motors at 31.0 to 36.5 °C
3              not known  2026-11-25 07:17  idim-ls         yes          5.64 %  outside: fc3 \
        +11.7 %
4              not known  2026-11-26 07:17  idim-ls          NO               –        not compared
5              not known  2026-11-27 07:17  idim-ls         yes          5.64 %        not \
        compared  2 kg, new
6              not known  2026-11-28 07:17  idim-ls         yes          5.64 %           ALARM fc3
7       2026-11-21 20:00  2026-11-29 07:17  idim-ls         yes          5.64 %           ALARM fc3
";
    let squeezed = |text: &str| -> Vec<String> {
        text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
    };
    assert_eq!(squeezed(&table_text(&history(), 200)), squeezed(expected));
    let narrow = table_text(&history(), 80);
    assert!(narrow.contains("recorded (UTC)") && !narrow.contains("relative error"), "{narrow}");
    let widths: Vec<_> =
        table_text(&history(), 200).lines().map(|line| line.find("idim-ls")).collect();
    assert!(widths[1..].iter().all(|at| *at == widths[1]), "aligned");
    let summary = summary(&history());
    assert!(summary.starts_with("baseline: result 1 of 2026-11-23T07:17:29Z\n"), "{summary}");
    // The slope through 6.0, 6.3, 6.7, 6.8 and 6.9 of days 0, 1, 2, 5 and 6: 3.54/26.8 of 6 a day.
    let alarm = "alarm: fc3 has grown by 15.0 % ± 0.2 % since the baseline of 2026-11-23, +2.2 ± ";
    assert!(summary.contains(alarm), "{summary}");
    assert!(summary.contains("left its band on 2026-11-25"), "{summary}");
    let none = JudgedHistory::new(lines(), None, DriftOptions::default());
    assert!(self::summary(&none).contains("no baseline is set"));
    assert!(!table_text(&none, 200).contains("ALARM"));
}

#[test]
fn two_results_side_by_side_have_their_difference_in_deviations() {
    let history = history();
    let difference = Difference::new(&history, [1, 7]).unwrap();
    let fc3 = &difference.parameters[0];
    // 0.9 / (0.01 √2), and 0.9 of 0.6.
    assert!((fc3.deviation_sigma - 63.639_610_306_789_3).abs() < 1e-9, "{fc3:?}");
    assert!((fc3.relative_change - 0.15).abs() < 1e-12 && (fc3.band_share - 1.5).abs() < 1e-9);
    let table = difference.table();
    let row = table.lines().nth(1).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(row, "fc3 6.000 6.900 N·m +0.900 +15.00 % +63.6 outside");
    assert_eq!(table.lines().count(), 3, "no caveat: {table}");
    let refused = |numbers| Difference::new(&history, numbers).unwrap_err().to_string();
    assert!(refused([1, 99]).contains("result 99 is not in the history"));
    let mut other = lines();
    other[7].method = "didim".into();
    // A result that is not usable is compared on request, with a note. An incomparable one is
    // refused.
    other[7].applicable = false;
    let other = JudgedHistory::new(other, None, DriftOptions::default());
    let error = Difference::new(&other, [1, 7]).unwrap_err().to_string();
    assert_eq!(error, "nothing to compare: result 7 is by didim, result 1 by idim-ls");
    let caveats = |numbers| Difference::new(&history, numbers).unwrap().caveats;
    assert_eq!(caveats([1, 4]), ["result 4 is not usable for monitoring"]);
    assert_eq!(caveats([4, 1]), ["result 4 is not usable for monitoring"]);
    assert!(caveats([1, 5])[0].contains("a payload of 2 kg was noted with result 5"));
}

#[test]
fn a_plot_has_the_newest_value_at_its_end_and_stands_any_history() {
    let plot = |lines: Vec<HistoryLine>| {
        let baseline = lines.first().cloned().map(Baseline::from_result);
        plot(&JudgedHistory::new(lines, baseline, DriftOptions::default()), "fc3", 32)
    };
    let text = plot(vec![line(0, 6.0), line(1, 6.0), line(2, 7.0)]).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    assert_eq!(rows.len(), 1 + 8 + 1, "{text}");
    // The highest and latest value is in the last character of the first row, and only there.
    assert_ne!(rows[1].chars().last(), Some('\u{2800}'), "{text}");
    assert!(rows[1].chars().skip(12).take(18).all(|c| c == '\u{2800}'), "{text}");
    assert!(rows[9].contains("2026-11-22 07:17"), "{text}");
    assert!(plot(vec![line(0, 6.0)]).unwrap().contains("2026-11-22 07:17"));
    assert_eq!(plot(Vec::new()), None);
    let mut odd = line(0, f64::NAN);
    assert_eq!(plot(vec![odd.clone()]), None);
    odd.applicable = false;
    assert_eq!(plot(vec![odd]), None);
    let mut unsure = line(0, 6.0);
    unsure.parameters[0].standard_deviation = f64::INFINITY;
    assert!(plot(vec![unsure, line(1, 6.0)]).is_some());
}

#[test]
fn the_report_stands_by_itself_and_takes_no_orders() {
    let mut hostile = lines();
    for line in &mut hostile {
        line.robot = HOSTILE.into();
        line.method = HOSTILE.into();
        line.parameters[0].name = HOSTILE.into();
        line.note = Some(Note { text: Some(HOSTILE.into()), ..Note::default() });
    }
    let baseline = Baseline::from_result(hostile[1].clone());
    let history = JudgedHistory::new(hostile, Some(baseline), DriftOptions::default());
    let parameters = history.parameters();
    let report = HistoryReport { history: &history, parameters: &parameters };
    let html = report.to_html();
    assert_eq!(html, report.to_html());
    assert!(!html.contains("<script") && !html.contains("http") && html.contains("&lt;script"));
    assert!(!html.contains("NaN") && !html.contains("=\"inf"), "{html}");
    assert_eq!(html.matches("<svg class=\"panel\"").count(), 2);
}

#[test]
fn the_report_shows_band_baseline_alarm_and_trend() {
    let history = history();
    let html = HistoryReport { history: &history, parameters: &["mx4", "fc3"] }.to_html();
    assert!(html.contains("One parameter has left its band"));
    let (first, second) = html.split_once("<figure class=\"\">").unwrap();
    assert!(first.contains("<figure class=\"alarmed\">") && first.contains(">fc3 [N·m]</text>"));
    assert!(second.contains(">mx4 [N·m]</text>") && !second.contains("class=\"when\""));
    for class in ["band", "baseline", "when", "trend"] {
        assert_eq!(first.matches(&format!("class=\"{class}\"")).count(), 1, "{class}");
    }
    // Seven may be used; those of 6.7, 6.8 and 6.9 are outside.
    assert_eq!(first.matches("class=\"value").count(), 7);
    assert_eq!(first.matches("class=\"value off\"").count(), 3);
    let none = JudgedHistory::new(Vec::new(), None, DriftOptions::default());
    let empty = HistoryReport { history: &none, parameters: &[] }.to_html();
    assert!(empty.contains("No baseline") && empty.contains("No result"));
}

#[test]
fn the_rows_of_the_report_stand_by_the_share_of_their_bands() {
    let history = history();
    let html = HistoryReport { history: &history, parameters: &["mx4", "fc3"] }.to_html();
    let table = html.split_once("class=\"sparks\"").unwrap().1.split_once("</table>").unwrap().0;
    let rows: Vec<&str> = table.split("<th scope=\"row\">").skip(1).collect();
    assert!(rows.len() == 2 && rows[0].starts_with("fc3") && rows[1].starts_with("mx4"), "{table}");
    // 0.9 of 6, and of a band of 0.6.
    assert!(rows[0].contains("+15.0 %") && rows[0].contains(">150 %<"), "{}", rows[0]);
    assert_eq!(table.matches("class=\"spark\"").count(), 2);
    assert_eq!(table.matches("class=\"shade\"").count(), 2, "{table}");
    assert!(table.contains("N·m"));
}

/// A line from day to day, none across ten days without a result, and a value outside that raises
/// no alarm yet.
#[test]
fn a_gap_has_no_line_and_no_alarm_is_not_a_band() {
    let mut lines: Vec<_> = [0, 1, 2, 3, 14, 15].map(|day| line(day, 6.0)).into();
    lines.push(line(16, 6.9));
    lines[6].parameters[0].description = Some("Coulomb friction of joint 3, `elbow`".into());
    let baseline = Baseline::from_result(lines[0].clone());
    let history = JudgedHistory::new(lines, Some(baseline), DriftOptions::default());
    let html = HistoryReport { history: &history, parameters: &["fc3"] }.to_html();
    let spark = html.split_once("class=\"spark\"").unwrap().1.split_once("</svg>").unwrap().0;
    assert_eq!(spark.matches("class=\"line\"").count(), 2, "{spark}");
    assert!(html.contains("<h2>No alarm</h2>") && !html.contains("Every parameter"), "{html}");
    assert!(html.contains("fc3 (Coulomb friction of joint 3, <code>elbow</code>)"), "{html}");
    assert!(summary(&history).contains("fc3 (Coulomb friction of joint 3, `elbow`)"));
    assert!(plot(&history, "fc3", 42).unwrap().starts_with("Coulomb friction of joint 3, "));
    let drift = drift_text(&history, &history.entries[6]);
    assert_eq!(drift, "outside: fc3 (elbow) +15.0 %");
}

#[test]
fn torques_along_a_motion_have_the_names_of_their_joints() {
    let of = |joint_name: Option<&str>| crate::analysis::JointDifference {
        joint: didim_dynamics::robot::JointIndex::new(2),
        joint_name: joint_name.map(str::to_owned),
        unit: "N·m",
        rms: 0.8,
        by_chance: Some(0.01),
        largest: 1.1,
        at_s: 2.5,
        relative: 0.04,
    };
    let torques = vec![of(Some("elbow")), of(None)];
    let difference = Difference { results: [0, 3], caveats: vec![], parameters: vec![], torques };
    let table = difference.table();
    let first = |line: &str| line.split("  ").next().map(str::to_owned);
    let joints: Vec<_> = table.lines().rev().take(2).filter_map(first).collect();
    assert_eq!(joints, ["joint 3", "joint 3 (elbow)"], "{table}");
}

#[test]
fn what_happened_before_what_is_shown_is_not_drawn() {
    let mut history = history();
    for (shown, marks) in [(8, 1), (5, 1), (4, 0), (1, 0)] {
        let surplus = history.entries.len() - shown;
        history.entries.drain(..surplus);
        let html = HistoryReport { history: &history, parameters: &["fc3"] }.to_html();
        assert_eq!(html.matches("class=\"when\"").count(), marks, "{shown} shown");
        assert!(html.contains("left its band on 2026-11-25"), "{html}");
    }
}

#[test]
fn a_trend_goes_through_the_points_however_few_are_shown() {
    let lines: Vec<_> = (0..12).map(|day| line(day, 6.0 + 0.01 * day as f64)).collect();
    let baseline = Baseline::from_result(lines[0].clone());
    let mut history = JudgedHistory::new(lines, Some(baseline), DriftOptions::default());
    for shown in [12, 5] {
        history.entries.drain(..history.entries.len() - shown);
        let html = HistoryReport { history: &history, parameters: &["fc3"] }.to_html();
        let number = |text: &str, key: &str| -> String {
            let rest = text.split_once(&format!("{key}=\"")).unwrap().1;
            rest.split_once('"').unwrap().0.to_owned()
        };
        let points: Vec<&str> = html.split("<circle class=\"value\"").skip(1).collect();
        assert_eq!(points.len(), shown);
        let trend = html.split_once("<line class=\"trend\"").unwrap().1;
        for (point, end) in [(points[0], '1'), (points[shown - 1], '2')] {
            assert_eq!(number(trend, &format!("x{end}")), number(point, "cx"));
            assert_eq!(number(trend, &format!("y{end}")), number(point, "cy"));
        }
    }
}

#[test]
fn plots_leave_an_unset_clock_out_and_need_no_order() {
    let ordered: Vec<_> = (0..5).map(|day| line(day, 6.0 + 0.01 * day as f64)).collect();
    let mut mixed = vec![ordered[0].clone(), ordered[3].clone(), ordered[1].clone()];
    mixed.push(HistoryLine { time: Timestamp::from_unix_s(90), ..line(9, 6.05) });
    mixed.extend([ordered[4].clone(), ordered[2].clone()]);
    // The undated one comes first too: a history begins with a new arm.
    mixed.insert(0, HistoryLine { time: Timestamp::from_unix_s(60), ..line(8, 6.05) });
    let history = |lines: &[HistoryLine]| {
        let baseline = Some(Baseline::from_result(ordered[0].clone()));
        JudgedHistory::new(lines.to_vec(), baseline, DriftOptions::default())
    };
    let (ordered, mixed) = (history(&ordered), history(&mixed));
    assert_eq!(mixed.parameter_points("fc3"), ordered.parameter_points("fc3"));
    assert_eq!(plot(&mixed, "fc3", 42), plot(&ordered, "fc3", 42));
    let trends = |of: &JudgedHistory| of.tracker.as_ref().unwrap().trend("fc3").unwrap();
    assert!((trends(&mixed).slope / trends(&ordered).slope - 1.0).abs() < 1e-9);
    let chart = |of: &JudgedHistory| {
        let html = HistoryReport { history: of, parameters: &["fc3"] }.to_html();
        let svg = html.split_once("<svg class=\"panel\"").unwrap().1;
        svg.split_once("</svg>").unwrap().0.to_owned()
    };
    assert_eq!(chart(&mixed), chart(&ordered));
    let words =
        "2 results were stored while the clock was not set and are left out of plots and trends";
    assert!(summary(&mixed).contains(words) && !summary(&ordered).contains("clock"));
    let html = HistoryReport { history: &mixed, parameters: &["fc3"] }.to_html();
    assert!(html.contains(words) && html.contains("7 results from 2026-11-22 07:17 to 2026-11-26"));
    assert_eq!(HistoryDocument::new(&mixed, &["fc3"], None).undated, 2);
    // Only undated results.
    let undated = [HistoryLine { time: Timestamp::from_unix_s(60), ..line(0, 6.0) }];
    let undated = JudgedHistory::new(undated.to_vec(), None, DriftOptions::default());
    assert_eq!(plot(&undated, "fc3", 42), None);
    assert!(
        summary(&undated)
            .contains("1 result was stored while the clock was not set and is left out")
    );
    let html = HistoryReport { history: &undated, parameters: &["fc3"] }.to_html();
    assert!(html.contains("<p>1 result</p>"), "{html}");
}
