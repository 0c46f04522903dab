//! Which results may be compared with a baseline.

use crate::archive::store::HistoryLine;

/// Payloads that differ by less are the same one \[kg\]: what a bench balance tells.
const SAME_PAYLOAD_KG: f64 = 0.01;
/// Names that are listed where parameters differ.
const NAMES: usize = 6;

/// Why a result is not compared with another.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotComparable {
    /// It is not good for monitoring.
    #[error("result {result} is not good for monitoring")]
    NotGood {
        /// Its number.
        result: u64,
    },
    /// They are of two robots. Set a new baseline.
    #[error("result {result} is of the robot {robot}, result {other} of {other_robot}")]
    OtherRobot {
        /// Number of the later one.
        result: u64,
        /// Its robot.
        robot: String,
        /// Number of the one it would be compared with.
        other: u64,
        /// Its robot.
        other_robot: String,
    },
    /// Errors of the model affect each method differently. Set a new baseline.
    #[error("result {result} is by {method}, result {other} by {other_method}")]
    OtherMethod {
        /// Number of the later one.
        result: u64,
        /// Its method.
        method: String,
        /// Number of the one it would be compared with.
        other: u64,
        /// Its method.
        other_method: String,
    },
    /// The names stand for other sums of parameters: the robot file has changed. Set a new baseline.
    #[error(
        "the base parameters of result {result} are regrouped in another way than those of result \
         {other}"
    )]
    OtherRegrouping {
        /// Number of the later one.
        result: u64,
        /// Number of the one it would be compared with.
        other: u64,
    },
    /// Leaving a parameter out changes the others. Set a new baseline.
    #[error("result {result} has other parameters than result {other} ({names})")]
    OtherParameters {
        /// Number of the later one.
        result: u64,
        /// Number of the one it would be compared with.
        other: u64,
        /// Parameters that only one of them has: `+` the later one, `−` the other.
        names: String,
    },
    /// Another mass was noted. Note with the next window what is carried now, or set a baseline with
    /// this payload.
    #[error(
        "a payload of {payload_kg} kg was noted with result {result}, {} with result {other}",
        other_kg.map_or("none".to_owned(), |kg| format!("one of {kg} kg"))
    )]
    OtherPayload {
        /// Number of the later one.
        result: u64,
        /// Its payload \[kg\].
        payload_kg: f64,
        /// Number of the one it would be compared with.
        other: u64,
        /// Its payload \[kg\].
        other_kg: Option<f64>,
    },
}

impl NotComparable {
    /// Whether no later result will be comparable either, if nothing is done.
    pub fn is_lasting(&self) -> bool {
        !matches!(self, Self::NotGood { .. } | Self::OtherPayload { .. })
    }
}

/// Whether a result may be compared with an earlier one, the baseline as a rule.
///
/// A result with which no payload was noted carries what the baseline did: most windows have no note.
/// A baseline with which none was noted carries none: a payload that was noted with the result alone is
/// another one, unless it is 0 kg.
///
/// # Errors
/// [`NotComparable`] says why not.
pub fn comparable(baseline: &HistoryLine, line: &HistoryLine) -> Result<(), NotComparable> {
    let (result, other) = (line.result, baseline.result);
    if !line.is_good_for_monitoring() {
        return Err(NotComparable::NotGood { result });
    }
    if line.robot != baseline.robot {
        let (robot, other_robot) = (line.robot.clone(), baseline.robot.clone());
        return Err(NotComparable::OtherRobot { result, robot, other, other_robot });
    }
    if line.method != baseline.method {
        let (method, other_method) = (line.method.clone(), baseline.method.clone());
        return Err(NotComparable::OtherMethod { result, method, other, other_method });
    }
    if line.regrouping != baseline.regrouping {
        return Err(NotComparable::OtherRegrouping { result, other });
    }
    let names = difference(line, baseline);
    if !names.is_empty() {
        return Err(NotComparable::OtherParameters { result, other, names });
    }
    let other_kg = baseline.payload_kg();
    match line.payload_kg() {
        Some(payload_kg) if (other_kg.unwrap_or(0.0) - payload_kg).abs() > SAME_PAYLOAD_KG => {
            Err(NotComparable::OtherPayload { result, payload_kg, other, other_kg })
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
