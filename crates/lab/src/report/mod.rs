//! Output of a comparison as tables and figures: aligned text for the terminal, Markdown for
//! documents, and HTML for the report.

mod agreement;
mod conclusion;
mod estimates;
mod figure;
mod figures;
mod held_out;
pub mod html;
mod table;
mod text;
mod view;

use crate::comparison::{Framework, LimitOutcome, MethodResult};

pub use figure::autocorrelation_figure;
use table::number_text;
pub use table::{Cell, Table};
pub use text::{markdown, terminal};
pub use view::{Judgement, View};

impl View<'_> {
    /// Returns all tables, in order.
    pub fn tables(&self) -> Vec<Table> {
        let frameworks = [Framework::Strict, Framework::Decimated];
        let of_frameworks = frameworks
            .into_iter()
            .filter(|framework| self.comparison.results(*framework).any(|of| of.estimate.is_some()))
            .flat_map(|framework| {
                [estimates::table(self, framework), figures::table(self, framework)]
            });
        let others = [
            agreement::matrix(self),
            agreement::outside(self),
            agreement::outside_of_truth(self),
            held_out::table(self),
            self.limits(),
        ];
        of_frameworks.chain(others.into_iter().flatten()).collect()
    }

    /// Returns the verdict of every method.
    pub fn judgements(&self) -> Vec<Judgement> {
        self.comparison
            .methods
            .iter()
            .map(|of: &MethodResult| {
                let (verdict, reasons) = match &of.estimate {
                    Some(estimate) if estimate.verdict.applicable => ("applicable", &[][..]),
                    Some(estimate) => ("not applicable", &estimate.verdict.reasons[..]),
                    None => ("failed", &[][..]),
                };
                let reason = reasons.first().map(ToString::to_string).or(of.failure.clone());
                let more = reasons.len().saturating_sub(1);
                Judgement { trial: of.trial, verdict, reason, further_reasons: more }
            })
            .collect()
    }

    fn limits(&self) -> Option<Table> {
        let bound = |value: Option<f64>| value.map_or_else(Cell::missing, |v| v.to_string().into());
        (!self.outcomes.is_empty()).then(|| Table {
            title: "Limits".to_owned(),
            note: "Required figures; those that violate their limits are marked.".to_owned(),
            header: ["", "found", "at least", "at most"].map(str::to_owned).to_vec(),
            rows: self
                .outcomes
                .iter()
                .map(|outcome: &LimitOutcome<'_>| {
                    let figure =
                        outcome.found.map_or("–".to_owned(), |found| number_text(found, 4));
                    vec![
                        outcome.limit.to_string().into(),
                        Cell { text: figure, is_marked: !outcome.is_met() },
                        bound(outcome.limit.at_least),
                        bound(outcome.limit.at_most),
                    ]
                })
                .collect(),
        })
    }
}
