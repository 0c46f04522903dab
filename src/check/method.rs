//! Checks of the method: its requirements on the bus, and the match of filters and windows.

use didim_dynamics::JointSample;

use super::finding::Finding;
use super::limits::CheckLimits;
use crate::cell::Cell;
use crate::live::window_options::Trigger;
use crate::service::pipeline::MAX_WINDOWS;
use crate::text::significant_digits;

pub(super) fn check(cell: &Cell, findings: &mut Vec<Finding>) {
    check_reference(cell, findings);
    check_filters(cell, findings);
    // Only a service has windows.
    if cell.bus().is_ok() {
        check_rows(cell, findings);
    }
}

/// Checks that the reference exists, which methods that simulate the closed loop need.
fn check_reference(cell: &Cell, findings: &mut Vec<Finding>) {
    if cell.has_reference() || !cell.method.simulates() {
        return;
    }
    findings.push(Finding::warning(
        "bus.layout.reference",
        format!(
            "is missing, and {} simulates the closed loop: it uses the filtered measured \
                position as the reference, so its result is nearly that of idim-ls",
            cell.method
        ),
        "add the signal of the target position, or choose idim-ls",
    ));
}

fn check_filters(cell: &Cell, findings: &mut Vec<Finding>) {
    if cell.chooses_cutoff {
        return;
    }
    let rate = cell.sample_rate_hz();
    let cutoff = cell.options.position_filter.cutoff_hz;
    let key = "identification.position_filter";
    let hertz = |value: f64| significant_digits(value, 3);
    if cutoff > CheckLimits::DEFAULT.max_cutoff_share * rate {
        findings.push(Finding::warning(
            key,
            format!(
                "{} Hz at {} samples/s passes the noise that differentiation amplifies most",
                hertz(cutoff),
                hertz(rate)
            ),
            format!(
                "lower the cut-off frequency to {} Hz or less",
                hertz(CheckLimits::DEFAULT.max_cutoff_share * rate)
            ),
        ));
    }
    let decimation = &cell.options.decimation_filter;
    let band = decimation.cutoff_hz(rate);
    if cutoff < CheckLimits::DEFAULT.min_cutoff_ratio * band {
        findings.push(Finding::warning(
            key,
            format!(
                "{} Hz smooths motion that the decimation filter keeps, up to {} Hz",
                hertz(cutoff),
                hertz(band)
            ),
            format!(
                "raise the cut-off frequency to {} Hz or more, or use a larger \
                 `decimation_filter.factor`",
                hertz(CheckLimits::DEFAULT.min_cutoff_ratio * band)
            ),
        ));
    }
}

/// Checks that the shortest window has enough rows for the verdict after decimation. Also checks
/// the requirements for the longest window.
fn check_rows(cell: &Cell, findings: &mut Vec<Finding>) {
    let (decimation, limits) = (&cell.options.decimation_filter, &cell.options.limits);
    let parameters = cell.options.parameters.as_ref().map_or(cell.base.names().len(), Vec::len);
    let (key, shortest_s) = shortest_window(cell);
    #[expect(clippy::cast_precision_loss, reason = "small numbers")]
    let (rows, parameters) = (
        (shortest_s * cell.sample_rate_hz() / decimation.factor as f64).floor()
            * cell.robot.joints() as f64,
        parameters as f64,
    );
    let independent = decimation.cutoff_ratio * rows / parameters;
    if independent < limits.rows_per_parameter {
        findings.push(Finding::warning(
            key,
            format!(
                "the shortest window, {shortest_s} s, leaves {rows} rows for {parameters} \
                 parameters: {} independent rows for each, and the verdict requires {}",
                significant_digits(independent, 2),
                limits.rows_per_parameter
            ),
            "use longer windows, a smaller `decimation_filter.factor`, or fewer parameters",
        ));
    }
    if cell.window.max_s > 10.0 * cell.service.buffer_s {
        findings.push(Finding::note(
            "service.buffer_s",
            format!(
                "while a window of up to {} s is identified, the buffer holds samples of {} s only",
                cell.window.max_s, cell.service.buffer_s
            ),
            "enlarge it only if the status counts samples missing or batches lost",
        ));
    }
}

/// Returns the key that sets the shortest counted part of a window, and its value \[s\].
fn shortest_window(cell: &Cell) -> (&'static str, f64) {
    match cell.window.trigger {
        Trigger::Motion { .. } | Trigger::Command {} => ("window.min_s", cell.window.min_s),
        // Every window has this length, which is at least `min_s`.
        Trigger::Interval { length_s } => ("window.trigger.length_s", length_s),
    }
}

/// Returns the largest memory size of the service's windows \[bytes\].
pub(super) fn window_bytes(cell: &Cell) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 600 s at 20 kHz"
    )]
    let samples = (cell.window.max_s * cell.sample_rate_hz()).ceil() as u64;
    samples * (MAX_WINDOWS * size_of::<JointSample>()) as u64
}
