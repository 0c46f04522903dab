//! Link frames in the base frame.

use super::Model;
use super::pose::Pose;
use super::vector::Vector3;
use crate::robot::Joint;

/// Frame of a link in that of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkFrame {
    /// Its origin \[m\].
    pub origin_m: [f64; 3],
    /// Its x, y and z axes; z is the joint's axis.
    pub axes: [[f64; 3]; 3],
}

impl Model {
    /// Returns the frames of all links at joint positions \[rad or m\], from the first; missing
    /// positions are 0.
    pub fn link_frames(&self, q: &[f64]) -> Vec<LinkFrame> {
        let poses: Vec<Pose<f64>> = self
            .chain
            .iter()
            .enumerate()
            .map(|(index, joint): (usize, &Joint)| {
                let q: f64 = q.get(index).copied().unwrap_or(0.0);
                Pose::new(joint, q, q.sin_cos())
            })
            .collect();
        (1..=poses.len()).map(|links| LinkFrame::of_last(&poses[..links])).collect()
    }
}

impl LinkFrame {
    fn of_last(poses: &[Pose<f64>]) -> Self {
        let vector = |v: Vector3<f64>| [v.x, v.y, v.z];
        let inward = || poses.iter().rev();
        let axis =
            |unit| vector(inward().fold(Vector3::constant(unit), |v, pose| pose.to_previous(v)));
        let origin = inward().fold(Vector3::zero(), |v, pose| pose.to_previous(v) + pose.origin);
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(axis);
        Self { origin_m: vector(origin), axes }
    }
}
