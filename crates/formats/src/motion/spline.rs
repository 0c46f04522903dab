//! A periodic motion as a quintic spline: few numbers, and little to compute for each point.

use core::f64::consts::TAU;

use didim_identification::excitation::FourierSeries;

/// Knots in a period of the highest frequency, at least. The spline is then 1e-7 of an amplitude
/// off.
const KNOTS_PER_PERIOD: usize = 14;

/// The coefficients of a uniform quintic B-spline through the motion, one list per joint, from the
/// one that is centred at its begin: a harmonic of the coefficients is that of the motion over the
/// response (66 + 52 cos θ + 2 cos 2θ)/120 of the spline to it, θ being its phase from knot to
/// knot.
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
