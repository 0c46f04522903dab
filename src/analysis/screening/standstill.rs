//! Detection of joints that never move in a recording, before any fit.

use core::ops::Range;
use didim_dynamics::robot::JointIndex;
use std::collections::BTreeSet;

use didim_formats::Measurement;

use crate::cell::RestCheck;

/// Returns the joints that do not move beyond their noise in any counted sample.
pub fn still_joints(parts: &[(&Measurement, Range<usize>)], check: RestCheck) -> Vec<JointIndex> {
    let axes = parts.first().map_or(0, |(measurement, _)| measurement.axes());
    (0..axes)
        .filter(|axis: &usize| {
            let part_list: Vec<&[f64]> = parts
                .iter()
                .filter_map(|(measurement, counted)| {
                    measurement.signals.position_rad.get(*axis)?.get(counted.clone())
                })
                .collect();
            is_still(&part_list, check)
        })
        .map(JointIndex::new)
        .collect()
}

fn is_still(parts: &[&[f64]], check: RestCheck) -> bool {
    let values_of_all = || parts.iter().flat_map(|piece| piece.iter());
    let mut values = BTreeSet::new();
    if values_of_all().all(|value| {
        values.insert(value.to_bits());
        values.len() <= check.flickering_values
    }) {
        return true;
    }
    let (low, high) =
        values_of_all().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    // White noise of variance σ² has second differences of variance 6 σ². Motion adds almost
    // nothing to them.
    let bends = || parts.iter().flat_map(|piece| piece.windows(3));
    let squares: f64 = bends().map(|of| (of[0] - 2.0 * of[1] + of[2]).powi(2)).sum();
    #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
    let count = bends().count() as f64;
    let rests = high - low <= check.noise_deviations * (squares / (6.0 * count)).sqrt();
    count > 0.0 && rests && high - low < check.most_range
}

#[cfg(test)]
mod tests {
    use super::*;
    use didim_dynamics::Signals;
    use didim_formats::Side;

    #[test]
    #[expect(clippy::cast_precision_loss, reason = "samples")]
    fn joints_that_rest_are_reported_from_those_that_move_slowly() {
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
            // A flickering 16-bit encoder.
            column(&|_, noise| ((0.3 + 1e-4 * noise) / 9.6e-5).round() * 9.6e-5),
            // A hundredth of a radian in 10 s, and the same with noise.
            column(&|t, _| 0.01 * (0.3 * t).sin()),
            column(&|t, noise| 0.01 * (0.3 * t).sin() + 1e-3 * noise),
            // Seven samples per turn.
            column(&|t, _| (500.0 * t * 0.94).sin()),
        ];
        let torque_nm = vec![vec![0.0; samples]; position_rad.len()];
        let signals =
            Signals { sample_rate_hz: 500.0, position_rad, torque_nm, reference_rad: None };
        let measurement = Measurement { side: Side::Joint, rate_unchecked: false, signals };
        assert_eq!(
            still_joints(&[(&measurement, 0..samples)], RestCheck::default()),
            [0, 1, 2].map(JointIndex::new)
        );
        assert_eq!(still_joints(&[], RestCheck::default()), []);
    }
}
