//! Check if a result may be compared with a baseline.

use super::limits::DriftLimits;
use crate::archive::store::HistoryLine;

/// Maximum number of names that are listed if parameters differ.
const MAX_LISTED_NAMES: usize = 6;

/// Reason why a result is not compared with another.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotComparable {
    /// The result is not usable for monitoring.
    #[error("result {result} is not usable for monitoring")]
    NotGood {
        /// Number of the result.
        result: u64,
    },
    /// The results are of two different robots. Set a new baseline.
    #[error("result {result} is of the robot {robot}, result {other} of {other_robot}")]
    OtherRobot {
        /// Number of the later result.
        result: u64,
        /// Robot of the later result.
        robot: String,
        /// Number of the result to compare with.
        other: u64,
        /// Robot of the result to compare with.
        other_robot: String,
    },
    /// The results are of two different methods, and model errors affect each method differently.
    /// Set a new baseline.
    #[error("result {result} is by {method}, result {other} by {other_method}")]
    OtherMethod {
        /// Number of the later result.
        result: u64,
        /// Method of the later result.
        method: String,
        /// Number of the result to compare with.
        other: u64,
        /// Method of the result to compare with.
        other_method: String,
    },
    /// The base parameters of the two results are different sums, because the robot file has
    /// changed. Set a new baseline.
    #[error(
        "the base parameters of result {result} are regrouped in another way than those of \
            result {other}"
    )]
    OtherRegrouping {
        /// Number of the later result.
        result: u64,
        /// Number of the result to compare with.
        other: u64,
    },
    /// The two results have different parameters, and omitting a parameter changes the others. Set
    /// a new baseline.
    #[error("result {result} has other parameters than result {other} ({names})")]
    OtherParameters {
        /// Number of the later result.
        result: u64,
        /// Number of the result to compare with.
        other: u64,
        /// Parameters that only one of the two results has: `+` for the later result, `−` for the
        /// other.
        names: String,
    },
    /// The two results have different noted payload masses. Note the current payload with the next
    /// window, or set a baseline with this payload.
    #[error(
        "a payload of {payload_kg} kg was noted with result {result}, {} with result {other}",
        other_kg.map_or("none".to_owned(), |kg| format!("one of {kg} kg"))
    )]
    OtherPayload {
        /// Number of the later result.
        result: u64,
        /// Payload noted with the later result \[kg\].
        payload_kg: f64,
        /// Number of the result to compare with.
        other: u64,
        /// Payload noted with the result to compare with \[kg\].
        other_kg: Option<f64>,
    },
}

impl NotComparable {
    /// Returns true if the reason also affects all later results until somebody removes it.
    pub fn is_lasting(&self) -> bool {
        !matches!(self, Self::NotGood { .. } | Self::OtherPayload { .. })
    }
}

/// Checks that a result may be compared with an earlier one, usually the baseline.
///
/// If a result has no noted payload, it is assumed to have the baseline's payload, because most
/// windows have no note. If the baseline has no noted payload, it is assumed to have none. A
/// payload noted with the result is then a difference, unless it is 0 kg.
///
/// # Errors
/// [`NotComparable`] gives the reason.
pub fn check_comparable(baseline: &HistoryLine, line: &HistoryLine) -> Result<(), NotComparable> {
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
    // A line that was rebuilt from its result lacks it. One configuration has one robot file.
    let is_rebuilt = [line, baseline].iter().any(|of| of.regrouping.is_empty())
        && line.configuration == baseline.configuration;
    if line.regrouping != baseline.regrouping && !is_rebuilt {
        return Err(NotComparable::OtherRegrouping { result, other });
    }
    let names = differing_names(line, baseline);
    if !names.is_empty() {
        return Err(NotComparable::OtherParameters { result, other, names });
    }
    let other_kg = baseline.payload_kg();
    match line.payload_kg() {
        Some(payload_kg)
            if (other_kg.unwrap_or(0.0) - payload_kg).abs()
                > DriftLimits::DEFAULT.same_payload_kg =>
        {
            Err(NotComparable::OtherPayload { result, payload_kg, other, other_kg })
        }
        _ => Ok(()),
    }
}

fn differing_names(line: &HistoryLine, baseline: &HistoryLine) -> String {
    let only = |of: &HistoryLine, other: &HistoryLine, sign| -> Vec<String> {
        let names = of.parameters.iter().map(|parameter| &parameter.name);
        let missing = names.filter(|name| other.parameter(name).is_none());
        missing.map(|name| format!("{sign}{name}")).collect()
    };
    let mut names = only(line, baseline, '+');
    names.extend(only(baseline, line, '−'));
    let more = names.len().saturating_sub(MAX_LISTED_NAMES);
    names.truncate(MAX_LISTED_NAMES);
    match more {
        0 => names.join(" "),
        _ => format!("{} and {more} more", names.join(" ")),
    }
}
