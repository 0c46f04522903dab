//! Findings of a verdict as data: code, severity, subject, and figure.

use didim_dynamics::robot::{JointIndex, MotorIndex};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::finding_code::{FindingCode, Severity};
use super::setting::Setting;
use super::significance::Significance;
use crate::identification::problem::Use;

/// The object of a finding. Joints, motors and links count from 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "each is named for what it holds")]
pub enum Subject {
    Joints(Vec<JointIndex>),
    Motors(Vec<MotorIndex>),
    Links(Vec<usize>),
    Parameters(Vec<String>),
}

/// Finding as stored in a result file, which programs can read without parsing a sentence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// Code of the finding, which does not change between versions.
    pub code: FindingCode,
    /// Consequence of the finding.
    pub severity: Severity,
    /// Uses that the finding blocks or explains, including uses that the cell does not require.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uses: Vec<Use>,
    /// Affected joints, motors, links or parameters; `None` if the finding affects the whole
    /// result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subject: Option<Subject>,
    /// Deciding number, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure: Option<f64>,
    /// The limit that the figure exceeds or falls short of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// Unit of figure and limit: `1` for shares, ratios and counts, `σ` for standard deviations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Probability of the finding by chance, if it is the outcome of a statistical test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub significance: Option<Significance>,
    /// Key of a configured value, with the value that the data ask for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set: Option<Setting>,
    /// Message for the user, whose wording may change between versions.
    pub message: String,
}

impl Finding {
    /// Creates the finding of a sentence in a result of a version without findings.
    pub(super) fn from_sentence(message: String, severity: Severity) -> Self {
        Self {
            code: FindingCode::Other,
            severity,
            uses: Vec::new(),
            subject: None,
            figure: None,
            limit: None,
            unit: None,
            significance: None,
            set: None,
            message,
        }
    }
}
