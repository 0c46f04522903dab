//! Merges the parts of a study.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

use super::execute::{Job, remaining_jobs};
use super::grid::Grid;
use super::shard::Shard;
use super::{Header, Run, Store, StudyError};

/// Key that distinguishes a run of a study from the others: levels, method, seed.
type Key = (Vec<String>, String, u64);

fn run_key(run: &Run) -> Key {
    (run.levels.clone(), run.method.clone(), run.seed)
}

/// Run, its line, and the folder that had it first.
struct FoundRun {
    run: Run,
    line: String,
    folder: PathBuf,
}

impl FoundRun {
    /// Checks that the same run in another folder is equal.
    fn check_equal(&self, run: &Run, folder: &Path) -> Result<(), StudyError> {
        if self.run == *run {
            return Ok(());
        }
        let (folder, other) = (folder.to_owned(), self.folder.clone());
        let run = format!("{}, seed {}, {}", run.method, run.seed, run.levels.join(", "));
        Err(StudyError::Differ { folder, other, run })
    }
}

/// Merges the runs of several folders into `out`. The result equals the folder of a study on one
/// machine. Folders may come in any order and more than once, and `out` may already have runs. Runs
/// that occur twice have to be equal.
///
/// # Errors
/// [`StudyError`]: a folder is of another study, or divided in another way; two runs differ; parts
/// are missing. Nothing is written then.
pub fn merge(grid: &Grid, folders: &[PathBuf], out: &Path) -> Result<Vec<Run>, StudyError> {
    let header = Header::from_grid(grid);
    let mut runs_found: BTreeMap<Key, FoundRun> = BTreeMap::new();
    let mut division: Option<Shard> = None;
    for folder in folders {
        let (shard, runs) = Store::read(folder, &header)?;
        let first = *division.get_or_insert(shard);
        if first.part_count() != shard.part_count() {
            let (folder, parts) = (folder.clone(), shard.part_count());
            return Err(StudyError::OtherDivision { folder, parts, others: first.part_count() });
        }
        for (run, line) in runs {
            match runs_found.entry(run_key(&run)) {
                Entry::Occupied(entry) => entry.get().check_equal(&run, folder)?,
                Entry::Vacant(free) => {
                    free.insert(FoundRun { run, line, folder: folder.clone() });
                }
            }
        }
    }
    let present: Vec<Run> = runs_found.values().map(|found| found.run.clone()).collect();
    let missing = missing_parts(grid, &present, division.unwrap_or(Shard::COMPLETE));
    if !missing.is_empty() {
        return Err(StudyError::Missing { parts: missing });
    }
    let (mut store, mut runs) = Store::open(out, &header)?;
    for run in &runs {
        if let Some(found) = runs_found.remove(&run_key(run)) {
            found.check_equal(run, out)?;
        }
    }
    for FoundRun { run, line, .. } in runs_found.into_values() {
        store.add_line(&line)?;
        runs.push(run);
    }
    Ok(runs)
}

/// Returns the parts with missing runs, and the number of these runs.
fn missing_parts(grid: &Grid, there: &[Run], division: Shard) -> Vec<(Shard, usize)> {
    let mut missing = BTreeMap::new();
    for Job { number, methods, .. } in remaining_jobs(grid, there, Shard::COMPLETE) {
        let part = division.shard_of_experiment(number);
        missing.entry(part.index()).or_insert((part, 0)).1 += methods.len();
    }
    missing.into_values().collect()
}
