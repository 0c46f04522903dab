//! `didim completions`: prints the completions of a shell.

use clap::Args;
use clap_complete::Shell;

use crate::CliError;
use crate::output::print;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The shell
    shell: Shell,
}

pub(super) fn execute(arguments: &Arguments, mut command: clap::Command) -> Result<(), CliError> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "didim", &mut text);
    print(&String::from_utf8_lossy(&text))
}
