//! A table for which there is too little memory.

use std::ffi::OsStr;
use std::fmt::{Display, Write as _};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::program::repository;

/// Rows of the table, of six axes.
const ROWS: usize = 60_000;
/// Memory that the program may take without files \[kB\]: half of what these rows take.
const MOST_KB: usize = 40_000;
/// Too little for so many rows, by the 36 bytes that are asked for each of their 13 values.
const TOO_LITTLE_KB: usize = 24_000;

/// `didim identify --json` with so much memory at most, and files in that folder.
fn identify(table: &Path, most_kb: impl Display, temporary: impl AsRef<OsStr>) -> Output {
    let run =
        format!("ulimit -d {most_kb} && exec \"$0\" identify --json --cell \"$1\" --input \"$2\"");
    let cell = repository("tests/data/kr300/cell.toml");
    let mut shell = Command::new("sh");
    shell.args(["-c", &run, env!("CARGO_BIN_EXE_didim")]).args([&cell, table]);
    shell.env("TMPDIR", temporary.as_ref()).output().unwrap()
}

#[test]
fn a_table_beyond_the_free_memory_has_the_same_result_to_the_last_digit() {
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

    fn result(output: Output) -> Value {
        assert!(output.status.success(), "{output:?}");
        let mut result: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(result["elapsed_ms"].take().is_number());
        result
    }
    let limited = result(identify(&table, MOST_KB, folder.path()));
    assert_eq!(limited["samples"], ROWS);
    assert_eq!(limited, result(identify(&table, "unlimited", folder.path())));
    // Without files that much memory is too little.
    assert!(!identify(&table, MOST_KB, "/nowhere").status.success());
    // Files in memory are no room beyond it.
    let refused = identify(&table, TOO_LITTLE_KB, "/dev/shm");
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("more than 52512 samples") && said.contains("TMPDIR"), "{said}");
}
