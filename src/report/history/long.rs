//! The history as a long table for databases, with one row per parameter of each result.

use std::io::Write;

use didim_formats::{LongColumn, LongFormat, LongTableError, LongValues};
use didim_identification::identification::Use;

use crate::archive::drift::JudgedHistory;
use crate::archive::store::{HistoryError, HistoryLine, ParameterValue};

/// Number of results that are written at once \[1\]. With 28 parameters, their rows take some 5 MB.
const BATCH_RESULTS: usize = 500;

/// Reason why a long table is not written.
#[derive(Debug, thiserror::Error)]
pub enum LongHistoryError {
    /// The history cannot be read again.
    #[error(transparent)]
    History(#[from] HistoryError),
    /// The table cannot be written.
    #[error(transparent)]
    Table(#[from] LongTableError),
}

/// Writes a table for these parameters, oldest result first. Keeps some results in memory at a
/// time.
///
/// # Errors
/// [`LongHistoryError`].
pub fn write_long_table(
    history: &JudgedHistory,
    format: LongFormat,
    parameters: &[&str],
    output: &mut (dyn Write + Send),
) -> Result<(), LongHistoryError> {
    let mut table = format.table(output)?;
    let (mut batch, mut written) = (Vec::new(), Ok(()));
    history.for_each_entry(|entry| {
        if written.is_ok() {
            batch.push((entry.line.identity(), entry.line.clone()));
            if batch.len() >= BATCH_RESULTS {
                written = table.write(&columns(&batch, parameters));
                batch.clear();
            }
        }
    })?;
    written?;
    table.write(&columns(&batch, parameters))?;
    Ok(table.finish()?)
}

/// Returns the columns of the table for results with their identities. Values are in the unit of
/// their row. A value that a result does not contain is missing, and so is the time of a result
/// that was stored while the clock was not set.
fn columns<'a>(results: &'a [(String, HistoryLine)], parameters: &[&str]) -> Vec<LongColumn<'a>> {
    let rows: Vec<Row<'a>> = results
        .iter()
        .flat_map(|(identity, line)| {
            let parameters = line.parameters.iter();
            parameters.map(move |parameter| Row { identity, line, parameter })
        })
        .filter(|row| parameters.contains(&row.parameter.name.as_str()))
        .collect();
    let text = |of: fn(&Row<'a>) -> &'a str| {
        let texts = rows.iter().map(|row| Some(of(row)).filter(|text| !text.is_empty()));
        LongValues::Text(texts.collect())
    };
    let number =
        |of: fn(&Row<'a>) -> Option<f64>| LongValues::Number(rows.iter().map(of).collect());
    let flag =
        |of: &dyn Fn(&Row<'a>) -> Option<bool>| LongValues::Flag(rows.iter().map(of).collect());
    let good = |of: Use| flag(&move |row| row.line.is_good_for(of));
    let time = |row: &Row<'a>| row.line.time.is_set().then(|| row.line.time.unix_s());
    let columns = [
        ("identity", text(|row| row.identity)),
        ("cell", text(|row| &row.line.cell)),
        ("robot", text(|row| &row.line.robot)),
        ("result", LongValues::Count(rows.iter().map(|row| Some(row.line.result)).collect())),
        ("time", LongValues::Time(rows.iter().map(time).collect())),
        ("method", text(|row| &row.line.method)),
        ("configuration", text(|row| &row.line.configuration)),
        ("regrouping", text(|row| &row.line.regrouping)),
        ("parameter", text(|row| &row.parameter.name)),
        ("unit", text(|row| &row.parameter.unit)),
        ("value", number(|row| Some(row.parameter.value))),
        ("standard_deviation", number(|row| Some(row.parameter.standard_deviation))),
        ("combined_standard_deviation", number(|row| row.parameter.combined_standard_deviation)),
        ("relative_error", number(|row| row.line.relative_error)),
        ("applicable", flag(&|row| Some(row.line.applicable))),
        ("monitoring", good(Use::Monitoring)),
        ("prediction", good(Use::Prediction)),
        ("contact_detection", good(Use::ContactDetection)),
        ("physical_values", good(Use::PhysicalValues)),
        ("rigid_body", good(Use::RigidBody)),
        ("payload_kg", number(|row| row.line.payload_kg())),
        ("temperature_c", number(|row| row.line.note.as_ref()?.temperature_c)),
        (
            "note",
            text(|row| row.line.note.as_ref().and_then(|note| note.text.as_deref()).unwrap_or("")),
        ),
        ("motor_temperature_c", number(|row| row.line.readings.mean_temperature_c())),
    ];
    columns.map(|(name, values)| LongColumn { name, values }).into()
}

/// One parameter of one result.
struct Row<'a> {
    identity: &'a str,
    line: &'a HistoryLine,
    parameter: &'a ParameterValue,
}
