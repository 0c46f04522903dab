//! A comparison as tables: aligned in the terminal, Markdown for documents, and HTML in the report.

mod agreement;
mod estimates;
mod figure;
mod figures;
mod held_out;
mod text;

use didim_core::identification::Method;

use crate::compare::{Comparison, Framework, Outcome, Published, Trial, title};

pub use figure::autocorrelation_figure;
pub use text::{markdown, terminal};

/// What is shown of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The comparison.
    pub comparison: &'a Comparison,
    /// Figures of others to stand beside.
    pub published: Option<&'a Published>,
    /// What was asked of it.
    pub outcomes: &'a [Outcome<'a>],
    /// Whether run times are shown, which differ from run to run.
    pub times: bool,
}

/// A table before it is text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Its heading.
    pub title: String,
    /// How to read it.
    pub note: String,
    /// One for each column.
    pub header: Vec<String>,
    /// The rows; the first cell of each is its name.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// What it says.
    pub text: String,
    /// Whether it is to be noticed.
    pub marked: bool,
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { text, marked: false }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::from(text.to_owned())
    }
}

impl Cell {
    /// What is not there.
    fn none() -> Self {
        Self::from("–")
    }
}

/// What a method says of its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// The method.
    pub trial: Trial,
    /// `applicable`, `not applicable` or `failed`.
    pub verdict: &'static str,
    /// The first reason against it.
    pub reason: Option<String>,
    /// How many more there are.
    pub more: usize,
}

impl View<'_> {
    /// Every table, in order.
    pub fn tables(&self) -> Vec<Table> {
        let frameworks = [Framework::Strict, Framework::Decimated];
        let of_frameworks = frameworks
            .into_iter()
            .filter(|framework| self.comparison.of(*framework).any(|of| of.estimate.is_some()))
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

    /// The verdict of every method.
    pub fn judgements(&self) -> Vec<Judgement> {
        let judgement = |of: &crate::compare::MethodResult| {
            let (verdict, reasons) = match &of.estimate {
                Some(estimate) if estimate.verdict.applicable => ("applicable", &[][..]),
                Some(estimate) => ("not applicable", &estimate.verdict.reasons[..]),
                None => ("failed", &[][..]),
            };
            let reason = reasons.first().map(ToString::to_string).or(of.failure.clone());
            let more = reasons.len().saturating_sub(1);
            Judgement { trial: of.trial, verdict, reason, more }
        };
        self.comparison.methods.iter().map(judgement).collect()
    }

    fn limits(&self) -> Option<Table> {
        let bound = |value: Option<f64>| value.map_or_else(Cell::none, |v| v.to_string().into());
        let row = |outcome: &Outcome<'_>| {
            let found = outcome.found.map_or("–".to_owned(), |found| number(found, 4));
            vec![
                outcome.limit.to_string().into(),
                Cell { text: found, marked: !outcome.holds() },
                bound(outcome.limit.at_least),
                bound(outcome.limit.at_most),
            ]
        };
        (!self.outcomes.is_empty()).then(|| Table {
            title: "Limits".to_owned(),
            note: "What must come out; what does not is marked.".to_owned(),
            header: ["", "found", "at least", "at most"].map(str::to_owned).to_vec(),
            rows: self.outcomes.iter().map(row).collect(),
        })
    }

    /// The columns of a framework's tables: its methods, after the reference, each with what was
    /// published of it. A method without a result has no column.
    fn columns(&self, framework: Framework) -> Vec<Column<'_>> {
        let reference = self.comparison.methods.iter().filter(|of| of.trial == Trial::REFERENCE);
        let others = self.comparison.of(framework).filter(|of| of.trial != Trial::REFERENCE);
        reference
            .chain(others)
            .filter_map(|of| {
                let published = self.published.and_then(|published| published.of(of.trial));
                let name = title(of.trial.method);
                Some(Column { name, estimate: of.estimate.as_ref()?, result: of, published })
            })
            .collect()
    }

    /// The header of those columns.
    fn header(columns: &[Column<'_>]) -> Vec<String> {
        let names = |column: &Column<'_>| {
            let published = column.published.map(|_| "published".to_owned());
            [Some(column.name.clone()), published].into_iter().flatten()
        };
        columns.iter().flat_map(names).collect()
    }
}

/// A method's column of a table.
struct Column<'a> {
    name: String,
    estimate: &'a didim_core::identification::Estimate,
    result: &'a crate::compare::MethodResult,
    published: Option<&'a crate::compare::PublishedFigures>,
}

impl Column<'_> {
    fn is_reference(&self) -> bool {
        self.result.trial.method == Method::IdimLs
    }
}

/// A framework in words.
fn framework_name(framework: Framework) -> &'static str {
    match framework {
        Framework::Strict => "strict output error framework",
        Framework::Decimated => "decimation filter",
    }
}

/// A number with so many significant digits; a dash for what is none.
fn number(value: f64, digits: usize) -> String {
    if value.is_finite() { super::table::significant(value, digits) } else { "–".to_owned() }
}

fn percent(share: f64, digits: usize) -> String {
    if share.is_finite() {
        format!("{} %", number(100.0 * share, digits))
    } else {
        "–".to_owned()
    }
}
