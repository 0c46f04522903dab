//! The regressor: the inverse dynamic model as a matrix times the standard parameters.

use super::inertia::Wrench;
use super::model::Model;
use super::motion::Motion;
use super::pose::Pose;
use super::regressor_columns::RegressorColumns;
use super::vector::Vector3;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::robot::JointKind;
use crate::sample::FEW_JOINTS;

impl Model {
    /// Prepares these columns of the regressor, in this order, each at most once.
    pub fn regressor_columns(&self, columns: &[usize]) -> RegressorColumns {
        let parameters = self.parameter_names().len();
        RegressorColumns::new(&self.first_columns, &self.drives, parameters, columns, true)
    }

    /// Prepares the entries of the same columns that can differ from 0, one column after the other.
    pub fn regressor_entries(&self, columns: &[usize]) -> RegressorColumns {
        let parameters = self.parameter_names().len();
        RegressorColumns::new(&self.first_columns, &self.drives, parameters, columns, false)
    }

    /// Computes the matrix Y(q, q̇, q̈) with τ = Y φ: n × p, row-major, row = joint, columns as
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

    /// Computes only the selected columns of the [`regressor`](Self::regressor), n × b, row-major,
    /// or their [`entries`](RegressorColumns::entries).
    ///
    /// # Panics
    /// When a slice is not of the model's size: n entries for q, dq and ddq, and for `out` as many
    /// as the columns have; or when the columns are those of another model.
    pub fn selected_regressor<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        columns: &RegressorColumns,
        q: &[T],
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        self.check_joints(q);
        T::vectorised(
            #[inline(always)]
            || {
                self.compute_poses(ws, q);
                let loads = self.loads(&ws.poses, None, q);
                self.regressor_of_poses(ws, columns, loads.as_ref(), dq, ddq, out);
            },
        );
    }

    /// Computes the same with the poses in the workspace, and with the loads if friction grows with
    /// them.
    ///
    /// The method is virtual power. A unit velocity of joint i gives the origin of link l the
    /// velocity b and the link the angular velocity c, both in the link's frame. τ_i is the sum of
    /// c · N_l + b · F_l over the links.
    #[inline(always)]
    pub(super) fn regressor_of_poses<T: Scalar>(
        &self,
        ws: &mut Workspace<T>,
        columns: &RegressorColumns,
        loads: Option<&[T; MAX_JOINTS]>,
        dq: &[T],
        ddq: &[T],
        out: &mut [T],
    ) {
        if self.has_few_joints() {
            self.regressor_up_to::<T, FEW_JOINTS>(ws, columns, loads, [dq, ddq], out);
        } else {
            self.regressor_up_to::<T, MAX_JOINTS>(ws, columns, loads, [dq, ddq], out);
        }
    }

    /// Does so for an arm with at most `N` joints.
    #[inline(always)]
    fn regressor_up_to<T: Scalar, const N: usize>(
        &self,
        ws: &mut Workspace<T>,
        columns: &RegressorColumns,
        loads: Option<&[T; MAX_JOINTS]>,
        [dq, ddq]: [&[T]; 2],
        out: &mut [T],
    ) {
        self.check_joints(dq);
        self.check_joints(ddq);
        assert_eq!(out.len(), columns.entries.len(), "one number per entry");
        self.compute_motions(ws, columns.links.len(), dq, Some(ddq));
        let column_index =
            |row: usize, column: usize| columns.entry_positions[row * columns.width + column];
        if columns.is_matrix {
            out.fill(T::zero());
        } else {
            columns.drives.for_each_entry(|row, column| out[column_index(row, column)] = T::zero());
        }

        let mut axes = [Axis::own_of(JointKind::Revolute); N];
        for (l, wanted) in columns.links.iter().enumerate() {
            for axis in &mut axes[..l] {
                *axis = axis.to_link(&ws.poses[l]);
            }
            let kind = self.chain[l].kind;
            axes[l] = Axis::own_of(kind);
            for &(component, first) in wanted {
                let mut entry = first;
                if component < INERTIA_COMPONENTS {
                    let moment = unit_inertia_moment(component, &ws.motions[l]);
                    for axis in &axes[..l] {
                        out[entry] = axis.angular.dot(moment);
                        entry += columns.joint_stride;
                    }
                    out[entry] = match kind {
                        JointKind::Revolute => moment.z,
                        JointKind::Prismatic => T::zero(),
                    };
                } else {
                    let wrench = unit_mass_wrench(component, &ws.motions[l]);
                    for axis in &axes[..l] {
                        out[entry] = axis.angular.dot(wrench.moment);
                        if axis.moves_origin {
                            out[entry] += axis.linear.dot(wrench.force);
                        }
                        entry += columns.joint_stride;
                    }
                    out[entry] = wrench.generalised_force(kind);
                }
            }
        }
        columns.drives.for_each_inertia(ddq, |row, column, c| out[column_index(row, column)] += c);
        columns.drives.for_each_friction(dq, ws.hysteresis.as_ref(), |row, column, c| {
            out[column_index(row, column)] += c;
        });
        if let Some(loads) = loads {
            let add = |row: usize, column: usize, c: T| out[column_index(row, column)] += c;
            columns.drives.for_each_load_friction(dq, loads, add);
        }
    }
}

/// Effect of a joint's unit velocity on a link, in the link's frame.
#[derive(Clone, Copy)]
struct Axis<T> {
    /// Its angular velocity.
    angular: Vector3<T>,
    /// The velocity of its frame's origin.
    linear: Vector3<T>,
    /// True if the origin can move. Axes through the origin do not move it.
    moves_origin: bool,
}

impl<T: Scalar> Axis<T> {
    /// Creates the axis of the link's own joint.
    #[inline(always)]
    fn own_of(joint: JointKind) -> Self {
        let (zero, z) = (Vector3::zero(), Vector3::along_z(T::constant(1.0)));
        match joint {
            JointKind::Revolute => Self { angular: z, linear: zero, moves_origin: false },
            JointKind::Prismatic => Self { angular: zero, linear: z, moves_origin: true },
        }
    }

    /// Returns the axis of the same joint for the next link.
    #[inline(always)]
    fn to_link(self, pose: &Pose<T>) -> Self {
        let Self { angular, mut linear, moves_origin: mut displaced } = self;
        if pose.has_offset {
            linear = linear + angular.cross(pose.origin);
            displaced = true;
        }
        if displaced {
            linear = pose.to_link(linear);
        }
        Self { angular: pose.to_link(angular), linear, moves_origin: displaced }
    }
}

/// Number of inertia components, xx, xy, xz, yy, yz and zz, the first of a link's ten parameters.
const INERTIA_COMPONENTS: usize = 6;

/// Returns the moment N of a link with this component of J equal to 1 and all other parameters 0: J
/// ω̇ + ω × J ω (see [`Inertia::wrench`](super::inertia::Inertia::wrench)).
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

/// Returns moment N and force F of a link with one of mx, my, mz and m equal to 1 and all other
/// parameters 0: N = ms × a, F = m a + ω̇ × ms + ω × (ω × ms).
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
