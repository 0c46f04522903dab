//! URDF: an arm as ROS describes it, turned into a robot file.

mod chain;
mod edit;
mod element;
mod error;
mod file;
mod limits;
mod modified_dh;
mod note;
mod shape;
mod static_gravity;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use didim_dynamics::robot::{NamedFrame, Robot, is_hidden};
use nalgebra::{IsometryMatrix3, Vector3};

pub use edit::{UrdfValues, WRITTEN_BY};
pub use error::UrdfError;
pub(crate) use file::Body;
pub use note::{UnreadAttribute, UrdfNote};
pub use shape::{UrdfGeometry, UrdfShape};

use chain::{Chain, ChainAxis};
use file::{CollisionCapsule, UrdfFile};
use limits::UrdfLimits;
use modified_dh::{Frame, PlacedJoint, place_frames};
use static_gravity::unset_placeholders;

use crate::xml::normalise;

/// Gravity, against z of the root of a URDF \[m/s²\].
const GRAVITY_M_S2: f64 = 9.81;

const LINK_PARAMETERS: [&str; 10] = ["xx", "xy", "xz", "yy", "yz", "zz", "mx", "my", "mz", "m"];

/// The serial arm in a URDF.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfArm {
    /// Its file.
    text: String,
    name: String,
    base: String,
    tip: String,
    axes: Vec<ChainAxis>,
    link_parameters: Vec<PlacedJoint>,
    tip_position_m: Vector3<f64>,
    up_direction: Vector3<f64>,
    has_bodies: bool,
    base_capsules: Vec<CollisionCapsule>,
    shapes: Vec<UrdfShape>,
    unread_shapes: Vec<(String, usize)>,
    notes: Vec<UrdfNote>,
}

/// Properties of an arm that a URDF does not have.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfDrives {
    /// Gravity in the frame of the link on which the arm stands \[m/s²\]. `None` for an arm that
    /// stands upright: along −z of the root.
    pub gravity_m_s2: Option<[f64; 3]>,
    /// True if the inertias of the drives are parameters, for joints without their own key. Behind
    /// a torque sensor they are not.
    pub drive_inertia: bool,
    /// Turns of each motor per turn of each joint, a row for each motor; 1 on the diagonal for
    /// joint-side signals.
    pub gear_ratios: Vec<Vec<f64>>,
    /// Lines of a robot file's `[friction]`.
    pub friction: String,
    /// Keys of single joints, by their names: keys of a joint in a robot file, with their values as
    /// TOML.
    pub joints: BTreeMap<String, BTreeMap<String, String>>,
}

impl UrdfDrives {
    /// Returns the rows of motors that turn with their own joints only, from one ratio for each; 1
    /// for joint-side signals.
    pub fn rows_of_ratios(ratios: &[f64]) -> Vec<Vec<f64>> {
        let mut rows = vec![vec![0.0; ratios.len()]; ratios.len()];
        for (motor, ratio) in ratios.iter().enumerate() {
            rows[motor][motor] = *ratio;
        }
        rows
    }

    /// Assumes drives for inspecting an arm without configured drives: joint-side signals, drive
    /// inertias, viscous and Coulomb friction, and offsets.
    pub fn with_assumed_drives(joints: usize) -> Self {
        let sign = "sign = { model = \"tanh\", width_rad_s = 0.02 }";
        Self {
            gravity_m_s2: None,
            drive_inertia: true,
            gear_ratios: Self::rows_of_ratios(&vec![1.0; joints]),
            friction: format!("viscous = true\ncoulomb = true\noffset = true\n{sign}\n"),
            joints: BTreeMap::new(),
        }
    }
}

impl UrdfArm {
    /// Reads the arm between two links. If they are not given, the base is the only root and the
    /// tip the only end of moving joints. Its file is kept with its prefixes declared.
    ///
    /// # Errors
    /// [`UrdfError`].
    pub fn read(text: &str, base: Option<&str>, tip: Option<&str>) -> Result<Self, UrdfError> {
        let text = normalise(text);
        let file = UrdfFile::read(&text)?;
        let mut chain = file.chain(base, tip)?;
        unset_placeholders(&mut chain, GRAVITY_M_S2);
        let Chain {
            base,
            tip,
            axes,
            tip_pose,
            up_direction: up,
            has_bodies,
            base_capsules,
            shapes,
            unread_shapes,
            mut notes,
        } = chain;
        let placed = place_frames(&axes, &mut notes);
        let in_link_frame = |shape: UrdfShape| {
            let frame = placed[shape.number.saturating_sub(1)].frame();
            UrdfShape { pose: frame.pose().inverse() * shape.pose, ..shape }
        };
        let shapes = shapes.into_iter().map(in_link_frame).collect();
        let tip_position_m = tip_pose.translation.vector;
        Ok(Self {
            text,
            name: file.name,
            base,
            tip,
            axes,
            link_parameters: placed,
            tip_position_m,
            up_direction: up,
            has_bodies,
            base_capsules,
            shapes,
            unread_shapes,
            notes,
        })
    }

    /// Number of driven joints.
    pub fn joints(&self) -> usize {
        self.axes.len()
    }

    /// Returns the names of the driven joints, from base to tip.
    pub fn joint_names(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().map(|axis| axis.name.as_str())
    }

    /// Returns the names of the base and of the links that the driven joints move.
    pub fn link_names(&self) -> impl Iterator<Item = &str> {
        core::iter::once(self.base.as_str())
            .chain(self.axes.iter().map(|axis| axis.link_name.as_str()))
    }

    /// Returns the robot with the names of the links, and with the frames of the links that are
    /// fixed to the last one, in its frame.
    #[must_use]
    pub fn with_link_frames(&self, robot: Robot) -> Robot {
        let links = self.axes.iter().filter_map(|axis| axis.attached_links.first());
        let names = links.map(|link| link.name.clone()).collect();
        let last = self.axes.last().zip(self.link_parameters.last());
        let frames = last.into_iter().flat_map(|(axis, placed)| {
            let inverse = placed.frame().pose().inverse();
            let fixed = axis.attached_links.iter().filter(|link| !link.is_off_chain);
            fixed.map(move |link| {
                let pose = inverse * link.pose;
                let axis = |k: usize| pose.rotation.matrix().column(k).map(without_rounding).into();
                NamedFrame {
                    name: link.name.clone(),
                    origin_m: pose.translation.vector.map(without_rounding).into(),
                    axes: [axis(0), axis(1), axis(2)],
                }
            })
        });
        robot.with_link_names(names).with_frames(frames.collect())
    }

    /// Returns base and tip.
    pub fn base_and_tip(&self) -> [&str; 2] {
        [&self.base, &self.tip]
    }

    /// Returns the position of the tip at q = 0, in the frame of the base \[m\].
    pub fn tip_position_m(&self) -> [f64; 3] {
        self.tip_position_m.into()
    }

    /// Returns the shapes of the links, from base to tip: those for collisions, or else the visible
    /// ones.
    pub fn shapes(&self) -> &[UrdfShape] {
        &self.shapes
    }

    /// Returns the links with shapes that cannot be read, and the number of the driven joint that
    /// moves each; 0 for the base.
    pub fn unread_shapes(&self) -> &[(String, usize)] {
        &self.unread_shapes
    }

    /// Returns the pose of the link on which the arm stands in the base frame of the robot file.
    pub fn base_link_pose(&self) -> IsometryMatrix3<f64> {
        self.link_parameters[0].frame().pose().inverse()
    }

    /// Returns its notes.
    pub fn notes(&self) -> &[UrdfNote] {
        &self.notes
    }

    /// Converts a vector from the base frame of the robot file to the frame of the link on which
    /// the arm stands.
    pub fn vector_in_base_link(&self, vector: [f64; 3]) -> [f64; 3] {
        let pose = self.link_parameters[0].frame().pose();
        (pose.rotation * Vector3::from(vector)).map(without_rounding).into()
    }

    /// Converts the arm to a robot file. Its base frame is that of the first joint at q = 0, and
    /// gravity is rotated into it. Positions are those of the URDF. Bodies and friction of the URDF
    /// become nominal values if every moving link has a body.
    pub fn to_toml(&self, drives: &UrdfDrives) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = self.write(drives, &mut text);
        text
    }

    fn write(&self, drives: &UrdfDrives, out: &mut String) -> std::fmt::Result {
        let [name, base, tip] = [&self.name, &self.base, &self.tip].map(|name| single_line(name));
        writeln!(out, "# From the URDF of {name}, {base} to {tip}.")?;
        writeln!(out, "name = \"{}\"", toml_text(&name))?;
        let frame = self.link_parameters[0].frame();
        let upright = self.up_direction * -GRAVITY_M_S2;
        let in_base_link = drives.gravity_m_s2.map_or(upright, Vector3::from);
        let gravity = frame.vector_in_frame(&in_base_link).map(without_rounding);
        writeln!(out, "gravity_m_s2 = [{:?}, {:?}, {:?}]", gravity.x, gravity.y, gravity.z)?;
        write_capsules(out, "base_capsules", &self.base_capsules, frame)?;
        for (number, (axis, placed)) in self.axes.iter().zip(&self.link_parameters).enumerate() {
            let prismatic = axis.is_prismatic;
            writeln!(out, "\n[[joint]] # {}", number + 1)?;
            if !axis.name.trim().is_empty() {
                writeln!(out, "name = \"{}\"", toml_text(&axis.name))?;
            }
            writeln!(out, "type = \"{}\"", if prismatic { "prismatic" } else { "revolute" })?;
            writeln!(out, "alpha_deg = {:?}", placed.alpha_deg)?;
            writeln!(out, "d_m = {:?}", placed.d_m)?;
            writeln!(out, "theta_deg = {:?}", placed.theta_deg)?;
            writeln!(out, "r_m = {:?}", placed.r_m)?;
            let drive = drives.joints.get(&axis.name);
            let mut write_unless_configured = |key: String, value: String| match drive {
                Some(own) if own.contains_key(&key) => Ok(()),
                _ => writeln!(out, "{key} = {value}"),
            };
            write_unless_configured("drive_inertia".into(), drives.drive_inertia.to_string())?;
            let ([low, high], position, velocity, effort) = match prismatic {
                true => (axis.position, "m", "velocity_max_m_s", "force_max_n"),
                false => (
                    axis.position.map(f64::to_degrees),
                    "deg",
                    "velocity_max_rad_s",
                    "torque_max_nm",
                ),
            };
            for (end, limit) in [("min", low), ("max", high)] {
                write_unless_configured(
                    format!("position_{end}_{position}"),
                    format!("{limit:?}"),
                )?;
            }
            for (key, limit) in [(velocity, axis.velocity), (effort, axis.effort)] {
                let limit = limit.map_or("\"unknown\"".to_owned(), |most| format!("{most:?}"));
                write_unless_configured(key.to_owned(), limit)?;
            }
            let capsules: Vec<CollisionCapsule> =
                axis.attached_links.iter().flat_map(|of| &of.capsules).copied().collect();
            write_capsules(out, "capsules", &capsules, placed.frame())?;
            for (key, value) in drive.into_iter().flatten() {
                writeln!(out, "{key} = {value}")?;
            }
        }
        writeln!(out, "\n[transmission]\nrows = [")?;
        for row in &drives.gear_ratios {
            let row = row.iter().map(|ratio| format!("{ratio:?}"));
            writeln!(out, "  [{}],", row.collect::<Vec<_>>().join(", "))?;
        }
        writeln!(out, "]\n\n[friction]\n{}", drives.friction)?;
        if self.has_bodies { self.write_nominal(drives, out) } else { Ok(()) }
    }

    fn write_nominal(&self, drives: &UrdfDrives, out: &mut String) -> std::fmt::Result {
        writeln!(out, "[nominal]")?;
        let placed = self.axes.iter().zip(&self.link_parameters);
        let parameters = placed.map(|(axis, placed)| placed.parameters(axis.link_bodies()));
        let parameters = without_rounded_values(parameters.collect());
        for (number, (axis, parameters)) in self.axes.iter().zip(parameters).enumerate() {
            let number = number + 1;
            for (name, value) in LINK_PARAMETERS.iter().zip(parameters) {
                writeln!(out, "{name}{number} = {value:?}")?;
            }
            for (name, value) in ["fv", "fc"].iter().zip(axis.friction.into_iter().flatten()) {
                let term = if *name == "fv" { "viscous" } else { "coulomb" };
                let is_configured = |line: &str| line.replace(' ', "") == format!("{term}=true");
                if drives.friction.lines().any(is_configured) {
                    writeln!(out, "{name}{number} = {value:?}")?;
                }
            }
        }
        Ok(())
    }
}

/// Writes capsules, given in the base frame, in another frame. Writes nothing without capsules.
fn write_capsules(
    out: &mut String,
    key: &str,
    capsules: &[CollisionCapsule],
    frame: &Frame,
) -> std::fmt::Result {
    if capsules.is_empty() {
        return Ok(());
    }
    writeln!(out, "{key} = [")?;
    let pose = frame.pose().inverse();
    for capsule in capsules {
        let [from, to] =
            capsule.seen_from(&pose).end_points.map(|end| end.coords.map(without_rounding));
        writeln!(
            out,
            "  {{ from_m = [{:?}, {:?}, {:?}], to_m = [{:?}, {:?}, {:?}], radius_m = {:?} }},",
            from.x, from.y, from.z, to.x, to.y, to.z, capsule.radius_m
        )?;
    }
    writeln!(out, "]")
}

/// Returns a name on one line, as the content of a TOML string.
fn toml_text(name: &str) -> String {
    single_line(name).replace('\\', "\\\\").replace('"', "\\\"")
}

/// Returns a name on one line.
fn single_line(name: &str) -> String {
    name.chars().map(|of| if is_hidden(of) { ' ' } else { of }).collect()
}

/// Removes rounding errors.
fn without_rounding(value: f64) -> f64 {
    if value.abs() < 1e-13 { 0.0 } else { value }
}

/// Sets nominal values to 0 that are rounding: below this share of the largest of their kind
/// (inertia, first moment, mass) in the arm.
fn without_rounded_values(mut links: Vec<[f64; 10]>) -> Vec<[f64; 10]> {
    for kind in [0..6, 6..9, 9..10] {
        let values = links.iter().flat_map(|link| &link[kind.clone()]);
        let largest = values.fold(0.0, |largest: f64, value| largest.max(value.abs()));
        for value in links.iter_mut().flat_map(|link| &mut link[kind.clone()]) {
            if value.abs() < UrdfLimits::DEFAULT.zero_share * largest {
                *value = 0.0;
            }
        }
    }
    links
}
