//! Whether samples come at the rate that the cell states: the one check of it, for whatever is
//! identified, live or from a file.
//!
//! The samples' own stamps tell. A single interval says little, for stamps jitter; the slope of the
//! stamps over the sequence numbers says much. A frame may be late, by a burst of an adapter or a busy
//! machine, and is never early: so of each of some blocks only the stamp that is the least late counts
//! (as in Moon, Skelly and Towsley, Estimation and Removal of Clock Skew from Network Delay
//! Measurements, INFOCOM 1999). The slope through these is the median of the slopes of all pairs
//! (Theil 1950, Sen 1968), which a block that is late as a whole does not bend, and their scatter
//! about it gives its standard uncertainty.

use didim_core::JointSample;
use didim_drivers::layout::{CompiledLayout, CyclesBy};
use didim_formats::{Measurement, RATE_TOLERANCE};

/// Standard uncertainties by which an estimate has to be beyond the tolerance to be called wrong.
const COVERAGE: f64 = 3.0;

/// The largest standard uncertainty of the rate, as a share of it, with which it counts as checked.
/// A rate that is off by 1e-3 is then four of them from what passes.
const UNCERTAINTY: f64 = 1e-4;

/// Parts into which the samples are divided. Fewer samples than this identify nothing.
const BLOCKS: usize = 16;

/// The share of the blocks within the scatter, and how many standard deviations of normal noise that is:
/// nearly as many blocks may be off as the median of the slopes bears.
const WITHIN: (f64, f64) = (0.75, 1.15);

/// The rate of the samples is not that of the layout, or cannot be told.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RateError {
    /// The stamps tell another rate.
    #[error(
        "the time stamps give {found_hz:.2} ± {uncertainty_hz:.2} samples/s, the layout \
         {expected_hz:.2}: accelerations and inertias would be wrong by {:.2} %, and the fit would \
         not show it; correct rate_hz (or period_us) in [bus.layout], or {} if the stamps are wrong",
        100.0 * ((found_hz / expected_hz).powi(2) - 1.0).abs(),
        without_stamps(*frames_may_count)
    )]
    Wrong {
        /// What the stamps tell \[Hz\].
        found_hz: f64,
        /// The standard uncertainty of it \[Hz\].
        uncertainty_hz: f64,
        /// What the layout tells \[Hz\].
        expected_hz: f64,
        /// Whether the layout can do without stamps.
        frames_may_count: bool,
    },
    /// The stamps are too uneven to tell the rate.
    #[error(
        "the time stamps are too uneven to determine the rate: they give {found_hz:.2} ± \
         {uncertainty_hz:.2} samples/s, the layout {expected_hz:.2}; use a longer window \
         (window.min_s), or {} if rate_hz is certain",
        without_stamps(*frames_may_count)
    )]
    Unknown {
        /// What the stamps tell \[Hz\].
        found_hz: f64,
        /// The standard uncertainty of it \[Hz\].
        uncertainty_hz: f64,
        /// What the layout tells \[Hz\].
        expected_hz: f64,
        /// Whether the layout can do without stamps.
        frames_may_count: bool,
    },
}

/// What helps where the stamps are not those of the cycles.
fn without_stamps(frames_may_count: bool) -> &'static str {
    if frames_may_count {
        "set cycles_by = \"frames\" in [bus.layout]"
    } else {
        "use an adapter that stamps its frames (signals that are valid at the arrival of theirs need stamps)"
    }
}

/// The measurement that consecutive samples of a bus are. Whatever is identified from a bus, live or
/// recorded, is made here, so that its rate is checked.
///
/// # Errors
/// [`RateError`]: the stamps tell another rate than the layout, and they count.
pub(super) fn measurement(
    samples: &[JointSample],
    layout: &CompiledLayout,
) -> Result<Measurement, RateError> {
    let rate_unchecked = check_rate(samples, layout)?;
    let measurement = Measurement::from_samples(samples, layout.axes(), 1e9 / layout.period_ns());
    Ok(Measurement { rate_unchecked, ..measurement })
}

/// Whether the rate of samples, between which some may be missing, is not to be checked: the frames count.
///
/// # Errors
/// [`RateError`]: the stamps tell another rate than the layout, and they count.
pub(super) fn check_rate(
    samples: &[JointSample],
    layout: &CompiledLayout,
) -> Result<bool, RateError> {
    let rate_unchecked = layout.cycles_by() == CyclesBy::Frames;
    if !rate_unchecked {
        check(samples, 1e9 / layout.period_ns(), !layout.at_arrival())?;
    }
    Ok(rate_unchecked)
}

/// Checks the rate of samples, by their stamps and sequence numbers, against `expected_hz`.
///
/// # Errors
/// [`RateError`] where it is wrong for certain, or nothing is certain.
fn check(
    samples: &[JointSample],
    expected_hz: f64,
    frames_may_count: bool,
) -> Result<(), RateError> {
    if samples.len() < BLOCKS {
        return Ok(());
    }
    let (slow, uncertainty) = slope(&least_late(samples, expected_hz));
    let found_hz = expected_hz / (1.0 + slow);
    let uncertainty_hz = expected_hz * uncertainty;
    let off = (found_hz / expected_hz - 1.0).abs();
    if off > RATE_TOLERANCE + COVERAGE * uncertainty {
        return Err(RateError::Wrong { found_hz, uncertainty_hz, expected_hz, frames_may_count });
    }
    // Not a number either, where the stamps are none.
    if uncertainty.is_nan() || uncertainty > UNCERTAINTY {
        return Err(RateError::Unknown { found_hz, uncertainty_hz, expected_hz, frames_may_count });
    }
    Ok(())
}

/// Of each block the sample that is the least late: its nominal time and how late it is \[s\], both from
/// the first sample on.
fn least_late(samples: &[JointSample], expected_hz: f64) -> Vec<(f64, f64)> {
    let Some(first) = samples.first() else { return Vec::new() };
    let lateness = |sample: &JointSample| {
        let nominal_s = sample.sequence.saturating_sub(first.sequence) as f64 / expected_hz;
        // Of signed nanoseconds, so that a stamp before the first one is early and not enormous.
        let elapsed_ns = i128::from(sample.stamp_ns) - i128::from(first.stamp_ns);
        (nominal_s, 1e-9 * elapsed_ns as f64 - nominal_s)
    };
    let blocks = (0..BLOCKS).filter_map(|block| {
        let from = block * samples.len() / BLOCKS;
        let to = (block + 1) * samples.len() / BLOCKS;
        let all = samples.get(from..to)?.iter().map(lateness);
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    });
    blocks.collect()
}

/// The slope of the second over the first, and its standard uncertainty.
fn slope(points: &[(f64, f64)]) -> (f64, f64) {
    let pairs = points.iter().enumerate().flat_map(|(k, one)| {
        points[k + 1..].iter().map(move |other| (other.1 - one.1) / (other.0 - one.0))
    });
    let slope = quantile(pairs.collect(), 0.5);
    let residuals: Vec<f64> = points.iter().map(|(x, y)| y - slope * x).collect();
    let middle = quantile(residuals.clone(), 0.5);
    let deviations = residuals.iter().map(|e| (e - middle).abs()).collect();
    let scatter = quantile(deviations, WITHIN.0) / WITHIN.1;
    let mean = points.iter().map(|(x, _)| x).sum::<f64>() / points.len() as f64;
    let spread = points.iter().map(|(x, _)| (x - mean).powi(2)).sum::<f64>().sqrt();
    (slope, scatter / spread)
}

/// The value above a share of all.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length"
    )]
    let at = (share * values.len() as f64) as usize;
    values.get(at).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "stamps of seconds fit")]
mod tests {
    use super::*;

    /// Somewhere in 2026, as stamps of logs are.
    const EPOCH_NS: f64 = 1.79e18;

    /// `seconds` of a bus of 500 Hz whose rate is off by `off`, stamped `late_s(k, time)` late.
    fn samples(seconds: f64, off: f64, late_s: impl Fn(u64, f64) -> f64) -> Vec<JointSample> {
        let cycles = (seconds * 500.0) as u64;
        let sample = |k: u64| {
            let time_s = k as f64 / (500.0 * (1.0 + off));
            let stamp_ns = EPOCH_NS as u64 + (1e9 * (time_s + late_s(k, time_s))) as u64;
            JointSample::zero(7_000 + k, stamp_ns)
        };
        (0..cycles).map(sample).collect()
    }

    fn random(k: u64) -> f64 {
        let mut x = k.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// What stamps do: none of it, logged in microseconds, an adapter's jitter, a driver that polls
    /// every millisecond, and a machine that stands still for 200 ms every 1.7 s.
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
                    let found = check(&samples(seconds, off, stamping(name)), 500.0, true);
                    assert_eq!(found, Ok(()), "{name} {seconds} s {off}");
                }
                for off in [-9e-3, -1e-3, 1e-3, 5e-3, 1e-2, 0.05] {
                    let found = check(&samples(seconds, off, stamping(name)), 500.0, true);
                    assert!(found.is_err(), "{name} {seconds} s {off}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn the_error_has_both_rates_and_the_key() {
        let Err(error) = check(&samples(3.0, -9e-3, stamping("jitter")), 500.0, true) else {
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
            let text = |counts| check(&samples, 500.0, counts).unwrap_err().to_string();
            assert!(text(true).contains("set cycles_by = \"frames\""), "{}", text(true));
            assert!(!text(false).contains("cycles_by"), "{}", text(false));
            assert!(text(false).contains("an adapter that stamps its frames"));
        }
    }

    #[test]
    fn stamps_that_tell_nothing_are_not_taken_for_the_rate() {
        // Lateness of up to a second and a half, in steps of half a second: a burst at a time.
        let found =
            check(&samples(4.0, 0.0, |k, _| 0.5 * (3.0 * random(k / 250)).floor()), 500.0, true);
        assert!(found.is_err(), "{found:?}");
        // Beginning and end of another window are not compared.
        assert_eq!(check(&samples(0.02, 0.5, stamping("exact")), 500.0, true), Ok(()));
    }
}
