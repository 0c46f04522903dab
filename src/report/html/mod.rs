//! A report of a result: one self-contained HTML file for the people who judge the result.
//!
//! The file needs no network, no script and no own font. It follows the reader's light or dark
//! setting, can be printed, and is readable on a phone. It contains neither the run time nor the
//! date of its creation, so that the same input gives the same bytes. The HTML builder escapes all
//! text from files, without exception.

mod advice;
mod baseline;
pub mod chart;
mod expectation;
mod friction;
mod history;
mod information;
mod joints;
mod motion;
mod names;
mod nuisance_parameters;
pub mod page;
mod parameters;
mod prediction;
mod preview;
mod provenance;
mod summary;

use didim_identification::identification::{Identification, Method};
use maud::{Markup, PreEscaped, html};

pub use baseline::baseline_section;
pub use history::HistoryReport;
pub use prediction::PredictionReport;
pub use preview::preview_page;
pub use provenance::{InputFile, Origin, SampleRange, entries as provenance_entries};

use super::MissingAdvice;
use crate::analysis::ExpectedParameter;
use crate::archive::drift::DriftStatus;
use crate::cell::Cell;
use page::{
    contents_list, document, number_text, percent_text, probability, section, with_real_minus,
};

/// Input of a report.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Cell of the identification.
    pub cell: &'a Cell,
    /// The result.
    pub identification: &'a Identification,
    /// Source of the samples.
    pub origin: &'a Origin,
    /// Predictions for the motion. Empty if no designed motion was named.
    pub expectation: &'a [ExpectedParameter],
    /// Insufficient parameters and the motions that improve them. `None` if this was not requested.
    pub advice: Option<&'a MissingAdvice>,
    /// Comparison of a stored result with the baseline.
    pub drift: Option<&'a DriftStatus>,
}

impl<'a> Report<'a> {
    /// Creates a report of a result alone, without predictions and without advice.
    pub fn new(cell: &'a Cell, identification: &'a Identification, origin: &'a Origin) -> Self {
        Self { cell, identification, origin, expectation: &[], advice: None, drift: None }
    }

    /// Returns the report as HTML.
    pub fn to_html(&self) -> String {
        let estimate = &self.identification.estimate;
        let title = format!("{} · {} · dynamic parameters", estimate.robot, estimate.method);
        let sections = html! {
                (parameters::section(self))
                (joints::torque_section(self))
                (motion::section(self))
                (joints::residuals(self))
                (joints::delay_section(estimate, &self.cell.robot))
                (information::section(self))
                (expectation::section(self.expectation))
                (self.advice.map_or_else(Markup::default, advice::section))
                (friction::section(self))
                (nuisance_parameters::section(self))
                (summary::convergence_section(&estimate.convergence))
                (summary::singular_values(self))
                (names::section(self))
                (provenance::section(self))
        };
        let content = html! {
            (summary::heading(self))
            main {
                (summary::verdict_section(self))
                (contents_list(&sections))
                @if let Some(drift) = self.drift { (PreEscaped(baseline_section(drift))) }
                (summary::key_figures(self))
                (sections)
            }
        };
        document(&title, "", &content)
    }

    /// Returns the kind of the rows as text, because DIDIM may work without decimation.
    fn matrix(&self) -> &'static str {
        let estimate = &self.identification.estimate;
        let didim = estimate.method == Method::Didim.name();
        if didim && !self.cell.options.simulation.decimated {
            "observation matrix"
        } else {
            "decimated observation matrix"
        }
    }
}

#[cfg(test)]
mod specimen;
#[cfg(test)]
mod tests;
