//! The regressor: the inverse dynamic model as a matrix times the standard parameters.

use super::drives::Drives;
use super::inertia::Wrench;
use super::kinematics::{Motion, Pose};
use super::vector::Vector3;
use super::{Model, Workspace};
use crate::MAX_JOINTS;
use crate::dispatch::vectorised;
use crate::robot::{JointKind, SignModel};
use crate::scalar::Scalar;

/// Which columns of the regressor are wanted, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct RegressorColumns {
    width: usize,
    /// Of each link, which of its ten parameters are wanted, and their places among the wanted.
    links: Vec<Vec<(usize, usize)>>,
    /// The drives' parameters by their places.
    drives: Drives,
    /// Joint and place of the drives' entries, which are sums.
    sums: Vec<(usize, usize)>,
}

impl RegressorColumns {
    pub(super) fn new(
        first_columns: &[usize],
        drives: &Drives,
        parameters: usize,
        wanted: &[usize],
    ) -> Self {
        let place = |column: usize| wanted.iter().position(|&other| other == column);
        let of_link = |&first: &usize| {
            (0..10).filter_map(|component| Some((component, place(first + component)?))).collect()
        };
        let mut links: Vec<Vec<_>> = first_columns.iter().map(of_link).collect();
        // Beyond the last link with wanted parameters there is nothing to do.
        while links.last().is_some_and(Vec::is_empty) {
            links.pop();
        }
        let places: Vec<_> = (0..parameters).map(place).collect();
        let drives = drives.selecting(&places);
        let mut sums = Vec::new();
        drives.for_each_entry(|row, place| sums.push((row, place)));
        Self { width: wanted.len(), links, drives, sums }
    }

    pub(super) fn set_sign_model(&mut self, sign_model: SignModel) {
        self.drives.set_sign_model(sign_model);
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }
}

impl Model {
    /// These columns of the regressor, in this order, each at most once.
    pub fn regressor_columns(&self, columns: &[usize]) -> RegressorColumns {
        let parameters = self.parameter_names().len();
        RegressorColumns::new(&self.first_columns, &self.drives, parameters, columns)
    }

    /// The matrix Y(q, q̇, q̈) with τ = Y φ: n × p, row-major, row = joint, columns as
    /// [`parameter_names`](Self::parameter_names).
    ///
    /// # Panics
    /// When a slice is not of the model's size: n entries for q, dq and ddq, n × p for `out`.
    pub fn regressor<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        q: &[T],
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        self.selected_regressor(ws, &self.all_columns, q, dq, ddq, out);
    }

    /// The wanted columns of the [`regressor`](Self::regressor) alone, n × b, row-major.
    ///
    /// # Panics
    /// When a slice is not of the model's size: n entries for q, dq and ddq, n × b for `out`; or
    /// when the columns are those of another model.
    pub fn selected_regressor<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        columns: &RegressorColumns,
        q: &[T],
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        out.fill(T::zero());
        self.renew_regressor(ws, columns, q, dq, ddq, out);
    }

    /// The [`selected_regressor`](Self::selected_regressor) in place of another one of the same
    /// columns, or of zeros: what is always 0 is not written again.
    pub(crate) fn renew_regressor<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        columns: &RegressorColumns,
        q: &[T],
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        self.check_joints(q);
        vectorised(
            #[inline(always)]
            || {
                self.place(ws, q);
                self.regressor_of_poses(ws, columns, dq, ddq, out);
            },
        );
    }

    /// [`renew_regressor`](Self::renew_regressor) with the poses in the workspace.
    ///
    /// By virtual power: a unit velocity of joint i moves the origin of link l with b and turns
    /// the link with c, both in the link's frame, and τ_i is the sum over the links of
    /// c · N_l + b · F_l.
    #[inline(always)]
    pub(super) fn regressor_of_poses<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        columns: &RegressorColumns,
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        self.check_joints(dq);
        self.check_joints(ddq);
        let width = columns.width;
        assert_eq!(out.len(), self.joints() * width, "one row per joint, one column per parameter");
        self.propagate(ws, columns.links.len(), dq, Some(ddq));

        let mut axes = [Axis::own(JointKind::Revolute); MAX_JOINTS];
        for (l, wanted) in columns.links.iter().enumerate() {
            for axis in &mut axes[..l] {
                *axis = axis.to_link(&ws.poses[l]);
            }
            let kind = self.chain[l].kind;
            axes[l] = Axis::own(kind);
            for &(component, place) in wanted {
                let entries = out[place..].iter_mut().step_by(width);
                let rows = entries.zip(&axes[..l]);
                if component < INERTIA_COMPONENTS {
                    let moment = unit_inertia_moment(component, &ws.motions[l]);
                    for (entry, axis) in rows {
                        *entry = axis.turn.dot(moment);
                    }
                    if kind == JointKind::Revolute {
                        out[l * width + place] = moment.z;
                    }
                } else {
                    let wrench = unit_mass_wrench(component, &ws.motions[l]);
                    for (entry, axis) in rows {
                        *entry = axis.turn.dot(wrench.moment);
                        if axis.displaced {
                            *entry += axis.shift.dot(wrench.force);
                        }
                    }
                    out[l * width + place] = wrench.along(kind);
                }
            }
        }
        for &(row, place) in &columns.sums {
            out[row * width + place] = T::zero();
        }
        columns.drives.for_each_inertia(ddq, |row, place, c| out[row * width + place] += c);
        columns.drives.for_each_friction(dq, |row, place, c| out[row * width + place] += c);
    }

    /// Which entries of the regressor can differ from 0, in its layout: a joint feels only what
    /// hangs on it, and the drives that act on it.
    pub fn regressor_pattern(&self) -> Vec<bool> {
        let (n, width) = (self.joints(), self.parameter_names().len());
        let mut pattern = vec![false; n * width];
        for (link, &first) in self.first_columns.iter().enumerate() {
            for row in pattern.chunks_mut(width).take(link + 1) {
                row[first..first + 10].fill(true);
            }
        }
        self.drives.for_each_entry(|row, column| pattern[row * width + column] = true);
        pattern
    }
}

/// What a unit velocity of a joint does to a link, in the link's frame.
#[derive(Clone, Copy)]
struct Axis<T> {
    /// How the link turns.
    turn: Vector3<T>,
    /// How the origin of its frame moves.
    shift: Vector3<T>,
    /// Whether the origin can move at all: axes that meet in it do not move it.
    displaced: bool,
}

impl<T: Scalar> Axis<T> {
    /// Of the link's own joint.
    #[inline(always)]
    fn own(joint: JointKind) -> Self {
        let (zero, z) = (Vector3::zero(), Vector3::along_z(T::constant(1.0)));
        match joint {
            JointKind::Revolute => Self { turn: z, shift: zero, displaced: false },
            JointKind::Prismatic => Self { turn: zero, shift: z, displaced: true },
        }
    }

    /// The same joint and the next link.
    #[inline(always)]
    fn to_link(self, pose: &Pose<T>) -> Self {
        let Self { turn, mut shift, mut displaced } = self;
        if pose.shifted {
            shift = shift + turn.cross(pose.origin);
            displaced = true;
        }
        if displaced {
            shift = pose.to_link(shift);
        }
        Self { turn: pose.to_link(turn), shift, displaced }
    }
}

/// xx, xy, xz, yy, yz and zz come first of a link's ten parameters.
const INERTIA_COMPONENTS: usize = 6;

/// N of a link whose only parameter is this component of J, 1: J ω̇ + ω × J ω
/// (see [`Inertia::wrench`](super::inertia::Inertia::wrench)).
#[inline(always)]
fn unit_inertia_moment<T: Scalar>(component: usize, motion: &Motion<T>) -> Vector3<T> {
    let Motion { angular_velocity: w, angular_acceleration: dw, .. } = *motion;
    match component {
        0 => Vector3::new(dw.x, w.z * w.x, -(w.y * w.x)),
        1 => Vector3::new(dw.y - w.z * w.x, dw.x + w.z * w.y, w.x * w.x - w.y * w.y),
        2 => Vector3::new(dw.z + w.y * w.x, w.z * w.z - w.x * w.x, dw.x - w.y * w.z),
        3 => Vector3::new(-(w.z * w.y), dw.y, w.x * w.y),
        4 => Vector3::new(w.y * w.y - w.z * w.z, dw.z - w.x * w.y, dw.y + w.x * w.z),
        _ => Vector3::new(w.y * w.z, -(w.x * w.z), dw.z),
    }
}

/// N and F of a link whose only parameter is mx, my, mz or m, 1:
/// N = ms × a, F = m a + ω̇ × ms + ω × (ω × ms).
#[inline(always)]
fn unit_mass_wrench<T: Scalar>(component: usize, motion: &Motion<T>) -> Wrench<T> {
    let Motion { angular_velocity: w, angular_acceleration: dw, acceleration: a } = *motion;
    let zero = T::zero();
    let (moment, force) = match component {
        6 => (
            Vector3::new(zero, -a.z, a.y),
            Vector3::new(-(w.y * w.y) - w.z * w.z, dw.z + w.y * w.x, w.z * w.x - dw.y),
        ),
        7 => (
            Vector3::new(a.z, zero, -a.x),
            Vector3::new(w.x * w.y - dw.z, -(w.z * w.z) - w.x * w.x, dw.x + w.z * w.y),
        ),
        8 => (
            Vector3::new(-a.y, a.x, zero),
            Vector3::new(dw.y + w.x * w.z, w.y * w.z - dw.x, -(w.x * w.x) - w.y * w.y),
        ),
        _ => (Vector3::zero(), a),
    };
    Wrench { force, moment }
}
