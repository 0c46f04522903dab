//! The files from which a cell is proposed.

use std::path::{Path, PathBuf};

use didim_drivers::layout::{DeviceContents, EdsError, LayoutError};
use didim_drivers::source::SourceError;
use didim_formats::{BagContents, BagError, TableError, TableNames, list_bag, list_table};

use crate::cell::{CellError, Library, RobotSource, UrdfSection};

/// Paths of the files.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    /// A robot file or a URDF.
    pub robot: Option<PathBuf>,
    /// Base link of the arm in a URDF.
    pub base: Option<String>,
    /// Last link of the arm in a URDF.
    pub tip: Option<String>,
    /// A table (CSV or Parquet).
    pub table: Option<PathBuf>,
    /// A ROS 2 bag, a file or a folder.
    pub bag: Option<PathBuf>,
    /// A DBC file.
    pub dbc: Option<PathBuf>,
    /// Device files (EDS, DCF): one for each drive, or one EDS for all.
    pub eds: Vec<PathBuf>,
    /// A log or a recording of the bus.
    pub log: Option<PathBuf>,
}

/// Error when no cell can be proposed.
#[derive(Debug, thiserror::Error)]
pub enum ProposalError {
    /// The robot file or another file cannot be read or is invalid.
    #[error(transparent)]
    File(Box<CellError>),
    /// The table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The table has too few columns: it has another separator or no header, or is not a table.
    #[error("{}: {axes} joints need as many columns of positions and of torques, with their names \
        in the first line; found {columns:?}. A table with one value in each row needs a row for \
        each time first (a pivot, in InfluxDB and pandas)", file.display())]
    NoTable {
        /// The file.
        file: PathBuf,
        /// Columns of the table.
        columns: String,
        /// Number of joints of the robot.
        axes: usize,
    },
    /// Too few columns have numbers.
    #[error(
        "{}: {axes} joints need as many columns of positions and of torques, and these have no \
        numbers: {texts}. Leave a missing value empty; a table with one value in each row needs a \
        row for each time first (a pivot, in InfluxDB and pandas)",
        file.display()
    )]
    Texts {
        /// The file.
        file: PathBuf,
        /// Columns without numbers, each with its first text.
        texts: String,
        /// Number of joints of the robot.
        axes: usize,
    },
    /// An answer has too few or too many columns.
    #[error("`{key}`: give a column for each of the {axes} axes, not {count}")]
    ColumnCount {
        /// Key of the answer.
        key: String,
        /// Number of its columns.
        count: usize,
        /// Number of joints of the robot.
        axes: usize,
    },
    /// The table has no such column.
    #[error("{}: no column `{column}`; available: {available}", file.display())]
    NoColumn {
        /// The file.
        file: PathBuf,
        /// Column of an answer.
        column: String,
        /// Columns of the table.
        available: String,
    },
    /// The rows have the names of the joints, and no torques.
    #[error(
        "{}: its rows seem to be joint states without efforts, and without torques nothing is \
        identified. Record a topic with efforts or currents; if there are torques, number their \
        columns with --set data.torque.columns=[…]",
        file.display()
    )]
    NoEfforts {
        /// The file.
        file: PathBuf,
    },
    /// The times of the table are not in ascending order.
    #[error(
        "{}: time goes back in row {row} of `{column}`: rows of two recordings alternate, or rows \
        are out of order. Record one source alone; sort rows of one recording only",
        file.display()
    )]
    Backwards {
        /// The file.
        file: PathBuf,
        /// Column of the time.
        column: String,
        /// Number of the row, from 1.
        row: usize,
    },
    /// The joint states have no names of joints.
    #[error(
        "{}: the messages on {topic} have no names of joints (`name` is empty), so positions and \
        efforts cannot be assigned. Let the driver fill `name`, or write the signals as a table \
        (CSV)",
        file.display()
    )]
    NoJointNames {
        /// The bag.
        file: PathBuf,
        /// The topic.
        topic: String,
    },
    /// The file is not a DBC file.
    #[error("{}: {source}", file.display())]
    Dbc {
        /// The file.
        file: PathBuf,
        /// Problem in the file.
        source: Box<LayoutError>,
    },
    /// A device file is invalid.
    #[error(transparent)]
    Eds(Box<EdsError>),
    /// The number of device files is neither one per drive nor one for all drives.
    #[error(
        "{files} device files for {axes} joints; name one for each with --eds, in their order, or \
        one EDS for all of them"
    )]
    Devices {
        /// Number of files given.
        files: usize,
        /// Number of joints of the robot.
        axes: usize,
    },
    /// The log cannot be read.
    #[error(transparent)]
    Log {
        /// Problem with the log.
        source: Box<SourceError>,
    },
    /// No source describes the arm.
    #[error(
        "which arm is it? Name its URDF or robot file with --robot{}",
        .bag.as_ref()
            .map(|bag| format!("; {} has no robot_description", bag.display()))
            .unwrap_or_default()
    )]
    NoRobot {
        /// The bag, if there is one, which contains no description of the arm.
        bag: Option<PathBuf>,
    },
    /// An answer belongs to no question.
    #[error("`{key}` is not a key of this cell; available keys: {available}")]
    NotAsked {
        /// Key of the answer.
        key: String,
        /// Keys of the questions.
        available: String,
    },
}

/// Content of the files.
#[derive(Clone, Debug)]
pub struct Evidence {
    pub(super) robot: RobotSource,
    robot_file: Option<PathBuf>,
    pub(super) base: Option<String>,
    pub(super) tip: Option<String>,
    pub(super) table: Option<(PathBuf, TableNames)>,
    pub(super) bag: Option<(PathBuf, BagContents)>,
    pub(super) dbc: Option<(PathBuf, String)>,
    pub(super) eds: Vec<(PathBuf, DeviceContents)>,
    pub(super) log: Option<PathBuf>,
    /// URDF published in a bag. It is used if no other robot was named.
    pub description: Option<String>,
}

impl Evidence {
    /// Reads the arm, the header of the table and the complete bag.
    ///
    /// # Errors
    /// [`ProposalError`].
    pub fn read(sources: Sources) -> Result<Self, ProposalError> {
        let Sources { robot: robot_file, base, tip, table, bag, dbc, eds, log } = sources;
        let file_error = |error| ProposalError::File(Box::new(error));
        let bag = bag.map(|file| list_bag(&file).map(|contents| (file, contents))).transpose()?;
        let (file, text, description) = match (&robot_file, &bag) {
            (Some(file), _) => (file.clone(), Library::Files.read(file).map_err(file_error)?, None),
            (None, Some((file, BagContents { robot_description: Some(urdf), .. }))) => {
                (file.with_extension("urdf"), urdf.clone(), Some(urdf.clone()))
            }
            (None, bag) => {
                return Err(ProposalError::NoRobot {
                    bag: bag.as_ref().map(|(file, _)| file.clone()),
                });
            }
        };
        let ends = UrdfSection { base: base.clone(), tip: tip.clone(), ..UrdfSection::default() };
        let robot = RobotSource::read(&file, text, Some(&ends)).map_err(file_error)?;
        let table = table.map(|file| list_table(&file).map(|names| (file, names))).transpose()?;
        let read_device = |file: &Path| Library::Files.read_device_file(file).map_err(file_error);
        let dbc = dbc.map(|file| read_device(&file).map(|text| (file, text))).transpose()?;
        let eds = eds
            .into_iter()
            .map(|file: PathBuf| {
                let text = read_device(&file)?;
                let contents = DeviceContents::read(&text, &file, is_dcf(&file));
                let contents = contents.map_err(|error| ProposalError::Eds(Box::new(error)))?;
                Ok((file, contents))
            })
            .collect::<Result<_, ProposalError>>()?;
        Ok(Self { robot, robot_file, base, tip, table, bag, dbc, eds, log, description })
    }

    /// Returns the path of the robot for the cell file, and true if the robot file is written next
    /// to the cell file.
    pub(super) fn robot_path(&self, out: &Path) -> (PathBuf, bool) {
        match &self.robot_file {
            Some(file) => (relative_to_cell(file, out), false),
            None => {
                let name = Self::description_path(out).file_name().map(PathBuf::from);
                (name.unwrap_or_default(), true)
            }
        }
    }

    /// Returns the path to which the robot description of a bag is written.
    pub fn description_path(out: &Path) -> PathBuf {
        out.with_extension("urdf")
    }
}

/// Returns true if a device file is a DCF, by its file extension.
pub(super) fn is_dcf(file: &Path) -> bool {
    file.extension().is_some_and(|own| own.eq_ignore_ascii_case("dcf"))
}

/// Returns a path as written in the cell file: relative if it is below the folder of the cell file,
/// otherwise absolute.
pub(super) fn relative_to_cell(path: &Path, out: &Path) -> PathBuf {
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => path.strip_prefix(&folder).map(Path::to_path_buf).unwrap_or(path),
        _ => path.to_path_buf(),
    }
}
