//! Reference page of the meanings of parameter names.

use didim_dynamics::robot::JointKind::{Prismatic, Revolute};
use didim_dynamics::robot::ParameterKind::{self, *};

use super::page::{Block, Page};
use didim::report::names::{NAME_PARTS, kind_meaning};

/// All kinds of parameters, in the order of a model.
pub(super) const PARAMETER_KINDS: [ParameterKind; 22] = [
    Xx,
    Xy,
    Xz,
    Yy,
    Yz,
    Zz,
    Mx,
    My,
    Mz,
    M,
    Ia,
    Fv,
    FvQuadratic,
    FvCubic,
    FvAsymmetric,
    Fc,
    FcLoad,
    Fs,
    Fh,
    Off,
    FvMotor,
    FcMotor,
];

/// Returns the table row of a parameter kind: its symbol, units and meaning.
fn row(kind: &ParameterKind) -> Vec<String> {
    let (turning, sliding) = (kind.unit(Revolute), kind.unit(Prismatic));
    let unit = match kind.unit(Revolute) {
        "1" => "no unit".to_owned(),
        _ if turning == sliding => turning.to_owned(),
        _ => format!("{turning}, or {sliding}"),
    };
    vec![format!("`{}`", kind.symbol()), unit, kind_meaning(*kind).to_owned()]
}

pub(super) fn page() -> Page {
    let head = |cells: &[&str]| cells.iter().map(|cell| (*cell).to_owned()).collect();
    let text = |text: &str| Block::Text(text.to_owned());
    Page {
        name: "didim-parameters",
        section: 7,
        document: "parameters.md",
        title: "names of parameters, with unit and meaning",
        blocks: vec![
            text(
                "Results, histories, cell files and robot files name the dynamic parameters of an \
                 arm in the same way. Links have frames of modified Denavit–Hartenberg parameters, \
                 as in the robot file; the z axis of a link's frame is the axis of its joint.",
            ),
            Block::Heading("Symbols".to_owned()),
            text(
                "Where there are two units, the first is that of a revolute joint, the second that \
                of a prismatic one.",
            ),
            Block::Table {
                head: head(&["symbol", "unit", "meaning"]),
                rows: PARAMETER_KINDS.iter().map(row).collect(),
            },
            Block::Heading("Names".to_owned()),
            text("A name is a symbol and a number, and may end in `r`."),
            Block::Table {
                head: head(&["name", "meaning"]),
                rows: NAME_PARTS.iter().map(|row| head(row)).collect(),
            },
        ],
        files: &[],
        see_also: &[
            ["didim-robot(5)", "robot-file.md", "robot file"],
            ["didim-cell(5)", "cell-file.md", "cell file"],
            ["didim-identify(1)", "../method/README.md", "methods"],
        ],
    }
}
