//! Composite bodies: all links from the tip to a link as one body.

use super::inertia::{Inertia, Wrench};
use super::pose::Pose;
use super::vector::Vector3;
use crate::numeric::Scalar;
use crate::robot::JointKind;

/// Links from the tip to link j: their composite body, and the wrench for a unit acceleration of
/// each of their joints alone, in the frame of link j. There is room for `N` joints.
pub(super) struct OuterLinks<T, const N: usize> {
    body: Option<Inertia<T>>,
    unit_wrenches: [Wrench<T>; N],
    /// Number of links from the base.
    link_count: usize,
}

impl<T: Scalar, const N: usize> OuterLinks<T, N> {
    #[inline(always)]
    pub(super) fn empty() -> Self {
        Self { body: None, unit_wrenches: [Wrench::zero(); N], link_count: 0 }
    }

    /// Adds link j, the one before the present links.
    #[inline(always)]
    pub(super) fn add_link(
        &mut self,
        link: Inertia<T>,
        joint: JointKind,
        poses: &[Pose<T>],
        j: usize,
    ) {
        let subtree = match self.body {
            None => {
                self.link_count = j + 1;
                link
            }
            Some(body) => {
                let pose = &poses[j + 1];
                for wrench in &mut self.unit_wrenches[j + 1..self.link_count] {
                    *wrench = wrench.to_previous(pose);
                }
                link.combined(body.to_previous(pose))
            }
        };
        self.unit_wrenches[j] = unit_wrench(&subtree, joint);
        self.body = Some(subtree);
    }

    /// Returns the joints from j on, each with its wrench.
    #[inline(always)]
    pub(super) fn unit_wrenches(&self, j: usize) -> impl Iterator<Item = (usize, &Wrench<T>)> {
        self.unit_wrenches[..self.link_count].iter().enumerate().skip(j)
    }
}

/// Returns the wrench for a unit acceleration along or about z of a body at rest: revolute F = z ×
/// ms, N = J z; prismatic F = m z, N = ms × z.
#[inline(always)]
fn unit_wrench<T: Scalar>(body: &Inertia<T>, kind: JointKind) -> Wrench<T> {
    let Vector3 { x, y, .. } = body.first_moment;
    match kind {
        JointKind::Revolute => {
            Wrench { force: Vector3::new(-y, x, T::zero()), moment: body.about_z() }
        }
        JointKind::Prismatic => {
            Wrench { force: Vector3::along_z(body.mass), moment: Vector3::new(y, -x, T::zero()) }
        }
    }
}
