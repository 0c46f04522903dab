//! Derivation of events from successive states of the service. Few lines report many changes.

use core::time::Duration;
use std::collections::BTreeMap;
use std::time::Instant;

use didim_drivers::assemble::CycleCause;

use crate::archive::events::{Event, EventCounts, EventKind, Phase};
use crate::archive::store::Timestamp;
use crate::live::acquire::{AcquisitionStatus, BusState, InterfaceProblem};
use crate::live::pause::{Pause, PauseCause};
use crate::service::status::Snapshot;

/// Time without a further loss after which a series of losses has ended.
const QUIET: Duration = Duration::from_secs(5);
/// Number of events of one kind that may follow each other at once.
const BURST: u32 = 6;
/// Interval at which a further event of that kind is possible.
const REFILL: Duration = Duration::from_secs(20);
/// Maximum length of a cause \[characters\].
const MAX_CAUSE: usize = 300;

/// Kind of a change, and the interface if it concerns one.
type Key = (EventKind, Option<String>);

/// Watch over the state of the service. It keeps one entry for each kind of change.
#[derive(Debug, Default)]
pub(super) struct ChangeWatch {
    changes: BTreeMap<Key, Change>,
    counts: EventCounts,
    last_counts: Option<LossCounts>,
}

/// State of one kind of change.
#[derive(Debug)]
struct Change {
    is_active: bool,
    /// State that the last event reported.
    reported_active: bool,
    since: Instant,
    last_seen: Instant,
    /// Duration of the last active time.
    lasted: Duration,
    /// Occurrences since the last event.
    count: u64,
    cause: Option<String>,
    /// Number of events that are possible at once, and the time of the last increase.
    credit: u32,
    credited: Instant,
}

/// Counters whose growth is an event.
#[derive(Clone, Debug, PartialEq)]
struct LossCounts {
    cycles: BTreeMap<String, u64>,
    drops: u64,
    steps: u64,
    times_down: u64,
}

impl LossCounts {
    fn new(status: &AcquisitionStatus) -> Self {
        let mut cycles = status.cycles_lost.clone();
        // A silence is an event of its own, and disabled drives are no loss.
        cycles.retain(|cause, _| {
            *cause != CycleCause::Silence.key() && *cause != CycleCause::NotEnabled.key()
        });
        Self {
            cycles,
            drops: status.counters.queue_drops,
            steps: status.counters.clock_steps,
            times_down: status.counters.link_down,
        }
    }

    /// Returns the causes whose counts grew, with the growth.
    fn cycles_since(&self, before: &Self) -> Vec<(&str, u64)> {
        let mut grown: Vec<(&str, u64)> = Vec::new();
        for (cause, count) in &self.cycles {
            let new = count.saturating_sub(before.cycles.get(cause).copied().unwrap_or(0));
            if new > 0 {
                grown.push((cause, new));
            }
        }
        grown
    }
}

impl Change {
    fn new(now: Instant) -> Self {
        Self {
            is_active: false,
            reported_active: false,
            since: now,
            last_seen: now,
            lasted: Duration::ZERO,
            count: 0,
            cause: None,
            credit: BURST,
            credited: now,
        }
    }

    /// Returns the event that reports the state, if the last one reported another state.
    fn event(&mut self, key: &Key, time: Timestamp, now: Instant) -> Option<Event> {
        while self.credit < BURST && now.saturating_duration_since(self.credited) >= REFILL {
            self.credit += 1;
            self.credited += REFILL;
        }
        if self.is_active == self.reported_active || self.credit == 0 {
            return None;
        }
        if self.credit == BURST {
            self.credited = now;
        }
        self.credit -= 1;
        self.reported_active = self.is_active;
        let (event, interface) = key.clone();
        Some(Event {
            time,
            event,
            phase: if self.is_active { Phase::Begins } else { Phase::Ends },
            interface,
            count: core::mem::take(&mut self.count),
            duration_s: (!self.is_active).then_some(self.lasted.as_secs_f64()),
            cause: self.cause.take(),
        })
    }
}

impl ChangeWatch {
    /// Returns the numbers of events since the start.
    pub(super) fn counts(&self) -> &EventCounts {
        &self.counts
    }

    /// Returns the event of a pause.
    pub(super) fn handle_pause(&mut self, pause: &Pause, now: Instant) -> Option<Event> {
        let kind = match pause.cause {
            PauseCause::ProcessStopped => EventKind::ProcessStopped,
            PauseCause::MachineSuspended => EventKind::MachineSuspended,
            PauseCause::NoProcessor => EventKind::NoProcessor,
        };
        self.count(kind, 1, pause.duration);
        self.once(kind, 1, Some(pause.duration), now)
    }

    /// Returns the events since the previous snapshot. `is_started` is false until the start of the
    /// service is complete; its health is no event before.
    pub(super) fn handle_snapshot(
        &mut self,
        snapshot: &Snapshot,
        is_started: bool,
        now: Instant,
    ) -> Vec<Event> {
        let mut events = Vec::new();
        let mut active = BTreeMap::new();
        if let Some(acquisition) = &snapshot.acquisition {
            events.extend(self.handle_losses(acquisition, now));
            for (interface, problem) in &acquisition.interfaces_down {
                let kind = match problem {
                    InterfaceProblem::Down => EventKind::InterfaceDown,
                    InterfaceProblem::Missing => EventKind::InterfaceMissing,
                };
                active.insert((kind, Some(interface.clone())), None);
            }
            if acquisition.bus == BusState::Silent {
                active.insert((EventKind::Silence, None), None);
            }
        }
        if is_started && !snapshot.health.ok {
            let cause = snapshot.health.reasons.join("; ");
            active.insert((EventKind::Unhealthy, None), Some(cause));
        }
        self.update_states(active, now);
        let time = Timestamp::now();
        events.extend(
            self.changes.iter_mut().filter_map(|(key, change)| change.event(key, time, now)),
        );
        events
    }

    /// Counts the losses since the previous status. A series of losses is active until it has been
    /// quiet for some time.
    fn handle_losses(&mut self, status: &AcquisitionStatus, now: Instant) -> Vec<Event> {
        let counts = LossCounts::new(status);
        let Some(before) = self.last_counts.replace(counts.clone()) else { return Vec::new() };
        let lost = counts.cycles_since(&before);
        let total = lost.iter().map(|(_, count)| count).sum();
        let causes = lost.iter().map(|(cause, count)| format!("{count} by {cause}"));
        let causes = causes.collect::<Vec<_>>().join(", ");
        self.see_losses(EventKind::LostCycles, total, Some(causes), now);
        let dropped = counts.drops.saturating_sub(before.drops);
        self.see_losses(EventKind::DroppedFrames, dropped, None, now);
        let mut events = Vec::new();
        let steps = counts.steps.saturating_sub(before.steps);
        if steps > 0 {
            self.count(EventKind::ClockStep, steps, Duration::ZERO);
            events.extend(self.once(EventKind::ClockStep, steps, None, now));
        }
        // An interface that was down between two snapshots only.
        let downs = counts.times_down.saturating_sub(before.times_down);
        if downs > 0 && status.interfaces_down.is_empty() {
            self.count(EventKind::InterfaceDown, downs, Duration::ZERO);
            events.extend(self.once(EventKind::InterfaceDown, downs, None, now));
        }
        events
    }

    fn see_losses(&mut self, kind: EventKind, new: u64, cause: Option<String>, now: Instant) {
        let key = (kind, None);
        if new > 0 {
            let change = self.changes.entry(key).or_insert_with(|| Change::new(now));
            let begins = !change.is_active;
            if begins {
                (change.is_active, change.since) = (true, now);
            }
            change.last_seen = now;
            change.count += new;
            change.cause = cause;
            if begins {
                self.count(kind, 1, Duration::ZERO);
            }
            return;
        }
        let Some(change) = self.changes.get_mut(&key).filter(|change| change.is_active) else {
            return;
        };
        if now.saturating_duration_since(change.last_seen) >= QUIET {
            change.is_active = false;
            change.lasted = change.last_seen.saturating_duration_since(change.since);
            let lasted = change.lasted;
            self.count(kind, 0, lasted);
        }
    }

    /// Begins and ends states other than series of losses.
    fn update_states(&mut self, mut active: BTreeMap<Key, Option<String>>, now: Instant) {
        let mut ended = Vec::new();
        for (key, change) in &mut self.changes {
            let is_series = matches!(key.0, EventKind::LostCycles | EventKind::DroppedFrames);
            if !is_series && change.is_active && active.remove(key).is_none() {
                change.is_active = false;
                change.lasted = now.saturating_duration_since(change.since);
                ended.push((key.0, change.lasted));
            }
        }
        for (kind, lasted) in ended {
            self.count(kind, 0, lasted);
        }
        for (key, cause) in active {
            let kind = key.0;
            let change = self.changes.entry(key).or_insert_with(|| Change::new(now));
            if change.is_active {
                continue;
            }
            (change.is_active, change.since) = (true, now);
            change.count += 1;
            change.cause = cause.map(|cause| cause.chars().take(MAX_CAUSE).collect());
            self.count(kind, 1, Duration::ZERO);
        }
    }

    /// Returns the event of a change without a duration of its own, unless too many came before.
    fn once(
        &mut self,
        kind: EventKind,
        count: u64,
        duration: Option<Duration>,
        now: Instant,
    ) -> Option<Event> {
        let key = (kind, None);
        let change = self.changes.entry(key.clone()).or_insert_with(|| Change::new(now));
        change.count += count;
        (change.is_active, change.reported_active) = (true, false);
        let event = change.event(&key, Timestamp::now(), now);
        (change.is_active, change.reported_active) = (false, false);
        Some(Event {
            phase: Phase::Once,
            duration_s: duration.map(|duration| duration.as_secs_f64()),
            ..event?
        })
    }

    fn count(&mut self, kind: EventKind, count: u64, lasted: Duration) {
        let entry = self.counts.entry(kind.key().to_owned()).or_default();
        entry.count += count;
        entry.lasted_ms += u64::try_from(lasted.as_millis()).unwrap_or(u64::MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::status::{Health, ProcessStatus, SCHEMA, StreamStatus};

    fn snapshot(change: impl FnOnce(&mut AcquisitionStatus)) -> Snapshot {
        let mut acquisition = AcquisitionStatus { bus: BusState::Ok, ..Default::default() };
        change(&mut acquisition);
        let health = Health::new(Some(&acquisition), None);
        Snapshot {
            schema: SCHEMA,
            version: String::new(),
            cell: String::new(),
            uptime_s: 0.0,
            health,
            process: ProcessStatus::default(),
            stream: StreamStatus::default(),
            acquisition: Some(acquisition),
            estimation: None,
        }
    }

    /// Kind, phase, count and duration \[s\].
    type ShortEvent = (EventKind, Phase, u64, Option<f64>);

    /// Events of one snapshot a second.
    fn watched(seconds: &[Snapshot]) -> (Vec<ShortEvent>, EventCounts) {
        let (mut watch, start) = (ChangeWatch::default(), Instant::now());
        let mut events = Vec::new();
        for (second, snapshot) in (0..).zip(seconds) {
            events.extend(watch.handle_snapshot(
                snapshot,
                true,
                start + Duration::from_secs(second),
            ));
        }
        let short = |event: &Event| (event.event, event.phase, event.count, event.duration_s);
        (events.iter().map(short).collect(), watch.counts)
    }

    fn missing(status: &mut AcquisitionStatus) {
        status.bus = BusState::Down;
        status.interfaces_down.insert("can0".into(), InterfaceProblem::Missing);
    }

    #[test]
    fn a_state_has_an_event_at_its_beginning_and_one_at_its_end() {
        let good = || snapshot(|_| ());
        let (events, counts) =
            watched(&[good(), snapshot(missing), snapshot(missing), snapshot(missing), good()]);
        let expected = [
            (EventKind::InterfaceMissing, Phase::Begins, 1, None),
            (EventKind::Unhealthy, Phase::Begins, 1, None),
            (EventKind::InterfaceMissing, Phase::Ends, 0, Some(3.0)),
            (EventKind::Unhealthy, Phase::Ends, 0, Some(3.0)),
        ];
        assert_eq!(events, expected);
        let lasted = counts["interface-missing"];
        assert_eq!((lasted.count, lasted.lasted_ms), (1, 3_000));
        let silent = || snapshot(|status| status.bus = BusState::Silent);
        let (events, _) = watched(&[good(), silent(), silent(), good()]);
        let of_silence = events.iter().filter(|(kind, ..)| *kind == EventKind::Silence);
        let expected = [
            (EventKind::Silence, Phase::Begins, 1, None),
            (EventKind::Silence, Phase::Ends, 0, Some(2.0)),
        ];
        assert!(of_silence.eq(&expected), "{events:?}");
    }

    #[test]
    fn a_series_of_losses_is_two_events() {
        fn lost(cycles: u64, silence: u64) -> Snapshot {
            snapshot(|status| {
                let counts = [("missing_axis", cycles), ("silence", silence)];
                status.cycles_lost = counts.map(|(key, count)| (key.to_owned(), count)).into();
            })
        }
        let mut seconds = vec![lost(0, 0), lost(3, 5), lost(3, 500), lost(7, 500)];
        seconds.extend((0..8).map(|_| lost(7, 500)));
        let (events, counts) = watched(&seconds);
        let expected = [
            (EventKind::LostCycles, Phase::Begins, 3, None),
            (EventKind::LostCycles, Phase::Ends, 4, Some(2.0)),
        ];
        assert_eq!(events, expected);
        assert_eq!(counts["lost-cycles"].count, 1);
    }

    #[test]
    fn flapping_gives_few_events_and_the_last_one_is_true() {
        let mut seconds = Vec::new();
        for second in 0..600 {
            let is_missing = second % 2 == 1;
            seconds.push(snapshot(|status| {
                if is_missing {
                    missing(status)
                }
            }));
        }
        seconds.extend((0..60).map(|_| snapshot(missing)));
        let (events, counts) = watched(&seconds);
        let of_interface: Vec<_> =
            events.iter().filter(|event| event.0 == EventKind::InterfaceMissing).collect();
        assert!(of_interface.len() <= 6 + 660 / 20, "{}", of_interface.len());
        assert_eq!(of_interface.last().unwrap().1, Phase::Begins, "it stays so");
        let reported: u64 = of_interface.iter().map(|event| event.2).sum();
        assert!((250..=300).contains(&reported), "{reported}");
        assert_eq!(counts["interface-missing"].count, 300);
    }

    #[test]
    fn short_changes_and_pauses_are_events() {
        fn counted(down: u64, steps: u64) -> Snapshot {
            snapshot(|status| {
                (status.counters.link_down, status.counters.clock_steps) = (down, steps);
            })
        }
        let (events, counts) = watched(&[counted(0, 0), counted(2, 0), counted(2, 1)]);
        let expected = [
            (EventKind::InterfaceDown, Phase::Once, 2, None),
            (EventKind::ClockStep, Phase::Once, 1, None),
        ];
        assert_eq!(events, expected);
        assert_eq!((counts["interface-down"].count, counts["clock-step"].count), (2, 1));
        let (mut watch, now) = (ChangeWatch::default(), Instant::now());
        let duration = Duration::from_millis(3_200);
        let pause = Pause { cause: PauseCause::ProcessStopped, duration };
        let event = watch.handle_pause(&pause, now).unwrap();
        assert_eq!(event.to_string(), "the process was stopped for 3.2 s");
        assert_eq!(event.phase, Phase::Once);
    }
}
