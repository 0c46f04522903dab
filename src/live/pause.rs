//! Detection of times in which a thread did not run, with their cause.

use core::fmt;
use core::time::Duration;
use std::time::Instant;

use didim_drivers::socket::monotonic_ns;
use serde::{Deserialize, Serialize};

use super::limits::LiveLimits;

/// Interval at which the waiting time for a processor is read.
const DELAY_INTERVAL: Duration = Duration::from_secs(1);

/// Cause of a pause.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PauseCause {
    /// The process was stopped: by SIGSTOP, a debugger or the freezer of a container.
    ProcessStopped,
    /// The machine was suspended.
    MachineSuspended,
    /// Other threads had the processors, or the kernel does not report the waiting time.
    NoProcessor,
}

/// A time in which a thread did not run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pause {
    /// Cause of the pause.
    pub cause: PauseCause,
    /// Length of the pause.
    pub duration: Duration,
}

impl fmt::Display for Pause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sentence = match self.cause {
            PauseCause::ProcessStopped => "the process was stopped for",
            PauseCause::MachineSuspended => "the machine was suspended for",
            PauseCause::NoProcessor => "the process got no processor for",
        };
        write!(f, "{sentence} {:.1} s", self.duration.as_secs_f64())
    }
}

/// Watch of one thread, which calls it regularly.
#[derive(Debug)]
pub(crate) struct PauseWatch {
    /// Longest time between two calls of a thread that runs.
    turn: Duration,
    last_call: Clocks,
    /// Time that the thread had waited for a processor, and the time of that reading.
    last_delay: (Instant, Option<Duration>),
}

/// Readings of both clocks. Only the second one continues during a suspension.
#[derive(Clone, Copy, Debug)]
struct Clocks {
    awake: Instant,
    since_boot_ns: u64,
}

impl Clocks {
    fn read() -> Self {
        Self { awake: Instant::now(), since_boot_ns: monotonic_ns() }
    }
}

impl PauseWatch {
    /// Creates the watch of the calling thread, which calls [`Self::check`] at least every `turn`.
    pub(crate) fn new(turn: Duration) -> Self {
        Self { turn, last_call: Clocks::read(), last_delay: (Instant::now(), processor_delay()) }
    }

    /// Starts a turn. The time before it does not count.
    pub(crate) fn restart(&mut self) {
        self.last_call = Clocks::read();
    }

    /// Returns the pause since the last call, if there was one.
    pub(crate) fn check(&mut self) -> Option<Pause> {
        let now = Clocks::read();
        let before = core::mem::replace(&mut self.last_call, now);
        let elapsed = now.awake.saturating_duration_since(before.awake);
        let with_suspension =
            Duration::from_nanos(now.since_boot_ns.saturating_sub(before.since_boot_ns));
        let late = elapsed.saturating_sub(self.turn);
        let is_late = late >= LiveLimits::DEFAULT.pause;
        let mut waited = None;
        if is_late || now.awake.saturating_duration_since(self.last_delay.0) >= DELAY_INTERVAL {
            let (_, delay_before) = self.last_delay;
            self.last_delay = (now.awake, processor_delay());
            waited =
                self.last_delay.1.zip(delay_before).map(|(now, then)| now.saturating_sub(then));
        }
        judge(late, with_suspension.saturating_sub(elapsed), waited)
    }
}

/// Derives the pause from the time by which a call was late, from the time of a suspension, and
/// from the time that the thread waited for a processor.
fn judge(late: Duration, suspended: Duration, waited: Option<Duration>) -> Option<Pause> {
    let limit = LiveLimits::DEFAULT.pause;
    if suspended >= limit {
        return Some(Pause { cause: PauseCause::MachineSuspended, duration: suspended });
    }
    let cause = match waited {
        Some(waited) if waited < late / 2 => PauseCause::ProcessStopped,
        _ => PauseCause::NoProcessor,
    };
    (late >= limit).then_some(Pause { cause, duration: late })
}

/// Returns the time that this thread was ready to run without a processor, since its start (the
/// second number of schedstat, proc_pid(5)). `None` if the kernel does not count it.
fn processor_delay() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let delay_ns: u64 = text.split_ascii_whitespace().nth(1)?.parse().ok()?;
    Some(Duration::from_nanos(delay_ns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_has_its_cause() {
        let ms = Duration::from_millis;
        let judged = |late, suspended, waited: Option<u64>| {
            judge(ms(late), ms(suspended), waited.map(ms)).map(|pause| pause.to_string())
        };
        assert_eq!(judged(20, 0, Some(0)), None);
        let stopped = "the process was stopped for 3.2 s".to_owned();
        assert_eq!(judged(3_200, 0, Some(100)), Some(stopped));
        let busy = Some("the process got no processor for 3.2 s".to_owned());
        assert_eq!(judged(3_200, 0, Some(3_000)), busy);
        assert_eq!(judged(3_200, 0, None), busy, "the kernel does not say");
        let suspended = "the machine was suspended for 3600.0 s".to_owned();
        assert_eq!(judged(40, 3_600_000, None), Some(suspended));
    }

    #[test]
    fn a_thread_that_runs_has_no_pause() {
        let mut watch = PauseWatch::new(Duration::from_secs(600));
        assert_eq!(watch.check(), None);
        watch.restart();
        assert_eq!(watch.check(), None);
    }
}
