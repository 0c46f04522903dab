//! The parts of a study, put together.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

use super::execute::{Job, jobs};
use super::grid::Grid;
use super::shard::Shard;
use super::{Header, Run, Store, StudyError};

/// What tells one run of a study from the others: levels, method, seed.
type Key = (Vec<String>, String, u64);

fn key(run: &Run) -> Key {
    (run.levels.clone(), run.method.clone(), run.seed)
}

/// A run, its line, and the folder that had it first.
struct Found {
    run: Run,
    line: String,
    folder: PathBuf,
}

impl Found {
    /// That the same run in another folder is the same.
    fn check(&self, run: &Run, folder: &Path) -> Result<(), StudyError> {
        if self.run == *run {
            return Ok(());
        }
        let (folder, other) = (folder.to_owned(), self.folder.clone());
        let run = format!("{}, seed {}, {}", run.method, run.seed, run.levels.join(", "));
        Err(StudyError::Differ { folder, other, run })
    }
}

/// Puts the runs of several folders into `out`, a study's folder as one machine would have made it. Folders may come in any
/// order and more than once, and `out` may have runs already; what is there twice has to be the same.
///
/// # Errors
/// [`StudyError`]: a folder is of another study, or divided in another way; two runs differ; parts are missing. Nothing is
/// written then.
pub fn merge(grid: &Grid, folders: &[PathBuf], out: &Path) -> Result<Vec<Run>, StudyError> {
    let header = Header::of(grid);
    let mut found: BTreeMap<Key, Found> = BTreeMap::new();
    let mut division: Option<Shard> = None;
    for folder in folders {
        let (shard, runs) = Store::read(folder, &header)?;
        let first = *division.get_or_insert(shard);
        if first.of() != shard.of() {
            let (folder, parts) = (folder.clone(), shard.of());
            return Err(StudyError::OtherDivision { folder, parts, others: first.of() });
        }
        for (run, line) in runs {
            match found.entry(key(&run)) {
                Entry::Occupied(known) => known.get().check(&run, folder)?,
                Entry::Vacant(free) => {
                    free.insert(Found { run, line, folder: folder.clone() });
                }
            }
        }
    }
    let there: Vec<Run> = found.values().map(|found| found.run.clone()).collect();
    let missing = missing(grid, &there, division.unwrap_or(Shard::WHOLE));
    if !missing.is_empty() {
        return Err(StudyError::Missing { parts: missing });
    }
    let (mut store, mut runs) = Store::open(out, &header)?;
    for run in &runs {
        if let Some(found) = found.remove(&key(run)) {
            found.check(run, out)?;
        }
    }
    for Found { run, line, .. } in found.into_values() {
        store.add_line(&line)?;
        runs.push(run);
    }
    Ok(runs)
}

/// The parts that lack runs, with how many.
fn missing(grid: &Grid, there: &[Run], division: Shard) -> Vec<(Shard, usize)> {
    let mut missing = BTreeMap::new();
    for Job { number, methods, .. } in jobs(grid, there, Shard::WHOLE) {
        let part = division.holding(number);
        missing.entry(part.index()).or_insert((part, 0)).1 += methods.len();
    }
    missing.into_values().collect()
}
