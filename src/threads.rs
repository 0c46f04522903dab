//! Threads for independent pieces of work.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};

use didim_identification::parallel::Parallel;

/// Runs independent pieces of work on the available processors, one of them on the calling thread.
/// A piece that panics makes the call panic.
#[derive(Clone, Copy, Debug)]
pub struct Threads {
    /// Maximum number of threads, the calling thread included.
    most: usize,
}

impl Threads {
    /// One thread for each available processor.
    pub const ALL: Self = Self { most: usize::MAX };

    /// At most so many threads, for work that needs much memory.
    #[must_use]
    pub const fn at_most(most: usize) -> Self {
        Self { most }
    }
}

impl Parallel for Threads {
    fn run(&self, count: usize, work: &(dyn Fn(usize) + Sync)) {
        let processors = std::thread::available_parallelism().map_or(1, NonZero::get);
        let next = AtomicUsize::new(0);
        let take = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= count {
                    return;
                }
                work(index);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..processors.min(self.most).min(count) {
                scope.spawn(take);
            }
            take();
        });
    }
}

#[cfg(test)]
mod tests {
    use std::thread::ThreadId;
    use std::time::Duration;

    use didim_identification::parallel::map;

    use super::*;

    #[test]
    fn every_piece_runs_once_and_no_more_threads_than_permitted() {
        let slow = |index: usize| {
            // The first ones take longest.
            std::thread::sleep(Duration::from_micros(200_u64.saturating_sub(index as u64)));
            (index, std::thread::current().id())
        };
        for most in [1, 2, usize::MAX] {
            let done = map(&Threads::at_most(most), 200, slow);
            assert!(done.iter().map(|(index, _)| *index).eq(0..200));
            let mut threads: Vec<ThreadId> = Vec::new();
            for (_, thread) in done {
                if !threads.contains(&thread) {
                    threads.push(thread);
                }
            }
            assert!(threads.len() <= most, "{most}: {threads:?}");
        }
    }
}
