//! The inverse dynamic model of the links in its plainest form: dense spatial matrices, as in
//! Featherstone's textbook (*Rigid Body Dynamics Algorithms*, table 5.1), with nothing left out
//! that is 0. What the fast kernels are held to.

use didim_dynamics::robot::{Joint, JointIndex, JointKind, ParameterKind, Robot};
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};

/// v×
fn cross(v: Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

fn blocks(a: Matrix3<f64>, b: Matrix3<f64>, c: Matrix3<f64>, d: Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&a);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&b);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&c);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&d);
    matrix
}

/// Motion vectors (angular, linear) of the previous link, in the frame of the link.
fn transform(joint: &Joint, q: f64) -> Matrix6<f64> {
    let (turn, slide) = match joint.kind {
        JointKind::Revolute => (q, 0.0),
        JointKind::Prismatic => (0.0, q),
    };
    let alpha = joint.alpha.sin.atan2(joint.alpha.cos);
    let theta = joint.theta.sin.atan2(joint.theta.cos) + turn;
    let about_x = Rotation3::from_axis_angle(&Vector3::x_axis(), alpha);
    let rotation = (about_x * Rotation3::from_axis_angle(&Vector3::z_axis(), theta)).transpose();
    let origin =
        Vector3::new(joint.d_m, 0.0, 0.0) + about_x * Vector3::new(0.0, 0.0, joint.r_m + slide);
    let e = rotation.into_inner();
    blocks(e, Matrix3::zeros(), -e * cross(origin), e)
}

fn inertia(p: &[f64]) -> Matrix6<f64> {
    let about_origin = Matrix3::new(p[0], p[1], p[2], p[1], p[3], p[4], p[2], p[4], p[5]);
    let first = cross(Vector3::new(p[6], p[7], p[8]));
    blocks(about_origin, first, -first, Matrix3::identity() * p[9])
}

/// Torques of the links alone, without drives, friction and offsets.
pub(crate) fn link_torques(
    robot: &Robot,
    parameters: &[f64],
    gravity_m_s2: [f64; 3],
    [q, dq, ddq]: [&[f64]; 3],
) -> Vec<f64> {
    let n = robot.joints();
    let mut velocity = Vector6::zeros();
    let mut acceleration = Vector6::zeros();
    acceleration.fixed_rows_mut::<3>(3).copy_from(&-Vector3::from(gravity_m_s2));
    let (mut transforms, mut axes, mut wrenches) = (Vec::new(), Vec::new(), Vec::new());
    for (j, joint) in robot.chain().iter().enumerate() {
        let x = transform(joint, q[j]);
        let mut axis = Vector6::zeros();
        axis[if joint.kind == JointKind::Revolute { 2 } else { 5 }] = 1.0;
        velocity = x * velocity + axis * dq[j];
        let (w, u) = (velocity.fixed_rows::<3>(0).into(), velocity.fixed_rows::<3>(3).into());
        let matrix = blocks(cross(w), Matrix3::zeros(), cross(u), cross(w));
        acceleration = x * acceleration + axis * ddq[j] + matrix * axis * dq[j];
        let first = robot.parameters().column(ParameterKind::Xx, JointIndex::new(j)).unwrap();
        let body = inertia(&parameters[first..first + 10]);
        wrenches.push(body * acceleration - matrix.transpose() * (body * velocity));
        transforms.push(x);
        axes.push(axis);
    }
    let mut torques = vec![0.0; n];
    for j in (0..n).rev() {
        torques[j] = axes[j].dot(&wrenches[j]);
        if j > 0 {
            let velocity_matrix = transforms[j].transpose() * wrenches[j];
            wrenches[j - 1] += velocity_matrix;
        }
    }
    torques
}
