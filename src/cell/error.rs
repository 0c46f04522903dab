//! What can be wrong with a cell file.

use std::path::PathBuf;

use didim_core::dynamics::BaseParametersError;
use didim_core::robot::RobotError;
use didim_drivers::layout::LayoutError;
use didim_drivers::units::UnitsError;
use didim_formats::UrdfError;

use super::mistyped::WrongKey;
use super::open::OpenKey;
use super::suggestion::Instead;
use crate::files::TextError;

/// Why a cell cannot be used. Every variant names the file; the inner error names key and line
/// where they are known.
#[derive(Debug, thiserror::Error)]
pub enum CellError {
    /// A file cannot be read: check path and permissions, and that it is text.
    #[error("{}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: TextError,
    },
    /// A file that the cell names cannot be read: correct the path, which is relative to the cell
    /// file.
    #[error("{}: `{key}` names {source}; the path is relative to the cell file", cell.display())]
    Named {
        /// The cell file.
        cell: PathBuf,
        /// The key.
        key: &'static str,
        /// The file and what the system said.
        source: Box<CellError>,
    },
    /// Not TOML, a key that is missing, unknown, or of the wrong type.
    #[error("{}: {source}{}", file.display(), Instead::below(.source.message()))]
    Cell {
        /// The cell file.
        file: PathBuf,
        /// What the parser said, with line and key.
        source: Box<toml::de::Error>,
    },
    /// Values are open: put them in place of the question marks.
    #[error("{}: {} open:{}{}", file.display(), if open.len() == 1 { "1 value is".to_owned() } else { format!("{} values are", open.len()) }, lines(open), if wrong.is_empty() { String::new() } else { format!("\nand {} wrong:{}", wrong.len(), lines(wrong)) })]
    Open {
        /// The cell file.
        file: PathBuf,
        /// All of them.
        open: Vec<OpenKey>,
        /// Those of the others that cannot be what they are.
        wrong: Vec<WrongKey>,
    },
    /// An invalid value.
    #[error("{}: {}`{key}`: {problem}", file.display(), line.map_or_else(String::new, |line| format!("line {line}: ")))]
    Value {
        /// The cell file.
        file: PathBuf,
        /// The line of the key, or of the section that lacks it, where there is one.
        line: Option<usize>,
        /// The key.
        key: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
    /// The robot file is wrong.
    #[error("{}: {source}{}", file.display(), Instead::of(&.source.to_string()))]
    Robot {
        /// The robot file.
        file: PathBuf,
        /// What is wrong with it.
        source: RobotError,
    },
    /// Frames are asked for, and the cell describes none. State `[bus]`.
    #[error(
        "the cell {cell} has no [bus], and this takes its frames; describe the bus, or give `didim identify` a table (CSV)"
    )]
    NoBus {
        /// The cell.
        cell: String,
    },
    /// The URDF is no arm that can be identified.
    #[error("{}: {source}", file.display())]
    Urdf {
        /// The URDF.
        file: PathBuf,
        /// What is wrong with it.
        source: UrdfError,
    },
    /// The base parameters of the robot cannot be determined.
    #[error("{}: {source}", file.display())]
    BaseParameters {
        /// The robot file.
        file: PathBuf,
        /// What is wrong with it.
        source: BaseParametersError,
    },
    /// The layout does not fit the DBC file, or the device files of its nodes.
    #[error("{}: [bus.layout] with {}: {source}", file.display(), with.display())]
    Layout {
        /// The cell file.
        file: PathBuf,
        /// The DBC file, or the folder that the device files' names are relative to.
        with: PathBuf,
        /// What does not fit.
        source: Box<LayoutError>,
    },
    /// The drive gains do not fit the layout.
    #[error("{}: [[bus.drives]]: {source}", file.display())]
    Drives {
        /// The cell file.
        file: PathBuf,
        /// What does not fit.
        source: UnitsError,
    },
    /// The layout has another number of axes than the robot has joints.
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

/// What is wrong with a cell: as much as can be told at once.
#[derive(Debug)]
pub struct Faults {
    /// What is found first.
    pub first: Box<CellError>,
    /// What is found beside it.
    pub others: Vec<CellError>,
}

impl Faults {
    /// All, in the order in which they were found.
    pub fn iter(&self) -> impl Iterator<Item = &CellError> {
        core::iter::once(&*self.first).chain(&self.others)
    }
}

impl From<CellError> for Faults {
    fn from(first: CellError) -> Self {
        Self { first: Box::new(first), others: Vec::new() }
    }
}

/// Each on a line of its own.
fn lines(keys: &[impl ToString]) -> String {
    keys.iter().map(|key| format!("\n  {}", key.to_string())).collect()
}
