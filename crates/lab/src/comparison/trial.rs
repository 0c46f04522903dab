//! Trials: a method, and the rows of the equation that it solves.

use std::fmt;

use didim_identification::identification::Method;
use serde::{Deserialize, Serialize};

/// Returns the printed name of a method: `IDIM-LS`.
pub fn title(method: Method) -> String {
    method.name().to_uppercase()
}

/// Samples that become rows of the equation that a method solves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Framework {
    /// One of every N samples, after the decimation filter.
    Decimated,
    /// Every sample: the paper's strict output error framework.
    Strict,
}

/// A method in a framework.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Trial {
    /// The method.
    pub method: Method,
    /// The framework, which determines the rows of the equation.
    pub framework: Framework,
}

impl Trial {
    /// Reference for the other trials.
    pub const REFERENCE: Self = Self { method: Method::IdimLs, framework: Framework::Decimated };
}

impl fmt::Display for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&title(self.method))?;
        if self.framework == Framework::Strict { f.write_str(", strict") } else { Ok(()) }
    }
}

/// Returns the trials of the chosen methods and of the reference, which is always included. If
/// `strict` is true, the trials in the strict framework follow, for the methods that the paper also
/// has in this framework.
pub fn trials(methods: &[Method], strict: bool) -> Vec<Trial> {
    let reference = Trial::REFERENCE.method;
    let chosen = |method: &Method| *method == reference || methods.contains(method);
    let decimated = Method::ALL.into_iter().filter(chosen);
    let decimated = decimated.map(|method| Trial { method, framework: Framework::Decimated });
    let others =
        Method::ALL.into_iter().filter(|m| strict && chosen(m) && m.has_strict_framework());
    decimated.chain(others.map(|method| Trial { method, framework: Framework::Strict })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_is_always_there_and_the_strict_ones_come_last() {
        let names = |methods: &[Method]| -> Vec<String> {
            trials(methods, true).iter().map(ToString::to_string).collect()
        };
        assert_eq!(names(&[]), ["IDIM-LS"]);
        assert_eq!(names(&[Method::Didim]), ["IDIM-LS", "DIDIM", "DIDIM, strict"]);
        assert_eq!(names(&Method::ALL)[..5], ["IDIM-LS", "IDIM-IV", "CLIE", "CLOE", "DIDIM"]);
        assert_eq!(names(&Method::ALL)[5..], ["CLIE, strict", "CLOE, strict", "DIDIM, strict"]);
        assert_eq!(trials(&Method::ALL, false).len(), 5);
    }
}
