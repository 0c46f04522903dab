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

/// Writes a table for these parameters, oldest result first. A row that stands for the results of a
/// day has their number. Keeps some results in memory at a time.
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
    match rows {
        LongRows::Parameters => {
            let chosen = results.iter().flat_map(|(identity, line)| {
                let values = parameter_values(line, parameters);
                values.map(move |value| (ResultRow { identity, line }, value))
            });
            let (rows, values): (Vec<ResultRow<'_>>, Vec<RowValue<'_>>) = chosen.unzip();
            table.write(&columns(&rows, parameter_columns(&values)))
        }
        LongRows::Results => {
            let lists: Vec<[String; LISTS]> = results
                .iter()
                .map(|(_, line)| lists(&parameter_values(line, parameters).collect::<Vec<_>>()))
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
    let count =
        |of: fn(&ResultRow<'a>) -> Option<u64>| LongValues::Count(rows.iter().map(of).collect());
    let flag = |of: &dyn Fn(&ResultRow<'a>) -> Option<bool>| {
        LongValues::Flag(rows.iter().map(of).collect())
    };
    let good = |of: Use| flag(&move |row| row.line.is_good_for(of));
    let time = |row: &ResultRow<'a>| row.line.time.is_set().then(|| row.line.time.unix_s());
    let of_result = [
        ("identity", text(|row| row.identity)),
        ("cell", text(|row| &row.line.cell)),
        ("robot", text(|row| &row.line.robot)),
        ("result", count(|row| Some(row.line.result))),
        ("results", count(|row| Some(row.line.day.as_ref()?.results))),
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
        ("motor_temperature_c", number(motor_temperature_c)),
    ];
    let column = |(name, values)| LongColumn { name, values };
    let before = of_result.map(column).into_iter();
    before.chain(of_parameters).chain(of_verdict.map(column)).collect()
}

/// Returns the mean temperature of the motors, or the median of a day.
fn motor_temperature_c(row: &ResultRow<'_>) -> Option<f64> {
    match &row.line.day {
        Some(day) => day.temperature_c,
        None => row.line.readings.mean_temperature_c(),
    }
}

/// A parameter of a result, with the standard deviation between the results of a day.
type RowValue<'a> = (&'a ParameterValue, Option<f64>);

/// Returns the values of a row that are among `parameters`.
fn parameter_values<'a>(
    line: &'a HistoryLine,
    parameters: &[&str],
) -> impl Iterator<Item = RowValue<'a>> {
    let scatter = |index: usize| line.day.as_ref()?.scatter.get(index).copied().flatten();
    let values = line.parameters.iter().enumerate();
    let values = values.filter(|(_, value)| parameters.contains(&value.name.as_str()));
    values.map(move |(index, value)| (value, scatter(index)))
}

/// Returns the columns of rows for parameters. Values are in the unit of their row.
fn parameter_columns<'a>(values: &[RowValue<'a>]) -> [LongColumn<'a>; LISTS] {
    let text = |of: fn(&'a ParameterValue) -> &'a str| {
        let texts = values.iter().map(|(value, _)| Some(of(value)).filter(|text| !text.is_empty()));
        LongValues::Text(texts.collect())
    };
    let number =
        |of: fn(&RowValue<'a>) -> Option<f64>| LongValues::Number(values.iter().map(of).collect());
    [
        ("parameter", text(|value| &value.name)),
        ("unit", text(|value| &value.unit)),
        ("value", number(|(value, _)| Some(value.value))),
        ("standard_deviation", number(|(value, _)| Some(value.standard_deviation))),
        ("combined_standard_deviation", number(|(value, _)| value.combined_standard_deviation)),
        ("scatter", number(|(_, scatter)| *scatter)),
    ]
    .map(|(name, values)| LongColumn { name, values })
}

/// Number of columns about parameters.
const LISTS: usize = 6;

/// Returns the columns of rows for results.
fn list_columns(lists: &[[String; LISTS]]) -> [LongColumn<'_>; LISTS] {
    const NAMES: [&str; LISTS] = [
        "parameters",
        "units",
        "values",
        "standard_deviations",
        "combined_standard_deviations",
        "scatters",
    ];
    core::array::from_fn(|list| LongColumn {
        name: NAMES[list],
        values: LongValues::Text(lists.iter().map(|own| Some(own[list].as_str())).collect()),
    })
}

/// Returns the lists of the parameters of one result, in the order of the columns.
fn lists(values: &[RowValue<'_>]) -> [String; LISTS] {
    let texts =
        |of: fn(&ParameterValue) -> &str| array(values.iter().map(|(value, _)| quoted(of(value))));
    let numbers = |of: fn(&RowValue<'_>) -> Option<f64>| {
        array(values.iter().map(|value| match of(value).filter(|number| number.is_finite()) {
            Some(number) => number.to_string(),
            None => "NULL".to_owned(),
        }))
    };
    [
        texts(|value| &value.name),
        texts(|value| &value.unit),
        numbers(|(value, _)| Some(value.value)),
        numbers(|(value, _)| Some(value.standard_deviation)),
        numbers(|(value, _)| value.combined_standard_deviation),
        numbers(|(_, scatter)| *scatter),
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
