//! Reading of one result per arm from the rows of the histories.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::limits::FleetLimits;
use didim_formats::{LongTableError, read_long_table};
use serde::Serialize;

/// Reason why arms are not compared.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// A file is not from `didim history --out`.
    #[error("{}: {source}; name a file that `didim history --out` wrote", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// The problem.
        source: LongTableError,
    },
    /// A field is not a number.
    #[error("{}: `{text}` is not a number, but `{column}` needs one; write the file with `didim \
        history --out` again", file.display())]
    NotANumber {
        /// The file.
        file: PathBuf,
        /// The column.
        column: &'static str,
        /// Text in the field.
        text: String,
    },
    /// There are too few arms. Name the history files of more arms.
    #[error(
        "{arms} arms have a result that is usable for monitoring and has no payload noted; a \
            population needs at least {}; name the histories of more",
        FleetLimits::DEFAULT.min_arms
    )]
    TooFew {
        /// Number of arms.
        arms: usize,
    },
    /// The arms are not of one type. Compare only arms of one type.
    #[error("{arm} is {kind}, and {other} is {other_kind}; name the histories of arms of one type")]
    OtherKind {
        /// The first arm.
        arm: String,
        /// Robot, method and regrouping of the first arm.
        kind: String,
        /// An arm of another type.
        other: String,
        /// Robot, method and regrouping of the other arm.
        other_kind: String,
    },
}

/// An arm and its result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Member {
    /// Name of the arm's cell, or the file name if several arms have the same cell name or none.
    pub name: String,
    /// Name of the robot.
    #[serde(skip)]
    pub robot: String,
    /// Method of the result.
    #[serde(skip)]
    pub method: String,
    /// Hash of the composition of the base parameters.
    #[serde(skip)]
    pub regrouping: String,
    /// Number of the result.
    pub result: u64,
    /// Time at which the result was stored. Empty if the clock was not set.
    pub time: String,
    /// Parameters of the result.
    #[serde(skip)]
    pub parameters: Vec<MemberParameter>,
}

/// A parameter of an arm. All values are in its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value.
    pub value: f64,
    /// Its statistical standard deviation.
    pub standard_deviation: f64,
    /// Combined standard uncertainty, if the result reports it.
    pub combined_standard_deviation: Option<f64>,
}

impl Member {
    /// Returns a parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&MemberParameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Returns robot, method and regrouping. Parameters of the same name are comparable between two
    /// arms only if all three are equal.
    pub(super) fn kind(&self) -> [&str; 3] {
        [&self.robot, &self.method, &self.regrouping]
    }

    pub(super) fn kind_text(&self) -> String {
        let regrouping: String = self.regrouping.chars().take(12).collect();
        format!("a {} by {}, regrouped as {regrouping}…", self.robot, self.method)
    }
}

const COLUMN_NAMES: [&str; 14] = [
    "identity",
    "cell",
    "robot",
    "result",
    "time",
    "method",
    "regrouping",
    "parameter",
    "unit",
    "value",
    "standard_deviation",
    "combined_standard_deviation",
    "monitoring",
    "payload_kg",
];

/// Reads one result per arm from these files: the newest one that is usable for monitoring and has
/// no noted payload.
///
/// # Errors
/// [`FleetError::File`], [`FleetError::NotANumber`].
pub fn read_members(files: &[PathBuf]) -> Result<Vec<Member>, FleetError> {
    let mut newest = NewestResults::new();
    for file in files {
        let mut refused = Ok(());
        let read = read_long_table(file, COLUMN_NAMES, |row| {
            if refused.is_ok() {
                refused = add_row(&mut newest, file, row);
            }
        });
        read.map_err(|source| FleetError::File { file: file.clone(), source })?;
        refused?;
    }
    let names: Vec<String> = newest.keys().map(|(_, cell)| cell.clone()).collect();
    Ok(newest
        .into_iter()
        .map(|((file, cell), (_, member)): ((PathBuf, String), (String, Member))| {
            let alone = !cell.is_empty() && names.iter().filter(|name| **name == cell).count() == 1;
            let name = if alone { cell } else { file.display().to_string() };
            Member { name, ..member }
        })
        .collect())
}

/// The newest result of each arm with its identity. Key: the file, and the cell in it.
type NewestResults = BTreeMap<(PathBuf, String), (String, Member)>;

/// Adds a row of a history, if it belongs to the newest result of its arm so far.
fn add_row(
    newest: &mut NewestResults,
    file: &Path,
    row: [String; COLUMN_NAMES.len()],
) -> Result<(), FleetError> {
    let [
        identity,
        cell,
        robot,
        result,
        time,
        method,
        regrouping,
        name,
        unit,
        value,
        deviation,
        combined,
        monitoring,
        payload,
    ] = row;
    let loaded = !payload.is_empty() && parse_number::<f64>(file, "payload_kg", &payload)? != 0.0;
    if monitoring != "true" || loaded {
        return Ok(());
    }
    let result = parse_number(file, "result", &result)?;
    let is_newer = |member: &Member| (time.as_str(), result) > (&*member.time, member.result);
    let key = (file.to_owned(), cell);
    match newest.get(&key) {
        Some((own, member)) if *own != identity && !is_newer(member) => return Ok(()),
        Some((own, _)) if *own == identity => {}
        _ => {
            let (cell, parameters) = (key.1.clone(), Vec::new());
            let member = Member { name: cell, robot, method, regrouping, result, time, parameters };
            newest.insert(key.clone(), (identity, member));
        }
    }
    let Some((_, member)) = newest.get_mut(&key) else { return Ok(()) };
    let combined = Some(combined).filter(|text| !text.is_empty());
    let combined = combined
        .map(|text| parse_number(file, "combined_standard_deviation", &text))
        .transpose()?;
    // A NaN was written as an empty field. Such a parameter is omitted.
    if value.is_empty() || deviation.is_empty() {
        return Ok(());
    }
    member.parameters.push(MemberParameter {
        name,
        unit,
        value: parse_number(file, "value", &value)?,
        standard_deviation: parse_number(file, "standard_deviation", &deviation)?,
        combined_standard_deviation: combined,
    });
    Ok(())
}

fn parse_number<T: FromStr>(
    file: &Path,
    column: &'static str,
    text: &str,
) -> Result<T, FleetError> {
    let wrong = || FleetError::NotANumber {
        file: file.to_owned(),
        column,
        text: text.chars().take(40).collect(),
    };
    text.parse().map_err(|_| wrong())
}
