//! Verdict for each use: the deciding figure, its limit, and the reasons against the use.

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use super::finding::Finding;
use super::quantiles::ResidualQuantiles;
use super::reasons::{Note, Reason};
use crate::identification::problem::{Failure, Use};

/// Verdict on the use of a result, with the reasons against it.
///
/// Its JSON has the reasons and notes as sentences, and both as [`findings`](Self::findings).
#[derive(Clone, Debug, Default, PartialEq)]
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
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "named as the uses")]
pub struct Uses {
    pub monitoring: UseVerdict,
    pub prediction: UseVerdict,
    pub contact_detection: UseVerdict,
    pub physical_values: UseVerdict,
    pub rigid_body: UseVerdict,
}

/// Verdict for one use.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct UseVerdict {
    /// True if the result is usable for this use; `None` if that cannot be decided.
    pub applicable: Option<bool>,
    /// The deciding figure.
    pub figure: Option<f64>,
    /// Unit of the figure; `1` is a share.
    pub unit: &'static str,
    /// Largest permitted figure.
    pub limit: Option<f64>,
    /// Reasons against the use. They are empty if it is applicable.
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
        // Reasons that may be the cause of others come first.
        reasons.sort_by_key(|reason| {
            !matches!(reason, Reason::OppositeCommand { .. } | Reason::Controller { .. })
        });
        let failure = reasons.iter().find_map(Reason::failure);
        let unused = explanations.into_iter().filter(|reason| !reasons.contains(reason));
        notes.extend(unused.map(Note::Explanation));
        Self { applicable: reasons.is_empty(), reasons, uses, notes, failure }
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

impl Serialize for Verdict {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { applicable, reasons, uses, notes, failure } = self;
        let fields = 4 + usize::from(!notes.is_empty()) + usize::from(failure.is_some());
        let mut record = serializer.serialize_struct("Verdict", fields)?;
        record.serialize_field("applicable", applicable)?;
        record.serialize_field("reasons", reasons)?;
        record.serialize_field("findings", &self.findings())?;
        record.serialize_field("uses", uses)?;
        if !notes.is_empty() {
            record.serialize_field("notes", notes)?;
        }
        if failure.is_some() {
            record.serialize_field("failure", failure)?;
        }
        record.end()
    }
}
