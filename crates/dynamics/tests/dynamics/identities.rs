//! Identities that hold for every serial arm, on random ones.

use super::arms::{
    Design, Motors, Random, difference, inverse, mass_matrix, multiply, physical_parameters,
    random_robots,
};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{FrictionLaw, JointIndex, Parameter, ParameterKind};
use nalgebra::DMatrix;

const ROBOTS: u64 = 300;
const TOLERANCE: f64 = 1e-11;

#[test]
fn regressor_times_parameters_is_the_inverse_dynamics() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let model = Model::new(&robot);
        let (n, p) = (model.joints(), model.parameter_names().len());
        // Any parameters: the model is linear in them, physical or not.
        let parameters = random.vector(p, 1.0);
        let (q, dq, ddq) = (random.vector(n, 3.0), random.vector(n, 4.0), random.vector(n, 9.0));
        let mut regressor = vec![f64::NAN; n * p];
        model.regressor(&mut Workspace::new(), &q, &dq, &ddq, &mut regressor);
        let tau = inverse(&model, &parameters, &q, &dq, &ddq);
        assert!(difference(&multiply(&regressor, &parameters), &tau) < TOLERANCE);
    }
}

/// Arms of nine to sixteen joints: the regressor gives the inverse dynamics, as the mass matrix and
/// the bias do, the direct dynamics take it back, the partials are its derivatives, and positions
/// come back from the motors.
#[test]
fn arms_of_many_joints_obey_the_same_identities() {
    for seed in 0..40 {
        let mut random = Random(seed);
        let n = 9 + random.below(MAX_JOINTS - 8);
        let robot = Design::random_of(&mut random, n).robot();
        let (model, mut ws) = (Model::new(&robot), Workspace::new());
        let parameters = physical_parameters(&mut random, &robot);
        let (q, dq, ddq) = (random.vector(n, 2.0), random.vector(n, 2.0), random.vector(n, 5.0));
        let tau = inverse(&model, &parameters, &q, &dq, &ddq);
        let mut regressor = vec![f64::NAN; n * parameters.len()];
        model.regressor(&mut ws, &q, &dq, &ddq, &mut regressor);
        assert!(difference(&multiply(&regressor, &parameters), &tau) < TOLERANCE, "{seed}");
        let mut bias = vec![f64::NAN; n];
        model.bias(&mut ws, &parameters, &q, &dq, &mut bias);
        let inertial = multiply(&mass_matrix(&model, &parameters, &q), &ddq);
        let sum: Vec<f64> = bias.iter().zip(&inertial).map(|(bias, own)| bias + own).collect();
        assert!(difference(&sum, &tau) < TOLERANCE, "{seed}");
        let mut accelerations = vec![f64::NAN; n];
        model.direct_dynamics(&mut ws, &parameters, &q, &dq, &tau, &mut accelerations).unwrap();
        assert!(difference(&accelerations, &ddq) < 1e-8, "{seed}: {accelerations:?} for {ddq:?}");
        check_partials(&model, &parameters, [&q, &dq, &ddq], &format!("{seed}"));
        let (mut motor, mut joint) = (vec![0.0; n], vec![0.0; n]);
        robot.transmission().motor_position(&q, &mut motor);
        robot.transmission().joint_position(&motor, &mut joint);
        assert!(difference(&joint, &q) < TOLERANCE, "{seed}");
    }
}

/// Friction that grows with the load: with the loads of the parameters themselves the regressor has
/// it, direct dynamics takes it back, its partials are its derivatives, and the load is the torque
/// at rest.
#[test]
fn friction_grows_with_the_torque_at_rest() {
    let mut acting = 0;
    for seed in 0..100 {
        let mut random = Random(seed);
        let mut design = Design::random(&mut random);
        design.friction = [true, true, true];
        design.known_torques = true;
        let plain = design.robot();
        let grown = plain.own_friction().iter().map(|own| own.with_law(FrictionLaw::Load));
        let robot = plain.clone().with_friction(grown.collect());
        let (n, model, mut ws) = (robot.joints(), Model::new(&robot), Workspace::new());
        let mut parameters = physical_parameters(&mut random, &robot);
        for (value, parameter) in parameters.iter_mut().zip(robot.parameters().parameters()) {
            if parameter.kind == ParameterKind::FcLoad {
                *value = random.uniform(0.05, 0.5);
            }
        }
        let (q, dq, ddq) = (random.vector(n, 2.0), random.vector(n, 4.0), random.vector(n, 9.0));
        let tau = inverse(&model, &parameters, &q, &dq, &ddq);

        // Without friction there is nothing at rest but the load.
        let is_link_parameter =
            |parameter: &&Parameter| ParameterKind::LINK.contains(&parameter.kind);
        let table = robot.parameters().parameters();
        let rigid = table.iter().zip(&parameters);
        let rigid: Vec<f64> =
            rigid.map(|(own, value)| if is_link_parameter(&own) { *value } else { 0.0 }).collect();
        let still = vec![0.0; n];
        let load = inverse(&model, &rigid, &q, &still, &still);
        let plain_model = Model::new(&plain);
        let without = plain.parameters().names().iter();
        let without: Vec<f64> =
            without.map(|name| parameters[robot.parameters().find(name).unwrap()]).collect();
        let mut expected = inverse(&plain_model, &without, &q, &dq, &ddq);
        for (joint, torque) in expected.iter_mut().enumerate() {
            let column =
                robot.parameters().column(ParameterKind::FcLoad, JointIndex::new(joint)).unwrap();
            let by_load = parameters[column] * load[joint].abs();
            *torque += by_load * robot.sign_model(joint).value(dq[joint]);
            acting += usize::from(by_load.abs() > 0.1);
        }
        assert!(difference(&expected, &tau) < TOLERANCE, "{seed}");

        let p = parameters.len();
        let mut regressor = vec![f64::NAN; n * p];
        let linear = model.clone().with_load(parameters.clone());
        linear.regressor(&mut ws, &q, &dq, &ddq, &mut regressor);
        // What is known is no matter of the parameters.
        let mut torque = multiply(&regressor, &parameters);
        for ((torque, known_torque), q) in torque.iter_mut().zip(robot.known_torques()).zip(&q) {
            *torque -= known_torque.as_ref().unwrap().torque_and_slope(*q)[0];
        }
        assert!(difference(&torque, &tau) < TOLERANCE, "{seed}");
        assert!(difference(&inverse(&linear, &parameters, &q, &dq, &ddq), &tau) < TOLERANCE);

        let mut accelerations = vec![f64::NAN; n];
        model.direct_dynamics(&mut ws, &parameters, &q, &dq, &tau, &mut accelerations).unwrap();
        assert!(difference(&accelerations, &ddq) < 1e-9, "{seed}: {accelerations:?} for {ddq:?}");

        check_partials(&model, &parameters, [&q, &dq, &ddq], &format!("{seed}"));
    }
    assert!(acting > 100, "{acting}");
}

/// Compares the partial derivatives of the inverse dynamics with differences.
fn check_partials(model: &Model, parameters: &[f64], [q, dq, ddq]: [&[f64]; 3], name: &str) {
    let (n, mut ws) = (q.len(), Workspace::new());
    let tau = inverse(model, parameters, q, dq, ddq);
    let (mut by_position, mut by_velocity) = (vec![f64::NAN; n * n], vec![f64::NAN; n * n]);
    model.inverse_dynamics_partials(
        &mut ws,
        parameters,
        q,
        dq,
        ddq,
        &mut by_position,
        &mut by_velocity,
    );
    let h = 1e-6;
    for j in 0..n {
        fn shifted(of: &[f64], by: f64, j: &usize) -> Vec<f64> {
            let mut of = of.to_vec();
            of[*j] += by;
            of
        }
        let ends = [-h, h].map(|by| inverse(model, parameters, &shifted(q, by, &j), dq, ddq));
        let speeds = [-h, h].map(|by| inverse(model, parameters, q, &shifted(dq, by, &j), ddq));
        for i in 0..n {
            for (ends, partial) in [(&ends, &by_position), (&speeds, &by_velocity)] {
                let slope = (ends[1][i] - ends[0][i]) / (2.0 * h);
                let size = 1.0 + slope.abs() + tau[i].abs();
                assert!((slope - partial[i * n + j]).abs() < 1e-6 * size, "{name}: {i} {j}");
            }
        }
    }
}

/// What is known of the torques, the drives need not give: at every joint its own, at every motion.
#[test]
fn known_torques_are_taken_off() {
    let mut acting = 0;
    for seed in 0..100 {
        let mut random = Random(seed);
        let mut design = Design::random(&mut random);
        let plain = Model::new(&design.robot());
        design.known_torques = true;
        let robot = design.robot();
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = random.vector(model.parameter_names().len(), 1.0);
        let (q, dq, ddq) = (random.vector(n, 2.9), random.vector(n, 4.0), random.vector(n, 9.0));
        let compensated = inverse(&model, &parameters, &q, &dq, &ddq);
        let mut without = inverse(&plain, &parameters, &q, &dq, &ddq);
        for ((torque, known_torque), q) in without.iter_mut().zip(robot.known_torques()).zip(&q) {
            let [known_part, _] = known_torque.as_ref().unwrap().torque_and_slope(*q);
            *torque -= known_part;
            acting += usize::from(known_part.abs() > 1.0);
        }
        assert!(difference(&compensated, &without) < TOLERANCE);
    }
    assert!(acting > 300, "{acting}");
}

#[test]
fn regressor_is_zero_outside_its_pattern() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let model = Model::new(&robot);
        let (n, p) = (model.joints(), model.parameter_names().len());
        let columns: Vec<usize> = (0..p).collect();
        let mut pattern = vec![false; n * p];
        for &(row, column) in model.regressor_entries(&columns).entries() {
            pattern[row * p + column] = true;
        }
        let mut regressor = vec![f64::NAN; n * p];
        let (q, dq, ddq) = (random.vector(n, 3.0), random.vector(n, 4.0), random.vector(n, 9.0));
        model.regressor(&mut Workspace::new(), &q, &dq, &ddq, &mut regressor);
        assert!(pattern.iter().zip(&regressor).all(|(&can, &entry)| can || entry == 0.0));
        // The last joint does not carry the first link.
        assert!(n == 1 || !pattern[(n - 1) * p]);
    }
}

#[test]
fn mass_times_acceleration_plus_bias_is_the_inverse_dynamics() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = random.vector(model.parameter_names().len(), 1.0);
        let (q, dq, ddq) = (random.vector(n, 3.0), random.vector(n, 4.0), random.vector(n, 9.0));
        let mut sum = vec![f64::NAN; n];
        model.bias(&mut Workspace::new(), &parameters, &q, &dq, &mut sum);
        let inertial = multiply(&mass_matrix(&model, &parameters, &q), &ddq);
        sum.iter_mut().zip(inertial).for_each(|(sum, torque)| *sum += torque);
        assert!(difference(&sum, &inverse(&model, &parameters, &q, &dq, &ddq)) < TOLERANCE);
    }
}

#[test]
fn drives_across_couplings_are_those_of_their_motors() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let model = Model::new(&robot);
        let n = robot.joints();
        let motors = Motors::random(&mut random, n);
        let parameters = motors.parameters(&robot);
        let dq = random.vector(n, 4.0);

        // R' diag(J) R is the joint-side inertia, R' diag(Fv) R the viscous friction.
        let declared =
            |m: usize| if robot.chain()[m].drive_inertia { motors.inertia[m] } else { 0.0 };
        let r = DMatrix::from_fn(n, n, |m, i| robot.transmission().row(m)[i]);
        let inertia = DMatrix::from_fn(n, n, |i, j| if i == j { declared(i) } else { 0.0 });
        let mass = r.transpose() * inertia * &r;
        let mass_found = mass_matrix(&model, &parameters, &random.vector(n, 3.0));
        assert!(difference(mass.as_slice(), &mass_found) < TOLERANCE);

        // The motors' own friction, taken to the joints by R'.
        let mut speed = vec![0.0; n];
        robot.transmission().motor_position(&dq, &mut speed);
        let mut torque = vec![0.0; n];
        for m in 0..n {
            let ratio = robot.transmission().row(m)[m];
            if robot.friction().viscous {
                torque[m] += motors.viscous[m] * speed[m];
            }
            if robot.friction().coulomb {
                // The sign model reads the motor's speed as seen at the joint.
                let sign = robot.sign_model(m).value(speed[m] / ratio);
                torque[m] += motors.coulomb[m] * ratio.signum() * sign;
            }
        }
        let mut expected = vec![0.0; n];
        robot.transmission().joint_torque(&torque, &mut expected);
        let mut friction = vec![0.0; n];
        model.friction(&mut Workspace::new(), &parameters, &vec![0.0; n], &dq, &mut friction);
        assert!(difference(&friction, &expected) < TOLERANCE);
    }
}

#[test]
fn mass_matrix_of_a_physical_arm_is_symmetric_and_positive_definite() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = physical_parameters(&mut random, &robot);
        let mass = mass_matrix(&model, &parameters, &random.vector(n, 3.0));
        let mass = DMatrix::from_row_slice(n, n, &mass);
        assert_eq!(mass, mass.transpose());
        assert!(mass.symmetric_eigenvalues().min() > 0.0);
    }
}

#[test]
fn direct_dynamics_undoes_inverse_dynamics() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = physical_parameters(&mut random, &robot);
        let (q, dq, ddq) = (random.vector(n, 3.0), random.vector(n, 4.0), random.vector(n, 9.0));
        let tau = inverse(&model, &parameters, &q, &dq, &ddq);
        let mut back = vec![f64::NAN; n];
        let mut workspace = Workspace::new();
        model.direct_dynamics(&mut workspace, &parameters, &q, &dq, &tau, &mut back).unwrap();
        assert!(difference(&back, &ddq) < 1e-9);
    }
}
