//! What the method needs and the bus does not carry; filters and windows that do not fit each other.

use didim_core::JointSample;

use super::finding::Finding;
use crate::cell::Cell;
use crate::report::table::significant;

/// Above this part of the sample rate, the position filter lets the noise pass that central
/// differences raise most: twice differentiated, white noise is strongest at half the sample rate.
const NOISY: f64 = 0.35;
/// Where the decimation filter cuts, as a part of the Nyquist frequency behind it.
const DECIMATION_CUT: f64 = 0.8;
/// The position filter should be flat where the equation is used: four poles, forward and backward, are
/// down by 1 % at 0.56 of their cut-off frequency.
const FLAT: f64 = 1.8;
/// Rows for every parameter below which the shortest window says little.
const ROWS_PER_PARAMETER: f64 = 5.0;
/// Windows in memory: the open one, four waiting, the one being identified.
const WINDOWS: usize = 6;

pub(super) fn check(cell: &Cell, findings: &mut Vec<Finding>) {
    reference(cell, findings);
    filters(cell, findings);
    rows(cell, findings);
}

/// Methods that simulate the closed loop follow a reference.
fn reference(cell: &Cell, findings: &mut Vec<Finding>) {
    if cell.layout.has_reference() || !cell.method.simulates() {
        return;
    }
    findings.push(Finding::warning(
        "bus.layout.reference",
        format!(
            "is not there, and {} simulates the closed loop: the filtered measured position stands \
             in for the reference, which makes it nearly idim-ls",
            cell.method
        ),
        "add the signal of the target position, or choose idim-ls",
    ));
}

fn filters(cell: &Cell, findings: &mut Vec<Finding>) {
    let rate = cell.sample_rate_hz();
    let cutoff = cell.options.position_filter.cutoff_hz;
    let key = "identification.position_filter";
    let hertz = |value: f64| significant(value, 3);
    if cutoff > NOISY * rate {
        findings.push(Finding::warning(
            key,
            format!(
                "{} Hz of {} samples/s leaves the noise that differences raise most",
                hertz(cutoff),
                hertz(rate)
            ),
            format!("a cut-off frequency of at most {} Hz", hertz(NOISY * rate)),
        ));
    }
    #[expect(clippy::cast_precision_loss, reason = "a factor of decimation is small")]
    let band = DECIMATION_CUT * 0.5 * rate / cell.options.decimation_filter.factor as f64;
    if cutoff < FLAT * band {
        findings.push(Finding::warning(
            key,
            format!(
                "{} Hz smooths motion that the decimation filter keeps, up to {} Hz",
                hertz(cutoff),
                hertz(band)
            ),
            format!(
                "a cut-off frequency of at least {} Hz, or a larger `decimation_filter.factor`",
                hertz(FLAT * band)
            ),
        ));
    }
}

/// What the shortest window leaves after decimation, and what the longest takes.
fn rows(cell: &Cell, findings: &mut Vec<Finding>) {
    let rate = cell.sample_rate_hz();
    let parameters = cell.options.parameters.as_ref().map_or(cell.base.names().len(), Vec::len);
    #[expect(clippy::cast_precision_loss, reason = "small numbers")]
    let (rows, parameters) = (
        (cell.window.min_s * rate / cell.options.decimation_filter.factor as f64).floor()
            * cell.robot.joints() as f64,
        parameters as f64,
    );
    if rows < ROWS_PER_PARAMETER * parameters {
        findings.push(Finding::warning(
            "window.min_s",
            format!(
                "the shortest window, {} s, leaves {rows} rows for {parameters} parameters",
                cell.window.min_s
            ),
            "longer windows, a smaller `decimation_filter.factor`, or fewer parameters",
        ));
    }
    if cell.window.max_s > 10.0 * cell.service.buffer_s {
        findings.push(Finding::note(
            "service.buffer_s",
            format!(
                "windows of up to {} s are identified beside a buffer of {} s",
                cell.window.max_s, cell.service.buffer_s
            ),
            "nothing, unless the status counts samples missing or batches lost",
        ));
    }
}

/// What the windows of the service take at most \[bytes\].
pub(super) fn window_bytes(cell: &Cell) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 600 s at 20 kHz"
    )]
    let samples = (cell.window.max_s * cell.sample_rate_hz()).ceil() as u64;
    samples * (WINDOWS * size_of::<JointSample>()) as u64
}
