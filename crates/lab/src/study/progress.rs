//! Progress of a study, and its remaining time.

use std::time::Duration;

/// Durations of one kind of task.
#[derive(Clone, Debug, Default)]
struct Times {
    done_runs: u32,
    remaining_runs: usize,
    total_time: Duration,
}

impl Times {
    fn new(remaining: usize) -> Self {
        Self { remaining_runs: remaining, ..Self::default() }
    }

    fn add(&mut self, time: Duration) {
        self.done_runs += 1;
        self.remaining_runs = self.remaining_runs.saturating_sub(1);
        self.total_time += time;
    }

    fn mean(&self) -> Option<Duration> {
        self.total_time.checked_div(self.done_runs)
    }

    fn remaining_runs_time(&self) -> Option<Duration> {
        match self.remaining_runs {
            0 => Some(Duration::ZERO),
            remaining => Some(self.mean()? * u32::try_from(remaining).unwrap_or(u32::MAX)),
        }
    }
}

/// Progress of a study: completed and remaining runs, with their durations.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Number of planned runs in the executed part of the study.
    pub runs: u64,
    simulations: Times,
    methods: Vec<Times>,
    threads: usize,
}

impl Progress {
    pub(super) fn new(
        runs: u64,
        remaining: Vec<usize>,
        simulations: usize,
        threads: usize,
    ) -> Self {
        let methods = remaining.into_iter().map(Times::new).collect();
        Self { runs, simulations: Times::new(simulations), methods, threads }
    }

    pub(super) fn add_simulation(&mut self, time: Duration) {
        self.simulations.add(time);
    }

    pub(super) fn add_identification(&mut self, method: usize, time: Duration) {
        if let Some(times) = self.methods.get_mut(method) {
            times.add(time);
        }
    }

    /// Returns the number of completed runs, including the runs of earlier executions.
    pub fn completed_runs(&self) -> u64 {
        let remaining: usize = self.methods.iter().map(|times| times.remaining_runs).sum();
        self.runs.saturating_sub(remaining as u64)
    }

    /// Returns the number of runs that this execution has completed.
    pub fn added_runs(&self) -> u64 {
        self.methods.iter().map(|times| u64::from(times.done_runs)).sum()
    }

    /// Returns the mean duration of a simulation of the arm; `None` before the first simulation.
    pub fn simulation_time(&self) -> Option<Duration> {
        self.simulations.mean()
    }

    /// Returns the mean duration of a run of each method, in the order of the plan.
    pub fn method_times(&self) -> impl Iterator<Item = Option<Duration>> {
        self.methods.iter().map(Times::mean)
    }

    /// Returns the estimated remaining time. The estimate uses the mean duration of each method,
    /// because slow methods may have fewer seeds than fast ones. It is `None` until a simulation
    /// and a run of each remaining method have ended.
    pub fn remaining(&self) -> Option<Duration> {
        let times = std::iter::once(&self.simulations).chain(&self.methods);
        let total: Duration = times.map(Times::remaining_runs_time).sum::<Option<Duration>>()?;
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
        assert_eq!((progress.completed_runs(), progress.remaining()), (8, None));
        progress.add_simulation(second);
        progress.add_identification(0, second);
        assert_eq!(progress.remaining(), None, "the second method has not run");
        progress.add_identification(1, 10 * second);
        // 19 simulations and 19 runs of one second, and one run of ten, on two threads.
        assert_eq!(progress.remaining(), Some(24 * second));
        assert_eq!((progress.completed_runs(), progress.added_runs()), (10, 2));
    }
}
