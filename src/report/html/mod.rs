//! A report: one HTML file that stands by itself, for whoever has to judge a result.
//!
//! It needs no network, no script and no font of its own, follows the reader's light or dark
//! setting, prints, and reads on a phone. It holds no run time and no date of its making: the same input gives the
//! same bytes. What comes from files is escaped by the builder, without exception.

mod chart;
mod comparison;
mod foretold;
mod freedoms;
mod friction;
mod history;
mod information;
mod joints;
mod motion;
mod names;
mod parameters;
mod prediction;
mod preview;
mod provenance;
mod summary;

use didim_core::identification::{Identification, Method};
use maud::{DOCTYPE, Markup, PreEscaped, html};

pub use comparison::{ComparisonReport, SimulatedInput};
pub use history::HistoryReport;
pub use prediction::PredictionReport;
pub use preview::preview;
pub use provenance::{InputFile, Origin, SampleRange};

use super::panel::CURVES;
use crate::cell::Cell;
use crate::offline::Foretold;
use crate::text::significant;

const STYLE: &str = include_str!("style.css");

/// What a report is made from.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The cell that it was identified with.
    pub cell: &'a Cell,
    /// The result.
    pub identification: &'a Identification,
    /// Where its samples come from.
    pub origin: &'a Origin,
    /// What its motion was foretold to tell; empty where no design was named.
    pub foretold: &'a [Foretold],
    /// What the result lacks and which motions bring it, in words ([`lacking_text`](super::lacking_text)); empty where that was not asked.
    pub advice: &'a str,
}

impl<'a> Report<'a> {
    /// Of a result alone: nothing was foretold of its motion, and no advice asked for.
    pub fn new(cell: &'a Cell, identification: &'a Identification, origin: &'a Origin) -> Self {
        Self { cell, identification, origin, foretold: &[], advice: "" }
    }

    /// The report as HTML.
    pub fn to_html(&self) -> String {
        let estimate = &self.identification.estimate;
        let title = format!("{} · {} · dynamic parameters", estimate.robot, estimate.method);
        let sections = html! {
                (parameters::section(self))
                (joints::torques(self))
                (motion::section(self))
                (joints::residuals(self))
                (joints::delays(estimate))
                (information::section(self))
                (foretold::section(self.foretold))
                (advice(self.advice))
                (friction::section(self))
                (freedoms::section(self))
                (summary::convergence(&estimate.convergence))
                (summary::singular_values(self))
                (names::section(self))
                (provenance::section(self))
        };
        let content = html! {
            (summary::heading(self))
            main {
                (summary::verdict(self))
                (contents(&sections))
                (summary::key_figures(self))
                (sections)
            }
        };
        document(&title, "", &content)
    }

    /// What the rows are, in words: DIDIM may do without decimation.
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

/// A whole file; `own_style` comes after the style of all.
fn document(title: &str, own_style: &str, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(CURVES)) (PreEscaped(own_style)) }
            }
            body { (content) }
        }
    };
    page.into_string() + "\n"
}

/// A section under a heading, with a sentence on how to read it.
fn section(heading: &str, explanation: &str, content: &Markup) -> Markup {
    html! {
        section id=(anchor(heading)) {
            h2 { (heading) }
            @if !explanation.is_empty() { p.explanation { (explanation) } }
            (content)
        }
    }
}

/// What a result lacks.
fn advice(text: &str) -> Markup {
    if text.is_empty() {
        return html! {};
    }
    let explanation =
        "As didim advise says it, for motions within half of the largest speeds and accelerations.";
    section(
        "What is lacking, and motions that bring it",
        explanation,
        &html! { pre.words { (text) } },
    )
}

/// The name of a section in its page: `torque-measured-and-predicted`.
fn anchor(heading: &str) -> String {
    let words = heading.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("-").to_lowercase()
}

/// A list of the sections, read from themselves, so that it has those that there are. What comes from
/// files cannot be taken for one: it is escaped.
fn contents(sections: &Markup) -> Markup {
    let headings = sections.0.split("<section id=\"").skip(1).filter_map(|section| {
        let (id, rest) = section.split_once('"')?;
        let heading = rest.split_once("<h2>")?.1.split_once("</h2>")?.0;
        Some((id, heading))
    });
    html! {
        nav.contents aria-label="Contents" { ul {
            @for (id, heading) in headings { li { a href=("#".to_owned() + id) { (PreEscaped(heading)) } } }
        } }
    }
}

/// A number with so many significant digits and a real minus sign; a dash for what is no number.
fn number(value: f64, digits: usize) -> String {
    if value.is_finite() { signed(&significant(value, digits)) } else { "–".to_owned() }
}

/// A share as a percentage.
fn percent(share: f64, digits: usize) -> String {
    if share.is_finite() {
        format!("{} %", number(100.0 * share, digits))
    } else {
        "–".to_owned()
    }
}

/// A probability; below one in ten thousand its size means nothing more.
fn probability(p: f64) -> String {
    if p < 1e-4 { "< 0.0001".to_owned() } else { number(p, 2) }
}

/// With real minus signs, and powers of ten in place of exponents.
fn signed(text: &str) -> String {
    let text = text.replace('-', "−");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let raised = |c: char| match c {
        '−' => '⁻',
        digit => digit.to_digit(10).map_or(digit, |k| SUPERSCRIPTS[k as usize]),
    };
    format!("{mantissa}·10{}", exponent.chars().map(raised).collect::<String>())
}

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

#[cfg(test)]
mod tests;
