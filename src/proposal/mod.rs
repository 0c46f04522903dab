//! Proposal of a cell file from the files of an engineer: an arm, and a table, a bag, a DBC file or
//! device files.
//!
//! A value that the files contain is taken from them. A usual value is assumed and marked as
//! assumed. A value that the files cannot show stays open. No physical value is guessed.

mod bag;
mod bus;
mod dbc;
mod draft;
mod evidence;
mod limits;
mod names;
mod nodes;
mod plausible;
mod table;
mod time;
mod value;

use limits::ProposalLimits;
use std::path::Path;

pub use draft::{Answers, Entry, Proposal};
pub use evidence::{Evidence, ProposalError, Sources};
pub use value::ValueOrigin;

use draft::Draft;
use value::{Guess, list_text, quote_text};

/// Proposes a cell file from these files and answers. The keys of the answers are keys of the cell
/// file with their sections.
///
/// # Errors
/// [`ProposalError`], if a file cannot be read or an answer belongs to no question.
pub fn propose(
    evidence: &Evidence,
    out: &Path,
    answers: &Answers,
) -> Result<Proposal, ProposalError> {
    let mut draft = Draft::new(answers);
    let stem = out.file_stem().map_or_else(|| "cell".into(), |stem| stem.to_string_lossy());
    draft.add_entry("", "name", Guess::assumed(quote_text(&stem), "the name of this file"));
    let (robot, from) = evidence.robot_path(out);
    let why = if from { "the bag's robot_description" } else { "as named" };
    draft.add_entry("", "robot", Guess::from_file(quote_text(&robot.display().to_string()), why));
    match (&evidence.table, &evidence.bag) {
        (Some(file), _) => table::propose(&mut draft, evidence, file)?,
        (None, Some(file)) => bag::propose(&mut draft, evidence, file)?,
        (None, None) => {}
    }
    if let Some(file) = &evidence.dbc {
        dbc::propose(&mut draft, evidence, file, out)?;
    }
    if !evidence.eds.is_empty() {
        nodes::propose(&mut draft, evidence, out)?;
    }
    propose_drives(&mut draft, evidence);
    propose_identification(&mut draft);
    draft.finish(evidence.robot.robot.joints())
}

/// Proposes the drive data that a URDF does not contain.
fn propose_drives(draft: &mut Draft<'_>, evidence: &Evidence) {
    let Some(arm) = &evidence.robot.urdf else { return };
    let joints = arm.joints();
    for (key, link) in [("base", &evidence.base), ("tip", &evidence.tip)] {
        if let Some(link) = link {
            draft.add_entry("urdf", key, Guess::from_file(quote_text(link), "as named"));
        }
    }
    draft.add_entry(
        "urdf",
        "drive_inertia",
        Guess::without_value(
            "true if torque comes from motor current, false if it comes from joint torque \
                sensors",
        ),
    );
    let ratios = if draft.has_text("data.side", "joint") {
        Guess::assumed(list_text(&vec!["1.0"; joints]), "the signals are of the joints' side")
    } else {
        Guess::without_value(
            "motor turns per joint turn, such as [100.0, 100.0]; 1 if the signals are on the \
                joint side",
        )
    };
    draft.add_entry("urdf", "gear_ratios", ratios);
    let laws = "{ viscous = true, coulomb = true, offset = true, sign = { model = \"tanh\", \
        width_rad_s = 0.02 } }";
    let why = "the usual law; `friction = \"auto\"` in [identification] lets the recording \
        choose";
    draft.add_entry("urdf", "friction", Guess::assumed(laws.to_owned(), why));
}

/// Returns the usual number of samples per row at a sample rate: ten, or as many as give 25 rows a
/// second.
pub fn usual_samples_per_row(rate_hz: f64) -> f64 {
    let ProposalLimits { rows_hz, samples_per_row, .. } = ProposalLimits::DEFAULT;
    (rate_hz / rows_hz).round().max(samples_per_row)
}

fn propose_identification(draft: &mut Draft<'_>) {
    let rate_hz = draft.number("data.rate_hz").or(draft.number("bus.layout.rate_hz"));
    let section = "identification";
    draft.add_entry(
        section,
        "method",
        Guess::assumed(quote_text("idim-ls"), "needs no controller"),
    );
    let why = "the recording chooses the cut-off; enter the printed one before you compare \
        results over time";
    draft.add_entry(section, "position_filter.cutoff_hz", Guess::assumed(quote_text("auto"), why));
    let factor = rate_hz.map(usual_samples_per_row);
    let guess = match factor {
        Some(factor) => Guess::assumed(
            format!("{factor:.0}"),
            "samples per row: ten, or as many as give 25 rows a second",
        ),
        None => Guess::without_value("samples per row: ten, or rate_hz / 25 if that is more"),
    };
    draft.add_entry(section, "decimation_filter.factor", guess);
}
