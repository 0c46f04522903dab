//! `[bus]` of a DBC file: which signals, of which drives.

use std::path::{Path, PathBuf};

use didim_drivers::frame::FrameId;
use didim_drivers::layout::{Database, NamedSignal};
use didim_formats::AXIS;

use super::bus::{WHICH_VALIDITY, drives, rate, rate_hz, surroundings};
use super::draft::Draft;
use super::evidence::{Evidence, ProposalError, relative};
use super::names::{Group, Meaning, groups, meaning, words};
use super::table::{chosen, is_measured, torques};
use super::value::{Guess, quoted};

/// The SYNC of CANopen by its identifier.
const SYNC: FrameId = FrameId::Standard(0x80);

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
    surroundings(draft);
    let layout = "bus.layout";
    let path = quoted(&relative(file, out).display().to_string());
    draft.put(layout, "dbc", Guess::found(path, "as named"));
    draft.put(layout, "axes", Guess::found(axes.to_string(), "joints of the robot"));
    let instant = bus.instant(draft, evidence.log.as_deref())?;
    bus.layout(draft, instant);
    drives(draft, axes, |draft, what, axis| bus.unit(draft, what, axis));
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
        draft.put("bus.layout", "rate_hz", rate(rate_hz));
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
            false => Guess::open(WHICH_VALIDITY),
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

    /// The unit of the signal that was found for a quantity of an axis.
    fn unit(&self, draft: &Draft<'_>, what: &str, axis: usize) -> Option<String> {
        let pattern = draft.text(&format!("bus.layout.{what}.signal"))?;
        let name = pattern.replace(AXIS, &axis.to_string());
        self.find(&name).map(|signal| signal.unit.to_lowercase())
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
