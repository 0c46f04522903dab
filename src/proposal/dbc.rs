//! `[bus]` of a DBC file: the signals and their drives.

use std::path::{Path, PathBuf};

use didim_drivers::frame::FrameId;
use didim_drivers::layout::{Database, NamedSignal};
use didim_dynamics::MAX_JOINTS;
use didim_formats::{AXIS_PLACEHOLDER, INDEX_PLACEHOLDER};

use super::bus::{VALIDITY_QUESTION, drives, propose_bus_and_windows, rate, rate_hz};
use super::draft::Draft;
use super::evidence::{Evidence, ProposalError, relative_to_cell};
use super::names::{
    ColumnGroup, ColumnMeaning, axis_name, column_meaning, is_measured, numbered_groups,
    split_words,
};
use super::table::{choose_group, choose_torque_group};
use super::value::{Guess, list_text, quote_text};

/// Identifier of the CANopen SYNC.
const SYNC_ID: FrameId = FrameId::Standard(0x80);

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
    // A gripper may be an additional drive of the same kind. Messages with a number above the axis
    // count belong to no axis.
    let named = |signal: &NamedSignal<'_>| format!("{}.{}", signal.message, signal.name);
    let names: Vec<String> = signals
        .iter()
        .filter(|signal: &&NamedSignal<'_>| {
            let number = signal.message.rsplit(|c: char| !c.is_ascii_digit()).next();
            let number = number.and_then(|digits| digits.parse::<usize>().ok());
            !number.is_some_and(|number| (axes + 1..=MAX_JOINTS).contains(&number))
        })
        .map(named)
        .collect();
    let groups = numbered_groups(&names, axes);
    let bus = DbcSignals { axes, signals, groups, messages: database.messages().collect() };
    propose_bus_and_windows(draft);
    let layout = "bus.layout";
    let path = quote_text(&relative_to_cell(file, out).display().to_string());
    draft.add_entry(layout, "dbc", Guess::from_file(path, "as named"));
    draft.add_entry(layout, "axes", Guess::from_file(axes.to_string(), "joints of the robot"));
    let (by_sync, by_arrival) = bus.propose_instant(draft, evidence.log.as_deref())?;
    bus.layout(draft, by_sync, by_arrival);
    bus.propose_readings(draft);
    drives(draft, axes, |draft, what, axis| bus.signal_unit(draft, what, axis));
    Ok(())
}

struct DbcSignals<'a> {
    axes: usize,
    signals: Vec<NamedSignal<'a>>,
    /// Groups with one signal for each axis.
    groups: Vec<ColumnGroup>,
    messages: Vec<(&'a str, FrameId)>,
}

impl DbcSignals<'_> {
    /// Proposes the message that marks a sample, and the rate if a log shows it. Returns two flags.
    /// The first is true if the message is a SYNC. The second is true if every signal is valid when
    /// its own frame arrives, as on a bus without SYNC.
    fn propose_instant(
        &self,
        draft: &mut Draft<'_>,
        log: Option<&Path>,
    ) -> Result<(bool, bool), ProposalError> {
        let is_sync =
            |(name, id): &&(&str, FrameId)| *id == SYNC_ID || name.eq_ignore_ascii_case("sync");
        let of_signals: Vec<FrameId> = self
            .signals_of(&[ColumnMeaning::Position, ColumnMeaning::Torque, ColumnMeaning::Command])
            .iter()
            .filter_map(|name| self.find(name).map(|signal| signal.id))
            .collect();
        let packed = of_signals.first().filter(|first| of_signals.iter().all(|id| id == *first));
        let reference = self.find_reference().map(|group| vec![axis_name(group.name(), 0)]);
        // The command begins the cycle if the drives send their frames in answer to it.
        let once = reference.or(self.find_position().ok());
        let once = once.and_then(|names| self.find(names.first()?));
        let sync = self.messages.iter().find(is_sync);
        let marks = match (sync, packed) {
            (Some((name, id)), _) => {
                draft.add_entry(
                    "bus.layout",
                    "sync",
                    Guess::from_file(
                        quote_text(name),
                        "the message of this name or of identifier 80h",
                    ),
                );
                Some(*id)
            }
            (None, Some(id)) => Some(*id),
            (None, None) if once.is_some() => once.map(|signal| {
                let why = "the file has no SYNC: a message that comes once a cycle, here the \
                    first with a target or a position";
                draft.add_entry(
                    "bus.layout",
                    "sync",
                    Guess::assumed(quote_text(signal.message), why),
                );
                signal.id
            }),
            (None, None) => {
                let question = "the message that marks the instant of a sample: the signals are in \
                    several messages";
                draft.add_entry("bus.layout", "sync", Guess::without_value(question));
                None
            }
        };
        let rate_hz = match (marks, log) {
            (Some(id), Some(log)) => rate_hz(log, id)?,
            _ => None,
        };
        draft.add_entry("bus.layout", "rate_hz", rate(rate_hz));
        Ok((sync.is_some(), sync.is_none() && packed.is_none()))
    }

    /// Returns the position signal of each axis.
    fn find_position(&self) -> Result<Vec<String>, String> {
        let each = |pattern: &str| -> Vec<String> {
            (0..self.axes).map(|axis| axis_name(pattern, axis)).collect()
        };
        let group = choose_group(&self.groups, ColumnMeaning::Position);
        let unit = |name: &String| self.find(name).is_some_and(|signal| !signal.unit.is_empty());
        let without = match &group {
            Ok(ColumnGroup::Numbered(pattern)) if has_axis(pattern) => {
                let names = each(pattern);
                if names.iter().all(unit) {
                    return Ok(names);
                }
                format!("`{pattern}` has no unit")
            }
            Ok(group) => format!("`{}` counts otherwise", group.name()),
            Err(which) => which.clone(),
        };
        // Fallback for several axes in one message, where only the signal's name has the number of
        // the axis.
        let names: Option<Vec<String>> = (1..=self.axes)
            .map(|axis: usize| {
                let axis = axis.to_string();
                let mut of_axis = self.signals.iter().filter(|signal| {
                    let (name, number) = signal
                        .name
                        .split_at(signal.name.trim_end_matches(|c: char| c.is_ascii_digit()).len());
                    number == axis
                        && column_meaning(&format!("{}.{name}", signal.message))
                            == Some(ColumnMeaning::Position)
                });
                let name = |signal: &NamedSignal<'_>| format!("{}.{}", signal.message, signal.name);
                of_axis.next().map(name).filter(|_| of_axis.next().is_none())
            })
            .collect();
        names.filter(|names| names.iter().all(unit)).ok_or(without)
    }

    /// Returns the reference of each axis. `None` if its unit differs from that of the position,
    /// because both share one gain.
    fn find_reference(&self) -> Option<ColumnGroup> {
        let group = choose_group(&self.groups, ColumnMeaning::Reference).ok()?;
        let unit = |name: &str| self.find(name).map(|signal| signal.unit);
        let position = self.find_position().ok().and_then(|names| unit(names.first()?));
        let axis_unit = unit(&axis_name(group.name(), 0));
        (position.is_none() || axis_unit == position).then_some(group)
    }

    /// Proposes the additional readings of the drives. A reading is proposed if exactly one group
    /// of signals has a fitting name.
    fn propose_readings(&self, draft: &mut Draft<'_>) {
        // For each reading: its key, the word in its name, the words that select one of several
        // groups, and its units.
        let kinds: [(&str, &str, &[&str], &[&str]); 3] = [
            ("temperature", "temperature", &["motor", "rotor"], &["degC", "°C", "C"]),
            ("supply_voltage", "voltage", &["supply", "bus", "dc", "link"], &["V", "mV"]),
            ("mode", "mode", &["display"], &[""]),
        ];
        for (key, word, which, units) in kinds {
            let is = |name: &str, any: &[&str]| {
                let last_word = split_words(name.rsplit_once('.').map_or(name, |(_, own)| own));
                last_word.iter().any(|own| any.contains(&own.as_str()))
            };
            let fits = |name: &str| {
                let first = self.find(&name.replace(AXIS_PLACEHOLDER, "1"));
                name.contains(AXIS_PLACEHOLDER)
                    && is(name, &[word])
                    && first.is_some_and(|of| units.contains(&of.unit))
            };
            let names: Vec<&str> =
                self.groups.iter().map(ColumnGroup::name).filter(|name| fits(name)).collect();
            let meant: Vec<&str> = names.iter().copied().filter(|name| is(name, which)).collect();
            // A mode signal is ambiguous if its name does not mark it as the drive's own mode. It
            // may then be the requested mode.
            let single_name = match (names.as_slice(), meant.as_slice()) {
                (_, [one]) => one,
                ([one], []) if key != "mode" => one,
                _ => continue,
            };
            let guess = Guess::assumed(quote_text(single_name), "by its name");
            draft.add_entry("bus.layout", &format!("{key}.signal"), guess);
        }
    }

    fn layout(&self, draft: &mut Draft<'_>, by_sync: bool, by_arrival: bool) {
        let layout = "bus.layout";
        let groups = &self.groups;
        let group_of = |wanted| choose_group(groups, wanted);
        let signal = |draft: &mut Draft<'_>, what: &str, group: Result<_, String>| {
            let guess = match group {
                Ok(ColumnGroup::Numbered(pattern)) if has_axis(&pattern) => {
                    Guess::assumed(quote_text(&pattern), "by its name")
                }
                Ok(group) => Guess::without_value(&format!(
                    "the {what} as Message.Signal, with {{axis}} from 1; `{}` counts in another \
                        way",
                    group.name()
                )),
                Err(which) => Guess::without_value(&format!(
                    "the {what} as Message.Signal, with {{axis}} in place of the number; {which}"
                )),
            };
            draft.add_entry(layout, &format!("{what}.signal"), guess);
        };
        let arrival = || {
            let why = "the file has no SYNC: valid at the arrival of its own frame";
            Guess::assumed(quote_text("arrival"), why)
        };
        match (self.find_position(), group_of(ColumnMeaning::Position)) {
            (Ok(names), Ok(group)) if names[0] == axis_name(group.name(), 0) => {
                signal(draft, "position", Ok(group));
            }
            (Ok(names), _) => {
                let names: Vec<String> = names.iter().map(|name| quote_text(name)).collect();
                let guess = Guess::assumed(list_text(&names), "by their names");
                draft.add_entry(layout, "position.signal", guess);
            }
            (Err(which), _) => signal(draft, "position", Err(which)),
        }
        let valid = match by_arrival {
            true => arrival(),
            false => Guess::assumed(quote_text("instant"), "the instant of the sample"),
        };
        draft.add_entry(layout, "position.valid", valid);
        let (torque, is_command) = choose_torque_group(groups);
        let is_measured = torque.as_ref().is_ok_and(|group| is_measured(group.name()));
        signal(draft, "torque", torque);
        let valid = match is_measured && !is_command {
            _ if by_arrival => arrival(),
            true => Guess::assumed(quote_text("instant"), "measured, at the instant of the sample"),
            false => Guess::without_value(VALIDITY_QUESTION),
        };
        draft.add_entry(layout, "torque.valid", valid);
        if let Some(reference) = self.find_reference() {
            signal(draft, "reference", Ok(reference));
            let assumed = |valid, why| Guess::assumed(quote_text(valid), why);
            let valid = match by_sync {
                _ if by_arrival => arrival(),
                true => assumed("next-sync", "a target takes effect at the next SYNC (CiA 301)"),
                false => assumed("instant", "in the sample whose frame carries it"),
            };
            draft.add_entry(layout, "reference.valid", valid);
        }
        let plain = |word: &str| {
            let mut signals =
                self.signals.iter().filter(|signal| signal.name.eq_ignore_ascii_case(word));
            signals.next().filter(|_| signals.next().is_none())
        };
        if let Some(counter) = plain("counter").filter(|_| !by_sync) {
            let name = format!("{}.{}", counter.message, counter.name);
            draft.add_entry(layout, "counter", Guess::from_file(quote_text(&name), "by its name"));
        }
        let status = groups.iter().find(|group| {
            split_words(group.name()).ends_with(&["status".to_owned(), "word".to_owned()])
        });
        if let Some(group) = status {
            let guess = Guess::from_file(quote_text(group.name()), "by its name");
            draft.add_entry(layout, "status_word", guess);
        }
    }

    /// Returns the unit of the signal that was found for a quantity of an axis.
    fn signal_unit(&self, draft: &Draft<'_>, what: &str, axis: usize) -> Option<String> {
        let name = match draft.value(&format!("bus.layout.{what}.signal"))? {
            toml::Value::Array(names) => names.get(axis - 1)?.as_str()?.to_owned(),
            value => axis_name(value.as_str()?, axis - 1),
        };
        self.find(&name).map(|signal| signal.unit.to_lowercase())
    }

    fn find(&self, name: &str) -> Option<&NamedSignal<'_>> {
        let (message, signal) = name.split_once('.')?;
        self.signals.iter().find(|own| own.message == message && own.name == signal)
    }

    /// Returns the signals of all axes that have one of these meanings.
    fn signals_of(&self, meanings: &[ColumnMeaning]) -> Vec<String> {
        let has = |group: &&ColumnGroup| {
            column_meaning(group.name()).is_some_and(|of| meanings.contains(&of))
        };
        let wanted = self.groups.iter().filter(has);
        let each =
            wanted.flat_map(|group| (0..self.axes).map(|axis| axis_name(group.name(), axis)));
        each.collect()
    }
}

/// Returns true if a pattern has a place for the number of the axis.
fn has_axis(pattern: &str) -> bool {
    pattern.contains(AXIS_PLACEHOLDER) || pattern.contains(INDEX_PLACEHOLDER)
}
