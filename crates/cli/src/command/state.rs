//! `didim state`: writes the folder of results for an earlier version of the program.

use clap::Args;

use crate::CliError;
use crate::output::count_with_noun;
use crate::state::WhichState;
use crate::terminal::print_for_terminal;
use didim::archive::store::{EarlierVersion, NEWER_FOLDER};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The earlier version that shall read the folder: 0.2
    #[arg(long = "for", value_name = "VERSION", required = true, value_parser = parse_version)]
    version: EarlierVersion,
    #[command(flatten)]
    state: WhichState,
}

/// Parses a version that this one can write for.
fn parse_version(text: &str) -> Result<EarlierVersion, String> {
    EarlierVersion::parse(text).ok_or_else(|| {
        format!(
            "didim {} writes for version 0.2 only; a later one needs no command",
            env!("CARGO_PKG_VERSION")
        )
    })
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let (folder, _) = arguments.state.find()?;
    let written = arguments.version.write_folder(&folder).map_err(CliError::from_failure)?;
    let lines = match written.lines {
        0 => "the history is in one file already".to_owned(),
        lines => format!("the history is one file of {}", count_with_noun(lines, "line")),
    };
    print_for_terminal(&format!(
        "{}: {} rewritten; {lines}; {} moved to {NEWER_FOLDER}/\n",
        folder.display(),
        count_with_noun(written.rewritten, "file"),
        count_with_noun(written.files_moved, "file"),
    ))
}
