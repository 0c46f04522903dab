//! The history as a long table for databases, with a row for each parameter of each result, or for
//! each result.

use core::fmt::Display;
use std::io::Write;

use didim_formats::{LongColumn, LongFormat, LongTable, LongTableError, LongValues};
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

/// Rows of a long table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LongRows {
    /// One for each parameter of each result.
    Parameters,
    /// One for each result. Its parameters are lists in the form of PostgreSQL's arrays, as
    /// `{fc1,fc2}`.
    Results,
}

/// Writes a table for these parameters, oldest result first. Keeps some results in memory at a
/// time.
///
/// # Errors
/// [`LongHistoryError`].
pub fn write_long_table(
    history: &JudgedHistory,
    (format, rows): (LongFormat, LongRows),
    parameters: &[&str],
    output: &mut (dyn Write + Send),
) -> Result<(), LongHistoryError> {
    let mut table = format.table(output)?;
    let (mut batch, mut written) = (Vec::new(), Ok(()));
    history.for_each_entry(|entry| {
        if written.is_ok() {
            batch.push((entry.line.identity(), entry.line.clone()));
            if batch.len() >= BATCH_RESULTS {
                written = write_batch(&mut table, &batch, rows, parameters);
                batch.clear();
            }
        }
    })?;
    written?;
    write_batch(&mut table, &batch, rows, parameters)?;
    Ok(table.finish()?)
}

/// Results with their identities.
type Results = [(String, HistoryLine)];

fn write_batch(
    table: &mut LongTable<'_>,
    results: &Results,
    rows: LongRows,
    parameters: &[&str],
) -> Result<(), LongTableError> {
    let is_chosen = |of: &&ParameterValue| parameters.contains(&of.name.as_str());
    match rows {
        LongRows::Parameters => {
            let chosen: Vec<(ResultRow<'_>, &ParameterValue)> = results
                .iter()
                .flat_map(|(identity, line)| {
                    let parameters = line.parameters.iter().filter(is_chosen);
                    parameters.map(move |parameter| (ResultRow { identity, line }, parameter))
                })
                .collect();
            let (rows, parameters): (Vec<ResultRow<'_>>, Vec<&ParameterValue>) =
                chosen.into_iter().unzip();
            table.write(&columns(&rows, parameter_columns(&parameters)))
        }
        LongRows::Results => {
            let lists: Vec<[String; 5]> = results
                .iter()
                .map(|(_, line)| {
                    lists(&line.parameters.iter().filter(is_chosen).collect::<Vec<_>>())
                })
                .collect();
            let rows: Vec<ResultRow<'_>> =
                results.iter().map(|(identity, line)| ResultRow { identity, line }).collect();
            table.write(&columns(&rows, list_columns(&lists)))
        }
    }
}

/// Returns the columns of the table with those of the parameters. A value that a result does not
/// contain is missing, and so is the time of a result that was stored while the clock was not set.
fn columns<'a>(
    rows: &[ResultRow<'a>],
    of_parameters: impl IntoIterator<Item = LongColumn<'a>>,
) -> Vec<LongColumn<'a>> {
    let text = |of: fn(&ResultRow<'a>) -> &'a str| {
        let texts = rows.iter().map(|row| Some(of(row)).filter(|text| !text.is_empty()));
        LongValues::Text(texts.collect())
    };
    let number =
        |of: fn(&ResultRow<'a>) -> Option<f64>| LongValues::Number(rows.iter().map(of).collect());
    let flag = |of: &dyn Fn(&ResultRow<'a>) -> Option<bool>| {
        LongValues::Flag(rows.iter().map(of).collect())
    };
    let good = |of: Use| flag(&move |row| row.line.is_good_for(of));
    let time = |row: &ResultRow<'a>| row.line.time.is_set().then(|| row.line.time.unix_s());
    let of_result = [
        ("identity", text(|row| row.identity)),
        ("cell", text(|row| &row.line.cell)),
        ("robot", text(|row| &row.line.robot)),
        ("result", LongValues::Count(rows.iter().map(|row| Some(row.line.result)).collect())),
        ("time", LongValues::Time(rows.iter().map(time).collect())),
        ("method", text(|row| &row.line.method)),
        ("configuration", text(|row| &row.line.configuration)),
        ("regrouping", text(|row| &row.line.regrouping)),
    ];
    let of_verdict = [
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
    let column = |(name, values)| LongColumn { name, values };
    let before = of_result.map(column).into_iter();
    before.chain(of_parameters).chain(of_verdict.map(column)).collect()
}

/// Returns the columns of rows for parameters. Values are in the unit of their row.
fn parameter_columns<'a>(parameters: &[&'a ParameterValue]) -> [LongColumn<'a>; 5] {
    let text = |of: fn(&'a ParameterValue) -> &'a str| {
        LongValues::Text(parameters.iter().map(|own| Some(of(own))).collect())
    };
    let number = |of: fn(&ParameterValue) -> Option<f64>| {
        LongValues::Number(parameters.iter().map(|own| of(own)).collect())
    };
    [
        ("parameter", text(|own| &own.name)),
        ("unit", text(|own| &own.unit)),
        ("value", number(|own| Some(own.value))),
        ("standard_deviation", number(|own| Some(own.standard_deviation))),
        ("combined_standard_deviation", number(|own| own.combined_standard_deviation)),
    ]
    .map(|(name, values)| LongColumn { name, values })
}

/// Returns the columns of rows for results.
fn list_columns(lists: &[[String; 5]]) -> [LongColumn<'_>; 5] {
    const NAMES: [&str; 5] =
        ["parameters", "units", "values", "standard_deviations", "combined_standard_deviations"];
    core::array::from_fn(|list| LongColumn {
        name: NAMES[list],
        values: LongValues::Text(lists.iter().map(|own| Some(own[list].as_str())).collect()),
    })
}

/// Returns the lists of the parameters of one result, in the order of the columns.
fn lists(parameters: &[&ParameterValue]) -> [String; 5] {
    let texts =
        |of: fn(&ParameterValue) -> &str| array(parameters.iter().map(|own| quoted(of(own))));
    let numbers = |of: fn(&ParameterValue) -> Option<f64>| {
        array(parameters.iter().map(|own| match of(own).filter(|value| value.is_finite()) {
            Some(value) => value.to_string(),
            None => "NULL".to_owned(),
        }))
    };
    [
        texts(|own| &own.name),
        texts(|own| &own.unit),
        numbers(|own| Some(own.value)),
        numbers(|own| Some(own.standard_deviation)),
        numbers(|own| own.combined_standard_deviation),
    ]
}

fn array(items: impl Iterator<Item = impl Display>) -> String {
    let mut text = "{".to_owned();
    for (number, item) in items.enumerate() {
        text += if number > 0 { "," } else { "" };
        text += &item.to_string();
    }
    text + "}"
}

/// Returns a text as an element of an array, with quotes where it needs them.
fn quoted(text: &str) -> String {
    let is_plain = |of: char| of.is_alphanumeric() || "_-·/.".contains(of);
    if !text.is_empty() && text.chars().all(is_plain) && !text.eq_ignore_ascii_case("null") {
        return text.to_owned();
    }
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// One result of a row.
#[derive(Clone, Copy)]
struct ResultRow<'a> {
    identity: &'a str,
    line: &'a HistoryLine,
}
