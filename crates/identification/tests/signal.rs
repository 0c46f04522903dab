//! Filters and differences against SciPy and NumPy (`golden/filters.py`), their refusals, and what
//! holds for any linear zero-phase filter.

use didim_identification::signal::{
    OddPadding, ParallelDecimation, SecondOrderSections, SignalError, butterworth_low_pass,
    central_difference, chebyshev1_low_pass, delay_linear,
};
use proptest::prelude::*;
use toml::{Table, Value};

const SAMPLES: usize = 400;

fn golden() -> Table {
    include_str!("golden/filters.toml").parse().unwrap()
}

fn floats(table: &Table, key: &str) -> Vec<f64> {
    table[key].as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect()
}

fn picked(table: &Table, signal: &[f64]) -> Vec<f64> {
    let indices = table["picked"].as_array().unwrap();
    indices.iter().map(|k| signal[usize::try_from(k.as_integer().unwrap()).unwrap()]).collect()
}

/// The signal of `golden/filters.py`: a ramp with something rough on it.
fn rough(samples: usize) -> Vec<f64> {
    (0..samples)
        .map(|k| {
            ((k * k * 7919 + 13 * k) % 1009) as f64 / 1009.0 + k as f64 / 64.0
                - (k % 97) as f64 / 97.0
        })
        .collect()
}

/// Largest difference relative to the largest expected value.
fn relative_difference(actual: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(actual.len(), expected.len());
    let scale = expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    actual.iter().zip(expected).fold(0.0, |m: f64, (a, e)| m.max((a - e).abs())) / scale
}

fn design(case: &Table) -> SecondOrderSections {
    let order = usize::try_from(case["order"].as_integer().unwrap()).unwrap();
    let number = |key: &str| case[key].as_float().unwrap();
    match case["kind"].as_str().unwrap() {
        "butterworth" => butterworth_low_pass(order, number("cutoff")),
        "chebyshev1" => chebyshev1_low_pass(order, number("ripple_db"), number("cutoff")),
        other => panic!("unknown kind {other}"),
    }
    .unwrap()
}

fn cases(golden: &Table) -> impl Iterator<Item = &Table> {
    golden["filter"].as_array().unwrap().iter().map(|case| case.as_table().unwrap())
}

#[test]
fn responses_agree_with_scipy_for_every_order() {
    let golden = golden();
    let ratios = floats(&golden, "ratios");
    let mut compared = 0;
    for case in cases(&golden) {
        let filter = design(case);
        let (re, im): (Vec<f64>, Vec<f64>) = ratios.iter().map(|&r| filter.response(r)).unzip();
        for (actual, key) in [(re, "response_re"), (im, "response_im")] {
            let expected = floats(case, key);
            // The gain is at most 1, so this is relative to the pass band.
            for (a, e) in actual.iter().zip(&expected) {
                assert!((a - e).abs() < 1e-9, "{key} of {case:?}: {a} instead of {e}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 48 * 9 * 2);
}

#[test]
fn zero_phase_filtering_agrees_with_scipy() {
    let golden = golden();
    let mut compared = 0;
    for case in cases(&golden).filter(|case| case.contains_key("zero_phase")) {
        let filter = design(case);
        for (key, padding) in [
            ("zero_phase", filter.default_padding()),
            ("zero_phase_padded_3", OddPadding { samples: 3 }),
            ("zero_phase_padded_0", OddPadding { samples: 0 }),
        ] {
            let mut signal = rough(SAMPLES);
            filter.filter_zero_phase(&mut signal, padding).unwrap();
            let difference = relative_difference(&picked(&golden, &signal), &floats(case, key));
            assert!(difference < 1e-9, "{key} of {case:?}: {difference}");
            compared += 1;
        }
    }
    assert_eq!(compared, 16 * 3);
}

#[test]
fn position_filter_agrees_with_filtfilt_on_the_transfer_function() {
    let golden = golden();
    let filter = butterworth_low_pass(4, 0.02).unwrap();
    assert_eq!(filter.default_padding().samples, 15);
    let mut signal = rough(SAMPLES);
    filter.filter_zero_phase(&mut signal, filter.default_padding()).unwrap();
    let difference =
        relative_difference(&picked(&golden, &signal), &floats(&golden, "filtfilt_butter4"));
    assert!(difference < 1e-9, "{difference}");
}

#[test]
fn central_difference_agrees_with_numpy() {
    let golden = golden();
    let mut derivative = vec![0.0; SAMPLES];
    central_difference(&rough(SAMPLES), 250.0, &mut derivative).unwrap();
    let difference =
        relative_difference(&picked(&golden, &derivative), &floats(&golden, "gradient"));
    assert!(difference < 1e-12, "{difference}");
}

#[test]
fn lanes_have_the_bits_of_single_signals() {
    let filter = chebyshev1_low_pass(8, 0.05, 0.008).unwrap();
    let single: Vec<Vec<f64>> =
        (1..=4).map(|l| rough(SAMPLES).iter().map(|x| x.sin() * f64::from(l)).collect()).collect();
    let mut lanes: Vec<[f64; 4]> =
        (0..SAMPLES).map(|k| core::array::from_fn(|l| single[l][k])).collect();
    filter.filter_zero_phase_lanes(&mut lanes, filter.default_padding()).unwrap();
    for (l, mut signal) in single.into_iter().enumerate() {
        filter.filter_zero_phase(&mut signal, filter.default_padding()).unwrap();
        for (k, x) in signal.iter().enumerate() {
            assert_eq!(x.to_bits(), lanes[k][l].to_bits(), "sample {k} of lane {l}");
        }
    }
}

#[test]
fn decimation_keeps_multiples_of_the_factor_inside_the_range() {
    let decimation = ParallelDecimation::chebyshev1(8, 0.05, 0.8, 100).unwrap();
    let samples: Vec<usize> = decimation.kept_samples(250..601).collect();
    assert_eq!(samples, [300, 400, 500, 600]);
    assert_eq!(decimation.kept_samples(300..37_401).count(), 372);
    assert_eq!(decimation.kept_samples(301..302).count(), 0);
    assert_eq!(decimation.factor(), 100);
}

#[test]
fn half_a_sample_of_delay_is_the_mean_of_the_neighbours() {
    let signal = [1.0, 2.0, -4.0, 8.0];
    assert_eq!(delay_linear(&signal, 0.5).unwrap(), [1.0, 1.5, -1.0, 2.0]);
    assert_eq!(delay_linear(&signal, 1.0).unwrap(), [1.0, 1.0, 2.0, -4.0]);
    assert_eq!(delay_linear(&signal, -2.0).unwrap(), [-4.0, 8.0, 8.0, 8.0]);
    assert_eq!(delay_linear(&signal, 0.0).unwrap(), signal);
    assert_eq!(delay_linear(&signal, 1e300).unwrap(), [1.0; 4]);
    assert_eq!(delay_linear(&[], 0.5).unwrap(), [0.0; 0]);
}

#[test]
fn what_cannot_be_filtered_is_refused() {
    for order in [0, 13] {
        assert_eq!(butterworth_low_pass(order, 0.1), Err(SignalError::Order { order }));
    }
    for ratio in [-0.1, 0.0, 1.0, 1.5, f64::INFINITY] {
        assert_eq!(butterworth_low_pass(4, ratio), Err(SignalError::Cutoff { ratio }));
        assert_eq!(chebyshev1_low_pass(4, 1.0, ratio), Err(SignalError::Cutoff { ratio }));
    }
    assert!(butterworth_low_pass(4, f64::NAN).is_err());
    for ripple_db in [-1.0, 0.0, 100.0] {
        let refused = chebyshev1_low_pass(4, ripple_db, 0.1);
        assert_eq!(refused, Err(SignalError::Ripple { ripple_db }));
    }
    assert!(chebyshev1_low_pass(4, f64::NAN, 0.1).is_err());
    assert_eq!(ParallelDecimation::chebyshev1(8, 0.05, 0.8, 0), Err(SignalError::Factor));

    let filter = butterworth_low_pass(4, 0.1).unwrap();
    let padding = filter.default_padding();
    let mut signal = vec![1.0; 15];
    let refused = filter.filter_zero_phase(&mut signal, padding);
    assert_eq!(refused, Err(SignalError::TooShort { samples: 15, needed: 16 }));
    assert!(filter.filter_zero_phase(&mut [], OddPadding { samples: 0 }).is_err());
    assert!(filter.filter_zero_phase(&mut signal, OddPadding { samples: usize::MAX }).is_err());

    let mut signal = vec![1.0; 100];
    signal[42] = f64::NAN;
    let refused = filter.filter_zero_phase(&mut signal, padding);
    assert_eq!(refused, Err(SignalError::NotFinite { index: 42 }));
    let refused = central_difference(&signal, 1.0, &mut [0.0; 100]);
    assert_eq!(refused, Err(SignalError::NotFinite { index: 42 }));
    assert_eq!(delay_linear(&signal, 0.5), Err(SignalError::NotFinite { index: 42 }));
    assert!(delay_linear(&[1.0], f64::NAN).is_err());

    assert_eq!(
        central_difference(&[1.0], 1.0, &mut [0.0]),
        Err(SignalError::TooShort { samples: 1, needed: 2 })
    );
    for sample_rate_hz in [0.0, -1.0, f64::INFINITY] {
        let refused = central_difference(&[1.0, 2.0], sample_rate_hz, &mut [0.0; 2]);
        assert_eq!(refused, Err(SignalError::SampleRate { sample_rate_hz }));
    }
}

#[test]
fn golden_file_holds_what_the_tests_count() {
    assert!(golden()["filter"].as_array().is_some_and(|cases| cases.len() == 48));
    assert!(matches!(golden()["picked"], Value::Array(_)));
}

proptest! {
    /// A straight line passes a Butterworth filter unchanged: unit gain, no phase, and a padding
    /// that continues the line.
    #[test]
    fn butterworth_keeps_a_line(
        order in 1_usize..=12,
        cutoff in 0.01..0.99_f64,
        offset in -10.0..10.0_f64,
        slope in -1.0..1.0_f64,
    ) {
        let filter = butterworth_low_pass(order, cutoff).unwrap();
        // Long enough for the start-up of the lowest cut-off, which SciPy's padding does not cover.
        let line: Vec<f64> = (0..4000).map(|k| offset + slope * f64::from(k)).collect();
        let mut filtered = line.clone();
        filter.filter_zero_phase(&mut filtered, OddPadding { samples: 3999 }).unwrap();
        prop_assert!(relative_difference(&filtered[1000..3000], &line[1000..3000]) < 1e-6);
    }

    /// Without phase, filtering the reversed signal is reversing the filtered one, away from ends.
    #[test]
    fn filtering_commutes_with_time_reversal(order in 1_usize..=12, cutoff in 0.1..0.9_f64) {
        let filter = chebyshev1_low_pass(order, 0.05, cutoff).unwrap();
        let mut forward = rough(12_000).iter().map(|x| x.sin()).collect::<Vec<_>>();
        let mut backward: Vec<f64> = forward.iter().rev().copied().collect();
        filter.filter_zero_phase(&mut forward, filter.default_padding()).unwrap();
        filter.filter_zero_phase(&mut backward, filter.default_padding()).unwrap();
        backward.reverse();
        prop_assert!(relative_difference(&backward[5900..6100], &forward[5900..6100]) < 1e-8);
    }
}
