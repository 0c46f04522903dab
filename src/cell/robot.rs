//! The robot of a cell: a robot file (TOML), or a URDF together with its missing drive data.

use std::collections::BTreeMap;
use std::path::Path;

use didim_dynamics::robot::{Robot, RobotError, Transmission};
use didim_formats::{TextKind, UrdfArm, UrdfDrives, UrdfNote};

use super::CellError;
use super::file::{GearRatios, UrdfSection};
use super::suggestion::Suggestion;

/// A robot and its source.
#[derive(Clone, Debug)]
pub struct RobotSource {
    /// The robot.
    pub robot: Robot,
    /// Text of the robot file. For a URDF, it is the robot file made from it.
    pub toml: String,
    /// The arm in the URDF, if the source is a URDF.
    pub urdf: Option<UrdfArm>,
}

/// Returns the names of an arm's joints. Without a URDF, these are the joint numbers.
pub fn joint_names(urdf: Option<&UrdfArm>, joints: usize) -> Vec<String> {
    match urdf {
        Some(arm) => arm.joint_names().map(str::to_owned).collect(),
        None => (1..=joints).map(|joint| format!("joint_{joint}")).collect(),
    }
}

/// Key of a cell, and the problem.
type Wrong = (String, String);

impl RobotSource {
    /// Reads the robot from the text of a file. `section` names the first and the last link of a
    /// URDF's arm. The drives of a URDF are assumed ([`UrdfDrives::with_assumed_drives`]), which is
    /// sufficient to inspect the arm.
    ///
    /// # Errors
    /// [`CellError::Robot`], [`CellError::Urdf`].
    pub fn read(
        file: &Path,
        text: String,
        section: Option<&UrdfSection>,
    ) -> Result<Self, CellError> {
        if !is_urdf(file, &text) {
            let wrong = |source| match TextKind::detect(&text) {
                Some(kind) if kind != TextKind::Robot => {
                    let wanted = "a URDF or a robot file";
                    CellError::OtherKind { file: file.to_path_buf(), kind, wanted }
                }
                _ => CellError::Robot { file: file.to_path_buf(), source },
            };
            let robot = Robot::from_toml(&text).map_err(wrong)?;
            return Ok(Self { robot, toml: text, urdf: None });
        }
        let [base, tip] = match section {
            Some(section) => [section.base.as_deref(), section.tip.as_deref()],
            None => [None, None],
        };
        let arm = UrdfArm::read(&text, base, tip)
            .map_err(|source| CellError::Urdf { file: file.to_path_buf(), source })?;
        let toml = arm.to_toml(&UrdfDrives::with_assumed_drives(arm.joints()));
        let robot = Robot::from_toml(&toml).map_err(|source| {
            // The line numbers are those of the robot file made from the URDF.
            let as_robot_file = format!("{} (as `didim robot --toml` prints it)", file.display());
            CellError::Robot { file: as_robot_file.into(), source }
        })?;
        Ok(Self { robot: arm.with_link_frames(robot), toml, urdf: Some(arm) })
    }

    /// Returns the robot with the drive data that the cell gives for a URDF. A robot file contains
    /// its own drive data.
    pub(super) fn with_drives(self, section: Option<&UrdfSection>) -> Result<Self, Wrong> {
        let wrong = |problem: String| Err(("urdf".to_owned(), problem));
        let (arm, section) = match (&self.urdf, section) {
            (None, None) => return Ok(self),
            (None, Some(_)) => {
                return wrong(
                    "belongs to a URDF, and the robot is a robot file; remove [urdf]".to_owned(),
                );
            }
            (Some(arm), None) => return wrong(missing_section(arm)),
            (Some(arm), Some(section)) => (arm, section),
        };
        let drives = drives(arm, section)?;
        let toml = arm.to_toml(&drives);
        match Robot::from_toml(&toml) {
            Ok(robot) => Ok(Self { robot: arm.with_link_frames(robot), toml, ..self }),
            Err(error) => {
                Err(at_fault(arm, drives).unwrap_or(("urdf".to_owned(), problem_text(&error))))
            }
        }
    }

    /// Returns the names of the joints, if they have any.
    pub fn joint_names(&self) -> impl Iterator<Item = &str> {
        self.urdf.iter().flat_map(UrdfArm::joint_names)
    }

    /// Returns the names of the joints of a URDF that turn without end.
    pub fn continuous_joints(&self) -> Vec<&str> {
        let notes = self.notes().iter();
        let joints = notes.filter_map(|note| match note {
            UrdfNote::Continuous { joint } => Some(joint.as_str()),
            _ => None,
        });
        joints.collect()
    }

    /// Returns the notes on a URDF's arm.
    pub fn notes(&self) -> &[UrdfNote] {
        self.urdf.as_ref().map_or(&[], UrdfArm::notes)
    }
}

/// Returns the problem without the line number, which refers to a generated file that the user does
/// not have.
fn problem_text(error: &RobotError) -> String {
    let text = error.to_string();
    let rest = text.strip_prefix("line ").and_then(|rest| rest.split_once(": "));
    let text = rest.map_or(text.as_str(), |(_, rest)| rest).trim_end();
    format!("{text}{}", Suggestion::parse(text))
}

/// Returns the configured value that makes the robot invalid. Tries each value separately.
fn at_fault(arm: &UrdfArm, drives: UrdfDrives) -> Option<Wrong> {
    let UrdfDrives { joints, .. } = drives.clone();
    let wrong = |key: String, joints| -> Option<Wrong> {
        let error = Robot::from_toml(&arm.to_toml(&UrdfDrives { joints, ..drives.clone() }));
        Some((key, problem_text(&error.err()?)))
    };
    wrong("urdf.friction".to_owned(), BTreeMap::new()).or_else(|| {
        joints.into_iter().find_map(|(joint, own)| {
            own.into_iter().find_map(|(key, value)| {
                let full = format!("urdf.joints.{joint}.{key}");
                let alone = BTreeMap::from([(key, value)]);
                wrong(full, BTreeMap::from([(joint.clone(), alone)]))
            })
        })
    })
}

/// Returns true if the ratios of the motors to their own joints are valid.
fn is_gear(rows: &[Vec<f64>]) -> bool {
    let own = rows.iter().enumerate().map(|(motor, row)| row[motor]);
    own.into_iter().all(|ratio| ratio.is_finite() && ratio != 0.0)
}

/// Detects a URDF by its file extension, or else by its first character.
fn is_urdf(file: &Path, text: &str) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("urdf"))
        || text.trim_start().starts_with('<')
}

/// Keys of a joint in a robot file that a URDF does not contain, or whose values are often wrong
/// there.
const ROBOT_FILE_REMEDY: [&str; 15] = [
    "position_min_deg",
    "position_max_deg",
    "velocity_max_rad_s",
    "torque_max_nm",
    "position_min_m",
    "position_max_m",
    "velocity_max_m_s",
    "force_max_n",
    "drive_inertia",
    "friction",
    "known_torque",
    "acceleration_max_rad_s2",
    "jerk_max_rad_s3",
    "acceleration_max_m_s2",
    "jerk_max_m_s3",
];

/// Reads the drives of a section. The section has to configure all of them.
fn drives(arm: &UrdfArm, section: &UrdfSection) -> Result<UrdfDrives, Wrong> {
    let (Some(drive_inertia), Some(gear_ratios), Some(friction)) =
        (section.drive_inertia, &section.gear_ratios, &section.friction)
    else {
        return Err(("urdf".to_owned(), missing_section(arm)));
    };
    let wrong = |key: &str, problem: String| Err((format!("urdf.{key}"), problem));
    let (joints, rows) = (arm.joints(), gear_ratios.rows());
    let found = rows.iter().map(Vec::len).find(|found| *found != joints).unwrap_or(rows.len());
    if found != joints || rows.len() != joints {
        let problem = format!("has {found} entries for {joints} driven joints; give one for each");
        return wrong("gear_ratios", problem);
    }
    if let (GearRatios::Rows(_), Err(error)) = (gear_ratios, Transmission::new(joints, &rows)) {
        return wrong("gear_ratios", format!("is no transmission: {error}"));
    }
    if !is_gear(&rows) {
        let problem = "has an entry that is 0 or no finite number; give the turns of the motor to \
            one of the joint";
        return wrong("gear_ratios", problem.to_owned());
    }
    let mut tables = section.joints.clone();
    for (joint, friction) in &section.joint_friction {
        let table = tables.entry(joint.clone()).or_default();
        table.entry("friction").or_insert_with(|| friction.clone());
    }
    for (joint, own) in &tables {
        if arm.joint_names().all(|name| name != joint) {
            let names = arm.joint_names().collect::<Vec<_>>().join(" ");
            let problem = format!("is no driven joint of the arm; these are: {names}");
            return wrong(&format!("joints.{joint}"), problem);
        }
        if let Some(key) = own.keys().find(|key| !ROBOT_FILE_REMEDY.contains(&key.as_str())) {
            let problem = format!(
                "is not for a joint of a URDF, which has its geometry; here it may have {}",
                ROBOT_FILE_REMEDY.join(" ")
            );
            return wrong(&format!("joints.{joint}.{key}"), problem);
        }
    }
    let values = |own: &toml::Table| -> BTreeMap<String, String> {
        own.iter().map(|(key, value)| (key.clone(), value.to_string())).collect()
    };
    if section.gravity_m_s2.is_some_and(|gravity| gravity.iter().any(|own| !own.is_finite())) {
        return wrong("gravity_m_s2", "has an entry that is no finite number".to_owned());
    }
    Ok(UrdfDrives {
        gravity_m_s2: section.gravity_m_s2,
        drive_inertia,
        gear_ratios: rows,
        friction: friction.iter().map(|(key, value)| format!("{key} = {value}\n")).collect(),
        joints: tables.iter().map(|(joint, own)| (joint.clone(), values(own))).collect(),
    })
}

/// Returns the text of the missing section, for the user to paste.
fn missing_section(arm: &UrdfArm) -> String {
    let ones = vec!["1.0"; arm.joints()].join(", ");
    let names: Vec<&str> = arm.joint_names().collect();
    format!(
        "a URDF does not describe the drives of {}; add these lines with your values:\n\n[urdf]\n\
         drive_inertia = true # false if torque comes from joint torque sensors\n\
         gear_ratios = [{ones}] # motor turns per joint turn; 1 if the signals are on the joint \
         side\n\
         friction = {{ viscous = true, coulomb = true, offset = true, sign = {{ model = \"tanh\", \
         width_rad_s = 0.02 }} }}",
        names.join(" ")
    )
}
