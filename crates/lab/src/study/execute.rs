//! Executes the remaining runs on several threads.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use super::grid::Grid;
use super::progress::Progress;
use super::run::{run, simulate_cell};
use super::{Run, Shard, Store, StudyError};

/// Interval of progress reports while no run ends.
const PROGRESS_INTERVAL: Duration = Duration::from_secs(1);

/// Experiment of one grid cell with one seed, and the methods that still have to be run on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Job {
    /// Number of the experiment in the order of the study. It does not depend on the completed
    /// runs.
    pub(super) number: u64,
    cell: usize,
    seed: u64,
    pub(super) methods: Vec<usize>,
}

/// Message of a worker thread.
enum Event {
    Simulated(Duration),
    /// Index of the method, the run, and the duration of the run.
    Identified(usize, Run, Duration),
}

/// Executes the runs of a part that are not in `done`, on `threads` threads. Each run is stored
/// when it ends. Once `stop` is true, no further run begins. A run depends only on its grid cell,
/// its method and its seed.
///
/// # Errors
/// [`StudyError`], if a run cannot be stored.
pub fn execute(
    grid: &Grid,
    shard: Shard,
    done: &[Run],
    store: &mut Store,
    threads: usize,
    stop: &AtomicBool,
    report: &mut dyn FnMut(&Progress),
) -> Result<Progress, StudyError> {
    let planned = remaining_jobs(grid, &[], shard).iter().map(|job| job.methods.len() as u64).sum();
    let jobs = remaining_jobs(grid, done, shard);
    let simulations = jobs.len();
    let count = |method| jobs.iter().filter(|job| job.methods.contains(&method)).count();
    let counts = (0..grid.plan.method.len()).map(count).collect();
    let mut progress = Progress::new(planned, counts, simulations, threads);
    report(&progress);
    let (next, halt) = (AtomicUsize::new(0), AtomicBool::new(false));
    let halted = || stop.load(Ordering::Relaxed) || halt.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        let (sender, events) = sync_channel(64);
        for _ in 0..threads.min(jobs.len()) {
            let (sender, jobs, next, halted) = (sender.clone(), &jobs, &next, &halted);
            scope.spawn(move || {
                while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if halted() || !do_job(grid, job, &sender, halted) {
                        return;
                    }
                }
            });
        }
        drop(sender);
        loop {
            match events.recv_timeout(PROGRESS_INTERVAL) {
                Ok(Event::Simulated(time)) => progress.add_simulation(time),
                Ok(Event::Identified(method, run, time)) => {
                    if let Err(error) = store.add(&run) {
                        // The threads end when the receiver is dropped.
                        halt.store(true, Ordering::Relaxed);
                        return Err(error);
                    }
                    progress.add_identification(method, time);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            report(&progress);
        }
    })?;
    Ok(progress)
}

/// Does one job. Returns `false` if the study was stopped or the receiver was dropped.
fn do_job(grid: &Grid, job: &Job, events: &SyncSender<Event>, halted: &dyn Fn() -> bool) -> bool {
    let cell = &grid.cells[job.cell];
    let begin = Instant::now();
    let record = simulate_cell(cell, job.seed);
    let mut listened = events.send(Event::Simulated(begin.elapsed())).is_ok();
    for &method in &job.methods {
        if halted() || !listened {
            return false;
        }
        let begin = Instant::now();
        let run = run(grid, cell, &grid.plan.method[method], job.seed, &record);
        listened = events.send(Event::Identified(method, run, begin.elapsed())).is_ok();
    }
    listened
}

/// Returns the remaining jobs of a part in the order of their seeds, so that an interrupted study
/// has few seeds in many grid cells, not many seeds in few.
pub(super) fn remaining_jobs(grid: &Grid, done: &[Run], shard: Shard) -> Vec<Job> {
    let key = |run: &Run| (run.levels.clone(), run.method.clone(), run.seed);
    let done: BTreeSet<_> = done.iter().map(key).collect();
    let methods = &grid.plan.method;
    let seeds = methods.iter().map(|method| method.seeds).max().unwrap_or(0);
    let job = |(number, (seed, cell)): (u64, (u64, usize))| {
        let levels = grid.level_names(&grid.cells[cell]);
        let methods = (0..methods.len())
            .filter(|method: &usize| {
                let plan = &methods[*method];
                seed <= plan.seeds
                    && !done.contains(&(levels.clone(), plan.name().to_owned(), seed))
            })
            .collect();
        Job { number, cell, seed, methods }
    };
    let tasks = (1..=seeds).flat_map(|seed| (0..grid.cells.len()).map(move |cell| (seed, cell)));
    let tasks = (0..).zip(tasks).filter(|(number, _)| shard.shard_of_experiment(*number) == shard);
    tasks.map(job).filter(|job| !job.methods.is_empty()).collect()
}
