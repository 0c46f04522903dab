//! `didim advise`: describes the insufficiently identified parameters of a result, and motions that
//! improve them. The command does not move the arm.

use std::path::{Path, PathBuf};

use clap::Args;

use super::design::{DesignSubject, LimitShares, format_of, motion_text, requested_motion};
use crate::CliError;
use crate::names::{DEFAULT_CELL, MOTION_FILE};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_text};
use crate::progress::WorkIndicator;
use didim::analysis::{AdviceForResult, OTHER_CONFIGURATION, StoredModel};
use didim::cell::Cell;
use didim::report::{MissingAdvice, advice_text, prediction_lines};
use didim_identification::identification::Estimate;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The result: a file that the service stored, or the file of `didim identify --out`
    #[arg(value_name = "RESULT")]
    result: PathBuf,
    /// The cell of the identification
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    #[command(flatten)]
    within: LimitShares,
    /// Also write the motions: next.csv becomes next-1.csv, next-2.csv …; the extensions are those
    /// of `didim design`
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { result, cell, out, .. } = arguments;
    check_outputs(out, &[result.as_path(), cell.as_path()])?;
    let cell = Cell::read(cell).map_err(CliError::from_configuration)?;
    let (model, cell) =
        StoredModel::read_stored_model(result, cell).map_err(CliError::from_failure)?;
    let format = match out {
        Some(path) => Some((path, format_of(path, cell.robot.joints())?)),
        None => None,
    };
    if model.is_of(&cell) == Some(false) {
        print_note(&format!("note: {OTHER_CONFIGURATION}\n"));
    }
    let working = WorkIndicator::start("trying motions");
    let (subject, advised) =
        working.show_during(|| compute_advice(&cell, &model, &arguments.within))?;
    if let Some((path, format)) = format {
        for (number, piece) in (1..).zip(&advised.advice.motions) {
            let path = numbered_path(path, number);
            let predicted = prediction_lines(&subject.assignment, &piece.deviations);
            write_text(
                &path,
                &motion_text(
                    &path,
                    format,
                    &subject,
                    &piece.design.series,
                    (&piece.design).into(),
                    &predicted,
                )?,
            )?;
        }
    }
    print(&advice_text(&cell.robot, &subject.assignment, &advised))?;
    if out.is_none() && !advised.advice.motions.is_empty() {
        print_note(&NextCommand::repeated().with_option("--out", MOTION_FILE).to_string());
    }
    Ok(())
}

/// Returns the insufficiently identified parameters of a result, and motions for them.
pub(super) fn advice_for(cell: &Cell, estimate: &Estimate) -> Result<MissingAdvice, CliError> {
    let json = serde_json::to_vec(estimate).map_err(CliError::from_failure)?;
    let read = StoredModel::parse(&json, Path::new("the result"), cell.clone());
    let (model, cell) = read.map_err(CliError::from_failure)?;
    let (subject, advised) = compute_advice(&cell, &model, &LimitShares::default())?;
    Ok(MissingAdvice::new(&cell.robot, &subject.assignment, &advised))
}

fn compute_advice(
    cell: &Cell,
    model: &StoredModel,
    within: &LimitShares,
) -> Result<(DesignSubject, AdviceForResult), CliError> {
    let accelerations = within.accelerations(cell.robot.joints());
    // The length and the requirements of a designed motion have no effect here.
    let wanted = requested_motion(within, accelerations.as_deref(), 1.0);
    let subject = DesignSubject::of_cell(cell, Some(model), &wanted)?;
    let advised =
        AdviceForResult::new(cell, model, &subject.assignment).map_err(CliError::from_failure)?;
    Ok((subject, advised))
}

/// Returns `next.csv` with a number before its extension.
fn numbered_path(path: &Path, number: usize) -> PathBuf {
    let part = |of: Option<&std::ffi::OsStr>| {
        of.and_then(std::ffi::OsStr::to_str).unwrap_or_default().to_owned()
    };
    let (stem, ending) = (part(path.file_stem()), part(path.extension()));
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}
