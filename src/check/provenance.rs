//! Check for torque gains of unknown origin.

use super::finding::Finding;
use crate::cell::CellBus;

/// Words that indicate a guess.
const GUESS_WORDS: &[&str] = &[
    "unknown",
    "todo",
    "tbd",
    "tbc",
    "fixme",
    "xxx",
    "guess",
    "guessed",
    "guesstimate",
    "assumed",
    "assumption",
    "approx",
    "approximately",
    "roughly",
    "probably",
    "maybe",
    "perhaps",
    "likely",
    "none",
    "n/a",
    "na",
    "dummy",
    "placeholder",
    "?",
    "??",
    "???",
];

pub(super) fn check(bus: &CellBus, findings: &mut Vec<Finding>) {
    for (drive, axis) in bus.drives.iter().zip(1..) {
        let gains = [
            ("position", drive.position.provenance.as_str()),
            ("torque", drive.torque.provenance.as_str()),
        ];
        for (gain, provenance) in gains {
            if is_guess(provenance) {
                findings.push(Finding::warning(
                    format!("bus.drives[{axis}].{gain}.provenance"),
                    format!("`{provenance}` does not say where the gain comes from"),
                    "a wrong gain makes parameters wrong by the same factor, and the fit does \
                        not show it: name the data sheet, the object of the drive, or the \
                        measurement",
                ));
            }
        }
    }
}

fn is_guess(provenance: &str) -> bool {
    let text = provenance.to_lowercase();
    if !text.chars().any(char::is_alphanumeric) {
        return true;
    }
    let is_separator =
        |c: char| c.is_whitespace() || matches!(c, ',' | ';' | ':' | '.' | '(' | ')' | '!');
    let guesses = text.split(is_separator).any(|word| GUESS_WORDS.contains(&word));
    guesses || text.contains("not known") || text.contains("don't know")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guesses_are_reported_from_sources() {
        for text in ["unknown", "TODO: ask", "a guess", "?", "-", "n/a", "not known yet"] {
            assert!(is_guess(text), "{text}");
        }
        for text in ["encoder of the simulated arm", "data sheet 12.3", "6076h", "measured 2024"] {
            assert!(!is_guess(text), "{text}");
        }
    }
}
