//! Failures of a command, and their exit codes for the shell.

use std::error::Error;
use std::fmt;
use std::path::Path;
use std::process::ExitCode;

use didim::signals::EXIT_CODE_INTERRUPTED;

use super::notes::print_note;

/// Reason why a command failed; each kind has its exit code.
#[derive(Debug)]
pub enum CliError {
    /// The arguments contradict each other or name something that does not exist. Exit code 2.
    Usage(String),
    /// A cell, robot or layout file is wrong. Exit code 78 (`EX_CONFIG`, sysexits.h).
    Configuration(Box<dyn Error + Send + Sync>),
    /// The work was refused or failed. Exit code 1.
    Failed(Box<dyn Error + Send + Sync>),
    /// The work was done, but its result does not meet a requirement of the command line. Exit code
    /// 3.
    NotUsable(String),
    /// The command was stopped before it was done. Exit code 130.
    Interrupted(String),
}

impl CliError {
    /// Creates a failure of the work itself.
    pub fn from_failure(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Failed(error.into())
    }

    /// Creates a failure caused by the content of a file.
    pub fn in_file(file: &Path, error: impl fmt::Display) -> Self {
        Self::from_failure(format!("{}: {error}", file.display()))
    }

    /// Creates a configuration error.
    pub fn from_configuration(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Configuration(error.into())
    }

    /// Writes the error and its causes to stderr, one per line, and returns the exit code.
    pub fn report(&self) -> ExitCode {
        let code = match self {
            Self::Usage(_) => 2,
            Self::Configuration(_) => 78,
            Self::Failed(_) => 1,
            Self::NotUsable(_) => 3,
            Self::Interrupted(_) => EXIT_CODE_INTERRUPTED,
        };
        print_note(&format!("didim: {self}\n"));
        let mut last = self.to_string();
        let mut cause = match self {
            Self::Usage(_) | Self::NotUsable(_) | Self::Interrupted(_) => None,
            Self::Configuration(error) | Self::Failed(error) => error.source(),
        };
        while let Some(error) = cause {
            let text = error.to_string();
            // Many errors print their source already; do not repeat it.
            if !last.contains(&text) {
                print_note(&format!("  because: {text}\n"));
            }
            last = text;
            cause = error.source();
        }
        ExitCode::from(code)
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(text) | Self::NotUsable(text) | Self::Interrupted(text) => text.fmt(f),
            Self::Configuration(error) | Self::Failed(error) => error.fmt(f),
        }
    }
}
