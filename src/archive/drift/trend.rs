//! A straight line through the estimates of a parameter over time.

/// A weighted straight line: value(t) = `at_mean` + `slope`·(t − `mean_time`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trend {
    /// Number of points: days with results.
    pub points: usize,
    /// Slope, in value units per time unit.
    pub slope: f64,
    /// Standard deviation of the slope.
    pub slope_deviation: f64,
    /// Earliest and latest time.
    pub span: (f64, f64),
    /// Weighted mean of the times.
    pub mean_time: f64,
    /// Value of the line at `mean_time`.
    pub at_mean: f64,
    /// Σ ((value − line) / σ)².
    pub chi_squared: f64,
    /// √(χ²/(n − 2)), but at least 1: ratio of the points' scatter to their σ. `slope_deviation`
    /// includes it as a factor.
    pub scatter: f64,
}

/// Fits the line to (time, value, σ) with the weights 1/σ².
///
/// slope = Σ w (t − t̄)(v − v̄) / Σ w (t − t̄)², σ_slope = s / √(Σ w (t − t̄)²), with the scale
/// factor s = max(1, √(χ²/(n − 2))) of the Particle Data Group (Review of Particle Physics,
/// introduction, 5.2.2). The factor includes day-to-day effects other than noise, such as
/// temperature.
///
/// Returns `None` for fewer than three points, if all times are equal, if a number is NaN, or if a
/// σ is not positive.
pub fn trend(points: &[(f64, f64, f64)]) -> Option<Trend> {
    let usable = |&(time, value, sigma): &(f64, f64, f64)| {
        time.is_finite() && value.is_finite() && sigma.is_finite() && sigma > 0.0
    };
    if points.len() < 3 || !points.iter().all(usable) {
        return None;
    }
    let weighted = |value: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|&(time, of, sigma)| value(time, of) / (sigma * sigma)).sum()
    };
    let weight = weighted(&|_, _| 1.0);
    let mean_time = weighted(&|time, _| time) / weight;
    let at_mean = weighted(&|_, value| value) / weight;
    let spread = weighted(&|time, _| (time - mean_time).powi(2));
    let slope = weighted(&|time, value| (time - mean_time) * (value - at_mean)) / spread;
    let line = |time: f64| at_mean + slope * (time - mean_time);
    let chi_squared = weighted(&|time, value| (value - line(time)).powi(2));
    #[expect(clippy::cast_precision_loss, reason = "a few hundred days")]
    let scatter = (chi_squared / (points.len() - 2) as f64).sqrt().max(1.0);
    let slope_deviation = scatter / spread.sqrt();
    let is_finite = slope.is_finite() && slope_deviation.is_finite();
    let times = points.iter().map(|(time, ..)| *time);
    is_finite.then(|| Trend {
        points: points.len(),
        slope,
        slope_deviation,
        span: times.fold((f64::MAX, f64::MIN), |(first, last), t| (first.min(t), last.max(t))),
        mean_time,
        at_mean,
        chi_squared,
        scatter,
    })
}
