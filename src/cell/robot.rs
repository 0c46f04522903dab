//! The robot of a cell: a robot file (TOML), or a URDF with what that does not say of the drives.

use std::path::Path;

use didim_core::robot::{Robot, RobotError};
use didim_formats::{UrdfArm, UrdfDrives, UrdfNote};

use super::CellError;
use super::file::UrdfSection;

/// A robot and where it came from.
#[derive(Clone, Debug)]
pub struct RobotSource {
    /// The robot.
    pub robot: Robot,
    /// Its robot file: that of a URDF is made from it.
    pub toml: String,
    /// The arm in the URDF, where it is one.
    pub urdf: Option<UrdfArm>,
}

impl RobotSource {
    /// The robot in the text of a file; `section` has what a URDF does not say. Where it does not say all of the
    /// drives, they are assumed ([`UrdfDrives::assumed`]): enough to look at the arm, and a cell is then refused.
    ///
    /// # Errors
    /// [`CellError::Robot`], [`CellError::Urdf`].
    pub fn read(
        file: &Path,
        text: String,
        section: Option<&UrdfSection>,
    ) -> Result<Self, CellError> {
        if !is_urdf(file, &text) {
            let wrong = |source| CellError::Robot { file: file.to_path_buf(), source };
            let robot = Robot::from_toml(&text).map_err(wrong)?;
            return Ok(Self { robot, toml: text, urdf: None });
        }
        let [base, tip] = match section {
            Some(section) => [section.base.as_deref(), section.tip.as_deref()],
            None => [None, None],
        };
        let arm = UrdfArm::read(&text, base, tip)
            .map_err(|source| CellError::Urdf { file: file.to_path_buf(), source })?;
        let drives = section.and_then(UrdfSection::drives);
        let drives = drives.filter(|drives| is_gear(&drives.gear_ratios, arm.joints()));
        let toml = arm.to_toml(&drives.unwrap_or_else(|| UrdfDrives::assumed(arm.joints())));
        let robot = Robot::from_toml(&toml).map_err(|source| {
            // What is not wrong with other friction is wrong with this.
            let plain = arm.to_toml(&UrdfDrives::assumed(arm.joints()));
            if Robot::from_toml(&plain).is_ok() {
                return CellError::UrdfFriction { problem: without_line(&source) };
            }
            // Its lines are those of the robot file that comes of it.
            let as_robot_file = format!("{} (as `didim robot --toml` prints it)", file.display());
            CellError::Robot { file: as_robot_file.into(), source }
        })?;
        Ok(Self { robot, toml, urdf: Some(arm) })
    }

    /// The names of the joints, where they have any.
    pub fn joint_names(&self) -> impl Iterator<Item = &str> {
        self.urdf.iter().flat_map(UrdfArm::joint_names)
    }

    /// What has to be known of a URDF's arm.
    pub fn notes(&self) -> &[UrdfNote] {
        self.urdf.as_ref().map_or(&[], UrdfArm::notes)
    }
}

/// What is wrong, without the line of a file that nobody has.
fn without_line(error: &RobotError) -> String {
    let text = error.to_string();
    let rest = text.strip_prefix("line ").and_then(|rest| rest.split_once(": "));
    rest.map_or(text.clone(), |(_, rest)| rest.to_owned())
}

/// Whether these are gear ratios of so many joints.
fn is_gear(ratios: &[f64], joints: usize) -> bool {
    ratios.len() == joints && ratios.iter().all(|ratio| ratio.is_finite() && *ratio != 0.0)
}

/// By its name, or by its first character where it has another.
fn is_urdf(file: &Path, text: &str) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("urdf"))
        || text.trim_start().starts_with('<')
}

/// What the cell lacks for a URDF, or has too much for a robot file; nothing where both fit.
pub(super) fn misfit(
    source: &RobotSource,
    section: Option<&UrdfSection>,
) -> Option<(&'static str, String)> {
    match (&source.urdf, section) {
        (None, Some(_)) => {
            Some(("urdf", "belongs to a URDF, and the robot is a robot file; remove [urdf]".into()))
        }
        (Some(arm), None) => Some(("urdf", missing(arm))),
        (Some(arm), Some(section)) => {
            let (joints, found) = (arm.joints(), section.gear_ratios.as_ref().map_or(0, Vec::len));
            let stated = section.drives().is_some();
            let is_none = |name: &&String| arm.joint_names().all(|own| own != *name);
            match () {
                () if let Some(name) = section.joint_friction.keys().find(is_none) => Some((
                    "urdf.joint_friction",
                    format!(
                        "has `{name}`, which is no driven joint of the arm; these are: {}",
                        arm.joint_names().collect::<Vec<_>>().join(" ")
                    ),
                )),
                () if !stated => Some(("urdf", missing(arm))),
                () if found != joints => Some((
                    "urdf.gear_ratios",
                    format!("has {found} entries for {joints} driven joints; give one for each"),
                )),
                () if !is_gear(section.gear_ratios.as_deref().unwrap_or_default(), joints) => Some((
                    "urdf.gear_ratios",
                    "has an entry that is 0 or no finite number; give the turns of the motor to one of the joint"
                        .to_owned(),
                )),
                () => None,
            }
        }
        (None, None) => None,
    }
}

/// The section to paste.
fn missing(arm: &UrdfArm) -> String {
    let ones = vec!["1.0"; arm.joints()].join(", ");
    let names: Vec<&str> = arm.joint_names().collect();
    format!(
        "a URDF says nothing of the drives, of {}; state them, where these lines do not fit with other values:\n\n[urdf]\n\
         drive_inertia = true # false where torque is measured behind the gear\n\
         gear_ratios = [{ones}] # turns of the motor to one of the joint; 1 where signals are of the joints' side\n\
         friction = {{ viscous = true, coulomb = true, offset = true, sign = {{ model = \"tanh\", width_rad_s = 0.02 }} }}",
        names.join(" ")
    )
}
