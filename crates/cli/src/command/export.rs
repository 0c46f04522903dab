//! `didim export`: exports a stored result as a model for other tools.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::CliError;
use crate::input::{Samples, parse_positive};
use crate::names::{DEFAULT_CELL, format_parser};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_text};
use crate::stream::InputFileOrStream;
use didim::analysis::{
    ConsistentModel, Format, NO_FRICTION, OTHER_CONFIGURATION, StoredModel, measurement_pairs,
};
use didim::cell::Cell;
use didim::report::consistent_summary;
use didim::text::to_uncertainty;
use didim_formats::LeftOut;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The result: a file that the service stored, or the file of `didim identify --out`
    #[arg(long, value_name = "FILE")]
    result: PathBuf,
    /// Format of the export
    #[arg(long, value_name = "FORMAT", value_parser = format_parser())]
    to: Format,
    /// The file; standard output when left out
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Mass of all moving links \[kg\] from the data sheet: for a robot whose file has no nominal
    /// bodies, or wrong ones
    #[arg(long, value_name = "KG", value_parser = parse_positive, allow_negative_numbers = true)]
    total_mass_kg: Option<f64>,
    /// A recording for the error before and after, preferably one that the result is not from
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { cell, result, to, out, total_mass_kg, input } = arguments;
    let cell_file = cell;
    let cell = Cell::read(cell).map_err(CliError::from_configuration)?;
    let read = [cell_file, result, &cell.robot_file].into_iter().chain(input);
    let read: Vec<&Path> = read.map(PathBuf::as_path).collect();
    check_outputs(out, &read)?;
    let (model, cell) =
        StoredModel::read_stored_model(result, cell).map_err(CliError::from_failure)?;
    let consistent = ConsistentModel::from_result(&cell, &model, *total_mass_kg)
        .map_err(|error| CliError::in_file(result, error))?;
    let name = out.as_deref().and_then(|path| path.file_stem()?.to_str()).unwrap_or("arm");
    let exported = consistent.write(*to, name).map_err(|error| CliError::in_file(result, error))?;
    let costs = input.as_deref().map(|input| {
        let input = InputFileOrStream::open(input)?;
        let parts = Samples::default().read(&input, &cell)?;
        let predictions = consistent.predict_both(&measurement_pairs(&parts));
        let predictions =
            predictions.map_err(|error| CliError::in_file(input.displayed_path(), error))?;
        let [identified, possible] = predictions.map(|of| 100.0 * of.error.relative_error);
        Ok(format!(
            "error on {}: {identified:.2} % as identified, {possible:.2} % consistent\n",
            input.displayed_path().display()
        ))
    });
    let costs = costs.transpose()?;
    match out {
        Some(path) => write_text(path, &exported.text)?,
        None => print(&exported.text)?,
    }
    print_note(&(consistent_summary(&consistent.outcome) + &costs.unwrap_or_default()));
    if model.is_of(&cell) == Some(false) {
        print_note(&format!("note: {OTHER_CONFIGURATION}\n"));
    }
    for refusal in model.refusals(&cell.options.required_uses) {
        print_note(&format!("warning: {refusal}\n"));
    }
    if consistent.has_no_friction() {
        print_note(&format!("note: {NO_FRICTION}\n"));
    }
    for left_out in &exported.left_out {
        print_note(&format!("left out: {}\n", left_out_text(left_out, &model)));
    }
    if let (Some(path), Format::Urdf | Format::Toml) = (out, to) {
        print_note(&NextCommand::new("robot").with_argument(path).to_string());
    }
    Ok(())
}

/// Largest number of digits of a value that is left out.
const MAX_DIGITS: usize = 6;

/// Returns a part that the format cannot hold, its value with the digits that its combined
/// uncertainty allows.
fn left_out_text(left_out: &LeftOut, model: &StoredModel) -> String {
    let named = left_out.name.as_deref().zip(left_out.value);
    let with_deviation =
        named.and_then(|(name, value)| Some((name, value, model.combined_deviation(name)?)));
    let Some((name, value, deviation)) = with_deviation else { return left_out.to_string() };
    let value = to_uncertainty(value, deviation, MAX_DIGITS);
    let deviation = to_uncertainty(deviation, deviation, 2);
    format!("{}: {name} = {value} ± {deviation} {} (combined)", left_out.subject(), left_out.unit)
}
