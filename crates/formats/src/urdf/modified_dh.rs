//! Conversion of arbitrary axes to modified Denavit–Hartenberg parameters (Khalil and Dombre,
//! *Modeling, Identification and Control of Robots*, ch. 3): x of each frame along the common
//! normal to the next axis.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::chain::ChainAxis;
use super::file::Body;
use super::limits::UrdfLimits;
use super::note::UrdfNote;

/// Rounding error of an angle.
const ROUNDING: f64 = 1e-14;

/// A joint in modified Denavit–Hartenberg parameters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlacedJoint {
    pub(super) alpha_deg: f64,
    pub(super) d_m: f64,
    pub(super) theta_deg: f64,
    pub(super) r_m: f64,
    frame: Frame,
}

/// A frame at q = 0, in that of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) origin: Vector3<f64>,
    pub(super) x: Vector3<f64>,
    pub(super) z: Vector3<f64>,
}

impl Frame {
    /// Returns the pose of this frame in that of the base.
    pub(super) fn pose(&self) -> IsometryMatrix3<f64> {
        let rotation = Rotation3::from_matrix_unchecked(self.rows().transpose());
        IsometryMatrix3::from_parts(Translation3::from(self.origin), rotation)
    }

    /// Converts a vector from the frame of the base to this one.
    pub(super) fn vector_in_frame(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.rows() * vector
    }

    fn rows(&self) -> Matrix3<f64> {
        let y = self.z.cross(&self.x);
        Matrix3::from_rows(&[self.x.transpose(), y.transpose(), self.z.transpose()])
    }
}

impl PlacedJoint {
    /// Its frame at q = 0.
    pub(super) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Returns the inertia about the frame's origin, first moments and mass of bodies together, as
    /// xx xy xz yy yz zz mx my mz m.
    pub(super) fn parameters<'a>(&self, link_bodies: impl Iterator<Item = &'a Body>) -> [f64; 10] {
        let rows = self.frame.rows();
        let (mut inertia, mut moment, mut mass) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for body in link_bodies {
            let centre = rows * (body.centre_m - self.frame.origin);
            let about = Matrix3::identity() * centre.norm_squared() - centre * centre.transpose();
            inertia += rows * body.inertia_kg_m2 * rows.transpose() + about * body.mass_kg;
            moment += centre * body.mass_kg;
            mass += body.mass_kg;
        }
        let j = inertia;
        let [mx, my, mz] = moment.into();
        [j[(0, 0)], j[(0, 1)], j[(0, 2)], j[(1, 1)], j[(1, 2)], j[(2, 2)], mx, my, mz, mass]
    }
}

/// Places the frames of all joints. The base's own frame is the first joint's at q = 0.
pub(super) fn place_frames(axes: &[ChainAxis], notes: &mut Vec<UrdfNote>) -> Vec<PlacedJoint> {
    let axes = &align_parallel_axes(axes.to_vec(), notes);
    let mut placed: Vec<PlacedJoint> = Vec::new();
    for (i, axis) in axes.iter().enumerate() {
        let z = axis.direction;
        // Point where the previous x axis meets this axis, and that x axis, which is normal to
        // both.
        let (foot, before) = match placed.last() {
            None => (axis.point_on_axis, normal_to(&z)),
            Some(previous) => {
                let origin_of = previous.frame();
                (
                    common_normal_foot(axis, &origin_of.origin, &origin_of.x, &origin_of.z),
                    origin_of.x,
                )
            }
        };
        let (origin, x) = match axes.get(i + 1) {
            None => (foot, before),
            Some(next) => common_normal(axis, next, foot, before),
        };
        let frame = Frame { origin, x, z };
        let first = PlacedJoint { alpha_deg: 0.0, d_m: 0.0, theta_deg: 0.0, r_m: 0.0, frame };
        let Some(PlacedJoint { frame: from, .. }) = placed.last() else {
            placed.push(first);
            continue;
        };
        let alpha = from.z.cross(&z).dot(&from.x).atan2(from.z.dot(&z));
        let theta = before.cross(&x).dot(&z).atan2(before.dot(&x));
        let offsets = [(foot - from.origin).dot(&from.x), (origin - foot).dot(&z)];
        let [d_m, r_m] = offsets.map(|length_m| clean_length(length_m, &axis.name, notes));
        let (alpha_deg, theta_deg) = (clean_degrees(alpha), clean_degrees(theta));
        let joint = PlacedJoint { alpha_deg, d_m, theta_deg, r_m, frame };
        placed.push(joint);
    }
    placed
}

/// Makes each axis parallel to the previous one where it nearly is, and notes angles with too few
/// digits.
fn align_parallel_axes(mut axes: Vec<ChainAxis>, notes: &mut Vec<UrdfNote>) -> Vec<ChainAxis> {
    for k in 1..axes.len() {
        let before = axes[k - 1].direction;
        let sine = before.cross(&axes[k].direction).norm();
        if sine < UrdfLimits::DEFAULT.parallel_sine {
            if sine > UrdfLimits::DEFAULT.noted_angle_rad {
                let joint = axes[k].name.clone();
                notes.push(UrdfNote::NearlyParallel { joint, angle_rad: sine });
            }
            axes[k].direction = before * before.dot(&axes[k].direction).signum();
        }
        let from_right = before.dot(&axes[k].direction).abs();
        let angle_rad = [sine, from_right].into_iter().fold(f64::INFINITY, f64::min);
        let is_near = (UrdfLimits::DEFAULT.noted_angle_rad..UrdfLimits::DEFAULT.rough_angle_rad)
            .contains(&angle_rad);
        if let (true, Some(text)) = (is_near, axes[k].rough_angle.take()) {
            notes.push(UrdfNote::RoughAngle { joint: axes[k].name.clone(), text, angle_rad });
        }
    }
    axes
}

/// Returns the foot of a common normal: the point of an axis where the normal meets it that leaves
/// another axis at `origin` along `x`.
fn common_normal_foot(
    axis: &ChainAxis,
    origin: &Vector3<f64>,
    x: &Vector3<f64>,
    z: &Vector3<f64>,
) -> Vector3<f64> {
    // In the projection along x both axes intersect there. For parallel axes the point is level
    // with the origin.
    let offset = origin - axis.point_on_axis;
    let across = z.cross(x);
    let sine = axis.direction.dot(&across);
    let along = match sine.abs() < UrdfLimits::DEFAULT.parallel_sine {
        true => offset.dot(&axis.direction),
        false => offset.dot(&across) / sine,
    };
    axis.point_on_axis + axis.direction * along
}

/// Returns the origin and the direction of x of this axis' frame.
fn common_normal(
    axis: &ChainAxis,
    next: &ChainAxis,
    foot: Vector3<f64>,
    before: Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let z = axis.direction;
    let cross = z.cross(&next.direction);
    let sine = cross.norm();
    let offset = next.point_on_axis - foot;
    if sine < UrdfLimits::DEFAULT.parallel_sine {
        let across = offset - z * offset.dot(&z);
        let x = if across.norm() > UrdfLimits::DEFAULT.zero_length_m {
            across.normalize()
        } else {
            before
        };
        return (foot, (x - z * x.dot(&z)).normalize());
    }
    let x = cross / sine;
    // next.point + b next.direction = foot + a z + d x
    let along = offset.cross(&next.direction).dot(&cross) / (sine * sine);
    let origin = foot + z * along;
    let d = offset.dot(&x);
    // The normal points away from this axis. If the axes intersect, the smaller rotation is chosen.
    let backwards = if d.abs() > UrdfLimits::DEFAULT.zero_length_m {
        d < 0.0
    } else {
        x.dot(&before) < -ROUNDING
    };
    (origin, if backwards { -x } else { x })
}

/// Returns a direction normal to another, nearest to x of the base, or to y if the other is along
/// x.
fn normal_to(z: &Vector3<f64>) -> Vector3<f64> {
    let projected = |axis: Vector3<f64>| axis - z * axis.dot(z);
    let x = projected(Vector3::x());
    if x.norm() > 0.1 { x.normalize() } else { projected(Vector3::y()).normalize() }
}

/// Removes rounding errors from quarter turns.
fn clean_degrees(angle_rad: f64) -> f64 {
    let quarters = (angle_rad / core::f64::consts::FRAC_PI_2).round();
    if (angle_rad - quarters * core::f64::consts::FRAC_PI_2).abs() < ROUNDING {
        return 90.0 * quarters + 0.0;
    }
    angle_rad.to_degrees()
}

/// Returns 0 for an offset that is too small for a part of a robot, with a note.
fn clean_length(length_m: f64, joint: &str, notes: &mut Vec<UrdfNote>) -> f64 {
    if length_m.abs() >= UrdfLimits::DEFAULT.zero_length_m {
        return length_m;
    }
    if length_m.abs() > UrdfLimits::DEFAULT.noted_length_m {
        notes.push(UrdfNote::ZeroLength { joint: joint.to_owned(), length_m });
    }
    0.0
}
