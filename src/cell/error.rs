//! Errors in a cell file.

use std::path::PathBuf;

use didim_drivers::layout::LayoutError;
use didim_drivers::units::UnitsError;
use didim_dynamics::dynamics::BaseParametersError;
use didim_dynamics::robot::RobotError;
use didim_formats::{TextKind, UrdfError};

use super::mistyped::WrongKey;
use super::open::OpenKey;
use super::suggestion::Suggestion;
use crate::files::TextError;

/// Error when a cell cannot be used. Every variant names the file. The inner error names the key
/// and the line if they are known.
#[derive(Debug, thiserror::Error)]
pub enum CellError {
    /// A file cannot be read. Check its path and permissions, and that it is a text file.
    #[error("{}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Error of the operating system.
        source: TextError,
    },
    /// A file that the cell names cannot be read. Correct the path, which is relative to the cell
    /// file.
    #[error("{}: `{key}` names {source}; the path is relative to the cell file", cell.display())]
    Named {
        /// The cell file.
        cell: PathBuf,
        /// Key that names the file.
        key: &'static str,
        /// Error of the named file.
        source: Box<CellError>,
    },
    /// The file is not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{}: {source}{}", file.display(), Suggestion::from_message(.source.message()))]
    Cell {
        /// The cell file.
        file: PathBuf,
        /// Message of the parser, with line and key.
        source: Box<toml::de::Error>,
    },
    /// The file is of another kind. Name the right file in its place.
    #[error("{}: this is {kind}, not {wanted}", file.display())]
    OtherKind {
        /// The file.
        file: PathBuf,
        /// Its kind.
        kind: TextKind,
        /// The file that is needed, and the remedy.
        wanted: &'static str,
    },
    /// The file has open values. Replace the question marks by values.
    #[error(
        "{}: {} open:{}{}",
        file.display(),
        if open.len() == 1 {
            "1 value is".to_owned()
        } else {
            format!("{} values are", open.len())
        },
        lines(open),
        if wrong.is_empty() {
            String::new()
        } else {
            format!("\nand {} wrong:{}", wrong.len(), lines(wrong))
        }
    )]
    Open {
        /// The cell file.
        file: PathBuf,
        /// All open keys.
        open: Vec<OpenKey>,
        /// Keys with invalid values.
        wrong: Vec<WrongKey>,
    },
    /// A value is invalid.
    #[error(
        "{}: {}`{key}`: {problem}",
        file.display(), line.map_or_else(String::new, |line| format!("line {line}: "))
    )]
    Value {
        /// The cell file.
        file: PathBuf,
        /// Line of the key if known. If the key is missing, line of its section.
        line: Option<usize>,
        /// The key.
        key: String,
        /// The problem and the allowed values.
        problem: String,
    },
    /// The robot file is invalid.
    #[error("{}: {source}{}", file.display(), Suggestion::parse(&.source.to_string()))]
    Robot {
        /// The robot file.
        file: PathBuf,
        /// Problem in the file.
        source: RobotError,
    },
    /// The command needs frames, but the cell has no bus. Add `[bus]`.
    #[error(
        "the cell {cell} has no [bus], and this takes its frames; describe the bus, or give `didim \
        identify` a table (CSV)"
    )]
    NoBus {
        /// Name of the cell.
        cell: String,
    },
    /// The URDF does not describe an arm that can be identified.
    #[error("{}: {source}", file.display())]
    Urdf {
        /// The URDF.
        file: PathBuf,
        /// Problem in the URDF.
        source: UrdfError,
    },
    /// The base parameters of the robot cannot be determined.
    #[error("{}: {source}", file.display())]
    BaseParameters {
        /// The robot file.
        file: PathBuf,
        /// Reason.
        source: BaseParametersError,
    },
    /// The layout does not fit the DBC file, or the device files of its nodes.
    #[error("{}: [bus.layout] with {}: {source}", file.display(), with.display())]
    Layout {
        /// The cell file.
        file: PathBuf,
        /// The DBC file, or the folder of the device files.
        with: PathBuf,
        /// The mismatch.
        source: Box<LayoutError>,
    },
    /// The drive gains do not fit the layout.
    #[error("{}: [[bus.drives]]: {source}", file.display())]
    Drives {
        /// The cell file.
        file: PathBuf,
        /// The mismatch.
        source: UnitsError,
    },
    /// The number of axes in the layout differs from the number of joints of the robot.
    #[error(
        "{}: [bus.layout] has {axes} axes, the robot has {joints} joints; they have to agree",
        file.display()
    )]
    Axes {
        /// The cell file.
        file: PathBuf,
        /// Axes of the layout.
        axes: usize,
        /// Joints of the robot.
        joints: usize,
    },
}

/// All faults of a cell that can be reported at once.
#[derive(Debug)]
pub struct Faults {
    /// The fault found first.
    pub first_fault: Box<CellError>,
    /// Additional faults.
    pub further_faults: Vec<CellError>,
}

impl Faults {
    /// Returns all faults, in the order in which they were found.
    pub fn iter(&self) -> impl Iterator<Item = &CellError> {
        core::iter::once(&*self.first_fault).chain(&self.further_faults)
    }
}

impl From<CellError> for Faults {
    fn from(first: CellError) -> Self {
        Self { first_fault: Box::new(first), further_faults: Vec::new() }
    }
}

/// Puts each key on a separate line.
fn lines(keys: &[impl ToString]) -> String {
    keys.iter().map(|key| format!("\n  {}", key.to_string())).collect()
}
