//! The TX40 against closed forms and figures found independently.

use didim_dynamics::dynamics::{BaseParameters, Model, NotPositiveDefinite, Workspace};
use didim_dynamics::robot::{JointIndex, Robot};
use nalgebra::{DMatrix, Matrix4, Vector4};

use super::arms::{Random, difference, inverse, mass_matrix, tx40, tx40_physical};

const G: f64 = 9.81;

fn parameters(robot: &Robot, values: &[(&str, f64)]) -> Vec<f64> {
    let mut parameters = vec![0.0; robot.parameters().names().len()];
    for (name, value) in values {
        parameters[robot.parameters().find(name).unwrap()] = *value;
    }
    parameters
}

#[test]
fn gravity_torques_of_shoulder_and_elbow_by_hand() {
    // x of link 2 points up at q2 = 0, and y of link 3 down: the potential energy is
    // g (mx2 cos q2 − my3 cos(q2 + q3)).
    let robot = tx40();
    let model = Model::new(&robot);
    let parameters = parameters(&robot, &[("mx2r", 2.21), ("my3r", -0.6)]);
    let mut random = Random(1);
    for _ in 0..100 {
        let q = random.vector(6, 3.0);
        let elbow = G * -0.6 * (q[1] + q[2]).sin();
        let shoulder = elbow - G * 2.21 * q[1].sin();
        let tau = inverse(&model, &parameters, &q, &[0.0; 6], &[0.0; 6]);
        assert!(difference(&tau, &[0.0, shoulder, elbow, 0.0, 0.0, 0.0]) < 1e-13);
    }
}

/// Potential energy from homogeneous transforms written out with angles in radians.
fn potential_energy(parameters: &[f64], q: &[f64]) -> f64 {
    use core::f64::consts::{FRAC_PI_2 as H, PI};
    let geometry = [
        (0.0, 0.0, 0.0, 0.32),
        (-H, 0.0, -H, 0.0),
        (0.0, 0.225, H, 0.035),
        (H, 0.0, 0.0, 0.225),
        (-H, 0.0, 0.0, 0.0),
        (H, 0.0, PI, 0.0),
    ];
    let mut base = Matrix4::identity();
    let mut energy = 0.0;
    for (j, (alpha, d, theta, r)) in geometry.into_iter().enumerate() {
        let ((sa, ca), (st, ct)) = (f64::sin_cos(alpha), f64::sin_cos(theta + q[j]));
        #[rustfmt::skip]
        let transform = Matrix4::new(
            ct,      -st,      0.0, d,
            ca * st,  ca * ct, -sa, -r * sa,
            sa * st,  sa * ct,  ca,  r * ca,
            0.0,      0.0,      0.0, 1.0,
        );
        base *= transform;
        let link = &parameters[14 * j..];
        energy += G * (base * Vector4::new(link[6], link[7], link[8], link[9])).z;
    }
    energy
}

#[test]
fn static_torque_is_the_slope_of_the_potential_energy() {
    let robot = tx40_physical();
    let model = Model::new(&robot);
    let parameters = robot.nominal().unwrap().standard_parameters();
    let mut random = Random(2);
    for _ in 0..50 {
        let q = random.vector(6, 3.0);
        let tau = inverse(&model, parameters, &q, &[0.0; 6], &[0.0; 6]);
        let slope: Vec<f64> = (0..6)
            .map(|j| {
                let energy_at = |step: f64| {
                    let mut q = q.clone();
                    q[j] += step;
                    potential_energy(parameters, &q)
                };
                (energy_at(1e-5) - energy_at(-1e-5)) / 2e-5
            })
            .collect();
        assert!(difference(&tau, &slope) < 1e-9);
    }
}

#[test]
fn coupling_of_joints_5_and_6_is_the_table_of_the_arm() {
    let robot = tx40();
    let names = robot.parameters().names();
    assert_eq!(names.len(), 6 * 14 + 2);
    assert_eq!(names[names.len() - 2..], ["fv_m6", "fc_m6"]);
    let robot = robot.with_sign_model(didim_dynamics::robot::SignModel::Sign);
    let model = Model::new(&robot);
    let column = |name: &str, dq: &[f64; 6], ddq: &[f64; 6]| {
        let tau = inverse(&model, &parameters(&robot, &[(name, 1.0)]), &[0.3; 6], dq, ddq);
        [tau[4], tau[5]]
    };
    let (rest, ddq) = ([0.0; 6], [0.0, 0.0, 0.0, 0.0, 5.0, 7.0]);
    assert_eq!(column("ia6", &rest, &ddq), [7.0, 12.0]);
    assert_eq!(column("ia5", &rest, &ddq), [5.0, 0.0]);
    let dq = [0.0, 0.0, 0.0, 0.0, -3.0, 2.0];
    assert_eq!(column("fv_m6", &dq, &rest), [2.0, -3.0]);
    assert_eq!(column("fv6", &dq, &rest), [0.0, 2.0]);
    assert_eq!(column("fc_m6", &dq, &rest), [-1.0, -1.0]);
    assert_eq!(column("fc6", &dq, &rest), [0.0, 1.0]);
}

#[test]
fn essential_parameters_make_a_positive_definite_arm() {
    let robot = tx40();
    let nominal = robot.nominal().unwrap();
    assert_eq!(nominal.given_values().len(), 28);
    assert_eq!(nominal.value("zz1r"), Some(1.24));
    let model = Model::new(&robot);
    let mut random = Random(3);
    let smallest = (0..2000)
        .map(|_| {
            let limits = robot.limits();
            let q: Vec<f64> =
                limits.map(|l| random.uniform(l.position_min, l.position_max)).collect();
            let mass = mass_matrix(&model, nominal.standard_parameters(), &q);
            DMatrix::from_row_slice(6, 6, &mass).symmetric_eigenvalues().min()
        })
        .fold(f64::INFINITY, f64::min);
    assert!((0.0065..0.0075).contains(&smallest), "{smallest}");
}

#[test]
fn start_with_every_drive_inertia_1_is_refused_and_ia5_of_2_is_not() {
    let robot = tx40();
    let model = Model::new(&robot);
    let start = |ia5| {
        let ones = ["ia1", "ia2", "ia3", "ia4", "ia6"].map(|name| (name, 1.0));
        let mut parameters = parameters(&robot, &ones);
        parameters[robot.parameters().find("ia5").unwrap()] = ia5;
        let mut ddq = [0.0; 6];
        let (q, zero, tau) = ([0.3; 6], [0.0; 6], [1.0; 6]);
        model
            .direct_dynamics(&mut Workspace::new(), &parameters, &q, &zero, &tau, &mut ddq)
            .map(|()| ddq)
    };
    // Joint 5 has no inertia left while joint 6 is free.
    assert_eq!(start(1.0), Err(NotPositiveDefinite { joint: JointIndex::new(4) }));
    // [2 1; 1 1] q̈ = [1; 1] for joints 5 and 6.
    assert!(difference(&start(2.0).unwrap(), &[1.0, 1.0, 1.0, 1.0, 0.0, 1.0]) < 1e-14);
}

#[test]
fn both_files_describe_one_arm() {
    let (essential, physical) = (tx40(), tx40_physical());
    assert_eq!(essential.chain(), physical.chain());
    assert_eq!(essential.transmission(), physical.transmission());
    assert_eq!(essential.parameters(), physical.parameters());

    // The essential parameters are base parameters by name ...
    let base = BaseParameters::compute(&Model::new(&essential)).unwrap();
    let nominal = essential.nominal().unwrap();
    let values = nominal.given_values().iter().map(|(name, value)| (name, *value));
    assert_eq!(base.to_standard(values).unwrap(), nominal.standard_parameters());
    // ... and the physical ones amount to an arm of the same size.
    let regrouped = base.to_base(physical.nominal().unwrap().standard_parameters());
    for name in ["zz1r", "zz2r", "mx2r", "my3r", "fv1", "fc1", "ia3"] {
        let ratio = regrouped[base.find(name).unwrap()] / nominal.value(name).unwrap();
        assert!((0.7..1.4).contains(&ratio), "{name}: {ratio}");
    }
}

#[test]
fn every_link_of_the_physical_set_is_a_body() {
    // The integral of (x y z 1)(x y z 1)' dm is positive definite for a body.
    let robot = tx40_physical();
    for link in robot.nominal().unwrap().standard_parameters().chunks(14).take(6) {
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = *link.first_chunk().unwrap();
        let half = 0.5 * (xx + yy + zz);
        #[rustfmt::skip]
        let second_moments = Matrix4::new(
            half - xx, -xy, -xz, mx,
            -xy, half - yy, -yz, my,
            -xz, -yz, half - zz, mz,
            mx, my, mz, m,
        );
        assert!(second_moments.symmetric_eigenvalues().min() > 0.0);
    }
}
