//! Counts of the last seconds. They describe the current state, which earlier losses do not.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use didim_drivers::assemble::{CycleCause, FrameCause, label};
use serde::{Deserialize, Serialize};

use super::counts::AcquisitionCounts;
use crate::live::limits::LiveLimits;

/// Counts that are closer together in time are treated as one.
const MIN_SEPARATION: Duration = Duration::from_millis(500);

/// Maximum number of causes to name, for frames and for cycles separately.
const MAX_NAMED_CAUSES: usize = 3;

/// Counts of the last seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecentCounts {
    /// Length of the period \[s\].
    pub seconds: f64,
    /// Frames received.
    pub frames: u64,
    /// Samples assembled.
    pub samples: u64,
    /// Number of lost cycles in which no drive was enabled.
    pub cycles_idle: u64,
    /// Number of frames that the kernel or an in-process bus dropped before they were read.
    pub queue_drops: u64,
    /// Number of error frames of the controller.
    pub error_frames: u64,
    /// Number of failed reads of the bus.
    pub source_failures: u64,
    /// Unused frames by cause. Causes that did not occur are omitted.
    pub frames_unused: BTreeMap<String, u64>,
    /// Lost cycles by cause. Causes that did not occur are omitted.
    pub cycles_lost: BTreeMap<String, u64>,
}

/// Conversion of frames into samples in the last seconds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SampleFlow {
    /// The conversion works, or there are no frames.
    Well,
    /// No drive is enabled.
    Idle,
    /// The frames gave no sample.
    Stopped {
        /// Description of the causes whose counts grew.
        causes: String,
    },
    /// Some of the cycles gave no sample.
    Lossy {
        /// Number of lost cycles.
        lost: u64,
        /// Total number of cycles.
        of: u64,
        /// Description of the causes whose counts grew.
        causes: String,
    },
}

impl RecentCounts {
    /// Returns how the frames were converted.
    pub fn flow(&self) -> SampleFlow {
        if self.seconds < LiveLimits::DEFAULT.settled_s || self.frames == 0 {
            return SampleFlow::Well;
        }
        // Silence is excluded, because it is reported as a state of the bus.
        let losses = of_all_but(&self.cycles_lost, &[CycleCause::Silence]);
        if self.samples == 0 {
            if self.cycles_idle > losses / 2 {
                return SampleFlow::Idle;
            }
            return SampleFlow::Stopped { causes: self.main_causes() };
        }
        // Disabled drives are excluded, because drives were enabled or disabled during the period.
        let losses = of_all_but(&self.cycles_lost, &[CycleCause::Silence, CycleCause::NotEnabled]);
        let total = self.samples + losses;
        if losses as f64 > LiveLimits::DEFAULT.tolerated_loss_share * total as f64 {
            return SampleFlow::Lossy { lost: losses, of: total, causes: self.main_causes() };
        }
        SampleFlow::Well
    }

    /// Returns the causes whose counts grew most. The faults that explain them come first.
    fn main_causes(&self) -> String {
        let faults = [
            (self.queue_drops, "frames dropped unread"),
            (self.error_frames, "error frames"),
            (self.source_failures, "source failures"),
        ];
        let faults = faults.into_iter().filter(|(count, _)| *count > 0);
        let faults = faults.map(|(count, what)| format!("{count} {what}"));
        let cycles = largest_counts(&self.cycles_lost, "cycles lost by", CycleCause::Silence.key());
        // Frames of lost cycles are excluded: these frames were valid, and the cause of their
        // cycle's loss is named.
        let frames =
            largest_counts(&self.frames_unused, "frames unused by", FrameCause::CycleLost.key());
        let causes_found: Vec<String> = faults.chain(cycles).chain(frames).collect();
        if causes_found.is_empty() {
            "no cycle has begun".to_owned()
        } else {
            causes_found.join(", ")
        }
    }
}

fn of_all_but(causes: &BTreeMap<String, u64>, but: &[CycleCause]) -> u64 {
    let counts = causes.iter().filter(|(key, _)| but.iter().all(|cause| cause.key() != *key));
    counts.map(|(_, count)| count).sum()
}

fn largest_counts(causes: &BTreeMap<String, u64>, what: &str, but: &str) -> Vec<String> {
    let mut causes: Vec<_> = causes.iter().filter(|(key, _)| *key != but).collect();
    causes.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    let causes = causes.into_iter().take(MAX_NAMED_CAUSES);
    causes.map(|(key, count)| format!("{count} {what} {}", label(key))).collect()
}

/// Record of the counts of the last seconds.
#[derive(Debug)]
pub struct RecentWatch(VecDeque<(Instant, AcquisitionCounts)>);

impl RecentWatch {
    /// Creates the record with no counts before `now`.
    pub fn new(now: Instant) -> Self {
        Self(VecDeque::from([(now, AcquisitionCounts::default())]))
    }

    /// Returns the counts of the last seconds before `now`.
    pub fn handle_counts(&mut self, counts: &AcquisitionCounts, now: Instant) -> RecentCounts {
        let age = |then: Instant| now.saturating_duration_since(then);
        while self.0.get(1).is_some_and(|(then, _)| age(*then) >= LiveLimits::DEFAULT.recent_period)
        {
            self.0.pop_front();
        }
        let recent = self.0.front().map(|(then, before)| {
            let since =
                |count: fn(&AcquisitionCounts) -> u64| count(counts).saturating_sub(count(before));
            let (losses, losses_before) = (&counts.losses, &before.losses);
            RecentCounts {
                seconds: age(*then).as_secs_f64(),
                frames: since(|counts| counts.source.frames),
                samples: since(|counts| counts.losses.samples),
                cycles_idle: since(|counts| counts.losses.cycles_idle),
                queue_drops: since(|counts| counts.source.queue_drops),
                error_frames: since(|counts| counts.source.error_frames),
                source_failures: since(|counts| counts.source_failures),
                frames_unused: by_cause(losses.frames.since(&losses_before.frames).by_cause()),
                cycles_lost: by_cause(losses.cycles.since(&losses_before.cycles).by_cause()),
            }
        });
        if self.0.back().is_none_or(|(then, _)| age(*then) >= MIN_SEPARATION) {
            self.0.push_back((now, *counts));
        }
        recent.unwrap_or_default()
    }
}

/// Returns the nonzero counts by name.
pub(super) fn by_cause(counts: impl Iterator<Item = (&'static str, u64)>) -> BTreeMap<String, u64> {
    counts.filter(|(_, count)| *count > 0).map(|(key, count)| (key.to_owned(), count)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts of a bus at 500 Hz. Every cycle of a second has the same outcome.
    #[derive(Default)]
    struct Bus {
        counts: AcquisitionCounts,
        seconds: u64,
    }

    impl Bus {
        fn run(&mut self, watch: &mut RecentWatch, start: Instant, fate: &str) -> SampleFlow {
            self.seconds += 1;
            self.counts.source.frames += 6_500;
            let losses = &mut self.counts.losses;
            match fate {
                "sample" => losses.samples += 500,
                "silent drive" => losses.cycles.missing_axis += 500,
                "other identifier" => {
                    losses.cycles.missing_axis += 500;
                    losses.frames.unknown_id += 500;
                }
                "one drive off" => losses.cycles.not_enabled += 500,
                "idle" => {
                    losses.cycles.not_enabled += 500;
                    losses.cycles_idle += 500;
                }
                "a gap of 8,000 cycles" => {
                    losses.samples += 500;
                    losses.cycles.silence += 8_000;
                }
                "2 % lost" => {
                    losses.samples += 490;
                    losses.cycles.missing_sync += 10;
                }
                "one lost" => {
                    losses.samples += 499;
                    losses.cycles.missing_sync += 1;
                }
                "dropped unread" => {
                    losses.samples += 400;
                    losses.cycles.missing_axis += 100;
                    self.counts.source.queue_drops += 1_000;
                }
                "disturbed" => {
                    losses.cycles.missing_axis += 500;
                    self.counts.source.error_frames += 70;
                    self.counts.source_failures += 1;
                }
                _ => panic!("{fate}"),
            }
            let now = start + Duration::from_secs(self.seconds);
            watch.handle_counts(&self.counts, now).flow()
        }

        /// Returns the flow after ten good seconds and eight seconds of that outcome.
        fn after(fate: &str) -> SampleFlow {
            let start = Instant::now();
            let (mut bus, mut watch) = (Self::default(), RecentWatch::new(start));
            let mut last = SampleFlow::Well;
            for second in 0..18 {
                let fate = if second < 10 { "sample" } else { fate };
                last = bus.run(&mut watch, start, fate);
                assert!(second >= 10 || last == SampleFlow::Well, "{last:?}");
            }
            // The flow is good again five seconds after it is over.
            let after: Vec<SampleFlow> =
                (0..6).map(|_| bus.run(&mut watch, start, "sample")).collect();
            assert_eq!(after.last(), Some(&SampleFlow::Well), "{fate}: {after:?}");
            last
        }
    }

    #[test]
    fn what_fails_later_shows_with_its_cause() {
        let stopped = |causes: &str| SampleFlow::Stopped { causes: causes.to_owned() };
        let silent = Bus::after("silent drive");
        assert_eq!(silent, stopped("2500 cycles lost by missing axis"));
        let other = Bus::after("other identifier");
        let causes = "2500 cycles lost by missing axis, 2500 frames unused by unknown id";
        assert_eq!(other, stopped(causes));
        let one_off = Bus::after("one drive off");
        assert_eq!(one_off, stopped("2500 cycles lost by not enabled"));
        let causes = "350 error frames, 5 source failures, 2500 cycles lost by missing axis";
        assert_eq!(Bus::after("disturbed"), stopped(causes));
        let causes = "5000 frames dropped unread, 500 cycles lost by missing axis".to_owned();
        assert_eq!(
            Bus::after("dropped unread"),
            SampleFlow::Lossy { lost: 500, of: 2_500, causes }
        );
        let causes = "50 cycles lost by missing sync".to_owned();
        assert_eq!(Bus::after("2 % lost"), SampleFlow::Lossy { lost: 50, of: 2_500, causes });
    }

    #[test]
    fn what_is_no_fault_of_now_does_not() {
        assert_eq!(Bus::after("idle"), SampleFlow::Idle);
        for fate in ["sample", "one lost", "a gap of 8,000 cycles"] {
            assert_eq!(Bus::after(fate), SampleFlow::Well, "{fate}");
        }
    }

    #[test]
    fn a_start_is_not_judged_before_it_can_be() {
        let start = Instant::now();
        let (mut bus, mut watch) = (Bus::default(), RecentWatch::new(start));
        assert_eq!(bus.run(&mut watch, start, "silent drive"), SampleFlow::Well);
        let flow = bus.run(&mut watch, start, "silent drive");
        assert!(matches!(flow, SampleFlow::Stopped { .. }), "{flow:?}");
    }
}
