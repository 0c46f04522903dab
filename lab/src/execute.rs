//! The runs that are left, on several threads.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use super::grid::Grid;
use super::progress::Progress;
use super::run::{run, simulated};
use super::{Run, Shard, Store, StudyError};

/// How often the progress is told while nothing ends.
const TICK: Duration = Duration::from_secs(1);

/// The arm of a cell of the grid with one seed, and the methods that have not seen it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Job {
    /// In the order of the study, whatever has been run.
    pub(super) number: u64,
    cell: usize,
    seed: u64,
    pub(super) methods: Vec<usize>,
}

/// What a thread tells of.
enum Event {
    Simulated(Duration),
    /// Method, run, and how long it took.
    Identified(usize, Run, Duration),
}

/// Runs what is of a part and not in `done` on `threads` threads and stores each run as it ends. At `stop` no
/// further run is begun. A run depends on its cell and its seed alone.
///
/// # Errors
/// [`StudyError`], when a run cannot be stored.
pub fn execute(
    grid: &Grid,
    shard: Shard,
    done: &[Run],
    store: &mut Store,
    threads: usize,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(&Progress),
) -> Result<Progress, StudyError> {
    let planned = jobs(grid, &[], shard).iter().map(|job| job.methods.len() as u64).sum();
    let jobs = jobs(grid, done, shard);
    let simulations = jobs.len();
    let left = |method| jobs.iter().filter(|job| job.methods.contains(&method)).count();
    let left = (0..grid.plan.method.len()).map(left).collect();
    let mut progress = Progress::new(planned, left, simulations, threads);
    tell(&progress);
    let (next, halt) = (AtomicUsize::new(0), AtomicBool::new(false));
    let halted = || stop.load(Ordering::Relaxed) || halt.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        let (sender, events) = sync_channel(64);
        for _ in 0..threads.min(jobs.len()) {
            let (sender, jobs, next, halted) = (sender.clone(), &jobs, &next, &halted);
            scope.spawn(move || {
                while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if halted() || !work(grid, job, &sender, halted) {
                        return;
                    }
                }
            });
        }
        drop(sender);
        loop {
            match events.recv_timeout(TICK) {
                Ok(Event::Simulated(time)) => progress.simulated(time),
                Ok(Event::Identified(method, run, time)) => {
                    if let Err(error) = store.add(&run) {
                        // The threads end when nobody listens.
                        halt.store(true, Ordering::Relaxed);
                        return Err(error);
                    }
                    progress.identified(method, time);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            tell(&progress);
        }
    })?;
    Ok(progress)
}

/// One job; `false` when nobody listens any more.
fn work(grid: &Grid, job: &Job, events: &SyncSender<Event>, halted: &dyn Fn() -> bool) -> bool {
    let cell = &grid.cells[job.cell];
    let begin = Instant::now();
    let record = simulated(cell, job.seed);
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

/// What is left of a part, the first seed of every cell first: a study that is interrupted has looked
/// everywhere.
pub(super) fn jobs(grid: &Grid, done: &[Run], shard: Shard) -> Vec<Job> {
    let key = |run: &Run| (run.levels.clone(), run.method.clone(), run.seed);
    let done: BTreeSet<_> = done.iter().map(key).collect();
    let methods = &grid.plan.method;
    let seeds = methods.iter().map(|method| method.seeds).max().unwrap_or(0);
    let job = |(number, (seed, cell)): (u64, (u64, usize))| {
        let levels = grid.level_names(&grid.cells[cell]);
        let wanted = |method: &usize| {
            let plan = &methods[*method];
            seed <= plan.seeds && !done.contains(&(levels.clone(), plan.name().to_owned(), seed))
        };
        let methods = (0..methods.len()).filter(wanted).collect();
        Job { number, cell, seed, methods }
    };
    let all = (1..=seeds).flat_map(|seed| (0..grid.cells.len()).map(move |cell| (seed, cell)));
    let own = (0..).zip(all).filter(|(number, _)| shard.holding(*number) == shard);
    own.map(job).filter(|job| !job.methods.is_empty()).collect()
}
