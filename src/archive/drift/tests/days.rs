//! The trend uses days as points.

use super::*;

#[test]
fn a_busy_arm_has_the_trend_of_its_days() {
    // A hundred results a day. The first ones of each day are those of a cold arm.
    fn result(day: u64, k: u64) -> HistoryLine {
        let time = Timestamp::from_unix_s(START_S + day * DAY_S + 300 * k);
        let warming = 0.2 * (-0.1 * k as f64).exp();
        HistoryLine { time, ..line(100 * day + k, 6.0 + 0.02 * day as f64 + warming) }
    }
    let mut tracker = Tracker::new(Baseline::from_result(result(0, 0)), DriftOptions::default());
    for day in 0..20 {
        (0..100).for_each(|k| drop(tracker.handle_line(&result(day, k))));
    }
    let trend = tracker.trend("fc3").unwrap();
    // Every day equally begins at 07:17 and ends at 15:32.
    assert_eq!(trend.points, 20);
    close(trend.slope, 0.02, 1e-9);
    // The scatter within a day counts, and does not become smaller with the number of results.
    let warming: Vec<f64> = (0..100).map(|k| 0.2 * (-0.1 * f64::from(k)).exp()).collect();
    let mean = warming.iter().sum::<f64>() / 100.0;
    let scatter = (warming.iter().map(|of| (of - mean).powi(2)).sum::<f64>() / 99.0).sqrt();
    assert!(scatter > 0.04, "{scatter}");
    close(trend.slope_deviation, scatter / 665.0_f64.sqrt(), 1e-9);
    assert!(tracker.sentence("fc3").unwrap().contains(" %/day"));
}

#[test]
fn a_day_is_the_weighted_mean_of_its_results_and_the_last_ones_count() {
    let options = DriftOptions { trend_results: 4, ..DriftOptions::default() };
    fn line_at(result: u64, hours: u64, fc3: f64, sigma: f64) -> HistoryLine {
        let mut line = line(result, fc3);
        line.time = Timestamp::from_unix_s(START_S + hours * 3600);
        line.parameters[0].standard_deviation = sigma;
        line
    }
    let mut lines = [
        line_at(1, 24, 6.1, 0.01),
        line_at(2, 30, 6.5, 0.02),
        line_at(3, 31, f64::NAN, 0.02),
        line_at(4, 32, 6.5, f64::INFINITY),
        line_at(5, 33, 6.5, 0.0),
        line_at(6, 48, 6.2, 0.01),
        line_at(7, 72, 6.1, 0.01),
    ];
    // Weights 4 and 1: 25.2 h and 6.18. The scatter of 6.1 and 6.5 about it is larger than the
    // standard deviations: √(2 · (4 · 0.08² + 0.32²)/5).
    let days = [
        (0.0, 6.0, 0.01),
        (1.05, 6.18, 0.0512_f64.sqrt()),
        (2.0, 6.2, 0.01),
        (3.0, 6.1, 0.01),
        (4.0, 6.3, 0.01),
    ];
    let mut tracker = Tracker::new(Baseline::from_result(line(0, 6.0)), options);
    fn same(tracker: &Tracker, points: &[(f64, f64, f64)]) {
        let (found, expected) = (tracker.trend("fc3").unwrap(), trend(points).unwrap());
        assert_eq!(found.points, expected.points);
        close(found.slope, expected.slope, 1e-9);
        close(found.slope_deviation, expected.slope_deviation, 1e-9);
        close(found.mean_time, expected.mean_time, 1e-9);
        close(found.at_mean, expected.at_mean, 1e-9);
    }
    lines.iter().for_each(|line| drop(tracker.handle_line(line)));
    same(&tracker, &days[..4]);
    // The order of the results does not matter.
    lines.reverse();
    let mut backwards = Tracker::new(Baseline::from_result(line(0, 6.0)), options);
    lines.iter().for_each(|line| drop(backwards.handle_line(line)));
    same(&backwards, &days[..4]);
    // A fifth day: the baseline's day is dropped.
    tracker.handle_line(&line_at(8, 96, 6.3, 0.01));
    same(&tracker, &days[1..]);
}

#[test]
fn a_result_of_an_unset_clock_is_judged_and_has_no_part_in_the_trend() {
    let unset = |result: u64, fc3: f64| HistoryLine {
        time: Timestamp::from_unix_s(90 * result),
        ..line(result, fc3)
    };
    let mut tracker = tracker();
    let mut untouched = super::tracker();
    for day in 1..=5 {
        tracker.handle_line(&line(10 * day, 6.0 + 0.01 * day as f64));
        untouched.handle_line(&line(10 * day, 6.0 + 0.01 * day as f64));
        untouched.handle_line(&unset(10 * day + 1, 6.7));
        assert!(untouched.status().compared);
    }
    assert!(untouched.trend("fc3").is_some());
    assert_eq!(untouched.trend("fc3"), tracker.trend("fc3"));
    for result in 60..62 {
        untouched.handle_line(&unset(result, 6.7));
    }
    let text = untouched.sentence("fc3").unwrap();
    assert!(text.ends_with(", left its band while the clock was not set"), "{text}");
    let mut first = Tracker::new(Baseline::from_result(unset(0, 6.0)), DriftOptions::default());
    for day in 1..=3 {
        first.handle_line(&line(day, 6.0 + 0.01 * day as f64));
    }
    assert_eq!(first.trend("fc3").unwrap().points, 3);
    let text = first.sentence("fc3").unwrap();
    assert!(text.contains(" since the baseline, +"), "{text}");
}

#[test]
fn a_long_history_in_bounded_memory_has_the_requested_results() {
    // A hundred a day.
    fn result(number: u64) -> HistoryLine {
        let time = Timestamp::from_unix_s(START_S + 864 * number);
        HistoryLine { time, ..line(number, 6.0) }
    }
    let folder = tempfile::tempdir().unwrap();
    let lines = (0..1_500).map(|number| serde_json::to_string(&result(number)).unwrap() + "\n");
    std::fs::write(folder.path().join("history.jsonl"), lines.collect::<String>()).unwrap();
    let options = DriftOptions::default();
    let history = JudgedHistory::read(folder.path(), None, options, &[3]).unwrap();
    assert_eq!(history.result_count(), 1_500);
    for number in [3, 1_499] {
        assert_eq!(history.result(number), Some(&result(number)));
    }
    assert_eq!(history.result(4), None, "a row of its day stands for it");
    let mut numbers = Vec::new();
    history.for_each_entry(|entry| numbers.push(entry.line.result)).unwrap();
    assert_eq!(numbers, (0..1_500).collect::<Vec<_>>());
}
