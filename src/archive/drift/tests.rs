use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;
use crate::archive::store::{
    HISTORY_SCHEMA, HistoryLine, ModelDifference, ParameterValue, Timestamp,
};
use crate::window::Note;

mod days;

const START_S: u64 = 1_795_331_849; // 2026-11-22T07:17:29Z
const DAY_S: u64 = 86_400;

fn value(name: &str, value: f64, standard_deviation: f64) -> ParameterValue {
    ParameterValue {
        description: None,
        name: name.into(),
        unit: "N·m".into(),
        value,
        standard_deviation,
        combined_standard_deviation: None,
    }
}

/// One result per day.
fn line(result: u64, fc3: f64) -> HistoryLine {
    HistoryLine {
        schema: HISTORY_SCHEMA,
        time: Timestamp::from_unix_s(START_S + result * DAY_S),
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
        relative_error: Some(0.05),
        note: None,
        parameters: vec![value("fc3", fc3, 0.01), value("zz1r", 1.24, 0.001)],
        against: None,
        load: None,
        day: None,
        readings: Default::default(),
    }
}

/// Another motion excites other model errors: the arm has not changed.
#[test]
fn what_the_model_makes_of_a_difference_widens_the_band() {
    let (then, now) = (line(0, 6.0), line(1, 7.0));
    let fc3 =
        |now: &HistoryLine| Change::between_results(&then, now, &DriftOptions::default()).remove(0);
    let outside = fc3(&now);
    close(outside.standard_deviation, 0.01 * 2_f64.sqrt(), 1e-12);
    assert!(outside.band_share() > 1.0);
    let against = |earlier: &HistoryLine| {
        let HistoryLine { result, time, .. } = *earlier;
        Some(ModelDifference { result, time, standard_deviations: vec![0.5, 0.0] })
    };
    let inside = fc3(&HistoryLine { against: against(&then), ..now.clone() });
    close(inside.standard_deviation, (2e-4_f64 + 0.25).sqrt(), 1e-12);
    assert!(inside.band_share() < 1.0);
    // The contribution of the model relative to another baseline is unknown.
    assert_eq!(fc3(&HistoryLine { against: against(&line(2, 6.0)), ..now }), outside);
}

fn payload(kg: f64) -> Option<Note> {
    Some(Note { payload_kg: Some(kg), ..Note::default() })
}

fn tracker() -> Tracker {
    Tracker::new(Baseline::from_result(line(0, 6.0)), DriftOptions::default())
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{found} for {expected}");
}

/// Normally distributed numbers by the Box–Muller method.
struct Normal(ChaCha8Rng);

impl Normal {
    fn draw(&mut self) -> f64 {
        let mut uniform = || (self.0.next_u64() >> 11) as f64 * 2_f64.powi(-53) + 2_f64.powi(-54);
        let (radius, angle) = (uniform(), uniform());
        (-2.0 * radius.ln()).sqrt() * (core::f64::consts::TAU * angle).cos()
    }
}

#[test]
fn a_change_has_both_deviations_and_both_limits() {
    let options = DriftOptions::default();
    let change = Change::new(&value("a", -2.0, 0.03), &value("a", -2.3, 0.04), 0.0, &options);
    close(change.standard_deviation, 0.05, 1e-12);
    close(change.difference_deviations(), -6.0, 1e-12);
    close(change.relative_change(), 0.15, 1e-12);
    close(change.relative_deviation(), 0.025, 1e-12);
    // 10 % of 2 are 0.2, and so are 4 σ_Δ.
    close(change.half_band, 0.2, 1e-12);
    close(change.band_share(), 1.5, 1e-12);
    let noisy = Change::new(&value("a", -2.0, 0.3), &value("a", -2.3, 0.4), 0.0, &options);
    close(noisy.half_band, 2.0, 1e-12);
    let time = Timestamp::from_unix_s(START_S);
    let outside = Change::new(&value("a", -2.0, 0.03), &value("a", -9.0, 0.04), 0.0, &options);
    // The history stores null for both. A restarted service therefore must not distinguish them.
    for sigma in [f64::NAN, f64::INFINITY] {
        for sigmas in [(sigma, 0.4), (0.4, sigma)] {
            let then = value("a", -2.0, sigmas.0);
            let unknown = Change::new(&then, &value("a", -9.0, sigmas.1), 0.0, &options);
            assert!(unknown.band_share().is_nan(), "{sigmas:?}");
            let mut alarm = Alarm::default();
            assert!((0..9).all(|_| alarm.handle_change(&unknown, time, 1).is_none()));
            assert_eq!(alarm.handle_change(&outside, time, 1), Some(AlarmEvent::Raised));
            assert!((0..9).all(|_| alarm.handle_change(&unknown, time, 1).is_none()));
        }
    }
}

#[test]
fn one_odd_result_is_no_alarm_and_two_are() {
    let mut tracker = tracker();
    // 6.7 is 11.7 % more; 4 σ_Δ are 0.06.
    let mut day = 0;
    let mut next = |fc3: f64| {
        day += 1;
        let events = tracker.handle_line(&line(day, fc3));
        (events, tracker.alarms().map(|(name, since)| (name.to_owned(), since)).collect::<Vec<_>>())
    };
    let raised = vec![("fc3".to_owned(), AlarmEvent::Raised)];
    let since = |day: u64| vec![("fc3".to_owned(), Timestamp::from_unix_s(START_S + day * DAY_S))];
    for fc3 in [6.0, 6.7, 6.1, 6.7, 6.59] {
        assert_eq!(next(fc3), (vec![], vec![]), "{fc3}");
    }
    assert_eq!(next(6.7), (vec![], vec![]));
    assert_eq!(next(5.3), (raised, since(6)), "outside is outside on either side");
    // Inside the band, but not well inside: 0.75 of 0.6 are 0.45.
    for fc3 in [6.5, 6.5, 6.5, 6.2, 6.5, 6.2] {
        assert_eq!(next(fc3), (vec![], since(6)), "{fc3}");
    }
    assert_eq!(next(6.2), (vec![("fc3".to_owned(), AlarmEvent::Cleared)], vec![]));
}

#[test]
fn what_is_not_comparable_is_said_and_changes_no_alarm() {
    let other = |change: &dyn Fn(&mut HistoryLine)| {
        let mut line = line(2, 9.0);
        change(&mut line);
        line
    };
    for (line, says) in [
        (other(&|line| line.applicable = false), "result 2 is not usable for monitoring"),
        (other(&|line| line.monitoring = Some(false)), "result 2 is not usable for monitoring"),
        (
            other(&|line| line.robot = "rx160".into()),
            "is of the robot rx160, result 0 of tx40; set a new baseline",
        ),
        (
            other(&|line| line.method = "didim".into()),
            "by didim, result 0 by idim-ls; set a new baseline",
        ),
        (
            other(&|line| line.regrouping = "s".into()),
            "another way than those of result 0; set a new baseline",
        ),
        (other(&|line| line.parameters[1].name = "zz1".into()), "(+zz1 −zz1r)"),
        (other(&|line| drop(line.parameters.pop())), "(−zz1r)"),
        (
            other(&|line| line.note = payload(2.0)),
            "2 kg was noted with result 2, none with result 0",
        ),
    ] {
        let mut tracker = tracker();
        tracker.handle_line(&self::line(1, 9.0));
        assert_eq!(tracker.handle_line(&line), vec![]);
        let status = tracker.status();
        assert!(!status.compared && status.parameters.is_empty());
        let why = status.why_not.unwrap();
        assert!(why.contains(says), "{why}");
        // The next comparable result is the second outside.
        assert_eq!(tracker.handle_line(&self::line(3, 9.0)).len(), 1);
        assert!(tracker.status().compared);
    }
}

#[test]
fn a_rebuilt_line_is_compared_if_its_configuration_is_the_same() {
    let rebuilt = |configuration: &str| HistoryLine {
        regrouping: String::new(),
        configuration: configuration.into(),
        ..line(2, 6.0)
    };
    assert_eq!(check_comparable(&line(1, 6.0), &rebuilt("c0ffee")), Ok(()));
    assert_eq!(check_comparable(&rebuilt("c0ffee"), &line(3, 6.0)), Ok(()));
    let other = check_comparable(&line(1, 6.0), &rebuilt("another"));
    assert_eq!(other, Err(NotComparable::OtherRegrouping { result: 2, other: 1 }));
}

#[test]
fn a_payload_is_the_baselines_unless_another_is_noted() {
    let noted = |kg: Option<f64>| HistoryLine { note: kg.and_then(payload), ..line(1, 6.0) };
    let cases = [
        (None, None, true),
        (Some(2.0), None, true),
        (Some(2.0), Some(2.005), true),
        (Some(2.0), Some(2.1), false),
        (None, Some(2.0), false),
        // A baseline without a noted payload carries none.
        (None, Some(0.0), true),
        (Some(0.0), Some(0.0), true),
        (Some(0.0), None, true),
        (Some(2.0), Some(0.0), false),
    ];
    for (baseline, result, same) in cases {
        let compared = check_comparable(&noted(baseline), &noted(result));
        assert_eq!(compared.is_ok(), same, "{baseline:?} {result:?}: {compared:?}");
    }
}

#[test]
fn a_restarted_tracker_comes_to_the_same_alarms() {
    let values = [6.0, 6.9, 7.0, 6.2, 6.9, 6.1, 6.1, 7.0, 7.0];
    let lines: Vec<_> = (1..).zip(values).map(|(day, fc3)| line(day, fc3)).collect();
    let mut uninterrupted = tracker();
    for (k, line) in lines.iter().enumerate() {
        uninterrupted.handle_line(line);
        let mut again = tracker();
        // The baseline's result and earlier results are ignored.
        again.handle_line(&self::line(0, 60.0));
        lines[..=k].iter().for_each(|line| drop(again.handle_line(line)));
        assert_eq!(again.status(), uninterrupted.status());
    }
}

#[test]
fn a_folder_that_was_emptied_counts_anew_and_is_still_compared() {
    let mut baseline = line(40, 6.0);
    baseline.time = Timestamp::from_unix_s(START_S);
    let mut tracker = Tracker::new(Baseline::from_result(baseline), DriftOptions::default());
    tracker.handle_line(&line(1, 6.0));
    assert!(tracker.status().compared);
}

// Reference values of both trends: from scipy.optimize import curve_fit; import numpy as np t =
// np.array([0,1.5,2,4,7.25,9]); s = np.array([.01,.02,.01,.015,.01,.02]) (a, b), C =
// curve_fit(lambda t, a, b: a + b*t, t, v, sigma=s, absolute_sigma=True) print(b, C[1,1]**.5,
// (((v-a-b*t)/s)**2).sum()) (SciPy 1.17.1)
const TIMES: [f64; 6] = [0.0, 1.5, 2.0, 4.0, 7.25, 9.0];
const SIGMAS: [f64; 6] = [0.01, 0.02, 0.01, 0.015, 0.01, 0.02];

fn trend_of(values: [f64; 6]) -> Trend {
    let points = TIMES.into_iter().zip(values).zip(SIGMAS);
    trend(&points.map(|((time, value), sigma)| (time, value, sigma)).collect::<Vec<_>>()).unwrap()
}

#[test]
fn a_trend_is_that_of_scipy() {
    let quiet = trend_of([6.480, 6.484, 6.489, 6.497, 6.512, 6.521]);
    close(quiet.slope, 0.004_484_778_835_436_246, 1e-6);
    close(quiet.slope_deviation, 0.001_638_900_233_186_787, 1e-6);
    close(quiet.chi_squared, 0.021_043_806_967_985_905, 1e-5);
    assert!((quiet.scatter - 1.0).abs() < 1e-12, "points that scatter less do not sharpen it");
    close(quiet.mean_time, 3.461_267_605_633_803, 1e-12);
    close(quiet.at_mean, 6.495_161_971_830_986, 1e-8);
    assert_eq!((quiet.points, quiet.span), (6, (0.0, 9.0)));
    let restless = trend_of([6.48, 6.50, 6.47, 6.55, 6.58, 6.66]);
    close(restless.slope, 0.017_450_435_506_327_633, 1e-6);
    close(restless.chi_squared, 17.176_764_751_085_19, 1e-6);
    close(restless.scatter, 2.072_243_032_988_963_4, 1e-6);
    close(restless.slope_deviation, 0.001_638_899_733_457_181_4 * restless.scatter, 1e-6);
}

#[test]
fn a_trend_needs_three_points_at_different_times() {
    let points = [(0.0, 1.0, 0.1), (1.0, 2.0, 0.1), (2.0, 2.5, 0.1)];
    assert!(trend(&points).is_some());
    assert_eq!(trend(&points[..2]), None);
    assert_eq!(trend(&points.map(|(_, value, sigma)| (3.0, value, sigma))), None);
    for bad in [(f64::NAN, 1.0, 0.1), (0.0, f64::NAN, 0.1), (0.0, 1.0, 0.0), (0.0, 1.0, f64::NAN)] {
        assert_eq!(trend(&[points[0], points[1], bad]), None, "{bad:?}");
    }
}

/// Share of baselines for which noise alone raises the alarm with two results. With bands of k
/// standard deviations both differences are standard normal and share the baseline's noise. Their
/// correlation is σ₀²/(σ² + σ₀²) = 1/2.
#[test]
fn noise_alone_raises_as_many_alarms_as_theory_says() {
    // from scipy.stats import multivariate_normal as m, norm
    // f = lambda a, b: m.cdf([a, b], cov=[[1, .5], [.5, 1]], abseps=1e-15, maxpts=10**7)
    // 2*norm.sf(k), 2*(f(-k, -k) + norm.cdf(-k) - f(-k, k))                    (SciPy 1.17.1)
    for (k, outside, twice) in
        [(1.5, 0.133_614_402_537_7, 0.036_990_693_2), (2.0, 0.045_500_263_9, 0.008_112_380_4)]
    {
        let options = DriftOptions {
            standard_deviations: k,
            relative: 0.0,
            results: 2,
            ..DriftOptions::default()
        };
        let mut normal = Normal(ChaCha8Rng::seed_from_u64(17));
        let trials = 200_000;
        let (mut firsts, mut alarms) = (0_u32, 0_u32);
        for _ in 0..trials {
            let mut estimate = || value("fc3", 6.48 + 0.003 * normal.draw(), 0.003);
            let (baseline, mut alarm) = (estimate(), Alarm::default());
            for result in 0..2 {
                let change = Change::new(&baseline, &estimate(), 0.0, &options);
                let time = Timestamp::from_unix_s(START_S);
                firsts += u32::from(result == 0 && change.band_share() > 1.0);
                alarms += u32::from(alarm.handle_change(&change, time, 2).is_some());
            }
        }
        for (found, expected) in [(firsts, outside), (alarms, twice)] {
            let trials = f64::from(trials);
            let sigma = (trials * expected * (1.0 - expected)).sqrt();
            let deviation = (f64::from(found) - trials * expected) / sigma;
            assert!(deviation.abs() < 4.0, "{found} of {trials}, {deviation:.1} σ from theory");
        }
    }
}

#[test]
fn the_default_band_is_left_by_noise_as_rarely_as_it_says() {
    // The same with k = 4, for 28 parameters: one in 37,000.
    let options = DriftOptions::default();
    assert!((options.standard_deviations - 4.0).abs() < 1e-12);
    close(28.0 * 9.741_095_244_454_97e-7, 1.0 / 37_000.0, 0.02);
    // The band is never narrower than 4 σ_Δ, however large the noise is.
    for sigma in [1e-6, 1e-3, 1.0, 1e3] {
        let change = Change::new(&value("a", 1.0, sigma), &value("a", 1.0, sigma), 0.0, &options);
        assert!(change.half_band >= 4.0 * change.standard_deviation);
    }
}

#[test]
fn the_sentence_says_what_changed_how_fast_and_since_when() {
    let mut tracker = tracker();
    for day in 1..=30 {
        tracker.handle_line(&line(day, 6.0 + 0.025 * day as f64));
    }
    assert_eq!(
        tracker.sentence("fc3").unwrap(),
        "fc3 has grown by 12.5 % ± 0.2 % since the baseline of 2026-11-22, +0.417 ± 0.003 %/day, \
         left its band on 2026-12-17"
    );
    let status = tracker.status();
    let alarm = &status.alarms[0];
    assert_eq!((status.alarms.len(), alarm.parameter.as_str()), (1, "fc3"));
    let reasons = |count: usize| {
        DriftStatus { alarms: vec![alarm.clone(); count], ..status.clone() }.reasons()
    };
    assert_eq!(reasons(5), vec![alarm.text.clone(); 5]);
    assert_eq!(reasons(6)[5], "1 more parameter has left its band");
    assert_eq!(reasons(8)[5], "3 more parameters have left their bands");
    close(alarm.relative_change.unwrap(), 0.125, 1e-9);
    close(alarm.slope_per_day.unwrap(), 0.025 / 6.0, 1e-9);
    close(alarm.deviation_sigma.unwrap(), 0.75 / (0.01 * 2_f64.sqrt()), 1e-9);
    assert_eq!(alarm.since.date(), "2026-12-17");
    let json = serde_json::to_string(&status).unwrap();
    assert_eq!(serde_json::from_str::<DriftStatus>(&json).unwrap(), status);
}

#[test]
fn a_trend_is_followed_no_further_than_it_reaches() {
    let grown = |days: u64, slope: f64| {
        let mut tracker = tracker();
        for day in 1..=days {
            tracker.handle_line(&line(day, 6.0 - slope * day as f64));
        }
        tracker.sentence("fc3").unwrap()
    };
    // At 0.03 a day, the band of 0.6 is left on day 20. Four times 6 days are enough, four times 4
    // are not.
    let near = grown(6, 0.03);
    assert!(near.contains("has shrunk by 3.0 %") && near.contains(", −0.50 ±"), "{near}");
    assert!(near.contains("leaves its band on 2026-12-12 at this rate"), "{near}");
    let far = grown(4, 0.03);
    assert!(!far.contains("band"), "{far}");
    assert!(!grown(30, 0.0).contains("band"));
}

#[test]
fn a_rate_per_day_needs_a_day() {
    let mut tracker = tracker();
    for hour in 1..=23 {
        let time = Timestamp::from_unix_s(START_S + hour * 3600);
        tracker.handle_line(&HistoryLine { time, ..line(hour, 6.0 - 0.01 * hour as f64) });
    }
    assert_eq!(tracker.trend("fc3"), None);
    assert!(!tracker.sentence("fc3").unwrap().contains("day"));
    // A third day, after this one and the one that began at midnight.
    tracker.handle_line(&line(24, 6.0));
    assert_eq!(tracker.trend("fc3").unwrap().points, 3);
}

#[test]
fn a_parameter_that_could_be_zero_is_reported_in_its_unit() {
    let change = Change::new(
        &value("b", 0.01, 0.02),
        &value("b", -0.3, 0.02),
        0.0,
        &DriftOptions::default(),
    );
    let text = change_sentence(&change, Timestamp::from_unix_s(START_S), None, None);
    assert_eq!(text, "b has fallen by 0.31 ± 0.03 since the baseline of 2026-11-22");
}

#[test]
fn a_baseline_is_whole_or_not_there_and_its_change_is_noticed_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut watch = BaselineWatch::new(folder.path());
    assert!(matches!(watch.poll(), Some(Ok(None))));
    assert!(watch.poll().is_none());
    let baseline = Baseline::from_result(line(3, 6.0));
    baseline.write(folder.path()).unwrap();
    let seen = watch.poll().unwrap().unwrap();
    assert_eq!(seen.as_ref(), Some(&baseline));
    assert!(watch.poll().is_none());
    Baseline::from_result(line(4, 6.0)).write(folder.path()).unwrap();
    assert_eq!(watch.poll().unwrap().unwrap().unwrap().result.result, 4);
    let path = folder.path().join("baseline.json");
    std::fs::write(&path, "{\"schema\":1").unwrap();
    let error = watch.poll().unwrap().unwrap_err().to_string();
    assert!(error.contains("is no baseline") && error.contains("didim baseline set"), "{error}");
    assert!(watch.poll().is_none(), "reported once");
    let mut later = [Baseline { schema: 2, ..baseline.clone() }, baseline];
    later[1].result.schema = HISTORY_SCHEMA + 1;
    for later in later {
        std::fs::write(&path, serde_json::to_string(&later).unwrap()).unwrap();
        assert!(Baseline::read(folder.path()).unwrap_err().to_string().contains("version 2"));
    }
    assert!(Baseline::remove(folder.path()).unwrap());
    assert!(!Baseline::remove(folder.path()).unwrap());
    assert!(matches!(watch.poll(), Some(Ok(None))));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
