//! Findings of a check, with their severity.

use core::fmt;

use serde::Serialize;

/// The severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The run would fail, or its results would be wrong.
    Error,
    /// The run works, but not always or not at its best.
    Warning,
    /// The finding is information and needs no action.
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
    /// Key of the cell file that the finding concerns.
    pub key: String,
    /// Description of the finding.
    pub what: String,
    /// Remedy for the finding.
    pub remedy: String,
}

impl Finding {
    /// Creates an error: the run would fail, or its results would be wrong.
    pub fn error(key: impl Into<String>, what: String, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Error, key, what, remedy)
    }

    /// Creates a warning: the run works, with restrictions.
    pub fn warning(key: impl Into<String>, what: String, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Warning, key, what, remedy)
    }

    /// Creates a note: information that needs no action.
    pub fn note(key: impl Into<String>, what: String, remedy: impl Into<String>) -> Self {
        Self::new(Severity::Note, key, what, remedy)
    }

    /// Creates a finding with a given severity.
    pub fn new(
        severity: Severity,
        key: impl Into<String>,
        what: String,
        remedy: impl Into<String>,
    ) -> Self {
        Self { severity, key: key.into(), what, remedy: remedy.into() }
    }
}
