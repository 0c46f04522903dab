//! Tables with didim's own columns, as text.

use std::io::Write;
use std::path::Path;

use super::error::TableError;
use super::header::column_name;
use crate::columns::Quantity;
use crate::measurement::Measurement;

/// Writes a measurement as CSV, with a `time_s` column that starts at 0. Numbers have enough digits
/// to read the same value back.
///
/// # Errors
/// [`TableError::Io`] when the file cannot be written.
pub fn write_csv(
    measured: &Measurement,
    output: impl Write,
    path: &Path,
) -> Result<(), TableError> {
    let table = |error| TableError::from_csv(path, error);
    let mut writer = csv::Writer::from_writer(output);
    let blocks: Vec<(Quantity, &Vec<Vec<f64>>)> = [
        (Quantity::Position, Some(&measured.signals.position_rad)),
        (Quantity::Torque, Some(&measured.signals.torque_nm)),
        (Quantity::Reference, measured.signals.reference_rad.as_ref()),
    ]
    .into_iter()
    .filter_map(|(quantity, block)| block.map(|b| (quantity, b)))
    .collect();

    let mut names = vec!["time_s".to_owned()];
    for (quantity, block) in &blocks {
        names.extend((0..block.len()).map(|axis| column_name(measured.side, *quantity, axis)));
    }
    writer.write_record(&names).map_err(table)?;
    let mut row = Vec::with_capacity(names.len());
    for k in 0..measured.samples() {
        row.clear();
        #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
        row.push((k as f64 / measured.signals.sample_rate_hz).to_string());
        row.extend(blocks.iter().flat_map(|(_, b)| b.iter().map(|axis| axis[k].to_string())));
        writer.write_record(&row).map_err(table)?;
    }
    writer.flush().map_err(|source| TableError::Io { file: path.to_path_buf(), source })
}
