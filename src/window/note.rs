//! Notes on a window. They state influences on a result that the bus does not report.

use super::note_limits::NoteLimits;
use core::ops::RangeInclusive;

use didim_dynamics::robot::is_hidden;
use serde::{Deserialize, Serialize};

/// A note on a window. It is stored in the history and in the report, but not in the result file. A
/// replay of the same samples therefore gives the same file with every note.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// Mass at the flange that the robot file does not describe \[kg\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<f64>,
    /// Temperature of the arm \[°C\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// Free text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

/// Error when a note is invalid. Correct the note as the error describes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoteError {
    /// The note is empty.
    #[error("nothing to note: give a payload [kg], a temperature [°C] or a text")]
    Empty,
    /// A number is impossible.
    #[error(
        "{what} of {value} {unit} is impossible: it lies between {} and {} {unit}",
        range.start(), range.end()
    )]
    Implausible {
        /// Name of the value.
        what: &'static str,
        /// The number.
        value: f64,
        /// Unit of the number.
        unit: &'static str,
        /// Allowed range.
        range: RangeInclusive<f64>,
    },
    /// The text is empty, too long, or contains control or format characters.
    #[error(
        "the text of a note has 1 to {} characters in one line, without control and format \
         characters",
        NoteLimits::DEFAULT.text_length
    )]
    Text,
}

impl Note {
    /// Returns the note if it is valid.
    ///
    /// # Errors
    /// [`NoteError`].
    pub fn validated(self) -> Result<Self, NoteError> {
        if self == Self::default() {
            return Err(NoteError::Empty);
        }
        let plausible = |what, value: Option<f64>, unit, range: RangeInclusive<f64>| match value {
            Some(value) if !range.contains(&value) => {
                Err(NoteError::Implausible { what, value, unit, range })
            }
            _ => Ok(()),
        };
        plausible("a payload", self.payload_kg, "kg", NoteLimits::DEFAULT.payload_kg)?;
        plausible("a temperature", self.temperature_c, "°C", NoteLimits::DEFAULT.temperature_c)?;
        if let Some(text) = &self.text {
            let length = text.chars().count();
            if text.trim().is_empty()
                || length > NoteLimits::DEFAULT.text_length
                || text.chars().any(is_hidden)
            {
                return Err(NoteError::Text);
            }
        }
        Ok(self)
    }

    /// Replaces each value that the later note contains.
    #[must_use]
    pub fn amend(self, later: Self) -> Self {
        Self {
            payload_kg: later.payload_kg.or(self.payload_kg),
            temperature_c: later.temperature_c.or(self.temperature_c),
            text: later.text.or(self.text),
        }
    }

    /// Formats the note as a line, such as `2.5 kg, 31 °C, gripper changed`.
    pub fn line(&self) -> String {
        let parts = [
            self.payload_kg.map(|kg| format!("{kg} kg")),
            self.temperature_c.map(|celsius| format!("{celsius} °C")),
            self.text.clone(),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn payload(kg: f64) -> Note {
        Note { payload_kg: Some(kg), ..Note::default() }
    }

    fn text(text: &str) -> Note {
        Note { text: Some(text.into()), ..Note::default() }
    }

    #[test]
    fn what_can_be_passes_unchanged() {
        let long = "ü".repeat(100);
        let notes = [payload(0.0), payload(3000.0), text(&long), text("gripper changed")];
        for note in notes {
            assert_eq!(note.clone().validated(), Ok(note));
        }
        let full_note = Note { temperature_c: Some(-12.5), ..payload(2.0) }.amend(text("x"));
        assert_eq!(full_note.line(), "2 kg, -12.5 °C, x");
        assert_eq!(full_note.amend(payload(3.0)).line(), "3 kg, -12.5 °C, x");
    }

    #[test]
    fn what_cannot_be_is_refused_in_words() {
        assert_eq!(Note::default().validated(), Err(NoteError::Empty));
        for kg in [-0.1, 3000.1, f64::NAN, f64::INFINITY] {
            let error = payload(kg).validated().unwrap_err().to_string();
            assert!(error.contains("payload") && error.contains("0 and 3000 kg"), "{error}");
        }
        for celsius in [-273.15, 201.0, f64::NAN] {
            let note = Note { temperature_c: Some(celsius), ..Note::default() };
            let error = note.validated().unwrap_err().to_string();
            assert!(error.contains("temperature") && error.contains("-60 and 200 °C"), "{error}");
        }
        for bad in ["", "  ", "two\nlines", "\u{1b}[2J", &"x".repeat(101)] {
            assert_eq!(text(bad).validated(), Err(NoteError::Text), "{bad:?}");
        }
        for hidden in ['\u{202e}', '\u{200b}', '\u{2066}', '\u{feff}', '\u{2028}'] {
            let bad = format!("gripper{hidden}changed");
            assert_eq!(text(&bad).validated(), Err(NoteError::Text), "{bad:?}");
        }
    }
}
