//! The verdict for each use, in words.

use didim_core::feasibility::Judgement;
use didim_core::identification::{Bodies, Estimate, Use};

use crate::text::significant;

/// One line of the table of uses.
pub(super) struct UseLine {
    pub(super) of: Use,
    /// `yes`, `no`, `cannot be told`, or `–` where the use has figures and no verdict.
    pub(super) answer: &'static str,
    pub(super) figure: String,
    pub(super) limit: String,
    /// What the figure is.
    pub(super) meaning: &'static str,
}

/// Every use of a result, and beside the last what bodies cost, where that is known.
pub(super) fn lines(estimate: &Estimate) -> impl Iterator<Item = UseLine> {
    let uses = Use::ALL.into_iter().map(|of| {
        let found = estimate.verdict.uses.of(of);
        let answer = match found.applicable {
            Some(true) => "yes",
            Some(false) => "no",
            None if found.reasons.is_empty() => "–",
            None => "cannot be told",
        };
        let shown = |value: Option<f64>| match value {
            None => "–".to_owned(),
            Some(value) if found.unit == "1" => format!("{} %", significant(100.0 * value, 3)),
            Some(value) if of == Use::RigidBody => format!("{} σ", significant(value, 2)),
            Some(value) => format!("{} {}", significant(value, 3), found.unit),
        };
        let meaning = match of {
            Use::Monitoring => "statistical uncertainty of a joint's torque along the motion",
            Use::Prediction => "uncertainty of the torque where the arm has not been",
            Use::ContactDetection => {
                "99.9 % of the residuals of a joint that were held out are below"
            }
            Use::PhysicalValues => "combined uncertainty of a parameter that carries torque",
            Use::RigidBody => "how far the mass matrix is from positive definite",
        };
        UseLine { of, answer, figure: shown(found.figure), limit: shown(found.limit), meaning }
    });
    uses.chain(estimate.bodies.as_ref().map(of_bodies))
}

fn of_bodies(bodies: &Bodies) -> UseLine {
    UseLine {
        of: Use::RigidBody,
        answer: if bodies.judgement == Judgement::Infeasible { "no" } else { "yes" },
        figure: format!("{} σ²", significant(bodies.cost, 2)),
        limit: format!("{} σ²", significant(bodies.cost_limit, 2)),
        meaning: "squared distance from parameters that bodies have",
    }
}
