//! The command to run next, which the user can paste into a shell.

use std::ffi::OsStr;
use std::fmt;
use std::path::PathBuf;

use crate::names::REPORT_FILE;

/// A line `next: didim …`.
pub(crate) struct NextCommand(String);

impl NextCommand {
    /// Starts a command line with a subcommand.
    pub(crate) fn new(subcommand: &str) -> Self {
        Self(format!("next: didim {subcommand}"))
    }

    /// Repeats the command line of this process.
    pub(crate) fn repeated() -> Self {
        let words = std::env::args_os().skip(1);
        words.fold(Self("next: didim".to_owned()), |line, word| line.with_argument(&word))
    }

    /// Repeats the command line of this process with a report. Empty if the command line has one,
    /// or if its input was a stream, which is over.
    pub(crate) fn with_report(report: Option<&PathBuf>, is_stream: bool) -> String {
        match report.is_some() || is_stream {
            true => String::new(),
            false => Self::repeated().with_option("--report", REPORT_FILE).to_string(),
        }
    }

    /// Adds an argument, quoted for the shell where it needs it.
    #[must_use]
    pub(crate) fn with_argument(self, value: impl AsRef<OsStr>) -> Self {
        let value = value.as_ref().to_string_lossy();
        let is_plain = |c: char| c.is_alphanumeric() || "_-./:=,+@%".contains(c);
        match !value.is_empty() && value.chars().all(is_plain) {
            true => Self(format!("{} {value}", self.0)),
            false => Self(format!("{} '{}'", self.0, value.replace('\'', "'\\''"))),
        }
    }

    /// Adds an option and its value.
    #[must_use]
    pub(crate) fn with_option(self, name: &str, value: impl AsRef<OsStr>) -> Self {
        Self(format!("{} {name}", self.0)).with_argument(value)
    }
}

impl fmt::Display for NextCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::NextCommand;

    #[test]
    fn arguments_are_quoted_where_a_shell_would_change_them() {
        let line = NextCommand::new("identify")
            .with_option("--cell", "my arm/cell.toml")
            .with_option("--input", "it's.csv")
            .with_option("--report", "");
        assert_eq!(
            line.to_string(),
            "next: didim identify --cell 'my arm/cell.toml' --input 'it'\\''s.csv' --report ''\n"
        );
        let plain = NextCommand::new("advise").with_argument("a-1/b_2.json");
        assert_eq!(plain.to_string(), "next: didim advise a-1/b_2.json\n");
    }
}
