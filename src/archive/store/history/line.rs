//! One line of the history.

use std::collections::BTreeMap;

use didim_core::identification::{Estimate, Use};
use didim_formats::RecordingStart;
use serde::{Deserialize, Deserializer, Serialize};

use crate::archive::store::against::Against;
use crate::archive::store::load::FoundLoad;
use crate::archive::store::record::{Beside, ResultRecord};
use crate::archive::store::timestamp::Timestamp;
use crate::text::sha256;
use crate::window::{DriveReadings, Note};

/// Version of a line's layout: it changes when a key changes its meaning or goes away.
pub const HISTORY_SCHEMA: u32 = 1;

/// A parameter as the history and the status have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// The field's name in lower case: `zz1r`, `ia3`, `fv_m6`.
    pub name: String,
    /// Its SI unit: kg·m², kg·m, N·m·s/rad or N·m by the kind of parameter; empty in lines of versions
    /// that did not say.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// SI value. What is no number is null in JSON.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Standard deviation in the unit of the value, corrected for the colour of the residuals.
    #[serde(deserialize_with = "number")]
    pub standard_deviation: f64,
    /// Combined standard uncertainty, in the same unit; nothing in lines of versions that had none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub combined_standard_deviation: Option<f64>,
}

/// JSON has no NaN and no infinity: they are written as null.
fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl ParameterValue {
    /// The parameters of an estimate, in the model's order.
    pub fn of(estimate: &Estimate) -> Vec<Self> {
        let one = |p: &didim_core::identification::ParameterEstimate| Self {
            name: p.name.clone(),
            unit: p.unit.to_owned(),
            value: p.value,
            standard_deviation: p.standard_deviation,
            combined_standard_deviation: Some(p.combined_standard_deviation)
                .filter(|uncertainty| uncertainty.is_finite()),
        };
        estimate.parameters.iter().map(one).collect()
    }

    /// The unit for a table: a dash where it is not known.
    pub fn unit_or_dash(&self) -> &str {
        if self.unit.is_empty() { "–" } else { &self.unit }
    }
}

/// One result in the history. Keys of a later version are passed over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryLine {
    /// [`HISTORY_SCHEMA`].
    pub schema: u32,
    /// When it was stored.
    pub time: Timestamp,
    /// When its window was recorded, by the stamps of the bus; nothing where these have no date, and in lines of versions that
    /// did not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded: Option<RecordingStart>,
    /// Number of the result: that of its file.
    pub result: u64,
    /// Name of the cell; empty in lines of versions that did not say.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub cell: String,
    /// Name of the robot.
    pub robot: String,
    /// Hash of the configuration.
    pub configuration: String,
    /// Hash of how the base parameters are made up: the same name stands for the same sum only
    /// where this is the same. Empty where it is not known.
    #[serde(default)]
    pub regrouping: String,
    /// Method.
    pub method: String,
    /// Whether the result may be used for all that its cell asks for.
    pub applicable: bool,
    /// Whether it is good for monitoring; nothing in lines of versions that had one verdict for every
    /// use.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub monitoring: Option<bool>,
    /// Whether it is good for each use, by the use's name. A use of which that cannot be told is not in it, and none
    /// in lines of versions that did not say.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub uses: BTreeMap<String, bool>,
    /// ‖y − Xθ‖ / ‖y‖; nothing when it is not a number.
    pub relative_error: Option<f64>,
    /// What was noted with its window.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<Note>,
    /// The parameters, in the model's order.
    pub parameters: Vec<ParameterValue>,
    /// How far the model's errors may set it apart from the baseline; nothing where there was none, or that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<Against>,
    /// What the arm carried beyond what it did with the baseline; nothing where there was none, or it tells no load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<FoundLoad>,
    /// What the drives told besides along its window.
    #[serde(flatten)]
    pub readings: DriveReadings,
}

impl HistoryLine {
    /// That of a result which is stored at this time under a number.
    pub fn of(result: u64, record: &ResultRecord, beside: &Beside, time: Timestamp) -> Self {
        let estimate = &record.estimate;
        let answer =
            |of: Use| Some((of.name().to_owned(), estimate.verdict.uses.of(of).applicable?));
        Self {
            schema: HISTORY_SCHEMA,
            time,
            recorded: record.window.recorded,
            result,
            cell: record.cell.clone(),
            robot: estimate.robot.clone(),
            configuration: record.configuration.clone(),
            regrouping: beside.regrouping.clone(),
            method: estimate.method.clone(),
            applicable: estimate.verdict.applicable,
            monitoring: Some(estimate.verdict.uses.monitoring.applicable == Some(true)),
            uses: Use::ALL.into_iter().filter_map(answer).collect(),
            relative_error: Some(estimate.relative_error).filter(|error| error.is_finite()),
            note: beside.note.clone(),
            parameters: ParameterValue::of(estimate),
            against: beside.against.clone(),
            load: beside.load.clone(),
            readings: record.window.readings.clone(),
        }
    }

    /// What tells this result from every other one, of whatever cabinet: a SHA-256 of its number, robot, configuration,
    /// method and parameters. The date is no part of it, so that a history which was made anew of its results has the
    /// same ones.
    pub fn identity(&self) -> String {
        let mut parts = vec![self.result.to_string()];
        parts.extend([&self.robot, &self.configuration, &self.method].map(String::clone));
        for ParameterValue { name, value, standard_deviation, .. } in &self.parameters {
            // Fewer digits than there are: what reads them may differ in the last one.
            parts.extend([
                name.clone(),
                format!("{value:.9e}"),
                format!("{standard_deviation:.9e}"),
            ]);
        }
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        sha256(&parts)
    }

    /// Whether it is good for a use; nothing where that is not known.
    pub fn is_good_for(&self, of: Use) -> Option<bool> {
        let stated = self.uses.get(of.name()).copied();
        stated.or_else(|| self.monitoring.filter(|_| of == Use::Monitoring))
    }

    /// Whether it may be a baseline, and be compared with one.
    pub fn is_good_for_monitoring(&self) -> bool {
        self.monitoring.unwrap_or(self.applicable)
    }

    /// A parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&ParameterValue> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// What errors of the model make of a parameter's difference to an earlier result, in its unit: 0 where that is not
    /// known.
    pub fn deviation_by_model(&self, index: usize, earlier: &Self) -> f64 {
        let known = self.against.as_ref();
        let known = known.filter(|of| (of.result, of.time) == (earlier.result, earlier.time));
        known.and_then(|of| of.standard_deviations.get(index)).copied().map_or(0.0, f64::from)
    }

    /// The payload that was noted \[kg\].
    pub fn payload_kg(&self) -> Option<f64> {
        self.note.as_ref()?.payload_kg
    }
}
