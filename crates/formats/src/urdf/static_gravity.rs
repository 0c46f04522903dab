//! Efforts of a file that its own weight exceeds: placeholders of exporters, and no limits.

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::chain::{Chain, ChainAxis};
use super::note::UrdfNote;

/// Number of postures. Convention: the largest torques of six joints are found to some percent.
const POSTURES: usize = 512;

/// Makes efforts unknown that do not hold the arm against gravity, and the same value of other
/// joints. A chain without bodies remains as it is.
pub(super) fn unset_placeholders(chain: &mut Chain, gravity_m_s2: f64) {
    if !chain.has_bodies {
        return;
    }
    let gravity = largest_static_torques(&chain.axes, &(chain.up_direction * -gravity_m_s2));
    let efforts: Vec<Option<f64>> = chain.axes.iter().map(|axis| axis.effort).collect();
    for effort in efforts.iter().copied().flatten() {
        let same =
            || chain.axes.iter().zip(&gravity).filter(|(axis, _)| axis.effort == Some(effort));
        let gravity = same().map(|(_, gravity)| *gravity).fold(0.0, f64::max);
        if effort < gravity {
            let names: Vec<String> = same().map(|(axis, _)| format!("`{}`", axis.name)).collect();
            let joints = names.join(" ");
            chain.notes.push(UrdfNote::PlaceholderEffort { joints, effort, gravity });
            for axis in chain.axes.iter_mut().filter(|axis| axis.effort == Some(effort)) {
                axis.effort = None;
            }
        }
    }
}

/// Returns the largest torque or force that gravity causes at each joint, over postures within the
/// limits.
fn largest_static_torques(axes: &[ChainAxis], gravity: &Vector3<f64>) -> Vec<f64> {
    let mut largest = vec![0.0_f64; axes.len()];
    for posture in 1..=POSTURES {
        let mut motion = IsometryMatrix3::identity();
        // Mass and first moment of the links on each joint, in the frame of the base.
        let mut loads = Vec::new();
        let mut axes_now = Vec::new();
        for (number, axis) in axes.iter().enumerate() {
            let from = motion * Point3::from(axis.point_on_axis);
            let direction = motion.rotation * axis.direction;
            motion *= joint_motion(axis, spread(posture, number));
            axes_now.push((from.coords, direction));
            let (mut mass, mut moment) = (0.0, Vector3::zeros());
            for body in axis.link_bodies() {
                mass += body.mass_kg;
                moment += (motion * Point3::from(body.centre_m)).coords * body.mass_kg;
            }
            loads.push((mass, moment));
        }
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for (k, axis) in axes.iter().enumerate().rev() {
            mass += loads[k].0;
            moment += loads[k].1;
            let (from, direction) = axes_now[k];
            let effort = match axis.is_prismatic {
                true => direction.dot(gravity) * mass,
                false => direction.dot(&(moment - from * mass).cross(gravity)),
            };
            largest[k] = largest[k].max(effort.abs());
        }
    }
    largest
}

/// Returns the motion of a joint from 0 to a position within its range, in the frame of the base at
/// q = 0.
fn joint_motion(axis: &ChainAxis, share: f64) -> IsometryMatrix3<f64> {
    let [low, high] = axis.position;
    let position = low + (high - low) * share;
    if axis.is_prismatic {
        let shift = Translation3::from(axis.direction * position);
        return IsometryMatrix3::from_parts(shift, Rotation3::identity());
    }
    let rotation = Rotation3::from_axis_angle(&Unit::new_normalize(axis.direction), position);
    let shift = axis.point_on_axis - rotation * axis.point_on_axis;
    IsometryMatrix3::from_parts(Translation3::from(shift), rotation)
}

/// Returns a share from 0 to 1 for each posture and joint, evenly spread (Kronecker sequence).
fn spread(posture: usize, joint: usize) -> f64 {
    (posture as f64 * (1.5 + joint as f64).sqrt()).fract()
}
