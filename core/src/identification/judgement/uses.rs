//! The verdict: for each use, what decides, by how much, and what speaks against it.

use serde::Serialize;

use super::quantiles::ResidualQuantiles;
use super::reasons::{Note, Reason};
use crate::identification::given::{Failure, Use};

/// Whether a result may be used, and if not, why not.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Verdict {
    /// True when nothing speaks against a use that the cell asks for.
    pub applicable: bool,
    /// What speaks against one of these.
    pub reasons: Vec<Reason>,
    /// Each use by itself, whether the cell asks for it or not.
    pub uses: Uses,
    /// Notes on the result that do not speak against its use.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
    /// How the method failed although it has a result, where it did; the first of the reasons that
    /// says so.
    #[serde(skip_serializing_if = "Option::is_none")]
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

/// The verdict for one use.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct UseVerdict {
    /// Whether the result is good for it; none where that cannot be told.
    pub applicable: Option<bool>,
    /// What decides.
    pub figure: Option<f64>,
    /// Its unit; `1` is a share.
    pub unit: &'static str,
    /// What the figure may be at most.
    pub limit: Option<f64>,
    /// What speaks against it.
    pub reasons: Vec<Reason>,
    /// What the residuals of each joint stay below, where the use is about them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub quantiles_per_joint: Vec<ResidualQuantiles>,
}

impl UseVerdict {
    /// A figure with its limit, and what speaks against the use.
    pub(super) fn new(
        figure: Option<f64>,
        unit: &'static str,
        limit: Option<f64>,
        reasons: Vec<Reason>,
    ) -> Self {
        // Where nothing speaks against it but that it cannot be told.
        let untold = !reasons.is_empty() && reasons.iter().all(Reason::is_untold);
        let applicable = (!untold).then_some(reasons.is_empty());
        Self { applicable, figure, unit, limit, reasons, quantiles_per_joint: Vec::new() }
    }
}

impl Uses {
    /// The verdict for one use.
    pub fn of(&self, wanted: Use) -> &UseVerdict {
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
    /// The verdict for those uses that are asked for.
    pub(super) fn new(uses: Uses, required: &[Use], notes: Vec<Note>) -> Self {
        let mut reasons: Vec<Reason> = Vec::new();
        for reason in required.iter().flat_map(|of| &uses.of(*of).reasons) {
            if !reasons.contains(reason) {
                reasons.push(reason.clone());
            }
        }
        // What others may follow from.
        reasons.sort_by_key(|reason| {
            !matches!(reason, Reason::OppositeCommand { .. } | Reason::Controller { .. })
        });
        let failure = reasons.iter().find_map(Reason::failure);
        Self { applicable: reasons.is_empty(), reasons, uses, notes, failure }
    }

    /// The same verdict with further reasons, against every use.
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
            let reasons = of.reasons.iter().chain(&more).cloned().collect();
            let UseVerdict { figure, unit, limit, .. } = *of;
            *of = UseVerdict::new(figure, unit, limit, reasons);
        }
        uses.contact_detection.reasons.extend(more);
        Self::new(uses, required, notes)
    }
}
