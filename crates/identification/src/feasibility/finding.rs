//! Findings that a user has to know before using an outcome. Their texts are defined only here.

use core::fmt::{self, Display};

use super::judgement::{Judgement, Shift};
use super::outcome::Outcome;
use super::prior::PriorSource;

/// Finding that no bodies explain the estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct PhysicallyImpossible {
    /// Smallest cost of any bodies.
    pub cost: f64,
    /// Limit below which the cost of the true bodies stays, with 99 % probability.
    pub threshold: f64,
    /// Friction and drive inertias that are below 0 or, if there are none, the base parameter with
    /// the largest shift.
    pub impossible_values: Vec<Shift>,
    /// True if `impossible_values` are friction and drive inertias below 0.
    pub are_negative: bool,
}

/// Finding that the bodies that explain the estimate contradict the prior, with the body that does
/// so most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarBody {
    /// Number of the link, from 1.
    pub link: usize,
    /// Its distance from the prior \[nats\].
    pub distance_nats: f64,
    /// Source of the prior.
    pub prior: PriorSource,
}

impl Outcome {
    /// Returns the finding if no bodies explain the estimate.
    pub fn no_bodies(&self) -> Option<PhysicallyImpossible> {
        (self.judgement == Judgement::Infeasible).then(|| {
            let negative = !self.negative_parameters.is_empty();
            let farthest = || self.largest_shift().into_iter().cloned().collect();
            PhysicallyImpossible {
                cost: self.least_cost,
                threshold: self.threshold,
                impossible_values: if negative {
                    self.negative_parameters.clone()
                } else {
                    farthest()
                },
                are_negative: negative,
            }
        })
    }

    /// Returns the body that is farthest from the prior, if the bodies contradict the prior.
    pub fn far_body(&self) -> Option<FarBody> {
        let links = (1..).zip(self.divergence_per_link.iter().copied());
        let farthest = links.max_by(|a, b| a.1.total_cmp(&b.1));
        farthest
            .filter(|_| self.judgement == Judgement::ContradictsPrior)
            .map(|(link, nats)| FarBody { link, distance_nats: nats, prior: self.prior })
    }
}

impl Display for PhysicallyImpossible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cost, threshold, impossible_values: most, are_negative: negative } = self;
        let each = most.iter().map(|of| format!("{} by {:.1} σ", of.name, of.deviations.abs()));
        write!(
            f,
            "no physically consistent parameters explain the result: the smallest cost is \
                {cost:.0}, correct results stay below {threshold:.0} (χ², 99 %); {} {}; check \
                the signs of torques and positions, and the torque delay, before you use its \
                parameters",
            if *negative { "below 0 are" } else { "the largest changes are" },
            each.collect::<Vec<_>>().join(", ")
        )
    }
}

impl Display for FarBody {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { link, distance_nats: nats, prior } = self;
        write!(
            f,
            "the inertial parameters of link {link} are far from {prior} ({nats:.1} nats); \
                check for a spring or counterbalance that the robot file lacks, the signs of \
                gravity and of the axis, and that value"
        )
    }
}
