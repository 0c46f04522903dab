//! The report of a prediction: the error of a stored result on a record that it was not identified
//! from.

use didim_dynamics::robot::JointIndex;
use std::fmt::Write as _;

use didim_formats::RecordingStart;
use didim_identification::identification::Prediction;
use maud::{Markup, html};

use super::super::{date_text, joint_panels};
use super::joints::torque_panels;
use super::{InputFile, document, number_text, percent_text, section};
use crate::cell::Cell;

/// Input of a prediction report.
#[derive(Clone, Copy, Debug)]
pub struct PredictionReport<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// File of the result.
    pub result: &'a InputFile,
    /// File of the record.
    pub input: &'a InputFile,
    /// Start time of the record, if known.
    pub recorded: Option<RecordingStart>,
    /// The prediction.
    pub prediction: &'a Prediction,
    /// Notes on the prediction.
    pub notes: &'a [String],
}

impl PredictionReport<'_> {
    /// Returns the report as HTML.
    pub fn to_html(&self) -> String {
        let robot = self.cell.robot.name();
        let mut sentence = format!(
            "Error {} of the torque",
            percent_text(self.prediction.error.relative_error, 3)
        );
        if let Some(expected) = &self.prediction.expected_error {
            // Writing to a String cannot fail.
            let _ = write!(sentence, ", expected {}", percent_text(expected.relative_error, 3));
        }
        let content = html! {
            header {
                p.kind { "Prediction by a stored result" }
                h1 { (robot) }
                p { (sentence) }
                @for note in self.notes { p { "Note: " (note) } }
            }
            main {
                (section("Torque, measured and predicted", "Both sides are filtered with the \
                    filters of the cell. Nothing was fitted.", &self.joints()))
                (section("Provenance", "", &html! { dl.provenance {
                    @for (name, file) in [("Result", self.result), ("Record", self.input)] {
                        div { dt { (name) } dd { (file.name) br; code { (file.sha256) } } }
                    }
                    div { dt { "Recorded" } dd { (date_text(self.recorded, self.input.written)) } }
                } }))
            }
        };
        document(&format!("{robot} · prediction"), "", &content)
    }

    fn joints(&self) -> Markup {
        let Prediction { error, quantiles_per_joint, expected_error, .. } = self.prediction;
        let expected = expected_error.as_ref().map(|error| &error.relative_error_per_joint);
        let expected_of = |joint: usize| expected.and_then(|of| of.get(joint)).copied();
        let errors = error.relative_error_per_joint.iter().zip(&error.rms_error_per_joint_nm);
        let joints = errors.zip(quantiles_per_joint).zip(self.cell.robot.chain()).enumerate();
        html! {
            (torque_panels(&joint_panels(self.prediction, &self.cell.robot)))
            div.scroll { table {
                thead { tr {
                    th scope="col" { "Joint" }
                    th.number scope="col" { "Error" }
                    th.number scope="col" { "Expected" }
                    th.number scope="col" { "RMS error" }
                    th.number scope="col" { "99 % below" }
                    th.number scope="col" { "99.9 % below" }
                    th.number scope="col" { "99.99 % below" }
                } }
                tbody { @for (k, (((relative, rms), quantiles), described)) in joints { tr {
                    th scope="row" { (self.cell.robot.joint_label(JointIndex::new(k))) }
                    td.number { (percent_text(*relative, 3)) }
                    td.number {
                        (expected_of(k).map_or("–".to_owned(), |share| percent_text(share, 3)))
                    }
                    @for nm in [*rms, quantiles.of_99, quantiles.of_999, quantiles.of_9999] {
                        td.number { (number_text(nm, 3)) " " (described.kind.torque_unit()) }
                    }
                } } }
            } }
        }
    }
}
