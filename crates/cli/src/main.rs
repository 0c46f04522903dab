//! The `didim` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    didim_cli::main()
}
