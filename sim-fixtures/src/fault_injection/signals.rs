//! Faults of measured values.

use didim_dynamics::Signals;

use super::InjectedFault;
use super::action::{AxisSignal, SignalFault};

/// Returns a pseudo-random number from 0 to 1 that depends only on a seed and an index.
pub(super) fn uniform(seed: u64, place: usize) -> f64 {
    let mut x = seed.wrapping_add(place as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
}

impl InjectedFault {
    pub(super) fn corrupt_signals(&self, action: &SignalFault, signals: &mut Signals) {
        let rate_hz = signals.sample_rate_hz;
        match *action {
            SignalFault::Freeze { signal, axis } => {
                for series in selected_series(signals, signal, axis) {
                    self.replace_affected(series, |now, k| {
                        k.checked_sub(1).map_or(now[k], |last| now[last])
                    });
                }
            }
            SignalFault::Hold { signal, axis, length } => {
                self.of_before(signals, signal, axis, |before, k| before[k - k % length.max(1)]);
            }
            SignalFault::Delay { signal, axis, by } => {
                self.of_before(signals, signal, axis, |before, k| before[k.saturating_sub(by)]);
            }
            SignalFault::Swap { signal, axes: [one, other] } => {
                if signal != AxisSignal::Torque {
                    self.swap_axes(&mut signals.position_rad, one, other);
                }
                if signal != AxisSignal::Position {
                    self.swap_axes(&mut signals.torque_nm, one, other);
                }
            }
            SignalFault::Add { signal, axis, value } => {
                self.of_before(signals, signal, axis, |before, k| before[k] + value);
            }
            SignalFault::Scale { signal, axis, factor } => {
                self.of_before(signals, signal, axis, |before, k| before[k] * factor);
            }
            SignalFault::ScalePositive { axis, factor, sign } => {
                self.of_before(signals, AxisSignal::Torque, Some(axis), |before, k| {
                    before[k] * if before[k] * sign > 0.0 { factor } else { 1.0 }
                });
            }
            SignalFault::Saturate { axis, limit } => {
                let cut = |before: &[f64], k: usize| before[k].clamp(-limit, limit);
                self.of_before(signals, AxisSignal::Torque, Some(axis), cut);
            }
            SignalFault::LowPass { signal, axis, cutoff_hz } => {
                self.low_pass(signals, rate_hz, signal, axis, cutoff_hz);
            }
            SignalFault::Ripple { axis, amplitude } => {
                let angle = signals.position_rad[axis - 1].clone();
                let add = |before: &[f64], k: usize| before[k] + amplitude * angle[k].sin();
                self.of_before(signals, AxisSignal::Torque, Some(axis), add);
            }
            SignalFault::Noise { signal, axis, rms, seed } => {
                self.add_noise(signals, signal, axis, rms, seed);
            }
            SignalFault::Quantise { signal, axis, step } => {
                self.of_before(signals, signal, axis, |now, k| step * (now[k] / step).round());
            }
            SignalFault::Wrap { axis, range, offset } => {
                self.of_before(signals, AxisSignal::Position, Some(axis), |before, k| {
                    let value = before[k] + offset;
                    value - range * (value / range + 0.5).floor()
                });
            }
            SignalFault::Resample { ratio } => {
                for series in all_series(signals) {
                    *series = resample_linear(series, ratio);
                }
            }
            SignalFault::Repeat => {
                for series in all_series(signals) {
                    let piece: Vec<f64> = self.affected_values(series).collect();
                    let end = self.from + self.cycles.unwrap_or(series.len());
                    let end = end.min(series.len());
                    series.splice(end..end, piece);
                }
            }
            SignalFault::Cut => {
                for series in all_series(signals) {
                    let mut cycle = 0..;
                    series.retain(|_| !cycle.next().is_some_and(|k| self.affects_cycle(k)));
                }
            }
        }
    }

    /// Swaps two axes, numbered from 1, in the affected cycles.
    fn swap_axes(&self, series: &mut [Vec<f64>], one: usize, other: usize) {
        let (Some(a), Some(b)) = (series.get(one - 1), series.get(other - 1)) else { return };
        let (mut a, mut b) = (a.clone(), b.clone());
        for k in (0..a.len()).filter(|k| self.affects_cycle(*k)) {
            std::mem::swap(&mut a[k], &mut b[k]);
        }
        (series[one - 1], series[other - 1]) = (a, b);
    }

    /// Filters a series by a first-order low-pass filter.
    fn low_pass(
        &self,
        signals: &mut Signals,
        rate_hz: f64,
        signal: AxisSignal,
        axis: Option<usize>,
        cutoff_hz: f64,
    ) {
        let share = 1.0 - (-core::f64::consts::TAU * cutoff_hz / rate_hz).exp();
        for series in selected_series(signals, signal, axis) {
            self.replace_affected(series, |now, k| {
                k.checked_sub(1).map_or(now[k], |last| now[last] + share * (now[k] - now[last]))
            });
        }
    }

    /// Adds noise with a uniform distribution and this root mean square.
    fn add_noise(
        &self,
        signals: &mut Signals,
        signal: AxisSignal,
        axis: Option<usize>,
        rms: f64,
        seed: u64,
    ) {
        for (number, series) in selected_series(signals, signal, axis).enumerate() {
            let seed = seed.wrapping_mul(31).wrapping_add(number as u64) << 24;
            let noise = |k| rms * 12.0_f64.sqrt() * (uniform(seed, k) - 0.5);
            self.replace_affected(series, |now, k| now[k] + noise(k));
        }
    }

    /// Returns the values of the affected cycles.
    fn affected_values<'a>(&'a self, series: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        (0..).zip(series).filter(|(k, _)| self.affects_cycle(*k)).map(|(_, value)| *value)
    }

    /// Replaces the values of the affected cycles in order. Each new value is computed from the
    /// series with all earlier replacements.
    fn replace_affected(&self, series: &mut [f64], new: impl Fn(&[f64], usize) -> f64) {
        for k in (0..series.len()).filter(|k| self.affects_cycle(*k)) {
            series[k] = new(series, k);
        }
    }

    /// Replaces the values of the affected cycles. Each new value is computed from the original
    /// series.
    fn of_before(
        &self,
        signals: &mut Signals,
        signal: AxisSignal,
        axis: Option<usize>,
        new: impl Fn(&[f64], usize) -> f64,
    ) {
        for series in selected_series(signals, signal, axis) {
            let before = series.clone();
            self.replace_affected(series, |_, k| new(&before, k));
        }
    }
}

/// Returns the series of a signal for one axis, or for all axes without an axis.
fn selected_series(
    signals: &mut Signals,
    signal: AxisSignal,
    axis: Option<usize>,
) -> impl Iterator<Item = &mut Vec<f64>> {
    let of_axis = move |(number, series)| axis.is_none_or(|axis| axis == number).then_some(series);
    let positions = (1..).zip(&mut signals.position_rad).filter_map(of_axis);
    let torques = (1..).zip(&mut signals.torque_nm).filter_map(of_axis);
    let (position, torque) = (signal != AxisSignal::Torque, signal != AxisSignal::Position);
    positions.filter(move |_| position).chain(torques.filter(move |_| torque))
}

/// Returns all series of the signals.
fn all_series(signals: &mut Signals) -> impl Iterator<Item = &mut Vec<f64>> {
    let reference = signals.reference_rad.iter_mut().flatten();
    signals.position_rad.iter_mut().chain(&mut signals.torque_nm).chain(reference)
}

/// Returns a series resampled to `ratio` times its number of samples, by linear interpolation.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the series")]
fn resample_linear(series: &[f64], ratio: f64) -> Vec<f64> {
    let Some(last) = series.len().checked_sub(1) else { return Vec::new() };
    (0..(series.len() as f64 * ratio) as usize)
        .map(|k: usize| {
            let place = (k as f64 / ratio).min(last as f64);
            let before = place as usize;
            let next = series[(before + 1).min(last)];
            series[before] + (place - before as f64) * (next - series[before])
        })
        .collect()
}
