//! Which results may be compared with a baseline.

use crate::store::HistoryLine;

/// Payloads that differ by less are the same one \[kg\]: what a bench balance tells.
const SAME_PAYLOAD_KG: f64 = 0.01;
/// Names that are listed where parameters differ.
const NAMES: usize = 6;

/// Why a result is not compared with another.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotComparable {
    /// Its verdict speaks against its use.
    #[error("result {result} is not applicable")]
    NotApplicable {
        /// Its number.
        result: u64,
    },
    /// It is of another robot. Set a new baseline.
    #[error(
        "result {result} is of the robot {robot}, the baseline of {baseline}; set a new baseline"
    )]
    OtherRobot {
        /// Its number.
        result: u64,
        /// Its robot.
        robot: String,
        /// The baseline's.
        baseline: String,
    },
    /// Methods differ in what they make of errors of the model. Set a new baseline.
    #[error("result {result} is by {method}, the baseline by {baseline}; set a new baseline")]
    OtherMethod {
        /// Its number.
        result: u64,
        /// Its method.
        method: String,
        /// The baseline's.
        baseline: String,
    },
    /// The names stand for other sums of parameters. Set a new baseline.
    #[error(
        "the base parameters of result {result} are made up in another way than the baseline's: the \
         robot file has changed; set a new baseline"
    )]
    OtherRegrouping {
        /// Its number.
        result: u64,
    },
    /// Leaving a parameter out moves others. Set a new baseline.
    #[error("result {result} has other parameters than the baseline ({names}); set a new baseline")]
    OtherParameters {
        /// Its number.
        result: u64,
        /// Those that only one of both has: `+` the result, `−` the baseline.
        names: String,
    },
    /// Another mass was noted. Note with the next window what is carried now, or set a baseline with
    /// this payload.
    #[error(
        "a payload of {payload_kg} kg was noted with result {result}, {} with the baseline",
        baseline_kg.map_or("none".to_owned(), |kg| format!("one of {kg} kg"))
    )]
    OtherPayload {
        /// Its number.
        result: u64,
        /// Its payload \[kg\].
        payload_kg: f64,
        /// The baseline's \[kg\].
        baseline_kg: Option<f64>,
    },
}

/// Whether a result may be compared with a baseline.
///
/// A result with which no payload was noted carries what the baseline did: most windows have no note.
/// A payload that was noted with the result alone is another one.
///
/// # Errors
/// [`NotComparable`] says why not.
pub fn comparable(baseline: &HistoryLine, line: &HistoryLine) -> Result<(), NotComparable> {
    let result = line.result;
    if !line.applicable {
        return Err(NotComparable::NotApplicable { result });
    }
    if line.robot != baseline.robot {
        let (robot, baseline) = (line.robot.clone(), baseline.robot.clone());
        return Err(NotComparable::OtherRobot { result, robot, baseline });
    }
    if line.method != baseline.method {
        let (method, baseline) = (line.method.clone(), baseline.method.clone());
        return Err(NotComparable::OtherMethod { result, method, baseline });
    }
    if line.regrouping != baseline.regrouping {
        return Err(NotComparable::OtherRegrouping { result });
    }
    let names = difference(line, baseline);
    if !names.is_empty() {
        return Err(NotComparable::OtherParameters { result, names });
    }
    let baseline_kg = baseline.payload_kg();
    match line.payload_kg() {
        Some(payload_kg)
            if baseline_kg.is_none_or(|kg| (kg - payload_kg).abs() > SAME_PAYLOAD_KG) =>
        {
            Err(NotComparable::OtherPayload { result, payload_kg, baseline_kg })
        }
        _ => Ok(()),
    }
}

fn difference(line: &HistoryLine, baseline: &HistoryLine) -> String {
    let only = |of: &HistoryLine, other: &HistoryLine, sign| -> Vec<String> {
        let names = of.parameters.iter().map(|parameter| &parameter.name);
        let missing = names.filter(|name| other.parameter(name).is_none());
        missing.map(|name| format!("{sign}{name}")).collect()
    };
    let mut names = only(line, baseline, '+');
    names.extend(only(baseline, line, '−'));
    let more = names.len().saturating_sub(NAMES);
    names.truncate(NAMES);
    match more {
        0 => names.join(" "),
        _ => format!("{} and {more} more", names.join(" ")),
    }
}
