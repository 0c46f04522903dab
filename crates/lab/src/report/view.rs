//! View of a comparison and its columns.

use didim_identification::identification::{Estimate, Method};

use crate::comparison::{
    Comparison, Framework, LimitOutcome, MethodResult, Published, PublishedFigures, Trial, title,
};

/// View of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The comparison.
    pub comparison: &'a Comparison,
    /// Published figures for comparison.
    pub published: Option<&'a Published>,
    /// The outcomes of the limits.
    pub outcomes: &'a [LimitOutcome<'a>],
    /// True if durations are shown. They differ from run to run.
    pub shows_times: bool,
}

/// The verdict of a method on its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// The method.
    pub trial: Trial,
    /// `applicable`, `not applicable` or `failed`.
    pub verdict: &'static str,
    /// The first reason against the result.
    pub reason: Option<String>,
    /// Number of further reasons.
    pub further_reasons: usize,
}

impl View<'_> {
    /// Returns the columns of a framework's tables: the reference, then its methods, each with its
    /// published figures. A method without a result has no column.
    pub(super) fn columns(&self, framework: Framework) -> Vec<Column<'_>> {
        let reference = self.comparison.methods.iter().filter(|of| of.trial == Trial::REFERENCE);
        let others = self.comparison.results(framework).filter(|of| of.trial != Trial::REFERENCE);
        reference
            .chain(others)
            .filter_map(|of| {
                let published = self.published.and_then(|published| published.figures(of.trial));
                let name = title(of.trial.method);
                Some(Column { name, estimate: of.estimate.as_ref()?, result: of, published })
            })
            .collect()
    }

    /// Returns the header of these columns.
    pub(super) fn header(columns: &[Column<'_>]) -> Vec<String> {
        columns
            .iter()
            .flat_map(|column: &Column<'_>| {
                let published = column.published.map(|_| "published".to_owned());
                [Some(column.name.clone()), published].into_iter().flatten()
            })
            .collect()
    }
}

/// Column of a method in a table.
pub(super) struct Column<'a> {
    pub(super) name: String,
    pub(super) estimate: &'a Estimate,
    pub(super) result: &'a MethodResult,
    pub(super) published: Option<&'a PublishedFigures>,
}

impl Column<'_> {
    pub(super) fn is_reference(&self) -> bool {
        self.result.trial.method == Method::IdimLs
    }
}

/// Returns the name of a framework in tables.
pub(super) fn framework_name(framework: Framework) -> &'static str {
    match framework {
        Framework::Strict => "strict output error framework",
        Framework::Decimated => "decimation filter",
    }
}
