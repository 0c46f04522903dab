//! Merges the parts of a study.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

use super::execute::{Job, remaining_jobs};
use super::grid::Grid;
use super::shard::Shard;
use super::{Header, Run, Store, StudyError};

/// Key that identifies a run within a study: level names, method name and seed.
type Key = (Vec<String>, String, u64);

fn run_key(run: &Run) -> Key {
    (run.levels.clone(), run.method.clone(), run.seed)
}

/// Run, its line in the file, and the folder in which it was found first.
struct FoundRun {
    run: Run,
    line: String,
    folder: PathBuf,
}

impl FoundRun {
    /// Checks that the same run in another folder has the same result.
    fn check_equal(&self, run: &Run, folder: &Path) -> Result<(), StudyError> {
        if self.run == *run {
            return Ok(());
        }
        let (folder, other) = (folder.to_owned(), self.folder.clone());
        let run = format!("{}, seed {}, {}", run.method, run.seed, run.levels.join(", "));
        Err(StudyError::Differ { folder, other, run })
    }
}

/// Merges the runs of several folders into `out`. Then `out` equals the folder of a study that ran
/// on one machine. The folders may be listed in any order and more than once, and `out` may already
/// contain runs. Two results of the same run have to be equal.
///
/// # Errors
/// [`StudyError`]: a folder belongs to another study or another division, two results of the same
/// run differ, or runs are missing. Nothing is written in these cases.
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

/// Returns each part that has missing runs, with the number of its missing runs.
fn missing_parts(grid: &Grid, there: &[Run], division: Shard) -> Vec<(Shard, usize)> {
    let mut missing = BTreeMap::new();
    for Job { number, methods, .. } in remaining_jobs(grid, there, Shard::COMPLETE) {
        let part = division.shard_of_experiment(number);
        missing.entry(part.index()).or_insert((part, 0)).1 += methods.len();
    }
    missing.into_values().collect()
}
