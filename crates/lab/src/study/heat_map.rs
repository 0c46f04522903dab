//! Heat maps with one panel per method. A panel has a coloured field with a number for each cell of
//! the grid.

use std::fmt::Write as _;

use super::grid::Grid;
use super::measure::{MEASURES, Measure};
use super::summary::{CellSummary, Summary};
use didim::text::escape;

/// Maximum width of a figure \[px\], unless a single panel is wider.
const MAX_WIDTH: f64 = 860.0;
/// Height above the panels: heading, explanation, legend.
const HEADER_HEIGHT: f64 = 108.0;
const ROW_HEIGHT: f64 = 22.0;
/// Height of a panel's title above the column names.
const PANEL_TITLE: f64 = 22.0;
const PANEL_GAP: f64 = 20.0;
/// Approximate width of a character.
const CHARACTER_WIDTH: f64 = 6.6;

/// Style sheet of the figures. The lightness decreases from class to class, so that the map is
/// readable without colour; on a dark background the lightness increases. A number has the text
/// colour that contrasts with its class.
const COLOURS: &str = "svg{--paper:#fff;--ink:#1d2530}text{font:12px \
system-ui,sans-serif;fill:var(--ink)}.paper{fill:var(--paper)}.heading{font-size:17px;\
    font-weight:600}.title{font-weight:600}.faint{opacity:.75}.none{fill:none;stroke:var(--ink);\
    stroke-opacity:.25}.n{font-size:11px;text-anchor:middle}.end{text-anchor:end}\
    .middle{text-anchor:middle}.c0{fill:#eef4fa}.c1{fill:#d3e3f1}.c2{fill:#aacde6}\
    .c3{fill:#78b0d8}.c4{fill:#4489c0}.c5{fill:#1f5f9e}.c6{fill:#0b3468}\
    .i0,.i1,.i2,.i3{fill:#10202f}.i4,.i5,.i6{fill:#fff}\
    @media screen and (prefers-color-scheme:dark){svg{--paper:#14181d;--ink:#e4e8ed}\
    .c0{fill:#1d2833}.c1{fill:#1f3d5a}.c2{fill:#275a87}.c3{fill:#3b7fb4}.c4{fill:#6ba6d3}\
    .c5{fill:#a6cdea}.c6{fill:#e3f1fb}.i0,.i1,.i2,.i3{fill:#fff}.i4,.i5,.i6{fill:#10202f}}";

/// Returns name and content of every figure of a study.
pub fn heat_maps(grid: &Grid, summary: &Summary) -> Vec<(&'static str, String)> {
    let layout = Layout::new(grid);
    MEASURES.iter().map(|measure| (measure.file, layout.draw(measure, summary))).collect()
}

/// Layout of the grid's cells: the rows are the levels of the axis with the most levels, the
/// columns are the combinations of the levels of all other axes.
struct Layout<'a> {
    grid: &'a Grid,
    /// Index of the axis whose levels are the rows; `None` if the plan has no axis.
    row_axis: Option<usize>,
    /// Indices of the other axes, outermost first.
    column_axes: Vec<usize>,
    rows: usize,
    columns: usize,
    label_width: f64,
    column_width: f64,
    /// Width of all columns together, or of the longest method name if it is wider.
    panel_width: f64,
    panels_abreast: usize,
}

impl<'a> Layout<'a> {
    #[expect(clippy::cast_precision_loss, reason = "names and numbers of levels are short")]
    fn new(grid: &'a Grid) -> Self {
        let axes = &grid.plan.axis;
        let levels = |axis: usize| axes[axis].level.len();
        // The first axis with the most levels: `max_by_key` returns the last maximum, so `rev` is
        // needed.
        let row_axis = (0..axes.len()).rev().max_by_key(|axis| levels(*axis));
        let column_axes: Vec<usize> = (0..axes.len()).filter(|a| Some(*a) != row_axis).collect();
        let columns: usize = column_axes.iter().map(|axis| levels(*axis)).product();
        let wide = |name: &str| name.chars().count() as f64 * CHARACTER_WIDTH;
        let longest = |axis: usize| {
            axes[axis].level.iter().fold(0.0_f64, |most, level| most.max(wide(&level.name)))
        };
        let mut column_width = 46.0_f64;
        let mut span = columns;
        for &axis in &column_axes {
            span /= levels(axis);
            column_width = column_width.max((longest(axis) + 8.0) / span as f64);
        }
        let names = column_axes.iter().map(|axis| wide(&axes[*axis].name));
        let label_width = names.fold(row_axis.map_or(0.0, longest), f64::max) + 16.0;
        let titles = grid.plan.method.iter().map(|method| 1.1 * wide(method.name()));
        let panel_width = titles.fold(columns as f64 * column_width, f64::max);
        let fitting = ((MAX_WIDTH - label_width) / (panel_width + PANEL_GAP)).floor().max(1.0);
        let panels = grid.plan.method.len();
        let panels_abreast = (1..=panels).rev().find(|n| *n as f64 <= fitting).unwrap_or(1);
        Self {
            grid,
            rows: row_axis.map_or(1, levels),
            row_axis,
            column_axes,
            columns,
            label_width,
            column_width,
            panel_width,
            panels_abreast,
        }
    }

    /// Returns the grid index of the cell in a row and a column; the last axis varies fastest.
    fn cell_index(&self, row: usize, column: usize) -> usize {
        let axes = &self.grid.plan.axis;
        let mut levels = vec![0; axes.len()];
        if let Some(axis) = self.row_axis {
            levels[axis] = row;
        }
        let mut rest = column;
        for &axis in self.column_axes.iter().rev() {
            levels[axis] = rest % axes[axis].level.len();
            rest /= axes[axis].level.len();
        }
        axes.iter().zip(&levels).fold(0, |index, (axis, level)| index * axis.level.len() + level)
    }

    #[expect(clippy::cast_precision_loss, reason = "rows and columns are few")]
    fn draw(&self, measure: &Measure, summary: &Summary) -> String {
        let methods = &self.grid.plan.method;
        let panel_width = self.panel_width;
        let names = PANEL_TITLE + 18.0 * self.column_axes.len() as f64;
        let panel_height = names + ROW_HEIGHT * self.rows as f64 + PANEL_GAP;
        let width =
            (self.label_width + self.panels_abreast as f64 * (panel_width + PANEL_GAP)).max(620.0);
        let height =
            HEADER_HEIGHT + panel_height * methods.len().div_ceil(self.panels_abreast) as f64;
        let heading = format!("{}: {}", self.grid.plan.name, measure.title);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             role=\"img\" aria-label=\"{0}\"><title>{0}</title><style>{COLOURS}</style><rect \
             class=\"paper\" width=\"{width:.0}\" height=\"{height:.0}\"/><text class=\"heading\" \
             x=\"16\" y=\"28\">{0}</text><text x=\"16\" y=\"49\">{1}</text>",
            escape(&heading),
            escape(measure.meaning)
        );
        legend(&mut svg, measure);
        for (index, method) in methods.iter().enumerate() {
            let (across, down) = (index % self.panels_abreast, index / self.panels_abreast);
            let x = self.label_width + across as f64 * (panel_width + PANEL_GAP);
            let y = HEADER_HEIGHT + down as f64 * panel_height;
            let _ = write!(svg, r#"<g transform="translate({x:.1} {y:.1})">"#);
            let title = escape(method.name());
            let _ = write!(svg, r#"<text class="title" y="12">{title}</text>"#);
            self.column_names(&mut svg, across == 0);
            let value = |row, column| {
                let cell = self.cell_index(row, column) * methods.len() + index;
                summary.cells.get(cell)
            };
            for row in 0..self.rows {
                let top = names + ROW_HEIGHT * row as f64;
                if let (Some(axis), 0) = (self.row_axis, across) {
                    let name = escape(&self.grid.plan.axis[axis].level[row].name);
                    let _ = write!(
                        svg,
                        r#"<text class="end" x="-8" y="{:.1}">{name}</text>"#,
                        top + 15.0
                    );
                }
                for column in 0..self.columns {
                    let left_x = self.column_width * column as f64;
                    self.draw_number(&mut svg, measure, value(row, column), left_x, top);
                }
            }
            svg += "</g>";
        }
        svg + "</svg>\n"
    }

    /// Draws the level names of the column axes. `first` is true for the leftmost panel, which also
    /// gets the axis names on its left.
    #[expect(clippy::cast_precision_loss, reason = "columns are few")]
    fn column_names(&self, svg: &mut String, first: bool) {
        let mut span = self.columns;
        let mut y = PANEL_TITLE + 10.0;
        for &axis in &self.column_axes {
            let axis = &self.grid.plan.axis[axis];
            span /= axis.level.len();
            let wide = span as f64 * self.column_width;
            for group in 0..self.columns / span {
                let x = (group as f64 + 0.5) * wide;
                let name = escape(&axis.level[group % axis.level.len()].name);
                let _ = write!(svg, r#"<text class="middle" x="{x:.1}" y="{y:.1}">{name}</text>"#);
            }
            if first {
                let name = escape(&axis.name);
                let _ = write!(svg, r#"<text class="end faint" x="-8" y="{y:.1}">{name}</text>"#);
            }
            y += 18.0;
        }
    }

    fn draw_number(
        &self,
        svg: &mut String,
        measure: &Measure,
        cell: Option<&CellSummary>,
        remaining: f64,
        top: f64,
    ) {
        let (wide, tall) = (self.column_width - 2.0, ROW_HEIGHT - 2.0);
        let place =
            format!(r#"x="{remaining:.1}" y="{top:.1}" width="{wide:.1}" height="{tall:.1}""#);
        let (x, y) = (remaining + 0.5 * wide, top + 14.0);
        let _ = match cell.and_then(measure.value) {
            Some(value) => {
                let (class, text) =
                    (measure.scale.value_class(value), measure.scale.format_value(value));
                let text = escape(&text);
                write!(
                    svg,
                    "<rect class=\"c{class}\" {place}/><text class=\"n i{class}\" x=\"{x:.1}\" \
                     y=\"{y:.1}\">{text}</text>"
                )
            }
            None => write!(
                svg,
                r#"<rect class="none" {place}/><text class="n" x="{x:.1}" y="{y:.1}">–</text>"#
            ),
        };
    }
}

/// Draws the legend: the classes, and the mark for a missing result.
#[expect(clippy::cast_precision_loss, reason = "seven classes")]
fn legend(svg: &mut String, measure: &Measure) {
    let each = 68.0;
    for (class, name) in measure.scale.names.iter().enumerate() {
        let x = 16.0 + each * class as f64;
        let _ = write!(
            svg,
            "<rect class=\"c{class}\" x=\"{x}\" y=\"64\" width=\"{}\" height=\"20\"/><text \
             class=\"n i{class}\" x=\"{}\" y=\"78\">{name}</text>",
            each - 2.0,
            x + 0.5 * each - 1.0
        );
    }
    let x = 16.0 + each * measure.scale.names.len() as f64;
    let _ = write!(
        svg,
        "<rect class=\"none\" x=\"{x}\" y=\"64\" width=\"20\" height=\"20\"/><text class=\"n\" \
         x=\"{}\" y=\"78\">–</text><text x=\"{}\" y=\"78\">no result</text>",
        x + 10.0,
        x + 26.0
    );
}
