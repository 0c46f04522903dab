//! What comes of a window or a log, and whether it is right.

use didim_identification::identification::{Estimate, Identification};
use didim_sim::Scenario;

/// A result, or why there is none.
#[derive(Clone, Debug)]
pub(super) enum Outcome {
    Result(Box<Estimate>),
    None { cause: String, words: String },
}

impl Outcome {
    pub(super) fn from_identification(identification: Identification) -> Self {
        Self::Result(Box::new(identification.estimate))
    }

    pub(super) fn none(cause: &str, words: String) -> Self {
        Self::None { cause: cause.to_owned(), words }
    }

    /// `yes` or `no`, as the verdict says, or the cause.
    pub(super) fn class(&self) -> &str {
        match self {
            Self::Result(estimate) if estimate.verdict.applicable => "yes",
            Self::Result(_) => "no",
            Self::None { cause, .. } => cause,
        }
    }

    /// Returns the messages of all findings, or the reason why there is no result.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Result(estimate) => {
                let messages = estimate.verdict.findings().into_iter().map(|of| of.message);
                messages.collect::<Vec<_>>().join("\n")
            }
            Self::None { words, .. } => words.clone(),
        }
    }

    /// True if the figures for prediction agree within 2 %, as those of the same motion with other
    /// ends do. A limit between the two separates them.
    pub(super) fn has_figure_of(&self, other: &Self) -> bool {
        let figure = |outcome: &Self| match outcome {
            Self::Result(estimate) => estimate.verdict.uses.prediction.figure,
            Self::None { .. } => None,
        };
        let pair = figure(self).zip(figure(other));
        pair.is_some_and(|(one, other)| (one - other).abs() <= 0.02 * other)
    }

    /// What the verdict for physical values says.
    pub(super) fn physical_values(&self) -> Option<bool> {
        match self {
            Self::Result(estimate) => estimate.verdict.uses.physical_values.applicable,
            Self::None { .. } => None,
        }
    }

    /// Whether its parameters are called good: for prediction or for their own sake. That of
    /// monitoring compares windows that lack the same.
    pub(super) fn is_called_good(&self) -> bool {
        match self {
            Self::Result(estimate) => {
                let uses = &estimate.verdict.uses;
                [&uses.prediction, &uses.physical_values]
                    .map(|of| of.applicable)
                    .contains(&Some(true))
            }
            Self::None { .. } => false,
        }
    }

    /// The parameter that is furthest from the truth, and how many combined uncertainties.
    pub(super) fn farthest(&self, scenario: &Scenario) -> (String, f64) {
        let Self::Result(estimate) = self else { return (String::new(), 0.0) };
        let off = estimate.parameters.iter().map(|parameter| {
            let error = parameter.value - scenario.truth_of(&parameter.name).unwrap();
            (parameter.name.clone(), (error / parameter.combined_standard_deviation).abs())
        });
        off.max_by(|one, other| one.1.total_cmp(&other.1)).unwrap()
    }
}
