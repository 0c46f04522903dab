//! Decimation of many signals at once against the plain recursion of one.

use core::ops::Range;

use didim_dynamics::numeric::Lanes;
use didim_identification::signal::{Group, ParallelDecimation, SignalError};
use nalgebra::DMatrix;
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};

/// Random values of sizes far apart, on a random walk about a level, signals × samples.
fn random(seed: u64, signals: usize, samples: usize) -> DMatrix<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let unit = Uniform::new(-1.0, 1.0).unwrap();
    let mut matrix = DMatrix::zeros(signals, samples);
    for mut signal in matrix.row_iter_mut() {
        let scale = 10_f64.powf(6.0 * unit.sample(&mut random));
        let mut level = 20.0 * unit.sample(&mut random);
        for value in signal.iter_mut() {
            level += 0.1 * unit.sample(&mut random);
            *value = scale * (level + unit.sample(&mut random));
        }
    }
    matrix
}

/// Sample by sample, as the decimation asks for them.
fn decimated(
    decimation: &ParallelDecimation,
    signals: &DMatrix<f64>,
    counted: Range<usize>,
) -> Result<DMatrix<f64>, SignalError> {
    let mut next = None;
    decimation.decimate_signals(signals.ncols(), signals.nrows(), counted, &mut |k, values| {
        assert!(next.is_none_or(|next| next == k), "sample {k} after {next:?} was due");
        next = Some(k + 1);
        values.copy_from_slice(signals.column(k).as_slice());
    })
}

/// The rows, and the differences of the neighbouring samples.
fn with_differences(
    decimation: &ParallelDecimation,
    signals: &DMatrix<f64>,
    counted: Range<usize>,
) -> [DMatrix<f64>; 2] {
    let (count, samples) = signals.shape();
    let mut read = |first: usize, group: &mut [Group]| {
        for (group, signal) in group.iter_mut().zip(signals.row_iter()) {
            *group = Lanes::from_fn(|l| signal[(first + l).min(samples - 1)]);
        }
    };
    decimation.decimate_with_differences(samples, count, counted, &mut read).unwrap()
}

/// The same by the recursion over every sample of one signal after the other.
fn recursion(
    decimation: &ParallelDecimation,
    signals: &DMatrix<f64>,
    counted: Range<usize>,
) -> DMatrix<f64> {
    let samples: Vec<usize> =
        decimation.kept_samples(counted).filter(|&k| k < signals.ncols()).collect();
    let mut decimated = DMatrix::zeros(samples.len(), signals.nrows());
    for (signal, mut column) in signals.row_iter().zip(decimated.column_iter_mut()) {
        let mut signal: Vec<f64> = signal.iter().copied().collect();
        decimation.filter(&mut signal).unwrap();
        for (to, &k) in column.iter_mut().zip(&samples) {
            *to = signal[k];
        }
    }
    decimated
}

/// Largest difference of a signal, relative to its largest value.
fn difference(actual: &DMatrix<f64>, expected: &DMatrix<f64>, signals: &DMatrix<f64>) -> f64 {
    assert_eq!(actual.shape(), expected.shape());
    (0..signals.nrows())
        .map(|s| (actual.column(s) - expected.column(s)).amax() / signals.row(s).amax())
        .fold(0.0, f64::max)
}

/// What both ways of summing may differ by: the rounding of the recursion itself reaches 1e-13 of
/// the signal at order 12 and a factor of 150, held against 34 digits.
const ROUNDING: f64 = 1e-12;

proptest! {
    #[test]
    fn decimation_gives_what_the_recursion_gives(
        seed in any::<u64>(), order in 1_usize..=12, cutoff_ratio in 0.5..0.95_f64,
        factor in 1_usize..=150, samples in 40_usize..2500, signals in 1_usize..=40,
        start in 0_usize..2500, length in 0_usize..3000,
    ) {
        let decimation = ParallelDecimation::chebyshev1(order, 0.05, cutoff_ratio, factor).unwrap();
        let signals = random(seed, signals, samples);
        let counted = start.min(samples)..start + length;
        let actual = decimated(&decimation, &signals, counted.clone()).unwrap();
        let difference = difference(&actual, &recursion(&decimation, &signals, counted), &signals);
        prop_assert!(difference < ROUNDING, "{difference}");
    }
}

#[test]
fn decimation_gives_what_the_recursion_gives_for_many_signals_and_long_records() {
    let decimation = ParallelDecimation::chebyshev1(8, 0.05, 0.8, 100).unwrap();
    // One sample less and one more than a whole number of blocks.
    for (seed, samples, count) in [(1, 9_999, 200), (2, 10_000, 168), (3, 10_001, 7), (4, 28, 1)] {
        let signals = random(seed, count, samples);
        for counted in [0..samples, 250..samples - 1, samples..samples + 9, 0..1] {
            let actual = decimated(&decimation, &signals, counted.clone()).unwrap();
            let expected = recursion(&decimation, &signals, counted);
            let difference = difference(&actual, &expected, &signals);
            assert!(difference < ROUNDING, "{samples} samples: {difference}");
        }
    }
}

/// The way back over the samples begins before the record has ended.
#[test]
fn a_record_of_any_length_is_filtered_as_a_whole() {
    for (order, factor) in [(8, 10), (1, 2), (4, 1)] {
        let decimation = ParallelDecimation::chebyshev1(order, 0.05, 0.8, factor).unwrap();
        let signals = random(9, 3, 60_003);
        for counted in [0..60_003, 31_000..33_000] {
            let [rows, differences] = with_differences(&decimation, &signals, counted.clone());
            let expected = recursion(&decimation, &signals, counted.clone());
            let error = difference(&rows, &expected, &signals);
            assert!(error < ROUNDING, "{order}: {error}");
            let mut filtered: Vec<f64> = signals.row(0).iter().copied().collect();
            decimation.filter(&mut filtered).unwrap();
            for (k, found) in decimation.kept_samples(counted).zip(differences.column(0).iter()) {
                if k > 0 && k + 1 < filtered.len() {
                    let error = found - (filtered[k + 1] - filtered[k - 1]);
                    assert!(error.abs() < ROUNDING * signals.row(0).amax(), "{order}: {error}");
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn differences_are_those_of_the_filtered_samples_next_to_the_kept_ones(
        seed in any::<u64>(), order in 1_usize..=12, cutoff_ratio in 0.5..0.95_f64,
        factor in 2_usize..=150, samples in 40_usize..2500, signals in 1_usize..=40,
        start in 0_usize..2500, length in 0_usize..3000,
    ) {
        let filtered = ParallelDecimation::chebyshev1(order, 0.05, cutoff_ratio, factor).unwrap();
        let signals = random(seed, signals, samples);
        let counted = start.min(samples)..start + length;
        for decimation in [filtered, ParallelDecimation::identity()] {
            let kept_samples: Vec<usize> =
                decimation.kept_samples(counted.clone()).filter(|&k| k < samples).collect();
            let [rows, differences] = with_differences(&decimation, &signals, counted.clone());
            prop_assert_eq!(&rows, &decimated(&decimation, &signals, counted.clone()).unwrap());
            for (s, signal) in signals.row_iter().enumerate() {
                let mut filtered: Vec<f64> = signal.iter().copied().collect();
                decimation.filter(&mut filtered).unwrap();
                for (row, &k) in kept_samples.iter().enumerate() {
                    if k > 0 && k + 1 < samples {
                        let expected = filtered[k + 1] - filtered[k - 1];
                        let error = (differences[(row, s)] - expected).abs() / signal.amax();
                        prop_assert!(error < ROUNDING, "row {row} of {s}: {error}");
                    }
                }
            }
        }
    }
}

#[test]
fn differences_without_a_filter_are_those_of_the_signal_up_to_its_ends() {
    let line = DMatrix::from_fn(1, 51, |_, k| 3.0 + 0.25 * k as f64);
    let [_, differences] = with_differences(&ParallelDecimation::identity(), &line, 0..51);
    assert_eq!(differences, DMatrix::from_element(51, 1, 0.5));
}

#[test]
fn a_signal_has_the_same_bits_whatever_the_others_are() {
    let decimation = ParallelDecimation::chebyshev1(8, 0.05, 0.8, 100).unwrap();
    let signals = random(5, 61, 3210);
    let all_signals = decimated(&decimation, &signals, 0..3210).unwrap();
    for (first, count) in [(0, 1), (7, 1), (60, 1), (3, 5), (20, 33)] {
        let some = signals.rows(first, count).into_owned();
        let some = decimated(&decimation, &some, 0..3210).unwrap();
        for (a, b) in some.iter().zip(all_signals.columns(first, count).iter()) {
            assert_eq!(a.to_bits(), b.to_bits(), "{count} signals from {first}");
        }
    }
}

#[test]
fn without_a_filter_the_counted_samples_stay_as_they_are() {
    let signals = random(6, 3, 50);
    let rows = decimated(&ParallelDecimation::identity(), &signals, 10..45).unwrap();
    assert_eq!(rows, signals.columns(10, 35).transpose());
    let rows = decimated(&ParallelDecimation::identity(), &signals, 40..60).unwrap();
    assert_eq!(rows.nrows(), 10);
}

#[test]
fn the_first_bad_sample_of_any_signal_is_named() {
    let decimation = ParallelDecimation::chebyshev1(8, 0.05, 0.8, 100).unwrap();
    for index in [0, 20, 100, 512, 999] {
        let mut signals = random(7, 9, 1000);
        signals[(8, 999)] = f64::INFINITY;
        signals[(4, index)] = f64::NAN;
        let refused = decimated(&decimation, &signals, 0..300);
        assert_eq!(refused, Err(SignalError::NotFinite { index }));
    }
    let refused = decimated(&decimation, &random(8, 2, 27), 0..27);
    assert_eq!(refused, Err(SignalError::TooShort { samples: 27, needed: 28 }));
    let refused = decimated(&decimation, &DMatrix::zeros(1, 0), 0..0);
    assert_eq!(refused, Err(SignalError::TooShort { samples: 0, needed: 28 }));
}
