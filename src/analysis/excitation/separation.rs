//! Collision checks of a designed motion: the bodies of the links, the floor and the box.

use std::path::{Path, PathBuf};

use didim_dynamics::robot::Robot;
use didim_formats::{MeshFolders, UrdfArm};
use didim_identification::excitation::{Corners, Shapes, Wall, WallKind};
use nalgebra::{IsometryMatrix3, Vector3};

use super::hulls::{UnreadShape, nearest_points, read_bodies};

/// The plane below an arm, normal to z of its base.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Floor {
    /// The plane on which a URDF's arm is mounted, through the origin of its base link. A robot
    /// file does not say where that is.
    #[default]
    Mounting,
    /// A plane at this height in the frame of the base \[m\].
    Height(f64),
    /// None.
    Missing,
}

/// Requested collision checks.
#[derive(Clone, Copy, Debug, Default)]
pub struct RequestedChecks<'a> {
    /// Box in the frame of the base that the arm stays in \[m\].
    pub box_corners: Option<Corners>,
    /// The plane that the arm stays above.
    pub floor: Floor,
    /// Folders in which the meshes of a URDF are searched, before those above it.
    pub package_folders: &'a [PathBuf],
}

impl RequestedChecks<'_> {
    /// Returns true if the request has no answer without bodies.
    pub(super) fn needs_shapes(&self) -> bool {
        self.box_corners.is_some() || matches!(self.floor, Floor::Height(_))
    }

    /// Returns the walls in the frame of the base of the robot file, in which the frame that people
    /// know has this pose.
    fn walls(&self, pose: &IsometryMatrix3<f64>, is_urdf: bool) -> Vec<Wall> {
        let height_m = match self.floor {
            Floor::Mounting => is_urdf.then_some(0.0),
            Floor::Height(height_m) => Some(height_m),
            Floor::Missing => None,
        };
        let floor = |offset_m| Wall { kind: WallKind::Floor, normal: [0.0, 0.0, 1.0], offset_m };
        let sides = self.box_corners.into_iter().flat_map(Wall::sides);
        let walls = height_m.map(floor).into_iter().chain(sides);
        let placed = walls.map(|Wall { kind, normal, offset_m }| {
            let normal = pose.rotation * Vector3::from(normal);
            let offset_m = offset_m + normal.dot(&pose.translation.vector);
            Wall { kind, normal: normal.into(), offset_m }
        });
        placed.collect()
    }
}

/// Coverage of the collision check of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckedLinks {
    /// Name of each link, first that of the base.
    pub names: Vec<String>,
    /// Shapes of a URDF that are not checked.
    pub unread: Vec<UnreadShape>,
    /// The plane below the arm.
    pub floor: Floor,
    /// True if the arm is described by a URDF.
    pub is_urdf: bool,
}

impl CheckedLinks {
    /// Returns true if all shapes of a link are read.
    pub fn is_read(&self, number: usize) -> bool {
        self.unread.iter().all(|of| of.number != number)
    }
}

/// Creates the shapes that must not collide, from a URDF and its meshes or from a robot file;
/// `None` if neither has one.
pub(super) fn separated_shapes(
    (robot, urdf): (&Robot, Option<&UrdfArm>),
    file: &Path,
    checks: &RequestedChecks<'_>,
    reference: &[f64],
) -> (Option<Shapes>, CheckedLinks) {
    let numbers = 1..=robot.joints();
    let Some(arm) = urdf else {
        let walls = checks.walls(&IsometryMatrix3::identity(), false);
        let names = numbers.map(|number| format!("link {number}"));
        let names = core::iter::once("the base".to_owned()).chain(names).collect();
        let links = CheckedLinks { names, unread: vec![], floor: checks.floor, is_urdf: false };
        return (Shapes::new(robot, &walls), links);
    };
    let (solids, unread) = read_bodies(arm, &MeshFolders::new(file, checks.package_folders));
    let walls = checks.walls(&arm.base_link_pose(), true);
    let shapes = Shapes::of_solids(robot, solids, nearest_points, &walls, reference);
    let names = arm.link_names().map(str::to_owned).collect();
    (shapes, CheckedLinks { names, unread, floor: checks.floor, is_urdf: true })
}
