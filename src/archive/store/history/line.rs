//! One line of the history.

use std::collections::BTreeMap;

use didim_formats::RecordingStart;
use didim_identification::identification::{Estimate, Use};
use serde::{Deserialize, Deserializer, Serialize};

use super::summary::DaySummary;
use crate::archive::store::against::ModelDifference;
use crate::archive::store::load::FoundLoad;
use crate::archive::store::record::{Attachments, ResultRecord};
use crate::archive::store::timestamp::Timestamp;
use crate::text::sha256;
use crate::window::{DriveReadings, Note};

/// Version of the line layout. It changes when a key changes its meaning or is removed.
pub const HISTORY_SCHEMA: u32 = 1;

/// A parameter in the history and the status.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Name of the parameter in lower case: `zz1r`, `ia3`, `fv_m6`.
    pub name: String,
    /// Its quantity with the name of its joint or link. `None` if the robot has no names, and in
    /// lines of versions without this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// SI unit, which depends on the kind of parameter: kg·m², kg·m, N·m·s/rad or N·m. Empty in
    /// lines of versions without units.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Value in SI units. NaN is written as null.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Standard deviation in the unit of the value, corrected for the autocorrelation of the
    /// residuals.
    #[serde(deserialize_with = "number")]
    pub standard_deviation: f64,
    /// Combined standard uncertainty, in the same unit. `None` in lines of versions without this
    /// key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub combined_standard_deviation: Option<f64>,
}

/// Reads a number. JSON has no NaN and no infinity, which are written as null.
fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl ParameterValue {
    /// Returns the parameters of an estimate, in the model's order.
    pub fn from_estimate(estimate: &Estimate) -> Vec<Self> {
        let value_of = |p: &didim_identification::identification::ParameterEstimate| Self {
            name: p.name.clone(),
            description: p.description.clone(),
            unit: p.unit.to_owned(),
            value: p.value,
            standard_deviation: p.standard_deviation,
            combined_standard_deviation: Some(p.combined_standard_deviation)
                .filter(|uncertainty| uncertainty.is_finite()),
        };
        estimate.parameters.iter().map(value_of).collect()
    }

    /// Returns the parameter with the digits that its uncertainty leaves: nine for the value, five
    /// for the deviations. More digits are noise, and would double the size of the history.
    pub(super) fn rounded(self) -> Self {
        Self {
            value: round(self.value, 9),
            standard_deviation: round(self.standard_deviation, 5),
            combined_standard_deviation: self.combined_standard_deviation.map(|of| round(of, 5)),
            ..self
        }
    }

    /// Returns the name of its joint or link, from its description.
    pub fn part_name(&self) -> Option<&str> {
        self.description.as_deref()?.split('`').nth(1)
    }

    /// Returns the unit for a table: a dash if it is unknown.
    pub fn unit_or_dash(&self) -> &str {
        if self.unit.is_empty() { "–" } else { &self.unit }
    }
}

/// Rounds a number to this many significant digits.
pub(super) fn round(value: f64, digits: usize) -> f64 {
    let decimals = digits.saturating_sub(1);
    format!("{value:.decimals$e}").parse().unwrap_or(value)
}

/// One result in the history, or the results of a day. Keys that a later version adds are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryLine {
    /// [`HISTORY_SCHEMA`].
    pub schema: u32,
    /// Time at which the result was stored.
    pub time: Timestamp,
    /// Time at which the window was recorded, from the time stamps of the bus. `None` if the stamps
    /// have no date, and in lines of versions without this key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded: Option<RecordingStart>,
    /// Number of the result, as in its file name.
    pub result: u64,
    /// Name of the cell. Empty in lines of versions without this key.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub cell: String,
    /// Name of the robot.
    pub robot: String,
    /// Hash of the configuration.
    pub configuration: String,
    /// Hash of the composition of the base parameters. The same name represents the same sum only
    /// if this hash is equal. Empty if unknown.
    #[serde(default)]
    pub regrouping: String,
    /// Name of the method.
    pub method: String,
    /// True if the result is usable for every use that its cell requires.
    pub applicable: bool,
    /// True if the result is usable for monitoring; `None` in lines of versions that had one
    /// verdict for every use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub monitoring: Option<bool>,
    /// Usability by the name of the use. Uses without a verdict are not included. Empty in lines of
    /// versions without this key.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub uses: BTreeMap<String, bool>,
    /// Relative error ‖y − Xθ‖ / ‖y‖. `None` if it is not a number.
    pub relative_error: Option<f64>,
    /// Note on the window.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<Note>,
    /// The parameters, in the model's order.
    pub parameters: Vec<ParameterValue>,
    /// Possible difference from the baseline due to model errors. `None` without a baseline, or if
    /// unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<ModelDifference>,
    /// Payload relative to that of the baseline. `None` without a baseline, or if the baseline
    /// cannot identify a load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<FoundLoad>,
    /// Further values of a row that stands for the results of a day. `None` for a result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<DaySummary>,
    /// Additional drive readings during the window.
    #[serde(flatten)]
    pub readings: DriveReadings,
}

impl HistoryLine {
    /// Creates the line of a result that is stored now under this number.
    pub fn new(
        result: u64,
        record: &ResultRecord,
        auxiliary: &Attachments,
        time: Timestamp,
    ) -> Self {
        let estimate = &record.estimate;
        let answer =
            |of: Use| Some((of.name().to_owned(), estimate.verdict.uses.get(of).applicable?));
        Self {
            schema: HISTORY_SCHEMA,
            time,
            recorded: record.window.recorded,
            result,
            cell: record.cell.clone(),
            robot: estimate.robot.clone(),
            configuration: record.configuration.clone(),
            regrouping: auxiliary.regrouping.clone(),
            method: estimate.method.clone(),
            applicable: estimate.verdict.applicable,
            monitoring: Some(estimate.verdict.uses.monitoring.applicable == Some(true)),
            uses: Use::ALL.into_iter().filter_map(answer).collect(),
            relative_error: Some(estimate.relative_error).filter(|error| error.is_finite()),
            note: auxiliary.note.clone(),
            parameters: ParameterValue::from_estimate(estimate)
                .into_iter()
                .map(ParameterValue::rounded)
                .collect(),
            day: None,
            against: auxiliary.against.clone(),
            load: auxiliary.load.clone(),
            readings: record.window.readings.clone(),
        }
    }

    /// Returns an identifier of this result that is unique over all installations. It is a SHA-256
    /// of number, robot, configuration, method and parameters. The date is not included, so that a
    /// history that was rebuilt from its results has the same identifiers.
    pub fn identity(&self) -> String {
        let mut parts = vec![self.result.to_string()];
        parts.extend([&self.robot, &self.configuration, &self.method].map(String::clone));
        for ParameterValue { name, value, standard_deviation, .. } in &self.parameters {
            // The numbers are rounded, because the last digit may differ after reading.
            parts.extend([
                name.clone(),
                format!("{value:.9e}"),
                format!("{standard_deviation:.9e}"),
            ]);
        }
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        sha256(&parts)
    }

    /// Returns true if a record has the robot, configuration, method and values of this result.
    pub fn has_values_of(&self, record: &ResultRecord) -> bool {
        let line = Self::new(self.result, record, &Attachments::default(), self.time);
        line.identity() == self.identity()
    }

    /// Returns true if the result is usable for a use. `None` if unknown.
    pub fn is_good_for(&self, of: Use) -> Option<bool> {
        let declared = self.uses.get(of.name()).copied();
        declared.or_else(|| self.monitoring.filter(|_| of == Use::Monitoring))
    }

    /// Returns true if the result may be a baseline or be compared with one.
    pub fn is_good_for_monitoring(&self) -> bool {
        self.monitoring.unwrap_or(self.applicable)
    }

    /// Returns a parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&ParameterValue> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Returns the contribution of model errors to a parameter's difference from an earlier result,
    /// in the parameter's unit. Returns 0 if it is unknown.
    pub fn deviation_by_model(&self, index: usize, earlier: &Self) -> f64 {
        let comparison = self.against.as_ref();
        let comparison =
            comparison.filter(|of| (of.result, of.time) == (earlier.result, earlier.time));
        comparison.and_then(|of| of.standard_deviations.get(index)).copied().map_or(0.0, f64::from)
    }

    /// Returns the noted payload \[kg\].
    pub fn payload_kg(&self) -> Option<f64> {
        self.note.as_ref()?.payload_kg
    }
}
