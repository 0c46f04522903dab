//! One panel of a figure: its size, the style of its curves, and the ticks of its axes.

pub(super) const PANEL_WIDTH: f64 = 400.0;
pub(super) const PANEL_HEIGHT: f64 = 190.0;
/// Margins around the curves of a panel: left for tick labels, top for the title.
pub(super) const PLOT_LEFT: f64 = 52.0;
pub(super) const PLOT_TOP: f64 = 30.0;
pub(super) const PLOT_RIGHT: f64 = 12.0;
pub(super) const PLOT_BOTTOM: f64 = 28.0;

/// Style of the panels. Their colours are those of the document that contains them.
pub(super) const CURVE_STYLE: &str = ".paper{fill:var(--paper)}text{fill:var(--ink);font:12px \
system-ui,sans-serif}.title{font-weight:600}.heading{font-size:17px;font-weight:600}\
    .tick{font-size:10.5px;opacity:.75}.grid{stroke:var(--faint);stroke-width:1}\
    path,.key{fill:none;stroke-linejoin:round}.measured{stroke:var(--measured);stroke-width:3}\
    .predicted{stroke:var(--predicted);stroke-width:1.1}.residual{stroke:var(--residual);\
    stroke-width:1}.sigmas{fill:var(--sigmas)}.downweighted{stroke:var(--ink);stroke-width:1.5}\
    circle{fill:var(--paper)}circle.filled{fill:var(--predicted)}";

/// Returns about `wanted` round numbers within `low..=high`, in steps of 1, 2 or 5 times a power of
/// ten.
pub(super) fn ticks(low: f64, high: f64, wanted: u32) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let rough = span / f64::from(wanted.max(1));
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|s| *s >= rough * 0.999)
        .unwrap_or(10.0 * power);
    let mut positions = Vec::new();
    let mut k = (low / step).ceil();
    while k * step <= high + 1e-9 * span && positions.len() < 50 {
        // The number is rounded to the decimals of the step, so that 0.30000000000000004 becomes
        // 0.3.
        positions.push((k * step * 1e9).round() / 1e9 + 0.0);
        k += 1.0;
    }
    positions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(-3.2, 9.9, 4), [0.0, 5.0]);
        assert_eq!(ticks(0.0, 0.7, 6), [0.0, 0.2, 0.4, 0.6]);
        assert!(ticks(1.0, 1.0, 4).is_empty() && ticks(0.0, f64::NAN, 4).is_empty());
    }
}
