//! Predicted standard deviations of a designed motion, compared with those of its result.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use didim_identification::identification::Estimate;
use serde::Serialize;

use crate::text::significant_digits;

/// Number of bytes that are read from the start of a motion's file. It is several times the header
/// size of a motion with sixty parameters.
const MAX_HEAD_BYTES: u64 = 256 << 10;
/// Word before the name, standard deviation and unit in a header line. Versions before 0.2.0 wrote
/// the second word.
const EXPECTATION_WORDS: [&str; 2] = ["predicted ", "foretold "];

/// Error when a result cannot be compared with the prediction.
#[derive(Debug, thiserror::Error)]
pub enum ExpectationError {
    /// The file cannot be read. Check its name and permissions.
    #[error("{}: {source}; check its name and permissions", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The header of the file has no predictions. Name a motion that was designed with `--result`.
    #[error(
        "{}: its head predicts no standard deviation; name the table, trajectory or URScript that \
        `didim design --result` wrote for this cell", file.display()
    )]
    Nothing {
        /// The file.
        file: PathBuf,
    },
}

/// Standard deviation of a parameter: the predicted one of the motion, and the achieved one of the
/// result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectedParameter {
    /// Name of the parameter.
    pub name: String,
    /// SI unit of both standard deviations.
    pub unit: String,
    /// Predicted standard deviation, from the header of the motion's file.
    #[serde(rename = "foretold")]
    pub expected: f64,
    /// Achieved standard deviation, from the result.
    pub achieved: f64,
}

/// Formats the header line that predicts a parameter's standard deviation.
pub fn expectation_line(name: &str, deviation: f64, unit: &str) -> String {
    let deviation = significant_digits(deviation, 4);
    format!("  {}{name}: {deviation} {unit}", EXPECTATION_WORDS[0]).trim_end().to_owned()
}

/// Parses name, standard deviation and unit, if the line predicts a parameter.
fn deviation_line(line: &str) -> Option<(&str, f64, &str)> {
    let (_, rest) = EXPECTATION_WORDS.iter().find_map(|word| line.split_once(word))?;
    let (name, rest) = rest.split_once(": ")?;
    let (deviation, unit) = rest.split_once(' ').unwrap_or((rest, ""));
    let deviation = deviation.parse().ok().filter(|of: &f64| of.is_finite() && *of > 0.0)?;
    Some((name, deviation, unit.trim_end()))
}

/// The header of a motion's file, with predicted standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignedMotion(String);

impl DesignedMotion {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// [`ExpectationError`].
    pub fn read(file: &Path) -> Result<Self, ExpectationError> {
        let mut head = Vec::new();
        let read =
            File::open(file).and_then(|open| open.take(MAX_HEAD_BYTES).read_to_end(&mut head));
        read.map_err(|source| ExpectationError::Read { file: file.to_path_buf(), source })?;
        let head = String::from_utf8_lossy(&head).into_owned();
        if !head.lines().any(|line| deviation_line(line).is_some()) {
            return Err(ExpectationError::Nothing { file: file.to_path_buf() });
        }
        Ok(Self(head))
    }

    /// Compares the predictions with the standard deviations of an estimate from this motion and
    /// the prior information. The comparison covers the parameters that both contain.
    pub fn compare(&self, estimate: &Estimate) -> Vec<ExpectedParameter> {
        self.0
            .lines()
            .filter_map(|line| {
                let (name, expected, unit) = deviation_line(line)?;
                let parameter = estimate.parameters.iter().find(|of| of.name == name)?;
                let achieved = parameter.standard_deviation;
                Some(ExpectedParameter {
                    name: name.to_owned(),
                    unit: unit.to_owned(),
                    expected,
                    achieved,
                })
            })
            .collect()
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
            let line = expectation_line(name, deviation, unit);
            for comment in ["#", "//", ";", "!"] {
                assert_eq!(
                    deviation_line(&format!("{comment} {line}")),
                    Some((name, deviation, unit))
                );
                assert_eq!(
                    deviation_line(&format!("{comment} {}", line.replace("predicted", "foretold"))),
                    Some((name, deviation, unit))
                );
            }
        }
        for line in [
            "# predicted",
            "# predicted a:",
            "# predicted a: b N·m",
            "# predicted a: -1 N·m",
            "# predicted a: inf N·m",
        ] {
            assert_eq!(deviation_line(line), None, "{line}");
        }
    }
}
