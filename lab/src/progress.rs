//! How far a study is, and how long it will take.

use std::time::Duration;

/// Times of things of one kind.
#[derive(Clone, Debug, Default)]
struct Times {
    done: u32,
    left: usize,
    total: Duration,
}

impl Times {
    fn left(left: usize) -> Self {
        Self { left, ..Self::default() }
    }

    fn add(&mut self, time: Duration) {
        self.done += 1;
        self.left = self.left.saturating_sub(1);
        self.total += time;
    }

    fn mean(&self) -> Option<Duration> {
        self.total.checked_div(self.done)
    }

    fn remaining(&self) -> Option<Duration> {
        match self.left {
            0 => Some(Duration::ZERO),
            left => Some(self.mean()? * u32::try_from(left).unwrap_or(u32::MAX)),
        }
    }
}

/// What was run and what is left.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Runs of the study.
    pub runs: u64,
    simulations: Times,
    methods: Vec<Times>,
    threads: usize,
}

impl Progress {
    pub(super) fn new(runs: u64, left: Vec<usize>, simulations: usize, threads: usize) -> Self {
        let methods = left.into_iter().map(Times::left).collect();
        Self { runs, simulations: Times::left(simulations), methods, threads }
    }

    pub(super) fn simulated(&mut self, time: Duration) {
        self.simulations.add(time);
    }

    pub(super) fn identified(&mut self, method: usize, time: Duration) {
        if let Some(times) = self.methods.get_mut(method) {
            times.add(time);
        }
    }

    /// Runs that are there, those of before included.
    pub fn done(&self) -> u64 {
        let left: usize = self.methods.iter().map(|times| times.left).sum();
        self.runs.saturating_sub(left as u64)
    }

    /// Runs that were added.
    pub fn added(&self) -> u64 {
        self.methods.iter().map(|times| u64::from(times.done)).sum()
    }

    /// Mean time of a simulation of the arm.
    pub fn simulation_time(&self) -> Option<Duration> {
        self.simulations.mean()
    }

    /// Mean time of each method's run, in the order of the plan.
    pub fn method_times(&self) -> impl Iterator<Item = Option<Duration>> {
        self.methods.iter().map(Times::mean)
    }

    /// What is left, at the times that were taken so far: methods differ, and the slow ones may have
    /// fewer seeds. Unknown before each has run once.
    pub fn remaining(&self) -> Option<Duration> {
        let all = std::iter::once(&self.simulations).chain(&self.methods);
        let total: Duration = all.map(Times::remaining).sum::<Option<Duration>>()?;
        Some(total / u32::try_from(self.threads.max(1)).unwrap_or(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_takes_as_long_as_what_is_done() {
        let second = Duration::from_secs(1);
        let mut progress = Progress::new(30, vec![20, 2], 20, 2);
        assert_eq!((progress.done(), progress.remaining()), (8, None));
        progress.simulated(second);
        progress.identified(0, second);
        assert_eq!(progress.remaining(), None, "the second method has not run");
        progress.identified(1, 10 * second);
        // 19 simulations, 19 runs of a second and one of ten, on two threads.
        assert_eq!(progress.remaining(), Some(24 * second));
        assert_eq!((progress.done(), progress.added()), (10, 2));
    }
}
