//! The `didim` command.
fn main() {}
