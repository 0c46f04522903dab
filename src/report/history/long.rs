//! The history as a long table for databases, with one row per parameter of each result.

use didim_formats::{LongColumn, LongValues};
use didim_identification::identification::Use;

use crate::archive::drift::JudgedHistory;
use crate::archive::store::{HistoryLine, ParameterValue};

/// Returns the identity of each result, in the order of the results.
pub fn identities(history: &JudgedHistory) -> Vec<String> {
    history.entries.iter().map(|entry| entry.line.identity()).collect()
}

/// Returns the columns of the table for these parameters, oldest result first. Values are in the
/// unit of their row. A value that a result does not contain is missing, and so is the time of a
/// result that was stored while the clock was not set.
pub fn long_table<'a>(
    history: &'a JudgedHistory,
    identities: &'a [String],
    parameters: &[&str],
) -> Vec<LongColumn<'a>> {
    let lines = history.entries.iter().map(|entry| &entry.line).zip(identities);
    let rows: Vec<Row<'a>> = lines
        .flat_map(|(line, identity)| {
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
