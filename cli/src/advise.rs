//! `didim advise`: what a result lacks, and motions that bring it, in words; nothing is moved.

use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use super::design::{Subject, Within, format_of, motion_text, wanted};
use super::names::DEFAULT_CELL;
use super::output::{check_outputs, print, write_text};
use super::progress::Working;
use super::tell::tell;
use didim::cell::Cell;
use didim::offline::{Advised, OTHER_CONFIGURATION, StoredModel};
use didim::report::{advice_text, foretold_lines, lacking_text};
use didim_core::identification::Estimate;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The result: a file that the service stored, or what `didim identify --json` printed
    #[arg(value_name = "RESULT")]
    result: PathBuf,
    /// The cell that it was identified with
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    #[command(flatten)]
    within: Within,
    /// Write the motions too: next.csv becomes next-1.csv, next-2.csv …; the endings are those of `didim design`
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { result, cell, out, .. } = arguments;
    check_outputs(out, &[result.as_path(), cell.as_path()])?;
    let cell = Cell::read(cell).map_err(CliError::configuration)?;
    let (model, cell) = StoredModel::read(result, cell).map_err(CliError::failed)?;
    let format = match out {
        Some(path) => Some((path, format_of(path, cell.robot.joints())?)),
        None => None,
    };
    if model.is_of(&cell) == Some(false) {
        tell(&format!("note: {OTHER_CONFIGURATION}\n"));
    }
    let working = Working::on("trying motions");
    let (subject, advised) = working.during(|| advised(&cell, &model, &arguments.within))?;
    if let Some((path, format)) = format {
        for (number, piece) in (1..).zip(&advised.advice.pieces) {
            let path = numbered(path, number);
            let foretold = foretold_lines(&subject.assignment, &piece.deviations);
            write_text(
                &path,
                &motion_text(
                    &path,
                    format,
                    &subject,
                    &piece.design.series,
                    (&piece.design).into(),
                    &foretold,
                )?,
            )?;
        }
    }
    print(&advice_text(&cell.robot, &subject.assignment, &advised))
}

/// What a result of a cell lacks, in words.
pub(super) fn advice_for(cell: &Cell, estimate: &Estimate) -> Result<String, CliError> {
    let json = serde_json::to_vec(estimate).map_err(CliError::failed)?;
    let read = StoredModel::parse(&json, Path::new("the result"), cell.clone());
    let (model, cell) = read.map_err(CliError::failed)?;
    let (subject, advised) = advised(&cell, &model, &Within::default())?;
    Ok(lacking_text(&cell.robot, &subject.assignment, &advised))
}

fn advised(
    cell: &Cell,
    model: &StoredModel,
    within: &Within,
) -> Result<(Subject, Advised), CliError> {
    let accelerations = within.accelerations(cell.robot.joints());
    // Neither the length nor what is wanted of a designed motion counts here.
    let wanted = wanted(within, accelerations.as_deref(), 1.0);
    let subject = Subject::of_cell(cell, Some(model), &wanted)?;
    let advised = Advised::new(cell, model, &subject.assignment).map_err(CliError::failed)?;
    Ok((subject, advised))
}

/// `next.csv` with a number before its ending.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let part = |of: Option<&std::ffi::OsStr>| {
        of.and_then(std::ffi::OsStr::to_str).unwrap_or_default().to_owned()
    };
    let (stem, ending) = (part(path.file_stem()), part(path.extension()));
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}
