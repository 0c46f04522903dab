//! `[bus]` of a DBC file: which signals, of which drives.

use std::path::{Path, PathBuf};
use std::time::Duration;

use didim_drivers::frame::FrameId;
use didim_drivers::layout::{Database, NamedSignal};
use didim_drivers::source::Received;
use didim_formats::{AXIS, mean_rate_hz};

use super::draft::Draft;
use super::evidence::{Evidence, ProposalError, relative};
use super::names::{Group, Meaning, groups, meaning, words};
use super::plausible::{RATES_HZ, rounded};
use super::table::{chosen, is_measured, torques};
use super::value::{Guess, quoted};
use crate::live::recording::open_log;

/// The SYNC of CANopen by its identifier.
const SYNC: FrameId = FrameId::Standard(0x80);
/// Stamps of a log that tell its rate.
const STAMPS: usize = 20_000;
const BATCH: usize = 4096;

pub(super) fn propose(
    draft: &mut Draft<'_>,
    evidence: &Evidence,
    (file, text): &(PathBuf, String),
    out: &Path,
) -> Result<(), ProposalError> {
    let wrong = |source| ProposalError::Dbc { file: file.clone(), source: Box::new(source) };
    let database = Database::parse(text).map_err(wrong)?;
    let axes = evidence.robot.robot.joints();
    let signals: Vec<NamedSignal<'_>> = database.signals().collect();
    let names: Vec<String> =
        signals.iter().map(|signal| format!("{}.{}", signal.message, signal.name)).collect();
    let groups = groups(&names, axes, &[]);
    let bus = Bus { axes, signals, groups, messages: database.messages().collect() };
    let why = "the first interface of a machine; didim only listens";
    draft.put("bus", "source", Guess::assumed(quoted("can:can0"), why));
    let layout = "bus.layout";
    let path = quoted(&relative(file, out).display().to_string());
    draft.put(layout, "dbc", Guess::found(path, "as named"));
    draft.put(layout, "axes", Guess::found(axes.to_string(), "joints of the robot"));
    let instant = bus.instant(draft, evidence.log.as_deref())?;
    bus.layout(draft, instant);
    bus.drives(draft);
    let trigger = "{ by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5 }";
    draft.put(
        "window",
        "trigger",
        Guess::assumed(trigger.to_owned(), "a motor that turns opens it, rest closes it"),
    );
    draft.put(
        "window",
        "min_s",
        Guess::assumed("3.0".to_owned(), "shorter motions are not identified"),
    );
    draft.put("window", "max_s", Guess::assumed("60.0".to_owned(), "bounds the memory"));
    Ok(())
}

struct Bus<'a> {
    axes: usize,
    signals: Vec<NamedSignal<'a>>,
    /// Those that are there once for each axis.
    groups: Vec<Group>,
    messages: Vec<(&'a str, FrameId)>,
}

impl Bus<'_> {
    /// What marks a sample, and the rate where a log tells it. Whether it is a SYNC.
    fn instant(&self, draft: &mut Draft<'_>, log: Option<&Path>) -> Result<bool, ProposalError> {
        let is_sync =
            |(name, id): &&(&str, FrameId)| *id == SYNC || name.eq_ignore_ascii_case("sync");
        let of_signals: Vec<FrameId> = self
            .signals_of(&[Meaning::Position, Meaning::Torque, Meaning::Command])
            .iter()
            .filter_map(|name| self.find(name).map(|signal| signal.id))
            .collect();
        let packed = of_signals.first().filter(|first| of_signals.iter().all(|id| id == *first));
        let sync = self.messages.iter().find(is_sync);
        let marks = match (sync, packed) {
            (Some((name, id)), _) => {
                draft.put(
                    "bus.layout",
                    "sync",
                    Guess::found(quoted(name), "the message of this name or of identifier 80h"),
                );
                Some(*id)
            }
            (None, Some(id)) => Some(*id),
            (None, None) => {
                let what = "the message that marks the instant of a sample: the signals are in several messages";
                draft.put("bus.layout", "sync", Guess::open(what));
                None
            }
        };
        let rate_hz = match (marks, log) {
            (Some(id), Some(log)) => rate_hz(log, id)?,
            _ => None,
        };
        let guess = match rate_hz {
            Some(rate_hz) => {
                Guess::found(format!("{rate_hz:?}"), "the mean distance of the stamps")
            }
            None => Guess::open("samples a second; a log tells it (--log)"),
        };
        draft.put("bus.layout", "rate_hz", guess);
        Ok(sync.is_some())
    }

    fn layout(&self, draft: &mut Draft<'_>, by_sync: bool) {
        let layout = "bus.layout";
        let groups = &self.groups;
        let found = |wanted| chosen(groups, wanted);
        let signal = |draft: &mut Draft<'_>, what: &str, group: Result<_, String>| {
            let guess = match group {
                Ok(Group::Numbered(pattern)) if pattern.contains(AXIS) => {
                    Guess::assumed(quoted(&pattern), "by its name")
                }
                Ok(group) => Guess::open(&format!(
                    "the {what} as Message.Signal, with {{axis}} from 1; `{}` counts otherwise",
                    group.name()
                )),
                Err(which) => Guess::open(&format!(
                    "the {what} as Message.Signal, with {{axis}} in place of the number; {which}"
                )),
            };
            draft.put(layout, &format!("{what}.signal"), guess);
        };
        let position = found(Meaning::Position).and_then(|group| {
            let first = group.name().replace(AXIS, "1");
            let has_unit = self.find(&first).is_some_and(|signal| !signal.unit.is_empty());
            if has_unit { Ok(group) } else { Err(format!("`{}` has no unit", group.name())) }
        });
        signal(draft, "position", position);
        let valid = "the instant of the sample";
        draft.put(layout, "position.valid", Guess::assumed(quoted("instant"), valid));
        let (torque, is_command) = torques(groups);
        let is_measured = torque.as_ref().is_ok_and(|group| is_measured(group.name()));
        signal(draft, "torque", torque);
        let valid = match is_measured && !is_command {
            true => Guess::assumed(quoted("instant"), "measured, at the instant of the sample"),
            false => Guess::open(
                "\"instant\" where it is measured; { held = { hold_us = …, delay_us = … } } where it is a command, as a rule for the cycle of the controller",
            ),
        };
        draft.put(layout, "torque.valid", valid);
        if let Ok(reference) = found(Meaning::Reference) {
            signal(draft, "reference", Ok(reference));
            let (valid, why) = match by_sync {
                true => ("next-sync", "a target takes effect at the next SYNC (CiA 301)"),
                false => ("instant", "in the sample whose frame carries it"),
            };
            draft.put(layout, "reference.valid", Guess::assumed(quoted(valid), why));
        }
        let plain = |word: &str| {
            let mut found =
                self.signals.iter().filter(|signal| signal.name.eq_ignore_ascii_case(word));
            found.next().filter(|_| found.next().is_none())
        };
        if let Some(counter) = plain("counter").filter(|_| !by_sync) {
            let name = format!("{}.{}", counter.message, counter.name);
            draft.put(layout, "counter", Guess::found(quoted(&name), "by its name"));
        }
        let status = groups
            .iter()
            .find(|group| words(group.name()).ends_with(&["status".to_owned(), "word".to_owned()]));
        if let Some(group) = status {
            draft.put(layout, "status_word", Guess::found(quoted(group.name()), "by its name"));
        }
    }

    /// Gains of each drive: what the units of the signals leave open.
    fn drives(&self, draft: &mut Draft<'_>) {
        let unit = |draft: &Draft<'_>, what: &str, axis: usize| {
            let pattern = draft.text(&format!("bus.layout.{what}.signal"))?;
            let name = pattern.replace(AXIS, &axis.to_string());
            self.find(&name).map(|signal| signal.unit.to_lowercase())
        };
        for axis in 1..=self.axes {
            let section = format!("bus.drives.{axis}");
            let named = "the unit in the DBC file";
            let scale = match unit(draft, "position", axis).as_deref() {
                Some("rad") => Guess::found(quoted("rad"), named),
                _ => Guess::open(
                    "{ counts_per_revolution = … } of the motor, { rad_per_count = … } or \"rad\"",
                ),
            };
            draft.put(&section, "position.scale", scale);
            draft.put(
                &section,
                "position.sign",
                Guess::open("1 where it counts as the robot file turns, else -1"),
            );
            draft.put(
                &section,
                "position.zero",
                Guess::open("the value at which the motor's angle is 0"),
            );
            let why = "the count never starts again; else \"modulo\"";
            draft.put(&section, "position.wraps", Guess::assumed(quoted("refuse"), why));
            draft.put(
                &section,
                "position.provenance",
                Guess::open("where scale, sign and zero come from"),
            );
            let scale = match unit(draft, "torque", axis).as_deref() {
                Some("nm" | "n·m" | "n.m") => Guess::found(quoted("nm"), named),
                _ => Guess::open(
                    "{ per_mille_of_rated_torque = { rated_torque_nm = … } }, { nm_per_count = … } or \"nm\"",
                ),
            };
            draft.put(&section, "torque.scale", scale);
            draft.put(
                &section,
                "torque.sign",
                Guess::open("1 where it drives as the robot file turns, else -1"),
            );
            draft.put(&section, "torque.provenance", Guess::open("where scale and sign come from"));
        }
    }

    fn find(&self, name: &str) -> Option<&NamedSignal<'_>> {
        let (message, signal) = name.split_once('.')?;
        self.signals.iter().find(|own| own.message == message && own.name == signal)
    }

    /// The signals of all axes that have one of these meanings.
    fn signals_of(&self, meanings: &[Meaning]) -> Vec<String> {
        let has = |group: &&Group| meaning(group.name()).is_some_and(|of| meanings.contains(&of));
        let wanted = self.groups.iter().filter(has);
        let each = wanted.flat_map(|group| {
            (1..=self.axes).map(|axis| group.name().replace(AXIS, &axis.to_string()))
        });
        each.collect()
    }
}

/// By the frames of a log that mark a sample.
fn rate_hz(log: &Path, marks: FrameId) -> Result<Option<f64>, ProposalError> {
    let wrong = |source| ProposalError::Log { source: Box::new(source) };
    let mut source = open_log(log).map_err(wrong)?;
    let mut batch = Vec::with_capacity(BATCH);
    let mut stamps: Vec<u64> = Vec::new();
    while stamps.len() < STAMPS {
        batch.clear();
        let received = source.receive(&mut batch, Duration::ZERO).map_err(wrong)?;
        stamps.extend(batch.iter().filter(|frame| frame.id == marks).map(|frame| frame.stamp_ns));
        if received == Received::End {
            break;
        }
    }
    let first_ns = stamps.first().copied().unwrap_or_default();
    #[expect(clippy::cast_precision_loss, reason = "times after the first")]
    let seconds = |stamp_ns: &u64| stamp_ns.saturating_sub(first_ns) as f64 * 1e-9;
    let times_s: Vec<f64> = stamps.iter().map(seconds).collect();
    Ok(mean_rate_hz(&times_s).filter(|found_hz| RATES_HZ.contains(found_hz)).map(rounded))
}
