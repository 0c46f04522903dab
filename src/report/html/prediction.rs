//! The report of a prediction: how far a stored result is from a record that it was not identified from.

use std::fmt::Write as _;

use didim_core::identification::Prediction;
use didim_formats::RecordingStart;
use maud::{Markup, html};

use super::super::panels;
use super::joints::torque_panels;
use super::{InputFile, document, number, percent, section};
use crate::cell::Cell;

/// What a report of a prediction is made from.
#[derive(Clone, Copy, Debug)]
pub struct PredictionReport<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// The file of the result.
    pub result: &'a InputFile,
    /// The file of the record.
    pub input: &'a InputFile,
    /// When that was recorded, where it is known.
    pub recorded: Option<RecordingStart>,
    /// What came of it.
    pub prediction: &'a Prediction,
    /// What must be known with it.
    pub notes: &'a [String],
}

impl PredictionReport<'_> {
    /// The report as HTML.
    pub fn to_html(&self) -> String {
        let robot = self.cell.robot.name();
        let mut whole =
            format!("Error {} of the torque", percent(self.prediction.error.relative_error, 3));
        if let Some(foretold) = &self.prediction.foretold {
            // Writing to a String cannot fail.
            let _ = write!(whole, ", foretold {}", percent(foretold.relative_error, 3));
        }
        let content = html! {
            header {
                p.kind { "Prediction by a stored result" }
                h1 { (robot) }
                p { (whole) }
                @for note in self.notes { p { "Note: " (note) } }
            }
            main {
                (section("Torque, measured and predicted", "Both sides behind the filters of the \
                    cell. Nothing was fitted.", &self.joints()))
                (section("Provenance", "", &html! { dl.provenance {
                    @for (name, file) in [("Result", self.result), ("Record", self.input)] {
                        div { dt { (name) } dd { (file.name) br; code { (file.sha256) } } }
                    }
                    div { dt { "Recorded" } dd { (RecordingStart::shown(self.recorded)) } }
                } }))
            }
        };
        document(&format!("{robot} · prediction"), "", &content)
    }

    fn joints(&self) -> Markup {
        let Prediction { error, quantiles_per_joint, foretold, .. } = self.prediction;
        let foretold = foretold.as_ref().map(|foretold| &foretold.relative_error_per_joint);
        let foretold = |joint: usize| foretold.and_then(|of| of.get(joint)).copied();
        let errors = error.relative_error_per_joint.iter().zip(&error.rms_error_per_joint_nm);
        let joints = errors.zip(quantiles_per_joint).zip(self.cell.robot.chain()).enumerate();
        html! {
            (torque_panels(&panels(self.prediction, &self.cell.robot)))
            div.scroll { table {
                thead { tr {
                    th scope="col" { "Joint" }
                    th.number scope="col" { "Error" }
                    th.number scope="col" { "Foretold" }
                    th.number scope="col" { "RMS error" }
                    th.number scope="col" { "99 % below" }
                    th.number scope="col" { "99.9 % below" }
                    th.number scope="col" { "99.99 % below" }
                } }
                tbody { @for (k, (((relative, rms), quantiles), described)) in joints { tr {
                    th scope="row" { (k + 1) }
                    td.number { (percent(*relative, 3)) }
                    td.number { (foretold(k).map_or("–".to_owned(), |share| percent(share, 3))) }
                    @for nm in [*rms, quantiles.of_99, quantiles.of_999, quantiles.of_9999] {
                        td.number { (number(nm, 3)) " " (described.kind.torque_unit()) }
                    }
                } } }
            } }
        }
    }
}
