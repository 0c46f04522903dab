//! Autocorrelations of the residuals of every method as one self-contained SVG file, as in the
//! paper's Figures 1 to 3.

use std::fmt::Write as _;

use didim_identification::identification::Fit;
use didim_identification::regression::autocorrelation;

use super::view::View;
use didim::text::escape;

const PANEL_WIDTH: f64 = 150.0;
const PANEL_HEIGHT: f64 = 84.0;
/// Free space around the curves of a panel, on each side.
const CURVE_MARGIN: f64 = 6.0;
/// Width of the method names on the left of the panels.
const LABEL_WIDTH: f64 = 112.0;
/// Height of the heading, its explanation and the joint names.
const HEADER_HEIGHT: f64 = 76.0;
/// Autocorrelation at the lower end of a panel; `AXIS_HIGH` is the autocorrelation at its upper
/// end.
const AXIS_LOW: f64 = -0.5;
const AXIS_HIGH: f64 = 1.0;
/// Half-width of the band in standard deviations, as in the paper.
const BAND_DEVIATIONS: f64 = 2.0;

/// The colours follow the reader's light or dark setting; a printer gets the light colours.
const STYLE: &str = "svg{--paper:#fff;--ink:#1d2530;--faint:#d9dee5;--band:#d6e4f0;--stem:#33658f}\
    text{fill:var(--ink);font:12px system-ui,sans-serif}.paper{fill:var(--paper)}\
    .heading{font-size:17px;font-weight:600}.title{font-weight:600}.faint{opacity:.75}\
    .middle{text-anchor:middle}.frame{fill:none;stroke:var(--faint)}.band{fill:var(--band)}\
    .axis{stroke:var(--ink);stroke-opacity:.5}.stem{stroke:var(--stem);stroke-width:2}\
    @media screen and (prefers-color-scheme:dark){svg{--paper:#14181d;--ink:#e4e8ed;\
    --faint:#333c46;--band:#24384c;--stem:#82b1d8}}";

/// Draws a row of panels per method with a result, and a panel per joint. Each panel shows the
/// autocorrelation of the residuals of the method's own equation over the lag in rows. The band is
/// the 2 σ interval of white noise after the decimation filter, or of unfiltered white noise if
/// nothing was decimated.
pub fn autocorrelation_figure(view: &View<'_>) -> String {
    let fits: Vec<_> = (view.comparison.methods.iter())
        .filter_map(|of| Some((of.trial.to_string(), of.fit.as_ref()?)))
        .collect();
    let joints = fits.iter().map(|(_, fit)| fit.equation_residuals.len()).max().unwrap_or(0);
    #[expect(clippy::cast_precision_loss, reason = "a few joints and methods")]
    let (width, height) = (
        LABEL_WIDTH + PANEL_WIDTH * joints.max(4) as f64 + CURVE_MARGIN,
        HEADER_HEIGHT + PANEL_HEIGHT * fits.len() as f64 + CURVE_MARGIN,
    );
    let heading = format!("Autocorrelation of the residuals, {}", view.comparison.robot);
    let mut svg = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"{0}\"><title>{0}</title><style>{STYLE}</style><rect class=\"paper\" \
         width=\"{width}\" height=\"{height}\"/><text class=\"heading\" x=\"16\" \
         y=\"26\">{0}</text><text class=\"faint\" x=\"16\" y=\"46\">over the lag in rows; the band \
         is 2 σ of white noise, behind the decimation filter where there is one; panels from −0.5 \
         to 1</text>",
        escape(&heading)
    );
    let mut x = LABEL_WIDTH;
    for joint in 1..=joints {
        let middle = x + PANEL_WIDTH / 2.0;
        let _ = write!(svg, r#"<text class="middle" x="{middle}" y="68">joint {joint}</text>"#);
        x += PANEL_WIDTH;
    }
    let mut y = HEADER_HEIGHT;
    for (name, fit) in fits {
        let (title, rows) = (y + 34.0, y + 52.0);
        let _ = write!(
            svg,
            "<text class=\"title\" x=\"16\" y=\"{title}\">{}</text><text class=\"faint\" x=\"16\" \
             y=\"{rows}\">{} rows</text>",
            escape(&name),
            fit.equation_residuals.first().map_or(0, Vec::len)
        );
        let mut x = LABEL_WIDTH;
        for residual in &fit.equation_residuals {
            let _ = write!(svg, r#"<g transform="translate({x} {y})">"#);
            draw_panel(&mut svg, residual, fit);
            svg += "</g>";
            x += PANEL_WIDTH;
        }
        y += PANEL_HEIGHT;
    }
    svg += "</svg>\n";
    svg
}

fn draw_panel(svg: &mut String, residual: &[f64], fit: &Fit) {
    let (wide, tall) = (PANEL_WIDTH - 2.0 * CURVE_MARGIN, PANEL_HEIGHT - 2.0 * CURVE_MARGIN);
    let autocorrelations = autocorrelation(residual, fit.white_noise.len());
    #[expect(clippy::cast_precision_loss, reason = "a few dozen lags")]
    let step = wide / (autocorrelations.len() as f64 + 0.5);
    // Values outside the panel are drawn at its edge.
    let height = |value: f64| {
        CURVE_MARGIN
            + (AXIS_HIGH - value.clamp(AXIS_LOW, AXIS_HIGH)) / (AXIS_HIGH - AXIS_LOW) * tall
    };
    let _ = write!(
        svg,
        "<rect class=\"frame\" x=\"{CURVE_MARGIN}\" y=\"{CURVE_MARGIN}\" width=\"{wide}\" \
         height=\"{tall}\"/>"
    );
    let mut stems = String::new();
    let mut x = CURVE_MARGIN + 0.75 * step;
    for (value, noise) in autocorrelations.iter().zip(&fit.white_noise) {
        let half = BAND_DEVIATIONS * noise.deviation;
        let (top, bottom) = (height(noise.mean + half), height(noise.mean - half));
        let _ = write!(
            svg,
            r#"<rect class="band" x="{:.1}" y="{top:.1}" width="{:.1}" height="{:.1}"/>"#,
            x - 0.5 * step,
            // The bar is slightly wider than its step, so that no gap is visible between adjacent
            // bars.
            step + 0.2,
            bottom - top
        );
        if value.is_finite() {
            let _ = write!(
                stems,
                r#"<line class="stem" x1="{x:.1}" x2="{x:.1}" y1="{:.1}" y2="{:.1}"/>"#,
                height(0.0),
                height(*value)
            );
        }
        x += step;
    }
    let zero = height(0.0);
    let _ = write!(
        svg,
        "<line class=\"axis\" x1=\"{CURVE_MARGIN}\" x2=\"{:.1}\" y1=\"{zero:.1}\" \
         y2=\"{zero:.1}\"/>{stems}",
        CURVE_MARGIN + wide
    );
}
