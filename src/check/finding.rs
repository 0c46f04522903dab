//! Findings of a check, with their severity.

use core::fmt;

use serde::Serialize;

/// The severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Creates an error: the run would fail, or its results would be wrong.
    Error,
    /// The run works, but not as well as it could, or not always.
    Warning,
    /// Worth knowing.
    Note,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        })
    }
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Its severity.
    pub severity: Severity,
    /// Key of the cell file that it concerns.
    pub key: String,
    /// The finding.
    pub what: String,
    /// Remedy.
    pub remedy: String,
}

impl Finding {
    /// The run would fail, or its results would be wrong.
    pub fn error(key: impl Into<String>, what: String, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Error, key, what, remedy)
    }

    /// Creates a warning: the run works, with restrictions.
    pub fn warning(key: impl Into<String>, what: String, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Warning, key, what, remedy)
    }

    /// Worth knowing.
    pub fn note(key: impl Into<String>, what: String, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Note, key, what, remedy)
    }

    /// Creates a finding of a severity that was decided in another place.
    pub fn new(
        severity: Severity,
        key: impl Into<String>,
        what: String,
        remedy: impl Into<String>,
    ) -> Self {
        Self { severity, key: key.into(), what, remedy: remedy.into() }
    }
}
