//! The `didim` command.

use std::process::ExitCode;

use didim_formats::DiskAllocator;

#[global_allocator]
static MEMORY: DiskAllocator = DiskAllocator;

fn main() -> ExitCode {
    didim_cli::main()
}
