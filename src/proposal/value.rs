//! A proposed value: as TOML, with its source.

use crate::cell::MISSING_VALUE;

/// Source of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ValueOrigin {
    /// The value was answered by the user.
    Configured,
    /// The files contain the value.
    Found,
    /// The value is usual, or is likely according to the files.
    Assumed,
    /// The files cannot show the value.
    Missing,
}

impl ValueOrigin {
    /// Returns the word for this source.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Configured => "stated",
            Self::Found => "found",
            Self::Assumed => "assumed",
            Self::Missing => "missing",
        }
    }
}

/// A value with its reason.
pub(super) struct Guess {
    /// Value as TOML.
    pub(super) value: String,
    pub(super) origin: ValueOrigin,
    pub(super) explanation: String,
}

impl Guess {
    pub(super) fn from_file(value: String, why: &str) -> Self {
        Self { value, origin: ValueOrigin::Found, explanation: why.to_owned() }
    }

    pub(super) fn assumed(value: String, why: &str) -> Self {
        Self { value, origin: ValueOrigin::Assumed, explanation: why.to_owned() }
    }

    /// Creates an open value that the files cannot show; `what` is the question.
    pub(super) fn without_value(what: &str) -> Self {
        let why = what.to_owned();
        Self { value: quote_text(MISSING_VALUE), origin: ValueOrigin::Missing, explanation: why }
    }
}

/// Questions for open values.
pub(super) const POSITION_UNIT_QUESTION: &str = "unit: \"rad\", \"deg\" or \"rev\"; of a prismatic \
    joint \"m\" or \"mm\"; any other by its size in SI units, as { name = \"count\", si = 1e-4 }; \
    a list if they differ";
pub(super) const TORQUE_UNIT_QUESTION: &str = "unit: \"Nm\" or \"mNm\"; \"N\" for a prismatic \
    joint; \"A\" or \"mA\" with per_ampere for currents; any other by its size in SI units, as \
    { name = \"%\", si = 1.2 }; a list if they differ";
pub(super) const TORQUE_SIGN_QUESTION: &str = "1 if a positive torque accelerates the joint in its \
    positive direction, else -1; a list if they differ";
pub(super) const SIDE_QUESTION: &str = "\"motor\" if angles and torques are on the motor \
    side, \"joint\" if they are on the joint side";

/// Returns the texts of a list.
pub(super) fn text_list(values: &[toml::Value]) -> Vec<String> {
    values.iter().filter_map(|value| value.as_str().map(str::to_owned)).collect()
}

/// Parses a TOML value.
pub(super) fn parse_value(value: &str) -> Option<toml::Value> {
    let table: toml::Table = toml::from_str(&format!("value = {value}")).ok()?;
    table.get("value").filter(|_| table.len() == 1).cloned()
}

/// Formats a TOML string.
pub(super) fn quote_text(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Formats a list of TOML values.
pub(super) fn list_text(values: &[impl AsRef<str>]) -> String {
    let values: Vec<&str> = values.iter().map(AsRef::as_ref).collect();
    format!("[{}]", values.join(", "))
}
