//! The parameters of the last estimate, compared with the baseline.

use ratatui::text::{Line, Span};

use super::looks::TextStyles;
use didim::archive::drift::ParameterDrift;
use didim::archive::store::ParameterValue;
use didim::service::status::Snapshot;
use didim::service::status::render::without_control_characters;
use didim::text::{significant_digits, to_uncertainty};

/// Width of half a bar \[characters\]. Half a bar represents half of a parameter's band.
const HALF_BAR_WIDTH: usize = 6;
/// Width of the complete table \[characters\].
pub(super) const TABLE_WIDTH: u16 = 67;
/// Width of the table without the bars \[characters\]; the next constants are its widths without
/// the changes and without the standard deviations.
const WITHOUT_BARS: u16 = 52;
const WITHOUT_CHANGES: u16 = 42;
const WITHOUT_DEVIATIONS: u16 = 31;

/// Returns true if the parameters are compared with a baseline, so that each uses a share of its
/// band.
pub(super) fn are_compared(snapshot: &Snapshot) -> bool {
    let drift = snapshot.estimation.as_ref().and_then(|status| status.drift.as_ref());
    drift.is_some_and(|drift| drift.compared)
}

/// Returns the lines of the parameters, in the model's order or sorted by the used share of their
/// bands.
pub(super) fn lines(
    snapshot: &Snapshot,
    looks: TextStyles,
    width: u16,
    in_model_order: bool,
) -> Vec<Line<'static>> {
    let Some(status) = &snapshot.estimation else { return Vec::new() };
    let Some(estimate) = &status.last_estimate else { return Vec::new() };
    let drift = status.drift.as_ref().filter(|drift| drift.compared);
    let compared = drift.is_some() && width >= WITHOUT_BARS;
    let bars = drift.is_some() && width >= TABLE_WIDTH;
    let mut heading = format!("{:9}{:>11}", "parameter", "value");
    if width >= WITHOUT_CHANGES {
        heading += &format!("{:>11}", "± σ stat.");
    }
    if width >= WITHOUT_DEVIATIONS {
        heading += &format!("  {:9}", "unit");
    }
    if compared {
        heading += &format!("{:>10}", "change");
    }
    if bars {
        heading += "  −    band   +";
    }
    let mut lines = vec![Line::styled(heading, looks.heading())];
    let change = |parameter: &ParameterValue| {
        let changes = drift.map_or(&[][..], |drift| &drift.parameters);
        changes.iter().find(|change| change.parameter == parameter.name)
    };
    let mut parameters: Vec<_> = estimate.parameters.iter().collect();
    if !in_model_order {
        let share = |of: &&ParameterValue| change(of).and_then(|change| change.band_share);
        let share = |of: &&ParameterValue| share(of).unwrap_or(-1.0);
        parameters.sort_by(|one, other| share(other).total_cmp(&share(one)));
    }
    for parameter in parameters {
        let change = change(parameter);
        let alarmed = drift.is_some_and(|drift| {
            drift.alarms.iter().any(|alarm| alarm.parameter == parameter.name)
        });
        let mut line = row(parameter, change.filter(|_| compared), bars, alarmed, looks, width);
        add_name(&mut line, parameter, usize::from(width));
        lines.push(line);
    }
    lines
}

/// Smallest number of characters of a name that is shown. Convention: fewer tell no joint.
const MIN_NAME: usize = 6;

/// Adds the name of the joint or link behind a row, as far as the width allows.
fn add_name(line: &mut Line<'static>, parameter: &ParameterValue, width: usize) {
    let available = width.saturating_sub(line.width() + 2);
    let Some(name) = parameter.part_name().filter(|_| available >= MIN_NAME) else { return };
    let name: String = without_control_characters(name).chars().take(available).collect();
    line.push_span(format!("  {name}"));
}

fn row(
    parameter: &ParameterValue,
    change: Option<&ParameterDrift>,
    bars: bool,
    alarmed: bool,
    looks: TextStyles,
    width: u16,
) -> Line<'static> {
    let ParameterValue { name, value, standard_deviation, .. } = parameter;
    let mut text = format!(
        "{:8}{:>12}",
        without_control_characters(name),
        to_uncertainty(*value, *standard_deviation, 7)
    );
    if width >= WITHOUT_CHANGES {
        text += &format!("{:>11}", significant_digits(*standard_deviation, 2));
    }
    if width >= WITHOUT_DEVIATIONS {
        text += &format!("  {:9}", without_control_characters(parameter.unit_or_dash()));
    }
    let Some(change) = change else { return Line::raw(text) };
    let relative = match change.relative_change {
        Some(relative) if relative.abs() < 10.0 => format!("{:+.2} %", 100.0 * relative),
        Some(relative) => format!("{relative:+.0}-fold"),
        None => "–".to_owned(),
    };
    text += &format!("{relative:>10}");
    let style = match (alarmed, change.band_share) {
        (true, _) => looks.bad_style(),
        (false, Some(share)) if share > 1.0 => looks.in_colour(ratatui::style::Color::Yellow),
        (false, _) => looks.good_style(),
    };
    let mut spans = vec![Span::raw(text)];
    if bars {
        spans.push(Span::styled(format!("  {}", bar(change)), style));
    } else if change.band_share.is_some_and(|share| share > 1.0) {
        spans.push(Span::styled(" !", style));
    }
    Line::from(spans)
}

/// Returns a bar with the used share of a parameter's band and its direction. An arrow marks a
/// parameter outside its band.
fn bar(change: &ParameterDrift) -> String {
    let (Some(share), Some(deviation)) = (change.band_share, change.deviation_sigma) else {
        return " ".repeat(HALF_BAR_WIDTH) + "│";
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "clamped to half of the bar"
    )]
    let used = (share * HALF_BAR_WIDTH as f64).round().clamp(0.0, HALF_BAR_WIDTH as f64) as usize;
    let (full, empty) = ("█".repeat(used), "·".repeat(HALF_BAR_WIDTH - used));
    let outside = share > 1.0;
    let short: String = full.chars().take(HALF_BAR_WIDTH - 1).collect();
    match (deviation < 0.0, outside) {
        (true, true) => format!("◀{short}│{}", "·".repeat(HALF_BAR_WIDTH)),
        (true, false) => format!("{empty}{full}│{}", "·".repeat(HALF_BAR_WIDTH)),
        (false, true) => format!("{}│{short}▶", "·".repeat(HALF_BAR_WIDTH)),
        (false, false) => format!("{}│{full}{empty}", "·".repeat(HALF_BAR_WIDTH)),
    }
}
