//! The report of a comparison: verdicts, estimates with their intervals, tables, residuals.

mod chart;
mod estimates;
mod residuals;
mod tables;
mod verdicts;

use didim_identification::identification::Method;
use maud::{Markup, html};

use crate::report::View;
use didim::cell::Cell;
use didim::report::html::page::{document, section};
use didim::report::html::{Origin, provenance_entries};

const OWN_STYLE: &str = include_str!("style.css");

/// Input of a comparison report.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonReport<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// The displayed data.
    pub view: View<'a>,
    /// Origin of the samples.
    pub origin: &'a Origin,
    /// The simulated experiment, if there is one.
    pub scenario: Option<SimulatedInput<'a>>,
}

/// Simulated experiment of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedInput<'a> {
    /// Name of the scenario.
    pub name: &'a str,
    /// Seed of its noise; `None` without noise.
    pub noise_seed: Option<u64>,
}

impl ComparisonReport<'_> {
    /// Returns the report as HTML.
    pub fn to_html(&self) -> String {
        let robot = &self.view.comparison.robot;
        let content = html! {
            header {
                p.kind { "Comparison of identification methods" }
                h1 { (robot) }
                p { "Cell " strong { (self.cell.name) } (self.data()) }
            }
            main {
                (verdicts::section(&self.view))
                (estimates::section(self))
                (tables::section(&self.view))
                (tables::singular_values(&self.view))
                (residuals::section(&self.view))
                (residuals::convergence(&self.view))
                (self.provenance())
            }
        };
        let title = format!("{robot} · comparison of identification methods");
        document(&title, OWN_STYLE, &content)
    }

    fn data(&self) -> Markup {
        html! {
            @if let Some(scenario) = self.scenario {
                ", simulated arm of the scenario " strong { (scenario.name) }
            } @else if let Some(input) = &self.origin.input {
                ", measurement " strong { (input.name) }
            }
        }
    }

    fn provenance(&self) -> Markup {
        let content = html! {
            dl.provenance {
                @if let Some(scenario) = self.scenario {
                    div { dt { "Scenario" } dd { (scenario.name) } }
                    @if let Some(seed) = scenario.noise_seed {
                        div { dt { "Seed of its noise" } dd { (seed) } }
                    }
                }
                (provenance_entries(self.cell, self.origin))
                @if let Some(published) = self.view.published {
                    div { dt { "Published figures" } dd { (published.source) } }
                }
            }
        };
        let explanation = "The same input, configuration and program give this report again, byte \
                           for byte. The configuration is the cell, robot and DBC file.";
        section("Provenance", explanation, &content)
    }
}

/// Returns the CSS class of a method.
fn css_class(method: Method) -> String {
    format!("m-{method}")
}

#[cfg(test)]
#[path = "../../../../../src/report/html/specimen.rs"]
mod specimen;
#[cfg(test)]
mod tests;
