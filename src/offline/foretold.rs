//! What a designed motion was foretold to tell, beside what came of it.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use didim_core::identification::Estimate;
use serde::Serialize;

use crate::text::significant;

/// The head of a motion's file that is read \[bytes\]: several times as long as one of sixty parameters.
const HEAD_BYTES: u64 = 256 << 10;
/// Before name, standard deviation and unit in a line of the head.
const FORETOLD: &str = "foretold ";

/// Why a result cannot be held against what was foretold.
#[derive(Debug, thiserror::Error)]
pub enum ForetoldError {
    /// The file cannot be read. Check its name and permissions.
    #[error("{}: {source}; check its name and permissions", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Nothing is foretold at the head of the file. Name a motion that was designed with `--result`.
    #[error(
        "{}: its head foretells no standard deviation; name the table, trajectory or URScript that \
         `didim design --result` wrote for this cell", file.display()
    )]
    Nothing {
        /// The file.
        file: PathBuf,
    },
}

/// A parameter's standard deviation: foretold with the motion, and of the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Foretold {
    /// Name of the parameter.
    pub name: String,
    /// The SI unit of both.
    pub unit: String,
    /// As the head of the motion's file says.
    pub foretold: f64,
    /// As the result says.
    pub achieved: f64,
}

/// The line of a file's head that says so of a parameter.
pub fn foretold_line(name: &str, deviation: f64, unit: &str) -> String {
    format!("  {FORETOLD}{name}: {} {unit}", significant(deviation, 4)).trim_end().to_owned()
}

/// Name, standard deviation and unit, where the line says that of a parameter.
fn told(line: &str) -> Option<(&str, f64, &str)> {
    let (_, rest) = line.split_once(FORETOLD)?;
    let (name, rest) = rest.split_once(": ")?;
    let (deviation, unit) = rest.split_once(' ').unwrap_or((rest, ""));
    let deviation = deviation.parse().ok().filter(|of: &f64| of.is_finite() && *of > 0.0)?;
    Some((name, deviation, unit.trim_end()))
}

/// The head of a motion's file, which foretells standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignedMotion(String);

impl DesignedMotion {
    /// Reads the head of a file.
    ///
    /// # Errors
    /// [`ForetoldError`].
    pub fn read(file: &Path) -> Result<Self, ForetoldError> {
        let mut head = Vec::new();
        let read = File::open(file).and_then(|open| open.take(HEAD_BYTES).read_to_end(&mut head));
        read.map_err(|source| ForetoldError::Read { file: file.to_path_buf(), source })?;
        let head = String::from_utf8_lossy(&head).into_owned();
        if !head.lines().any(|line| told(line).is_some()) {
            return Err(ForetoldError::Nothing { file: file.to_path_buf() });
        }
        Ok(Self(head))
    }

    /// What it foretells, beside the estimate from that motion and what was known before it; parameters of both.
    pub fn beside(&self, estimate: &Estimate) -> Vec<Foretold> {
        let beside = |line| {
            let (name, foretold, unit) = told(line)?;
            let found = estimate.parameters.iter().find(|of| of.name == name)?;
            let achieved = found.standard_deviation;
            Some(Foretold { name: name.to_owned(), unit: unit.to_owned(), foretold, achieved })
        };
        self.0.lines().filter_map(beside).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_is_written_in_whatever_comment() {
        for (name, deviation, unit) in
            [("zz1r", 0.012, "kg·m²"), ("fc_m6", 1.5e-7, "N·m"), ("x", 3.0, "")]
        {
            let line = foretold_line(name, deviation, unit);
            for comment in ["#", "//", ";", "!"] {
                assert_eq!(told(&format!("{comment} {line}")), Some((name, deviation, unit)));
            }
        }
        for line in [
            "# foretold",
            "# foretold a:",
            "# foretold a: b N·m",
            "# foretold a: -1 N·m",
            "# foretold a: inf N·m",
        ] {
            assert_eq!(told(line), None, "{line}");
        }
    }
}
