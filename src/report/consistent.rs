//! A consistent model as text.

use didim_identification::feasibility::{Outcome, ValueSource};

use crate::text::significant_digits;

/// Formats the cost of the consistent parameters, the sources of their values, and notes for the
/// user.
pub fn consistent_summary(outcome: &Outcome) -> String {
    let Outcome { judgement, cost, least_cost, threshold, prior, .. } = outcome;
    let mut text = format!(
        "{judgement}: cost {} of the nearest ones (correct results stay below {}, 99 %), cost \
            {} of those written, near the prior\nparameters without enough data come from \
            {prior}: ",
        significant_digits(*least_cost, 3),
        significant_digits(*threshold, 3),
        significant_digits(*cost, 3)
    );
    let count = |class| outcome.parameters.iter().filter(|of| of.class == class).count();
    text += &format!(
        "{} parameters come from the data, {} only as sums, {} from the prior\n",
        count(ValueSource::Data),
        count(ValueSource::Combination),
        count(ValueSource::Prior)
    );
    if let Some(largest) = outcome.largest_shift() {
        text += &format!(
            "largest change of a base parameter: {}, {} σ\n",
            largest.name,
            significant_digits(largest.deviations, 2)
        );
    }
    if let Some(far) = outcome.far_body() {
        text += &format!("note: {far}\n");
    }
    text
}
