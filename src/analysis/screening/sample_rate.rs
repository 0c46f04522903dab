//! Check of the sample rate against the cell. Every identification uses this check, from live data
//! or from a file.
//!
//! The check uses the time stamps of the samples. Stamps jitter, so a single interval is not
//! conclusive. The slope of the stamps over the sequence numbers is. A burst of the adapter or a
//! busy machine may delay a stamp, but no stamp is early. The samples are divided into blocks, and
//! only the stamp with the smallest delay of each block is used (as in Moon, Skelly and Towsley,
//! Estimation and Removal of Clock Skew from Network Delay Measurements, INFOCOM 1999). The slope
//! is the median of the slopes of all pairs of these stamps (Theil 1950, Sen 1968). A block in
//! which all stamps are delayed hardly affects this median. The scatter about the line gives the
//! standard uncertainty of the slope.

use didim_drivers::layout::{CompiledLayout, CyclesBy};
use didim_dynamics::JointSample;
use didim_formats::{Measurement, TimeLimits};

use crate::cell::RateCheck;

/// The rate of the samples differs from the layout or cannot be determined.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RateError {
    /// The stamps give a rate that differs from the layout's.
    #[error(
        "the time stamps give {found_hz:.2} ± {uncertainty_hz:.2} samples/s, the layout \
        {expected_hz:.2}: accelerations and inertias would be wrong by {:.2} %. The fit would not \
        show it. Correct rate_hz (or period_us) in [bus.layout], or {} if the stamps are wrong",
        100.0 * ((found_hz / expected_hz).powi(2) - 1.0).abs(),
        without_stamps(*frames_may_count)
    )]
    Wrong {
        /// Rate from the stamps \[Hz\].
        found_hz: f64,
        /// Its standard uncertainty \[Hz\].
        uncertainty_hz: f64,
        /// Rate from the layout \[Hz\].
        expected_hz: f64,
        /// True if the layout can count frames instead of using stamps.
        frames_may_count: bool,
    },
    /// The stamps are too uneven to determine the rate.
    #[error(
        "the time stamps are too uneven to determine the rate: they give {found_hz:.2} ± \
         {uncertainty_hz:.2} samples/s, the layout {expected_hz:.2}; use a longer window \
         (window.min_s), or {} if rate_hz is certain",
        without_stamps(*frames_may_count)
    )]
    Unknown {
        /// Rate from the stamps \[Hz\].
        found_hz: f64,
        /// Its standard uncertainty \[Hz\].
        uncertainty_hz: f64,
        /// Rate from the layout \[Hz\].
        expected_hz: f64,
        /// True if the layout can count frames instead of using stamps.
        frames_may_count: bool,
    },
}

/// Returns the remedy for stamps that do not show the times of the bus cycles.
fn without_stamps(frames_may_count: bool) -> &'static str {
    if frames_may_count {
        "set cycles_by = \"frames\" in [bus.layout]"
    } else {
        "use an adapter that stamps its frames (signals that are valid at the arrival of theirs \
        need stamps)"
    }
}

/// Creates a measurement from consecutive samples of a bus, and checks their rate. All data that
/// are identified from a bus, live or recorded, use this function.
///
/// # Errors
/// [`RateError`] if the layout uses the stamps and they give another rate than the layout.
pub(crate) fn checked_measurement(
    samples: &[JointSample],
    layout: &CompiledLayout,
    options: RateCheck,
) -> Result<Measurement, RateError> {
    let rate_unchecked = check_rate(samples, layout, options)?;
    let measurement = Measurement::from_samples(samples, layout.axes(), 1e9 / layout.period_ns());
    Ok(Measurement { rate_unchecked, ..measurement })
}

/// Checks the rate of samples, some of which may be missing. Returns true if the layout counts
/// frames instead of using stamps, so that the rate is unchecked.
///
/// # Errors
/// [`RateError`] if the layout uses the stamps and they give another rate than the layout.
pub(crate) fn check_rate(
    samples: &[JointSample],
    layout: &CompiledLayout,
    options: RateCheck,
) -> Result<bool, RateError> {
    let rate_unchecked = layout.cycles_by() == CyclesBy::Frames;
    if !rate_unchecked {
        check(samples, 1e9 / layout.period_ns(), !layout.at_arrival(), options)?;
    }
    Ok(rate_unchecked)
}

/// Checks the rate of samples against `expected_hz`, by their stamps and sequence numbers.
///
/// # Errors
/// [`RateError`] if the rate is significantly wrong, or if its uncertainty is too large for a
/// check.
fn check(
    samples: &[JointSample],
    expected_hz: f64,
    frames_may_count: bool,
    options: RateCheck,
) -> Result<(), RateError> {
    if samples.len() < options.block_count {
        return Ok(());
    }
    let (slow, uncertainty) =
        slope(&least_late(samples, expected_hz, options.block_count), options);
    let found_hz = expected_hz / (1.0 + slow);
    let uncertainty_hz = expected_hz * uncertainty;
    let off = (found_hz / expected_hz - 1.0).abs();
    if off > TimeLimits::DEFAULT.same_rate + options.coverage_deviations * uncertainty {
        return Err(RateError::Wrong { found_hz, uncertainty_hz, expected_hz, frames_may_count });
    }
    // The condition also covers NaN, which missing stamps give.
    if uncertainty.is_nan() || uncertainty > options.most_uncertainty {
        return Err(RateError::Unknown { found_hz, uncertainty_hz, expected_hz, frames_may_count });
    }
    Ok(())
}

/// Returns the sample with the smallest delay of each block: its nominal time and its delay \[s\],
/// both relative to the first sample.
fn least_late(samples: &[JointSample], expected_hz: f64, blocks: usize) -> Vec<(f64, f64)> {
    let Some(first) = samples.first() else { return Vec::new() };
    let blocks = (0..blocks).filter_map(|block| {
        let start = block * samples.len() / blocks;
        let end = (block + 1) * samples.len() / blocks;
        let block_samples = samples.get(start..end)?.iter().map(|sample: &JointSample| {
            let nominal_s = sample.sequence.saturating_sub(first.sequence) as f64 / expected_hz;
            // Signed nanoseconds, so that a stamp before the first one gives a small negative value
            // and not a huge positive one.
            let elapsed_ns = i128::from(sample.stamp_ns) - i128::from(first.stamp_ns);
            (nominal_s, 1e-9 * elapsed_ns as f64 - nominal_s)
        });
        block_samples.min_by(|a, b| a.1.total_cmp(&b.1))
    });
    blocks.collect()
}

/// Returns the slope of the second values over the first, and its standard uncertainty.
fn slope(points: &[(f64, f64)], options: RateCheck) -> (f64, f64) {
    let pairs = points.iter().enumerate().flat_map(|(k, one)| {
        points[k + 1..].iter().map(move |other| (other.1 - one.1) / (other.0 - one.0))
    });
    let slope = quantile(pairs.collect(), 0.5);
    let residuals: Vec<f64> = points.iter().map(|(x, y)| y - slope * x).collect();
    let middle = quantile(residuals.clone(), 0.5);
    let deviations = residuals.iter().map(|e| (e - middle).abs()).collect();
    let scatter = quantile(deviations, options.share_within) / options.deviations_within;
    let mean = points.iter().map(|(x, _)| x).sum::<f64>() / points.len() as f64;
    let spread = points.iter().map(|(x, _)| (x - mean).powi(2)).sum::<f64>().sqrt();
    (slope, scatter / spread)
}

/// Returns the quantile of the values at the given share.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length"
    )]
    let rank = (share * values.len() as f64) as usize;
    values.get(rank).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "stamps of seconds fit")]
mod tests {
    use super::*;

    /// A time in 2026, like the stamps of logs.
    const EPOCH_NS: f64 = 1.79e18;

    /// Creates `seconds` of samples of a 500 Hz bus. Its rate has the relative error `off`, and its
    /// stamps are `late_s(k, time)` late.
    fn samples(seconds: f64, off: f64, late_s: impl Fn(u64, f64) -> f64) -> Vec<JointSample> {
        let cycles = (seconds * 500.0) as u64;
        (0..cycles)
            .map(|k: u64| {
                let time_s = k as f64 / (500.0 * (1.0 + off));
                let stamp_ns = EPOCH_NS as u64 + (1e9 * (time_s + late_s(k, time_s))) as u64;
                JointSample::zero(7_000 + k, stamp_ns)
            })
            .collect()
    }

    fn random(k: u64) -> f64 {
        let mut x = k.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// Lateness of stamps: none, logging in microseconds, jitter of an adapter, a driver that polls
    /// every millisecond, and a machine that stalls for 200 ms every 1.7 s.
    fn stamping(name: &str) -> Box<dyn Fn(u64, f64) -> f64> {
        match name {
            "exact" => Box::new(|_, _| 0.0),
            "microseconds" => Box::new(|_, at| 1e-6 * (1e6 * at).ceil() - at),
            "jitter" => Box::new(|k, _| 1e-3 * random(k)),
            "both ways" => Box::new(|k, _| 1e-4 * (random(k) + random(k + 999_999))),
            "polled" => Box::new(|k, at| {
                let sent = at + 1e-4 * random(k);
                1e-3 * (1e3 * sent).ceil() - at
            }),
            "bursts" => Box::new(|_, at| (0.2 - at % 1.7).max(0.0)),
            _ => panic!("{name}"),
        }
    }

    const STAMPINGS: [&str; 6] =
        ["exact", "microseconds", "jitter", "both ways", "polled", "bursts"];

    #[test]
    fn crystals_pass_and_a_thousandth_does_not() {
        for name in STAMPINGS {
            for seconds in [1.5, 3.0, 8.0, 60.0] {
                for off in [-2e-4, -1e-4, 0.0, 1e-4, 2e-4] {
                    let outcome = check(
                        &samples(seconds, off, stamping(name)),
                        500.0,
                        true,
                        RateCheck::default(),
                    );
                    assert_eq!(outcome, Ok(()), "{name} {seconds} s {off}");
                }
                for off in [-9e-3, -1e-3, 1e-3, 5e-3, 1e-2, 0.05] {
                    let outcome = check(
                        &samples(seconds, off, stamping(name)),
                        500.0,
                        true,
                        RateCheck::default(),
                    );
                    assert!(outcome.is_err(), "{name} {seconds} s {off}: {outcome:?}");
                }
            }
        }
    }

    #[test]
    fn the_error_has_both_rates_and_the_key() {
        let Err(error) =
            check(&samples(3.0, -9e-3, stamping("jitter")), 500.0, true, RateCheck::default())
        else {
            panic!()
        };
        let RateError::Wrong { found_hz, uncertainty_hz, .. } = error else { panic!("{error}") };
        assert!((found_hz - 495.5).abs() < 0.05 && uncertainty_hz < 0.02, "{error}");
        let text = error.to_string();
        for part in ["495.5", "500.00", "rate_hz", "period_us", "cycles_by", "1.79 %"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn frames_are_not_advised_where_signals_need_stamps() {
        let late = |k: u64, _: f64| 0.5 * (3.0 * random(k / 250)).floor();
        for samples in [samples(3.0, -9e-3, stamping("jitter")), samples(4.0, 0.0, late)] {
            let text = |counts| {
                check(&samples, 500.0, counts, RateCheck::default()).unwrap_err().to_string()
            };
            assert!(text(true).contains("set cycles_by = \"frames\""), "{}", text(true));
            assert!(!text(false).contains("cycles_by"), "{}", text(false));
            assert!(text(false).contains("an adapter that stamps its frames"));
        }
    }

    #[test]
    fn stamps_that_show_nothing_are_not_taken_for_the_rate() {
        // Lateness of up to a second and a half, in steps of half a second, one burst at a time.
        let outcome = check(
            &samples(4.0, 0.0, |k, _| 0.5 * (3.0 * random(k / 250)).floor()),
            500.0,
            true,
            RateCheck::default(),
        );
        assert!(outcome.is_err(), "{outcome:?}");
        // A window with fewer samples than blocks is not checked.
        assert_eq!(
            check(&samples(0.02, 0.5, stamping("exact")), 500.0, true, RateCheck::default()),
            Ok(())
        );
    }
}
