//! Faults of files, executed: what is counted, when, and what results say.

use std::fmt::Write as _;

use didim::threads::Threads;
use didim_identification::parallel::map;

use super::bench::{Assembled, BASE, assemble, cell, identify, replay};
use super::file::{Expected, FaultFile};
use super::outcome::Outcome;

/// So many combined uncertainties from the truth a parameter may be that is called good.
pub(super) const FARTHEST: f64 = 5.0;

/// What came of a fault, and all that is not as expected.
struct Found {
    name: String,
    /// In one line, for who writes expectations.
    line: String,
    wrong: Vec<String>,
}

#[test]
fn every_fault_comes_to_what_was_stated() {
    let files = FaultFile::read_all();
    assert!(files.len() >= 70, "{} faults", files.len());
    let only = std::env::var("DIDIM_FAULT").ok();
    let wanted = |file: &&FaultFile| {
        file.expected.is_some() && only.as_ref().is_none_or(|only| file.name == *only)
    };
    let executed: Vec<&FaultFile> = files.iter().filter(wanted).collect();
    let outcomes = map(&Threads::ALL, executed.len(), |index| execute(executed[index]));
    let mut wrong = String::new();
    for Found { name, line, wrong: of_fault } in &outcomes {
        println!("{name}: {line}");
        for text in of_fault {
            writeln!(wrong, "{name}: {text}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}

fn execute(file: &FaultFile) -> Found {
    let (bus, expected) = (file.bus.unwrap(), file.expected.as_ref().unwrap());
    let cell = cell(bus);
    let frames = BASE.frames(bus, &file.faults).expect("its values fit their signals");
    let assembled = assemble(cell, &frames);
    let mut wrong = Vec::new();
    check_counts(expected, &assembled, &mut wrong);
    let start = file.faults.iter().map(|faults| faults.from).min().unwrap();
    let within = detected_within(expected, start, &assembled);
    let is_late = match (expected.within_cycles, within) {
        (Some(limit), Some(within)) => within > limit,
        (Some(_), None) => true,
        (None, _) => false,
    };
    if is_late {
        wrong.push(format!("detected within {within:?} cycles"));
    }
    let live = replay(cell, &assembled.samples);
    let folder = tempfile::tempdir().unwrap();
    let (offline, parts) = identify(cell, folder.path(), &frames);
    let mut classes: Vec<&str> = live.iter().map(Outcome::class).collect();
    classes.dedup();
    let as_expected = classes.len() == expected.replay.len()
        && classes.iter().zip(&expected.replay).all(|(found, configured)| is(found, configured));
    if !as_expected {
        wrong.push(format!("replay {classes:?}"));
    }
    if !is(offline.class(), &expected.identify) {
        wrong.push(format!("identify {}", offline.class()));
    }
    let outcomes: Vec<&Outcome> = live.iter().chain([&offline]).collect();
    if let Some(says) = &expected.says
        && !outcomes.iter().any(|of| of.words().contains(says.as_str()))
    {
        wrong.push(format!("nothing says {says:?}"));
    }
    if let Some(configured_value) = &expected.physical_values {
        let expects_values = configured_value == "yes";
        for found in
            outcomes.iter().filter_map(|of| of.physical_values()).filter(|of| *of != expects_values)
        {
            wrong.push(format!("physical values {found}"));
        }
    }
    agree(&live, &offline, &assembled, parts, &mut wrong);
    check_truth(expected, &outcomes, &mut wrong);
    if let Some(undetectable) = &expected.undetectable {
        let mut cell = cell.clone();
        let tolerances = &mut cell.options.tolerances;
        *match undetectable.tolerance.as_str() {
            "torque_gain" => &mut tolerances.torque_gain,
            "torque_delay_s" => &mut tolerances.torque_delay_s,
            other => panic!("no tolerance {other}"),
        } = undetectable.value;
        for outcome in replay(&cell, &assembled.samples) {
            let (name, off) = outcome.farthest(&BASE.scenario);
            let class = outcome.class();
            if !(expected.replay.iter().any(|configured_value| configured_value == class)
                && off <= FARTHEST)
            {
                wrong.push(format!("with the tolerance: {class}, {name} off by {off:.1}"));
            }
        }
    }
    let described = outcomes.iter().map(|of| describe(of)).collect::<Vec<_>>().join(" | ");
    let causes = assembled.losses.cycles.by_cause().chain(assembled.losses.frames.by_cause());
    let counts: Vec<String> =
        causes.filter(|(_, count)| *count > 0).map(|(key, n)| format!("{key} {n}")).collect();
    let line = format!("{} [{within:?}] {described}", counts.join(", "));
    Found { name: file.name.clone(), line, wrong }
}

fn describe(outcome: &Outcome) -> String {
    let (name, off) = outcome.farthest(&BASE.scenario);
    let physical = match outcome.physical_values() {
        Some(true) => " physical",
        _ => "",
    };
    let words = outcome.words();
    let first = words.lines().next().unwrap_or_default();
    format!(
        "{}{physical} {name} {off:.1} {}",
        outcome.class(),
        first.chars().take(110).collect::<String>()
    )
}

/// Whether a class is the stated one.
fn is(found: &str, configured: &str) -> bool {
    found == configured || (configured == "safe" && ["yes", "no", "refused"].contains(&found))
}

/// Causes are counted as stated, and no cycle is lost for another.
fn check_counts(expected: &Expected, assembled: &Assembled, wrong: &mut Vec<String>) {
    let losses = &assembled.losses;
    let counts: Vec<(&str, u64)> =
        losses.cycles.by_cause().chain(losses.frames.by_cause()).collect();
    for (cause, configured) in &expected.counted {
        match counts.iter().find(|(key, _)| key == cause) {
            Some((_, count)) if configured.has(*count) => {}
            Some((_, count)) => wrong.push(format!("{cause} {count}, not {}", configured.shown())),
            None => wrong.push(format!("no cause {cause}")),
        }
    }
    let unstated = losses
        .cycles
        .by_cause()
        .filter(|(key, count)| *count > 0 && !expected.counted.contains_key(*key));
    wrong.extend(unstated.map(|(key, count)| format!("{key} {count} is not stated")));
}

/// Cycles from the first corrupted one to the one after which a named cause is counted.
fn detected_within(expected: &Expected, from: usize, assembled: &Assembled) -> Option<usize> {
    let counted = assembled.after_cycle.iter().position(|losses| {
        let mut causes = losses.cycles.by_cause().chain(losses.frames.by_cause());
        causes.any(|(key, count)| count > 0 && expected.counted.contains_key(key))
    })?;
    Some(counted.saturating_sub(from))
}

/// Both ways refuse the same. Where cycles are lost a window is rejected, and a file is cut: its
/// whole pieces count.
fn agree(
    live: &[Outcome],
    offline: &Outcome,
    assembled: &Assembled,
    parts: usize,
    wrong: &mut Vec<String>,
) {
    let gaps = assembled.samples.windows(2).filter(|two| two[1].sequence != two[0].sequence + 1);
    let gaps = gaps.count();
    if gaps > 0 && parts > 0 && parts != gaps + 1 {
        wrong.push(format!("{gaps} gaps and {parts} pieces"));
    }
    let good = |of: &Outcome| of.class() == "yes";
    let differ = match (gaps, live) {
        (0, [window]) => good(window) != good(offline) && !window.has_figure_of(offline),
        (0, []) => good(offline),
        // What is left whole is judged by each in its own length.
        _ => false,
    };
    if differ {
        wrong.push("replay and identify do not agree".to_owned());
    }
}

/// Nothing is called good that is wrong, but for what no data can show; and that is shown to be
/// wrong. A result may predict torques well with parameters that are not the arm's: then a finding
/// has to name the fault, and the values are not called physical.
fn check_truth(expected: &Expected, all: &[&Outcome], wrong: &mut Vec<String>) {
    let good = |outcome: &&&Outcome| outcome.is_called_good();
    let worst = all.iter().filter(good).map(|outcome| outcome.farthest(&BASE.scenario));
    let worst = worst.max_by(|one, other| one.1.total_cmp(&other.1));
    let is_named = expected.says.is_some();
    let no_values = all.iter().all(|of| of.physical_values() != Some(true));
    let is_wrong = worst.as_ref().is_some_and(|(_, off)| *off > FARTHEST);
    match (is_wrong, &expected.undetectable) {
        (true, None) if !(is_named && no_values) => {
            wrong.push(format!("called good, and {worst:?} uncertainties off"));
        }
        (false, Some(_)) => wrong.push(format!("not wrong: {worst:?}")),
        _ => {}
    }
}
