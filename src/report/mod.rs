//! What people look at: tables, plots in the terminal, and figures.

pub mod convergence;
pub mod estimate;
pub mod figure;
pub mod table;
pub mod terminal;

/// One joint's torque, measured and predicted, for a plot.
#[derive(Clone, Copy, Debug)]
pub struct TorquePanel<'a> {
    /// The joint's number, from 1.
    pub joint: usize,
    /// Time of each row \[s\].
    pub time_s: &'a [f64],
    /// Measured torque \[N·m\], filtered as the identification used it.
    pub measured_nm: &'a [f64],
    /// Torque that the identified model predicts \[N·m\].
    pub predicted_nm: &'a [f64],
    /// ‖measured − predicted‖ / ‖measured‖.
    pub relative_error: f64,
}

/// The extremes of several series together, widened to contain zero; `None` without finite values.
fn value_range<'a>(series: impl IntoIterator<Item = &'a [f64]>) -> Option<(f64, f64)> {
    let finite = series.into_iter().flatten().copied().filter(|v| v.is_finite());
    let (low, high) = finite.fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    (high > low).then_some((low, high))
}
