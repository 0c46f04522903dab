//! The verdict for each use, as text.

use didim_identification::feasibility::Judgement;
use didim_identification::identification::{Estimate, PhysicalConsistency, Use};

use crate::text::significant_digits;

/// One line of the table of uses.
pub(super) struct UseLine {
    pub(super) usage: Use,
    /// `yes`, `no`, `undecided`, or `–` if the use has figures and no verdict.
    pub(super) answer: &'static str,
    pub(super) figure: String,
    pub(super) limit: String,
    /// Meaning of the figure.
    pub(super) meaning: &'static str,
}

/// Lists every use of a result. A line with the cost of the physically consistent parameters
/// follows, if it is known.
pub(super) fn lines(estimate: &Estimate) -> impl Iterator<Item = UseLine> {
    let uses = Use::ALL.into_iter().map(|of| {
        let verdict = estimate.verdict.uses.get(of);
        let answer = match verdict.applicable {
            Some(true) => "yes",
            Some(false) => "no",
            None if verdict.reasons.is_empty() => "–",
            None => "undecided",
        };
        let shown = |value: Option<f64>| match value {
            None => "–".to_owned(),
            Some(value) if verdict.unit == "1" => {
                format!("{} %", significant_digits(100.0 * value, 3))
            }
            Some(value) if of == Use::RigidBody => format!("{} σ", significant_digits(value, 2)),
            Some(value) => format!("{} {}", significant_digits(value, 3), verdict.unit),
        };
        let meaning = match of {
            Use::Monitoring => "statistical uncertainty of a joint's torque along the motion",
            Use::Prediction => "torque uncertainty outside the recorded motion",
            Use::ContactDetection => "99.9 % of held-out residuals are smaller (worst joint)",
            Use::PhysicalValues => {
                "combined uncertainty of a parameter that contributes to the torque"
            }
            Use::RigidBody => "distance of the mass matrix from positive definite",
        };
        UseLine {
            usage: of,
            answer,
            figure: shown(verdict.figure),
            limit: shown(verdict.limit),
            meaning,
        }
    });
    uses.chain(estimate.link_bodies.as_ref().map(of_bodies))
}

fn of_bodies(link_bodies: &PhysicalConsistency) -> UseLine {
    UseLine {
        usage: Use::RigidBody,
        answer: if link_bodies.judgement == Judgement::Infeasible { "no" } else { "yes" },
        figure: format!("{} σ²", significant_digits(link_bodies.cost, 2)),
        limit: format!("{} σ²", significant_digits(link_bodies.cost_limit, 2)),
        meaning: "squared distance from physically consistent parameters",
    }
}
