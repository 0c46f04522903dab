//! Comparison of two results.

use serde::Serialize;

use crate::analysis::JointDifference;
use crate::archive::drift::{Change, JudgedHistory, NotComparable, check_comparable};
use crate::archive::store::{HistoryLine, ParameterValue};
use crate::text::{align_table, significant_digits, to_uncertainty};

/// Error when two results cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DifferenceError {
    /// No result has this number. `didim history` lists the results.
    #[error("result {0} is not in the history; `didim history` lists those that there are")]
    Unknown(u64),
    /// The two results are not comparable.
    #[error("nothing to compare: {0}")]
    NotComparable(#[from] NotComparable),
}

/// Changes from one result to another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Numbers of the two results.
    pub results: [u64; 2],
    /// Differences between the results that do not prevent a comparison.
    pub caveats: Vec<String>,
    /// The parameters, in the model's order.
    pub parameters: Vec<ParameterDifference>,
    /// Torque difference of each joint along a motion; empty without a motion.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub torques: Vec<JointDifference>,
}

/// Change of one parameter. Values that are not finite are null in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterDifference {
    /// Its name.
    pub parameter: String,
    /// Value and standard deviation in both results.
    pub values: [ParameterValue; 2],
    /// Difference Δ, in the unit of the values.
    pub difference: f64,
    /// Difference in standard deviations, Δ / σ_Δ.
    pub deviation_sigma: f64,
    /// Relative change θ/θ₀ − 1.
    pub relative_change: f64,
    /// |Δ| relative to half of the band around the first value. A value above 1 is outside the
    /// band.
    pub band_share: f64,
}

impl Difference {
    /// Compares two results of the history.
    ///
    /// # Errors
    /// [`DifferenceError`].
    pub fn new(history: &JudgedHistory, [then, now]: [u64; 2]) -> Result<Self, DifferenceError> {
        let line = |number| history.result(number).ok_or(DifferenceError::Unknown(number));
        let (first, second) = (line(then)?, line(now)?);
        let mut caveats = Vec::new();
        if !first.is_good_for_monitoring() {
            caveats.push(NotComparable::NotGood { result: then }.to_string());
        }
        match check_comparable(first, second) {
            Err(why @ (NotComparable::NotGood { .. } | NotComparable::OtherPayload { .. })) => {
                caveats.push(why.to_string());
                // The later result counts as usable and without a note, so that the other checks
                // run as well.
                let usable = HistoryLine { monitoring: Some(true), note: None, ..second.clone() };
                check_comparable(first, &usable)?;
            }
            other => other?,
        }
        if first.configuration != second.configuration {
            caveats.push("their configurations differ".to_owned());
        }
        let changes = Change::between_results(first, second, &history.options);
        let parameters = changes.into_iter().filter_map(|change| {
            let name = &change.parameter;
            let values = [first.parameter(name)?.clone(), second.parameter(name)?.clone()];
            Some(ParameterDifference {
                parameter: name.clone(),
                values,
                difference: change.difference,
                deviation_sigma: change.difference_deviations(),
                relative_change: change.relative_change(),
                band_share: change.band_share(),
            })
        });
        Ok(Self {
            results: [then, now],
            caveats,
            parameters: parameters.collect(),
            torques: Vec::new(),
        })
    }

    /// Formats the comparison as a table for people.
    pub fn table(&self) -> String {
        let rows: Vec<Vec<String>> = (self.parameters.iter())
            .map(|row| {
                let value = |p: &ParameterValue| to_uncertainty(p.value, p.standard_deviation, 7);
                let sigma = row.difference / row.deviation_sigma;
                let band = match row.band_share {
                    share if share > 1.0 => "outside".to_owned(),
                    share if share.is_nan() => "–".to_owned(),
                    share => format!("{:.0} %", 100.0 * share),
                };
                vec![
                    row.parameter.clone(),
                    value(&row.values[0]),
                    value(&row.values[1]),
                    row.values[1].unit_or_dash().to_owned(),
                    signed_difference(row.difference, sigma),
                    format!("{:+.2} %", 100.0 * row.relative_change),
                    format!("{:+.1}", row.deviation_sigma),
                    band,
                    row.values[1].description.clone().unwrap_or_default(),
                ]
            })
            .collect();
        let [then, now] = self.results.map(|number| format!("result {number}"));
        let mut text = align_table(
            &["parameter", &then, &now, "unit", "Δ", "relative", "Δ [σ]", "of the band", "of"],
            &rows,
        );
        if !self.torques.is_empty() {
            text += "\n";
            text += &torques_table(&self.torques);
        }
        for caveat in &self.caveats {
            text += &format!("note: {caveat}\n");
        }
        text
    }
}

/// Formats the torque differences along a motion.
fn torques_table(of: &[JointDifference]) -> String {
    let header = ["torque", "difference, rms", "by chance", "of the torque", "largest", "at"];
    align_table(
        &header,
        &of.iter()
            .map(|of: &JointDifference| {
                let torque = |value: f64| format!("{} {}", significant_digits(value, 2), of.unit);
                vec![
                    of.joint_name.as_ref().map_or_else(
                        || format!("joint {}", of.joint),
                        |name| format!("joint {} ({name})", of.joint),
                    ),
                    torque(of.rms),
                    of.by_chance.map_or("–".to_owned(), torque),
                    format!("{:.2} %", 100.0 * of.relative),
                    torque(of.largest),
                    format!("{:.2} s", of.at_s),
                ]
            })
            .collect::<Vec<_>>(),
    )
}

/// Formats a difference with its sign. A difference of exactly zero is formatted without digits of
/// its uncertainty.
fn signed_difference(difference: f64, sigma: f64) -> String {
    if difference == 0.0 || !sigma.is_finite() {
        return significant_digits(difference, 3);
    }
    let text = to_uncertainty(difference, sigma, 4);
    if difference > 0.0 { format!("+{text}") } else { text }
}
