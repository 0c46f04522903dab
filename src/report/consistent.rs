//! A consistent model in words.

use didim_core::feasibility::{Class, Judgement, Outcome};

use crate::text::significant;

/// What consistent parameters cost, what decides them, and what a person has to know of them.
pub fn consistent_summary(outcome: &Outcome) -> String {
    let Outcome { judgement, cost, threshold, prior, .. } = outcome;
    let mut text = format!(
        "{judgement}: cost {} (true ones stay below {}, 99 %)\nwhere the data do not decide, {prior} do: ",
        significant(*cost, 3),
        significant(*threshold, 3)
    );
    let count = |class| outcome.parameters.iter().filter(|of| of.class == class).count();
    text += &format!(
        "{} parameters are the data's, {} are known in sums alone, {} are the prior's\n",
        count(Class::Data),
        count(Class::Combination),
        count(Class::Prior)
    );
    if let Some(largest) = outcome.largest_shift() {
        text += &format!(
            "largest change of a base parameter: {}, {} σ\n",
            largest.name,
            significant(largest.deviations, 2)
        );
    }
    if *judgement == Judgement::ContradictsPrior {
        let far = outcome.divergence_per_link.iter().enumerate();
        if let Some((link, nats)) = far.max_by(|a, b| a.1.total_cmp(b.1)) {
            text += &format!(
                "note: link {} is farthest from the prior ({} nats); look for a spring or counterbalance that the robot's file does not state, at the signs of gravity and of its axis, or at the prior\n",
                link + 1,
                significant(*nats, 2)
            );
        }
    }
    text
}
