//! Which joints never move in a recording, before anything is fitted to it.

use core::ops::Range;
use std::collections::BTreeSet;

use didim_formats::Measurement;

/// What keeps within so many standard deviations of its noise rests: ten million samples of white noise do.
const NOISE: f64 = 12.0;
/// Noise is never so large: motion that is sampled a few times a turn is no noise \[rad or m\].
const LARGEST: f64 = 0.05;
/// An encoder that flickers at rest has no more values than that.
const VALUES: usize = 4;

/// The joints, from 1, that do not move beyond their noise in any of the samples that count.
pub fn still_joints(pieces: &[(&Measurement, Range<usize>)]) -> Vec<usize> {
    let axes = pieces.first().map_or(0, |(measurement, _)| measurement.axes());
    let rests = |axis: &usize| {
        let pieces: Vec<&[f64]> = pieces
            .iter()
            .filter_map(|(measurement, counted)| {
                measurement.signals.position_rad.get(*axis)?.get(counted.clone())
            })
            .collect();
        is_still(&pieces)
    };
    (0..axes).filter(rests).map(|axis| axis + 1).collect()
}

fn is_still(pieces: &[&[f64]]) -> bool {
    let all = || pieces.iter().flat_map(|piece| piece.iter());
    let mut values = BTreeSet::new();
    if all().all(|value| {
        values.insert(value.to_bits());
        values.len() <= VALUES
    }) {
        return true;
    }
    let (low, high) =
        all().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    // Of white noise with variance σ² a second difference has 6 σ², and motion next to nothing.
    let bends = || pieces.iter().flat_map(|piece| piece.windows(3));
    let squares: f64 = bends().map(|of| (of[0] - 2.0 * of[1] + of[2]).powi(2)).sum();
    #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
    let count = bends().count() as f64;
    let rests = high - low <= NOISE * (squares / (6.0 * count)).sqrt();
    count > 0.0 && rests && high - low < LARGEST
}

#[cfg(test)]
mod tests {
    use super::*;
    use didim_core::identification::Signals;
    use didim_formats::Side;

    #[test]
    #[expect(clippy::cast_precision_loss, reason = "samples")]
    fn joints_that_rest_are_told_from_those_that_move_slowly() {
        // Uniform noise by a linear congruential generator.
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / (1 << 24) as f64 - 0.5
        };
        let samples = 5000;
        let mut column = |of: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..samples).map(|k| of(k as f64 / 500.0, noise())).collect()
        };
        let position_rad = vec![
            column(&|_, _| 0.3),
            column(&|_, noise| 0.3 + 1e-4 * noise),
            // An encoder of 16 bit that flickers.
            column(&|_, noise| ((0.3 + 1e-4 * noise) / 9.6e-5).round() * 9.6e-5),
            // A hundredth of a radian in 10 s, and the same with noise.
            column(&|t, _| 0.01 * (0.3 * t).sin()),
            column(&|t, noise| 0.01 * (0.3 * t).sin() + 1e-3 * noise),
            // Seven samples a turn.
            column(&|t, _| (500.0 * t * 0.94).sin()),
        ];
        let torque_nm = vec![vec![0.0; samples]; position_rad.len()];
        let signals =
            Signals { sample_rate_hz: 500.0, position_rad, torque_nm, reference_rad: None };
        let measurement = Measurement { side: Side::Joint, rate_unchecked: false, signals };
        assert_eq!(still_joints(&[(&measurement, 0..samples)]), [1, 2, 3]);
        assert_eq!(still_joints(&[]), [0; 0]);
    }
}
