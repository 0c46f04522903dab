//! Screen of `didim top`: the status of a running service, drawn as a function of a [`View`].
//!
//! The screen fits into 80 × 24 and scrolls. A sign or a word repeats the meaning of every colour.

mod looks;
mod parameters;
mod sections;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

use looks::{TextStyles, wrap_lines};

use didim::service::status::Snapshot;
use didim::service::status::render::{duration_text, without_control_characters};

/// Width from which the parameters are shown next to the other sections.
const SIDE_BY_SIDE_WIDTH: u16 = 120;
/// Number of parameters before the other sections, where not everything fits.
const FIRST_PARAMETERS: usize = 5;
/// Maximum number of lines about health. Further reasons for bad health are only counted.
const HEALTH_LINES: usize = 6;

/// State of the screen: the displayed data, and the choices of the user.
#[derive(Clone, Debug, Default)]
pub(crate) struct View {
    /// The last status.
    pub(crate) snapshot: Option<Snapshot>,
    /// Reason why no newer status is available, and the time since the last answer \[s\].
    pub(crate) unreachable: Option<(String, u64)>,
    /// True if new statuses are not shown.
    pub(crate) is_paused: bool,
    /// True if the terminal supports colours.
    pub(crate) has_colour: bool,
    /// True if the parameters are in the model's order. Otherwise those that use most of their
    /// bands come first.
    pub(crate) in_model_order: bool,
    /// True if an explanation of keys and figures replaces the status.
    pub(crate) shows_help: bool,
    /// Number of lines by which the screen is scrolled down.
    pub(crate) scrolled_lines: u16,
}

/// Draws the view. Returns the largest scroll offset and the lines of a page scroll.
pub(crate) fn draw(frame: &mut Frame<'_>, view: &View) -> (u16, u16) {
    let (looks, width) = (TextStyles { has_colour: view.has_colour }, frame.area().width);
    let mut head = vec![title(view, looks)];
    head.extend(health_lines(view, looks, width));
    let [head_area, body, foot] = Layout::vertical([
        Constraint::Length(line_count(&head)),
        Constraint::Fill(1),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    frame.render_widget(Paragraph::new(head), head_area);
    let scrolls = draw_body(frame, view, looks, body);
    frame.render_widget(Paragraph::new(key_line(view, scrolls)), foot);
    (scrolls, body.height.saturating_sub(1).max(1))
}

fn draw_body(frame: &mut Frame<'_>, view: &View, looks: TextStyles, area: Rect) -> u16 {
    if view.shows_help {
        let lines = help_lines(looks, area.width);
        let scrolls = line_count(&lines).saturating_sub(area.height);
        let scroll = (view.scrolled_lines.min(scrolls), 0);
        frame.render_widget(Paragraph::new(lines).scroll(scroll), area);
        return scrolls;
    }
    let Some(snapshot) = &view.snapshot else { return 0 };
    let columns = if area.width >= SIDE_BY_SIDE_WIDTH {
        let [left_column, _, right] = Layout::horizontal([
            Constraint::Fill(1),
            Constraint::Length(2),
            Constraint::Length(parameters::TABLE_WIDTH),
        ])
        .areas(area);
        let service = sections::lines(snapshot, looks, left_column.width);
        vec![
            (left_column, service),
            (right, parameters::lines(snapshot, looks, right.width, view.in_model_order)),
        ]
    } else {
        let service = sections::lines(snapshot, looks, area.width);
        let table = parameters::lines(snapshot, looks, area.width, view.in_model_order);
        let fits = service.len() + 1 + table.len() <= area.height.into();
        let are_sorted = !view.in_model_order && parameters::are_compared(snapshot);
        let first = if are_sorted && !fits { FIRST_PARAMETERS } else { 0 };
        vec![(area, single_column(service, table, first))]
    };
    let longest = columns.iter().map(|(_, lines)| line_count(lines)).max().unwrap_or(0);
    let scrolls = longest.saturating_sub(area.height);
    for (area, lines) in columns {
        // A column that fits does not scroll.
        let most = line_count(&lines).saturating_sub(area.height);
        let scroll = (view.scrolled_lines.min(most), 0);
        frame.render_widget(Paragraph::new(lines).scroll(scroll), area);
    }
    scrolls
}

/// Puts the sections before the table of the parameters, except for its first rows, which come
/// first.
fn single_column(
    service: Vec<Line<'static>>,
    mut table: Vec<Line<'static>>,
    first: usize,
) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    if first > 0 && table.len() > first + 1 {
        let heading = table.first().cloned();
        let rest = table.split_off(first + 1);
        lines.append(&mut table);
        lines.push(Line::default());
        table = heading.into_iter().chain(rest).collect();
    }
    lines.extend(service);
    lines.push(Line::default());
    lines.extend(table);
    lines
}

fn line_count(lines: &[Line<'_>]) -> u16 {
    u16::try_from(lines.len()).unwrap_or(u16::MAX)
}

fn title(view: &View, looks: TextStyles) -> Line<'static> {
    let mut spans = vec![Span::styled("didim top", looks.heading())];
    if let Some(snapshot) = &view.snapshot {
        let (cell, version) = (
            without_control_characters(&snapshot.cell),
            without_control_characters(&snapshot.version),
        );
        spans.push(Span::raw(format!("  {cell}  ")));
        spans.push(Span::raw(format!("up {}  didim {version}", duration_text(snapshot.uptime_s))));
    }
    if view.is_paused {
        spans.push(Span::styled("  PAUSED", looks.heading()));
    }
    Line::from(spans)
}

/// Returns the lines with the reasons for bad health, or one line if there is no such reason.
fn health_lines(view: &View, looks: TextStyles, width: u16) -> Vec<Line<'static>> {
    let mut reasons = Vec::new();
    if let Some((why, seconds)) = &view.unreachable {
        reasons.push(match view.snapshot {
            Some(_) => format!(
                "no answer for {seconds} s, asking again every second; the last answer is below"
            ),
            None => "no answer yet, asking again every second".to_owned(),
        });
        reasons.push(why.clone());
    } else if let Some(snapshot) = &view.snapshot {
        reasons.extend(snapshot.health.reasons.iter().cloned());
    }
    if reasons.is_empty() {
        return match &view.snapshot {
            Some(snapshot) => {
                let text = format!("health: {}", snapshot.health.label());
                vec![Line::styled(text, looks.good_style())]
            }
            None => vec![Line::raw("asking …")],
        };
    }
    let mut lines = Vec::new();
    for reason in &reasons {
        lines.extend(wrap_lines(
            "! ",
            &without_control_characters(reason),
            looks.bad_style(),
            width,
        ));
    }
    let more = lines.len().saturating_sub(HEALTH_LINES);
    if more > 0 {
        lines.truncate(HEALTH_LINES - 1);
        lines.push(Line::styled(
            format!("! {} lines more: `didim status`", more + 1),
            looks.bad_style(),
        ));
    }
    lines
}

fn key_line(view: &View, scrolls: u16) -> Line<'static> {
    let help = if view.shows_help { "? back" } else { "? help" };
    let pause = if view.is_paused { "p go on" } else { "p pause" };
    let order = if view.in_model_order { "s by band" } else { "s model's order" };
    let scroll = match (view.scrolled_lines.min(scrolls), scrolls) {
        (_, 0) => String::new(),
        (at, most) => format!("  ↑ ↓ scroll ({at} of {most})"),
    };
    let dim = Style::new().add_modifier(Modifier::DIM);
    Line::styled(format!("q quit  {help}  {pause}  {order}{scroll}"), dim)
}

/// Lines of the help: the keys, and the meaning of the figures.
const HELP_LINES: [(&str, &str); 14] = [
    ("q, Esc", "quit"),
    ("?, h", "this help, and back"),
    ("p", "pause, and go on"),
    ("s", "parameters by the share of their bands, or in the model's order"),
    ("↑ ↓", "scroll by a line; PgUp and PgDn by a page; Home and End to the ends"),
    ("", ""),
    ("losses", "frames, cycles and windows that were not used, by cause"),
    ("to buffer", "from the time of a frame to its sample in shared memory"),
    ("to worker", "from there to the worker that identifies"),
    ("± σ stat.", "one statistical standard deviation, in the unit of the value"),
    ("change", "of the value since the baseline"),
    ("band", "how much of its band a parameter uses, and to which side"),
    ("▶ or !", "outside of its band"),
    ("error", "of the torque that the model predicts, relative to the measured"),
];

fn help_lines(looks: TextStyles, width: u16) -> Vec<Line<'static>> {
    let mut section = sections::Section::new(looks, width);
    HELP_LINES.iter().for_each(|(name, meaning)| section.add_row(name, meaning));
    section.lines
}

#[cfg(test)]
mod tests;
