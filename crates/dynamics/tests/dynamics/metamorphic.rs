//! What a change of the robot must do to its torques.

use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::{JointKind, ParameterKind, Robot};

use super::arms::{Design, Random, difference, inverse};

const ROBOTS: u64 = 200;

/// A random arm whose joints have drives but no couplings and no friction.
fn plain(random: &mut Random) -> Design {
    let mut design = Design::random(random);
    for (i, row) in design.rows.iter_mut().enumerate() {
        row.iter_mut().enumerate().filter(|(j, _)| *j != i).for_each(|(_, entry)| *entry = 0.0);
    }
    design.friction = [false; 3];
    design.own_friction.fill(None);
    design
}

fn kind(robot: &Robot, joint: usize) -> JointKind {
    robot.chain()[joint].kind
}

/// Torques of both robots in corresponding states; `change` maps a standard parameter's value,
/// `motion` and `torque` a joint's motion and torque, from the first robot to the second.
fn compare(
    random: &mut Random,
    (first, second): (&Robot, &Robot),
    change: impl Fn(ParameterKind, JointKind) -> f64,
    motion: impl Fn(JointKind) -> f64,
    torque: impl Fn(JointKind) -> f64,
) {
    let n = first.joints();
    let parameters = random.vector(first.parameters().names().len(), 1.0);
    let changed: Vec<f64> = first
        .parameters()
        .parameters()
        .iter()
        .zip(&parameters)
        .map(|(parameter, value)| {
            value * change(parameter.kind, kind(first, parameter.joint.position()))
        })
        .collect();
    let map = |x: &[f64], factor: &dyn Fn(JointKind) -> f64| -> Vec<f64> {
        x.iter().enumerate().map(|(j, x)| x * factor(kind(first, j))).collect()
    };
    let [q, dq, ddq] = [3.0, 4.0, 9.0].map(|size| random.vector(n, size));
    let expected = map(&inverse(&Model::new(first), &parameters, &q, &dq, &ddq), &torque);
    let [q, dq, ddq] = [q, dq, ddq].map(|x| map(&x, &motion));
    let torques = inverse(&Model::new(second), &changed, &q, &dq, &ddq);
    assert!(difference(&torques, &expected) < 1e-11);
}

#[test]
fn a_mirrored_robot_mirrors_its_parameters() {
    use ParameterKind::{Mz, Xz, Yz};

    // The mirror z → −z in every frame turns α and r around, and what changes sign with z.
    for seed in 0..ROBOTS {
        let mut random = Random(seed);
        let design = plain(&mut random);
        let mut mirrored = design.clone();
        mirrored.gravity[2] *= -1.0;
        for (_, [alpha, _, _, r], _) in &mut mirrored.joints {
            (*alpha, *r) = (-*alpha, -*r);
        }
        let slides = |kind| if kind == JointKind::Prismatic { -1.0 } else { 1.0 };
        let change = |kind, _| if matches!(kind, Xz | Yz | Mz) { -1.0 } else { 1.0 };
        compare(&mut random, (&design.robot(), &mirrored.robot()), change, slides, slides);
    }
}

#[test]
fn lengths_in_another_unit_change_the_figures_by_their_dimension() {
    use ParameterKind::{Ia, M, Mx, My, Mz};

    const UNIT: f64 = 2.5;
    for seed in 0..ROBOTS {
        let mut random = Random(seed);
        let design = plain(&mut random);
        let mut scaled = design.clone();
        scaled.gravity = scaled.gravity.map(|g| g * UNIT);
        for (_, [_, d, _, r], _) in &mut scaled.joints {
            (*d, *r) = (*d * UNIT, *r * UNIT);
        }
        let change = |parameter, joint| match (parameter, joint) {
            (M, _) | (Ia, JointKind::Prismatic) => 1.0,
            (Mx | My | Mz, _) => UNIT,
            _ => UNIT * UNIT,
        };
        let slides = |kind| if kind == JointKind::Prismatic { UNIT } else { 1.0 };
        // A force is one length shorter than a torque.
        let torque = |kind| if kind == JointKind::Prismatic { UNIT } else { UNIT * UNIT };
        compare(&mut random, (&design.robot(), &scaled.robot()), change, slides, torque);
    }
}

#[test]
fn a_turned_base_with_turned_gravity_changes_nothing() {
    // Turning the whole cell about the base's x axis adds to α of the first joint.
    for seed in 0..ROBOTS {
        let mut random = Random(seed);
        let design = plain(&mut random);
        let mut rotated = design.clone();
        let angle = random.uniform(-180.0, 180.0);
        rotated.joints[0].1[0] += angle;
        let ((sin, cos), [x, y, z]) = (angle.to_radians().sin_cos(), design.gravity);
        rotated.gravity = [x, cos * y - sin * z, sin * y + cos * z];
        let same = |_| 1.0;
        compare(&mut random, (&design.robot(), &rotated.robot()), |_, _| 1.0, same, same);
    }
}
