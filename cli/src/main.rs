//! The `didim` command.

use std::process::ExitCode;

use didim_formats::Spill;

#[global_allocator]
static MEMORY: Spill = Spill;

fn main() -> ExitCode {
    didim_cli::main()
}
