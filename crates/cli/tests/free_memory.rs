//! A table for which there is too little memory.

use std::fmt::{Display, Write as _};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::program::repository;

/// Rows of the table, of six axes.
const ROWS: usize = 60_000;
/// Too little for so many rows, by the 36 bytes that are asked for each of their 13 values.
const TOO_LITTLE_KB: usize = 24_000;

/// Runs `didim identify` with so much memory at most.
fn identify(table: &Path, most_kb: impl Display) -> Output {
    let run =
        format!("ulimit -d {most_kb} && exec \"$0\" identify --json --cell \"$1\" --input \"$2\"");
    let cell = repository("tests/data/kr300/cell.toml");
    let mut shell = Command::new("sh");
    shell.args(["-c", &run, env!("CARGO_BIN_EXE_didim")]).args([&cell, table]);
    shell.output().unwrap()
}

#[test]
fn a_table_beyond_the_free_memory_is_refused_with_the_samples_that_fit() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let table = folder.path().join("long.csv");
    // From rest to rest, forwards and backwards, over and over.
    let recording = fs::read_to_string(repository("tests/data/kr300/a.csv")).unwrap();
    let (head, rows) = recording.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().map(|row| row.split_once(',').unwrap().1).collect();
    let there_and_back = rows[450..2050].iter().chain(rows[450..2050].iter().rev()).cycle();
    let mut text = format!("{head}\n");
    for (k, row) in there_and_back.take(ROWS).enumerate() {
        writeln!(text, "{:.3},{row}", k as f64 / 250.0).unwrap();
    }
    fs::write(&table, text).unwrap();

    let complete = identify(&table, "unlimited");
    assert!(complete.status.success(), "{complete:?}");
    let refused = identify(&table, TOO_LITTLE_KB);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("more than 52512 samples"), "{said}");
}
