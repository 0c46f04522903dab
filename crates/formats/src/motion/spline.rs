//! A periodic motion as a quintic spline, which has few coefficients and is cheap to evaluate.

use core::f64::consts::TAU;

use didim_identification::excitation::FourierSeries;

/// Minimum number of knots in a period of the highest frequency. The error of the spline is then
/// 1e-7 of the amplitude.
const KNOTS_PER_PERIOD: usize = 14;

/// Returns the coefficients of a uniform quintic B-spline through the motion, one list per joint,
/// beginning with the one centred at the start. Each harmonic of the coefficients is the harmonic
/// of the motion divided by the response of the spline, (66 + 52 cos θ + 2 cos 2θ)/120, where θ is
/// its phase from knot to knot.
pub(super) fn spline_coefficients(series: &FourierSeries) -> Vec<Vec<f64>> {
    let harmonics = series.joints.iter().map(|joint| joint.sine.len()).max().unwrap_or(0);
    let knots = KNOTS_PER_PERIOD * harmonics.max(1);
    let step = TAU / knots as f64;
    let joints = series.joints.iter().map(|joint| {
        (0..knots)
            .map(|i: usize| {
                let pairs = joint.sine.iter().zip(&joint.cosine).enumerate();
                let terms = pairs.map(|(k, (a, b))| {
                    let theta = (1.0 + k as f64) * step;
                    let response = (66.0 + 52.0 * theta.cos() + 2.0 * (2.0 * theta).cos()) / 120.0;
                    let (sin, cos) = (theta * i as f64).sin_cos();
                    (a * sin + b * cos) / response
                });
                joint.mean + terms.sum::<f64>()
            })
            .collect()
    });
    joints.collect()
}
