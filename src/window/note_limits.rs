//! Limits of a note.

use core::ops::RangeInclusive;

/// Plausible values of a note.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NoteLimits {
    /// Range of the payload of an arm \[kg\]. Derived: the strongest series models carry about 2.3
    /// t.
    pub payload_kg: RangeInclusive<f64>,
    /// Range of the temperature of a working arm \[°C\]. Derived: outdoor temperatures and the
    /// surroundings of a furnace.
    pub temperature_c: RangeInclusive<f64>,
    /// Maximum length of the text in characters. Convention: the text has to fit into a line of a
    /// table.
    pub text_length: usize,
}

impl NoteLimits {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self =
        Self { payload_kg: 0.0..=3000.0, temperature_c: -60.0..=200.0, text_length: 100 };
}
