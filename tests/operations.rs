//! Whatever a running service may say is in its manual, docs/operations.md: the lines of the status, the
//! reasons why all is not well, the causes of losses, the metrics.
//!
//! What it may say is read from the sources, so that nothing can be added there alone.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use didim::acquire::{BusState, FaultCounters};
use didim::status::IDLE;
use didim_drivers::assemble::{Losses, words};
use serde_json::Value;

const MANUAL: &str = include_str!("../docs/operations.md");

/// The code without its tests.
fn code(source: &'static str) -> &'static str {
    source.split("#[cfg(test)]").next().unwrap()
}

/// The text between quotation marks that follows each of the words, up to where a value is put in.
fn literals_after(source: &'static str, words: &str) -> Vec<&'static str> {
    let after = code(source).split(words).skip(1);
    let text = after.filter_map(|rest| rest.split('"').nth(1));
    text.map(|text| text.split('{').next().unwrap().trim()).collect()
}

/// Each is in the manual, written as code where `exact`; there are so many at least.
fn are_in_the_manual(names: &[&str], exact: bool, at_least: usize) {
    assert!(names.len() >= at_least, "the sources are written in another way: {names:?}");
    let missing: Vec<_> = names
        .iter()
        .filter(|name| {
            let wanted = if exact { format!("`{name}`") } else { format!("`{name}") };
            !MANUAL.contains(&wanted)
        })
        .collect();
    assert!(missing.is_empty(), "docs/operations.md has nothing on {missing:?}");
}

#[test]
fn lines_of_the_status() {
    let source = include_str!("../src/status/render.rs");
    let mut names = Vec::new();
    for kind in ["plain(", "counted(", "judged(", "latency(", "causes("] {
        names.extend(literals_after(source, &format!("rows.{kind}")));
    }
    let grants = code(source).split("for (name, grant) in [").nth(1).unwrap();
    names.extend(grants.split(']').next().unwrap().split('"').skip(1).step_by(2));
    names.extend(FaultCounters::default().each().map(|counter| counter.words));
    names.retain(|name| !name.is_empty());
    are_in_the_manual(&names, true, 35);
}

#[test]
fn reasons() {
    let sources = [
        include_str!("../src/status/snapshot.rs"),
        include_str!("../src/status/collect.rs"),
        include_str!("../src/status/fetch.rs"),
    ];
    let mut reasons = Vec::new();
    for source in sources {
        for words in ["reasons.push(", "health.add(", ".map(|why| format!("] {
            reasons.extend(literals_after(source, words));
        }
    }
    reasons.extend(literals_after(include_str!("../src/drift/status.rs"), "then(|| format!("));
    let unwell = BusState::ALL.into_iter().filter(|state| !state.is_well());
    reasons.extend(unwell.map(BusState::sentence));
    // What begins with a value is of a process, and has its own words.
    reasons.retain(|reason| !reason.is_empty());
    let (more, reasons): (Vec<_>, Vec<_>) =
        reasons.into_iter().partition(|reason| reason.starts_with("more "));
    assert!(more.iter().all(|_| MANUAL.contains("`N more parameters have left their bands`")));
    are_in_the_manual(&reasons, false, 12);
}

#[test]
fn states() {
    are_in_the_manual(&[IDLE], true, 1);
    are_in_the_manual(&BusState::ALL.map(BusState::words), true, 5);
}

#[test]
fn words_of_alarms_and_of_what_is_not_compared() {
    let words = include_str!("../src/drift/words.rs");
    for verb in words.split('"').filter(|text| text.starts_with("has ")) {
        assert!(MANUAL.contains(verb), "{verb}");
    }
    let source = include_str!("../src/drift/comparable.rs");
    let lasting = ["is not applicable", "is of the robot", "is by", "has other parameters than"];
    for what in lasting.into_iter().chain(["was noted with result", "are made up in another way"]) {
        assert!(source.contains(what) && MANUAL.contains(what), "{what}");
    }
    assert_eq!(source.matches("#[error(").count(), 6, "one more is not in the manual");
}

#[test]
fn causes_of_losses() {
    let Value::Object(losses) = serde_json::to_value(Losses::default()).unwrap() else { return };
    let of = |kind: &str| -> Vec<String> {
        let causes = losses[kind].as_object().unwrap();
        causes.keys().map(|cause| words(cause)).collect()
    };
    for (kind, at_least) in [("frames", 11), ("cycles", 11)] {
        let causes = of(kind);
        let causes: Vec<&str> = causes.iter().map(String::as_str).collect();
        are_in_the_manual(&causes, true, at_least);
    }
    let source = include_str!("../src/worker/window.rs");
    let causes = source.split("pub fn cause(").nth(1).unwrap().split("impl ").next().unwrap();
    let causes: Vec<&str> = causes.split('"').skip(1).step_by(2).collect();
    are_in_the_manual(&causes, true, 10);
}

#[test]
fn metrics() {
    let sources = [
        include_str!("../src/metrics/families.rs"),
        include_str!("../src/metrics/drift.rs"),
        include_str!("../src/metrics/recording.rs"),
    ];
    let names = sources.iter().flat_map(|source| code(source).split('"'));
    let is_name = |text: &&str| {
        text.starts_with("didim_")
            && text.bytes().all(|byte| byte == b'_' || byte.is_ascii_lowercase())
    };
    let mut names: Vec<&str> = names.filter(is_name).collect();
    names.extend(FaultCounters::default().each().map(|counter| counter.metric));
    are_in_the_manual(&names, true, 55);
}
