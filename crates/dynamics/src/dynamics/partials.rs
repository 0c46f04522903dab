//! Derivatives of the inverse dynamics with respect to positions and velocities.
//!
//! Singh, Russo and Wensing, *Efficient Analytical Derivatives of Rigid-Body Dynamics using Spatial
//! Vector Algebra*, IEEE Robotics and Automation Letters 7, 2022. All vectors are spatial ones
//! about the base's origin, in the base's axes (Featherstone, *Rigid Body Dynamics Algorithms*, ch.
//! 2). Quantities of several links are then plain sums.

use super::inertia::{Inertia, Wrench};
use super::model::Model;
use super::vector::Vector3;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::robot::JointKind;
use crate::sample::FEW_JOINTS;

/// A spatial velocity or acceleration: the angular part, and the linear part of the body's point at
/// the base's origin.
#[derive(Clone, Copy, Debug)]
struct Twist {
    angular: Vector3<f64>,
    linear: Vector3<f64>,
}

impl Twist {
    fn zero() -> Self {
        Self { angular: Vector3::zero(), linear: Vector3::zero() }
    }

    fn plus(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }

    fn scale(self, factor: f64) -> Self {
        Self { angular: self.angular.scale(factor), linear: self.linear.scale(factor) }
    }

    /// Returns v × m: the rate of change of a motion m that moves along with v.
    fn cross(self, m: Self) -> Self {
        Self {
            angular: self.angular.cross(m.angular),
            linear: self.angular.cross(m.linear) + self.linear.cross(m.angular),
        }
    }

    /// Returns v ×* f: the rate of change of a wrench f that moves along with v.
    fn cross_wrench(self, f: Wrench<f64>) -> Wrench<f64> {
        Wrench {
            moment: self.angular.cross(f.moment) + self.linear.cross(f.force),
            force: self.angular.cross(f.force),
        }
    }

    /// Returns the power of a wrench.
    fn dot(self, f: Wrench<f64>) -> f64 {
        self.angular.dot(f.moment) + self.linear.dot(f.force)
    }
}

/// A joint's axis S_j and how it moves, with v and a of the link before:
/// Ψ̇_j = v × S_j and Ψ̈_j = a × S_j + v × Ψ̇_j.
#[derive(Clone, Copy, Debug)]
struct MovingAxis {
    axis: Twist,
    rate: Twist,
    acceleration: Twist,
}

/// Several links as one body: inertia, wrench, and rate of change of the inertia as they move.
///
/// The derivative of a link's wrench with respect to its velocity, apart from the acceleration term
/// I w − I (v × w), is 2 B w = v ×* I w − I (v × w) + w ×* (I v). For w = (c, b) it is
///
/// ```text
/// 2 B w = −2 (D c, p × c)     D = ω× P + h× u×,     P = ½ tr(J) 1 − J
/// ```
///
/// with v = (ω, u), first moments h and momentum p. Like inertia, D and p of several links add up.
#[derive(Clone, Copy, Debug)]
struct MovingBody {
    inertia: Inertia<f64>,
    wrench: Wrench<f64>,
    /// The columns of D.
    coriolis: [Vector3<f64>; 3],
    momentum: Vector3<f64>,
}

impl MovingBody {
    fn new(inertia: Inertia<f64>, velocity: Twist, acceleration: Twist) -> Self {
        let momentum = inertia_times_twist(&inertia, velocity);
        // f = I a + v ×* I v
        let wrench =
            inertia_times_twist(&inertia, acceleration).combined(velocity.cross_wrench(momentum));
        let (w, u, h) = (velocity.angular, velocity.linear, inertia.first_moment);
        // h × (u × c) = u (h·c) − (h·u) c
        let [px, py, pz] = inertia.pseudo_inertia();
        let (scaled, hu) = (|share: f64| u.scale(share), h.dot(u));
        let [mut x, mut y, mut z] =
            [w.cross(px) + scaled(h.x), w.cross(py) + scaled(h.y), w.cross(pz) + scaled(h.z)];
        x.x -= hu;
        y.y -= hu;
        z.z -= hu;
        let coriolis = [x, y, z];
        Self { inertia, wrench, coriolis, momentum: momentum.force }
    }

    fn combined(self, other: Self) -> Self {
        let [a, b, c] = self.coriolis;
        let [d, e, f] = other.coriolis;
        Self {
            inertia: self.inertia.combined(other.inertia),
            wrench: self.wrench.combined(other.wrench),
            coriolis: [a + d, b + e, c + f],
            momentum: self.momentum + other.momentum,
        }
    }

    /// Returns 2 B w.
    fn double_coriolis(&self, w: Twist) -> Wrench<f64> {
        let ([x, y, z], c) = (self.coriolis, w.angular.scale(-2.0));
        Wrench { moment: x.scale(c.x) + y.scale(c.y) + z.scale(c.z), force: self.momentum.cross(c) }
    }

    /// Returns (2 B)ᵀ s, whose force is zero.
    fn double_coriolis_transposed(&self, s: Twist) -> Vector3<f64> {
        let ([x, y, z], c) = (self.coriolis, s.angular);
        let product = Vector3::new(x.dot(c), y.dot(c), z.dot(c));
        (product + s.linear.cross(self.momentum)).scale(-2.0)
    }
}

const UNIT_VECTORS: [Vector3<f64>; 3] = [
    Vector3 { x: 1.0, y: 0.0, z: 0.0 },
    Vector3 { x: 0.0, y: 1.0, z: 0.0 },
    Vector3 { x: 0.0, y: 0.0, z: 1.0 },
];

/// Returns I w = (J c + h × b, m b − h × c) for w = (c, b).
fn inertia_times_twist(inertia: &Inertia<f64>, w: Twist) -> Wrench<f64> {
    let h = inertia.first_moment;
    Wrench {
        moment: inertia.inertia_times_vector(w.angular) + h.cross(w.linear),
        force: w.linear.scale(inertia.mass) - h.cross(w.angular),
    }
}

impl Model {
    /// Computes ∂τ/∂q and ∂τ/∂q̇ of the [`inverse_dynamics`](Self::inverse_dynamics) at constant
    /// q̈, n × n each, row-major, row = torque. A hysteresis that was set stays constant.
    ///
    /// # Panics
    /// When a slice is not of the model's size: p parameters, n entries for q, dq and ddq, n × n
    /// for each of the others.
    pub fn inverse_dynamics_partials(
        &self,
        ws: &mut Workspace<f64>,
        parameters: &[f64],
        q: &[f64],
        dq: &[f64],
        ddq: &[f64],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) {
        self.check_joints(q);
        self.compute_poses(ws, q);
        self.partials_of_poses(ws, parameters, [q, dq, ddq], by_position, by_velocity);
    }

    /// Computes the same with the poses in the workspace.
    ///
    /// With the links from m = max(i, j) outward as one body:
    ///
    /// ```text
    /// ∂τ_i/∂q_j = S_iᵀ (I Ψ̈_j + 2 B Ψ̇_j)     and S_iᵀ (S_j ×* f) besides where i ≤ j
    /// ∂τ_i/∂q̇_j = S_iᵀ (2 I Ψ̇_j + 2 B S_j)
    /// ```
    pub(super) fn partials_of_poses(
        &self,
        ws: &Workspace<f64>,
        parameters: &[f64],
        [q, dq, ddq]: [&[f64]; 3],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) {
        self.rigid_partials(ws, parameters, [q, dq, ddq], by_position, by_velocity);
        let n = self.joints();
        self.drives.for_each_friction_partial(parameters, dq, |row, column, value| {
            by_velocity[row * n + column] += value;
        });
        // Hysteresis that was set by its history does not follow from this state.
        if ws.hysteresis.is_none() {
            self.drives.for_each_sliding_partial(parameters, dq, |joint, value| {
                by_velocity[joint * n + joint] += value;
            });
        }
        self.add_load_partials(ws, parameters, [q, dq], by_position, by_velocity);
    }

    /// Computes the same without friction.
    pub(super) fn rigid_partials(
        &self,
        ws: &Workspace<f64>,
        parameters: &[f64],
        motion: [&[f64]; 3],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) {
        if self.has_few_joints() {
            self.rigid_partials_up_to::<FEW_JOINTS>(
                ws,
                parameters,
                motion,
                by_position,
                by_velocity,
            );
        } else {
            self.rigid_partials_up_to::<MAX_JOINTS>(
                ws,
                parameters,
                motion,
                by_position,
                by_velocity,
            );
        }
    }

    /// Does so for an arm with at most `N` joints.
    fn rigid_partials_up_to<const N: usize>(
        &self,
        ws: &Workspace<f64>,
        parameters: &[f64],
        [q, dq, ddq]: [&[f64]; 3],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) {
        self.assert_parameter_count(parameters);
        self.check_joints(dq);
        self.check_joints(ddq);
        let n = self.joints();
        assert!(by_position.len() == n * n && by_velocity.len() == n * n, "n × n each");
        let mut axes =
            [MovingAxis { axis: Twist::zero(), rate: Twist::zero(), acceleration: Twist::zero() };
                N];
        let mut links: [Option<MovingBody>; N] = [None; N];
        self.move_in_base(ws, parameters, [dq, ddq], &mut axes, &mut links);

        by_position.fill(0.0);
        by_velocity.fill(0.0);
        let mut outer: Option<MovingBody> = None;
        for m in (0..n).rev() {
            outer = match (links[m], outer) {
                (Some(own), Some(outer)) => Some(own.combined(outer)),
                (own, outer) => own.or(outer),
            };
            // Links without inertia have no effect.
            let Some(body) = &outer else { continue };
            let MovingAxis { axis, rate, acceleration } = axes[m];
            let transferred = axis.cross_wrench(body.wrench);
            let position = inertia_times_twist(&body.inertia, acceleration)
                .combined(body.double_coriolis(rate))
                .combined(transferred);
            let velocity = inertia_times_twist(&body.inertia, rate.scale(2.0))
                .combined(body.double_coriolis(axis));
            for (i, before) in axes[..=m].iter().enumerate() {
                by_position[i * n + m] = before.axis.dot(position);
                by_velocity[i * n + m] = before.axis.dot(velocity);
            }
            let (felt, coriolis) =
                (inertia_times_twist(&body.inertia, axis), body.double_coriolis_transposed(axis));
            for (j, before) in axes[..m].iter().enumerate() {
                by_position[m * n + j] =
                    before.acceleration.dot(felt) + before.rate.angular.dot(coriolis);
                by_velocity[m * n + j] =
                    2.0 * before.rate.dot(felt) + before.axis.angular.dot(coriolis);
            }
        }
        for (joint, (table, q)) in self.known_torques.iter().zip(q).enumerate() {
            if let Some(known_torque) = table {
                let [_, slope] = known_torque.torque_and_slope(*q);
                by_position[joint * n + joint] -= slope;
            }
        }
    }

    /// Fills the axes and the links that have inertia, from base to tip:
    /// v_j = v + S_j q̇_j and a_j = a + S_j q̈_j + v × S_j q̇_j.
    fn move_in_base<const N: usize>(
        &self,
        ws: &Workspace<f64>,
        parameters: &[f64],
        [dq, ddq]: [&[f64]; 2],
        axes: &mut [MovingAxis; N],
        links: &mut [Option<MovingBody>; N],
    ) {
        let [x, y, z] = UNIT_VECTORS;
        let (mut frame, mut origin) = ([x, y, z], Vector3::zero());
        let mut velocity = Twist::zero();
        let lifted = Vector3::constant(self.gravity_m_s2.map(|g| -g));
        let mut acceleration = Twist { angular: Vector3::zero(), linear: lifted };
        for (j, joint) in self.chain.iter().enumerate() {
            let pose = &ws.poses[j];
            let in_base =
                |v: Vector3<f64>| frame[0].scale(v.x) + frame[1].scale(v.y) + frame[2].scale(v.z);
            origin = origin + in_base(pose.origin);
            let column = |unit| in_base(pose.to_previous(unit));
            frame = [column(x), column(y), column(z)];
            let z = frame[2];
            let axis = match joint.kind {
                JointKind::Revolute => Twist { angular: z, linear: origin.cross(z) },
                JointKind::Prismatic => Twist { angular: Vector3::zero(), linear: z },
            };
            let rate = velocity.cross(axis);
            axes[j] = MovingAxis {
                axis,
                rate,
                acceleration: acceleration.cross(axis).plus(velocity.cross(rate)),
            };
            velocity = velocity.plus(axis.scale(dq[j]));
            acceleration = acceleration.plus(axis.scale(ddq[j])).plus(rate.scale(dq[j]));
            let first = self.first_columns[j];
            let has_inertia = parameters[first..first + 10].iter().any(|value| *value != 0.0);
            links[j] = has_inertia.then(|| {
                let in_base = |v: Vector3<f64>| {
                    frame[0].scale(v.x) + frame[1].scale(v.y) + frame[2].scale(v.z)
                };
                MovingBody::new(
                    self.link(parameters, j).rotated(in_base).translated(origin),
                    velocity,
                    acceleration,
                )
            });
        }
    }
}
