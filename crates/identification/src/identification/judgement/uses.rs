//! Verdict for each use: the deciding figure, its limit, and the reasons against the use.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::change::Change;
use super::finding::Finding;
use super::finding_code::Severity;
use super::quantiles::ResidualQuantiles;
use super::reasons::{Note, Reason};
use super::setting::Setting;
use crate::identification::problem::{Failure, Use};
use crate::stored_value::{self, Unit};

/// Verdict on the use of a result, with the reasons against it.
///
/// Its JSON has the reasons and notes as sentences, and both as [`findings`](Self::findings).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "StoredVerdict", into = "StoredVerdict")]
pub struct Verdict {
    /// True if there is no reason against the uses that the cell requires.
    pub applicable: bool,
    /// Reasons against the required uses.
    pub reasons: Vec<Reason>,
    /// Verdict for each use, including those that the cell does not require.
    pub uses: Uses,
    /// Notes on the result that do not affect its use.
    pub notes: Vec<Note>,
    /// Kind of failure of the method even though it has a result: that of the first reason with a
    /// failure.
    pub failure: Option<Failure>,
}

/// The verdict for each use.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", default)]
#[expect(missing_docs, reason = "named as the uses")]
pub struct Uses {
    pub monitoring: UseVerdict,
    pub prediction: UseVerdict,
    pub contact_detection: UseVerdict,
    pub physical_values: UseVerdict,
    pub rigid_body: UseVerdict,
}

/// Verdict for one use.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct UseVerdict {
    /// True if the result is usable for this use; `None` if that cannot be decided.
    pub applicable: Option<bool>,
    /// The deciding figure.
    pub figure: Option<f64>,
    /// Unit of the figure; `1` is a share.
    #[serde(deserialize_with = "stored_value::unit")]
    pub unit: Unit,
    /// Largest permitted figure.
    pub limit: Option<f64>,
    /// Reasons against the use. They are empty if it is applicable.
    #[schemars(with = "Vec<String>")]
    pub reasons: Vec<Reason>,
    /// Those of the reasons that only explain why a figure exceeds its limit.
    #[serde(skip)]
    pub explanations: Vec<Reason>,
    /// Residual quantiles of each joint, if the use is about residuals.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub quantiles_per_joint: Vec<ResidualQuantiles>,
}

/// The figures of one use: the deciding one with its limit, and those that exceed their limits.
pub(super) struct Criteria {
    pub(super) figure: Option<f64>,
    pub(super) unit: &'static str,
    pub(super) limit: Option<f64>,
    pub(super) failing: Vec<Reason>,
}

impl Criteria {
    /// Decides the use. Explanations count only if they can explain a failing criterion. They come
    /// before the criteria that they explain.
    pub(super) fn decide(self, blocking: &[Reason], explanations: &[Reason]) -> UseVerdict {
        let Self { figure, unit, limit, failing } = self;
        let explained = failing.iter().any(Reason::may_have_cause);
        let explanations = if explained { explanations.to_vec() } else { Vec::new() };
        let reasons = [blocking, &explanations, &failing].concat();
        // If all reasons only report that the use cannot be judged, there is no verdict.
        let unidentifiable = !reasons.is_empty() && reasons.iter().all(Reason::is_unidentifiable);
        let applicable = (!unidentifiable).then_some(reasons.is_empty());
        let quantiles_per_joint = Vec::new();
        UseVerdict { applicable, figure, unit, limit, reasons, explanations, quantiles_per_joint }
    }
}

impl UseVerdict {
    /// Adds reasons that are no figure.
    fn add_blocking(&mut self, more: &[Reason]) {
        self.reasons.extend_from_slice(more);
        self.applicable = match self.applicable {
            Some(applicable) => Some(applicable && more.is_empty()),
            None if more.is_empty() => None,
            None => Some(false),
        };
    }
}

impl Uses {
    fn all_mut(&mut self) -> [&mut UseVerdict; 5] {
        let Self { monitoring, prediction, contact_detection, physical_values, rigid_body } = self;
        [monitoring, prediction, contact_detection, physical_values, rigid_body]
    }

    /// Returns the verdict for one use.
    pub fn get(&self, wanted: Use) -> &UseVerdict {
        match wanted {
            Use::Monitoring => &self.monitoring,
            Use::Prediction => &self.prediction,
            Use::ContactDetection => &self.contact_detection,
            Use::PhysicalValues => &self.physical_values,
            Use::RigidBody => &self.rigid_body,
        }
    }
}

impl Verdict {
    /// Creates the verdict for the required uses. Explanations that they do not need are notes.
    pub(super) fn new(
        uses: Uses,
        required: &[Use],
        mut notes: Vec<Note>,
        explanations: Vec<Reason>,
    ) -> Self {
        let mut reasons: Vec<Reason> = Vec::new();
        for reason in required.iter().flat_map(|of| &uses.get(*of).reasons) {
            if !reasons.contains(reason) {
                reasons.push(reason.clone());
            }
        }
        // Causes before the figures that follow from them.
        reasons.sort_by_key(|reason| reason.code().rank());
        let failure = reasons.iter().find_map(Reason::failure);
        let unused = explanations.into_iter().filter(|reason| !reasons.contains(reason));
        notes.extend(unused.map(Note::Explanation));
        Self { applicable: reasons.is_empty(), reasons, uses, notes, failure }
    }

    /// Adds the keys of the configured values that findings ask to change. `find` returns the key
    /// of a change, if a file has one.
    pub fn add_settings(&mut self, find: &dyn Fn(&Change) -> Option<Setting>) {
        let of_uses = (self.uses.all_mut().into_iter())
            .flat_map(|of| of.reasons.iter_mut().chain(&mut of.explanations));
        for reason in self.reasons.iter_mut().chain(of_uses) {
            reason.find_setting(find);
        }
        for note in &mut self.notes {
            note.find_setting(find);
        }
    }

    /// Returns every finding as data: the reasons against any use, and the notes.
    pub fn findings(&self) -> Vec<Finding> {
        let uses = Use::ALL.map(|usage| {
            let of = self.uses.get(usage);
            (usage, of.reasons.as_slice(), of.explanations.as_slice())
        });
        Finding::list(&uses, &self.notes)
    }

    /// Returns the verdict with further reasons against every use.
    #[must_use]
    pub(crate) fn with_reasons(
        self,
        required: &[Use],
        more: impl IntoIterator<Item = Reason>,
    ) -> Self {
        let Self { mut uses, notes, .. } = self;
        let more: Vec<Reason> = more.into_iter().collect();
        for of in [
            &mut uses.monitoring,
            &mut uses.prediction,
            &mut uses.physical_values,
            &mut uses.rigid_body,
        ] {
            of.add_blocking(&more);
        }
        uses.contact_detection.reasons.extend(more);
        Self::new(uses, required, notes, Vec::new())
    }
}

/// Verdict in JSON: reasons and notes are sentences, of which `findings` have the data.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename = "Verdict")]
struct StoredVerdict {
    /// True if there is no reason against the uses that the cell requires.
    applicable: bool,
    /// Reasons against the required uses, as sentences.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    reasons: Vec<Reason>,
    /// Every finding as data: the reasons against any use, and the notes. Missing in results of
    /// earlier versions.
    #[serde(default)]
    findings: Vec<Finding>,
    /// Verdict for each use. Missing in results of earlier versions.
    #[serde(default)]
    uses: Uses,
    /// Notes that do not affect the use, as sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<String>")]
    notes: Vec<Note>,
    /// Kind of failure of the method, if it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<Failure>,
}

impl From<Verdict> for StoredVerdict {
    fn from(verdict: Verdict) -> Self {
        let findings = verdict.findings();
        let Verdict { applicable, reasons, uses, notes, failure } = verdict;
        Self { applicable, reasons, findings, uses, notes, failure }
    }
}

impl From<StoredVerdict> for Verdict {
    /// Gives each sentence the data of its finding.
    fn from(stored: StoredVerdict) -> Self {
        let StoredVerdict { applicable, mut reasons, findings, mut uses, mut notes, failure } =
            stored;
        let of_uses = uses.all_mut().into_iter().flat_map(|usage| &mut usage.reasons);
        for reason in reasons.iter_mut().chain(of_uses) {
            let message = reason.to_string();
            let is_same = |of: &&Finding| of.message == message;
            if let Some(found) = findings.iter().find(is_same) {
                *reason = Reason::Stored(Box::new(found.clone()));
            }
        }
        for usage in uses.all_mut() {
            let explains = |of: &&Reason| {
                of.stored().is_some_and(|found| found.severity == Severity::Explanatory)
            };
            usage.explanations = usage.reasons.iter().filter(explains).cloned().collect();
        }
        for note in &mut notes {
            let message = note.to_string();
            // A possible explanation is a note, too, and has one finding.
            if let Some(found) = findings.iter().rfind(|of| of.message == message) {
                *note = Note::Stored(Box::new(found.clone()));
            }
        }
        Self { applicable, reasons, uses, notes, failure }
    }
}
