//! Fast kernels against the plain ones, on random robots.

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar};
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};
use nalgebra::{DMatrix, DVector};

use super::arms::{
    Design, Random, difference, inverse, mass_matrix, multiply, physical_parameters, random_robots,
};
use super::dual::Dual;
use super::plain::link_torques;

const ROBOTS: u64 = 300;

/// Relative to the largest entry.
const TOLERANCE: f64 = 1e-12;

/// Forward differentiation of the inverse dynamic model is the plain way.
#[test]
fn partials_of_the_inverse_dynamics_are_its_derivatives() {
    for seed in 0..ROBOTS {
        let mut random = Random(seed);
        let mut design = Design::random(&mut random);
        design.sign = "{ model = \"tanh\", width_rad_s = 1.0 }";
        design.known_torques = seed % 2 == 1;
        let robot = design.robot();
        let model = Model::new(&robot);
        let (n, p) = (model.joints(), model.parameter_names().len());
        // Any parameters, physical or not, and some links without any.
        let mut parameters = random.vector(p, 1.0);
        for link in (0..n).filter(|_| random.chance(0.2)) {
            parameters[10 * link..10 * link + 10].fill(0.0);
        }
        let [q, dq, ddq] = [3.0, 4.0, 9.0].map(|size| random.vector(n, size));
        let constants: Vec<_> = parameters.iter().map(|&value| Dual(value, 0.0)).collect();
        let derivative = |of_velocity: bool, joint: usize| -> Vec<f64> {
            fn lift(values: &[f64], varied: bool, joint: &usize) -> Vec<Dual> {
                let rate = |j: usize| if varied && j == *joint { 1.0 } else { 0.0 };
                let dual = |(j, &value): (usize, &f64)| Dual(value, rate(j));
                values.iter().enumerate().map(dual).collect()
            }
            let [q, dq, ddq] = [
                lift(&q, !of_velocity, &joint),
                lift(&dq, of_velocity, &joint),
                lift(&ddq, false, &joint),
            ];
            let mut tau = vec![Dual(0.0, 0.0); n];
            model.inverse_dynamics(&mut Workspace::new(), &constants, &q, &dq, &ddq, &mut tau);
            tau.iter().map(|tau| tau.1).collect()
        };
        let [mut by_q, mut by_dq] = [vec![f64::NAN; n * n], vec![f64::NAN; n * n]];
        let mut workspace = Workspace::new();
        model.inverse_dynamics_partials(
            &mut workspace,
            &parameters,
            &q,
            &dq,
            &ddq,
            &mut by_q,
            &mut by_dq,
        );
        for (found, of_velocity) in [(by_q, false), (by_dq, true)] {
            let columns: Vec<Vec<f64>> = (0..n).map(|j| derivative(of_velocity, j)).collect();
            let expected: Vec<f64> = (0..n * n).map(|k| columns[k % n][k / n]).collect();
            assert!(difference(&found, &expected) < TOLERANCE, "{seed} {of_velocity}");
        }
    }
}

#[test]
fn selected_columns_are_those_of_the_whole_regressor() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let model = Model::new(&robot);
        let (n, p) = (model.joints(), model.parameter_names().len());
        let mut wanted: Vec<usize> = (0..p).filter(|_| random.chance(0.4)).collect();
        wanted.reverse();
        let columns = model.regressor_columns(&wanted);
        assert_eq!(columns.width(), wanted.len());
        let [q, dq, ddq] = [3.0, 4.0, 9.0].map(|size| random.vector(n, size));
        let (mut all, mut some) = (vec![f64::NAN; n * p], vec![f64::NAN; n * wanted.len()]);
        let mut workspace = Workspace::new();
        model.regressor(&mut workspace, &q, &dq, &ddq, &mut all);
        model.selected_regressor(&mut workspace, &columns, &q, &dq, &ddq, &mut some);
        let expected = (0..n).flat_map(|i| wanted.iter().map(move |&column| i * p + column));
        assert!(expected.zip(some).all(|(at, found)| all[at] == found));
    }
}

/// Any parameters of the links, physical or not and some of them 0, and no drives.
fn link_parameters(random: &mut Random, robot: &Robot) -> Vec<f64> {
    let mut parameters = vec![0.0; robot.parameters().names().len()];
    for joint in 0..robot.joints() {
        let first = robot.parameters().column(ParameterKind::Xx, JointIndex::new(joint)).unwrap();
        for parameter in &mut parameters[first..first + 10] {
            *parameter = if random.chance(0.2) { 0.0 } else { random.uniform(-1.0, 1.0) };
        }
    }
    parameters
}

#[test]
fn inverse_dynamics_and_regressor_are_the_plain_ones() {
    for seed in 0..ROBOTS {
        let mut random = Random(seed);
        let design = Design::random(&mut random);
        let robot = design.robot();
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = link_parameters(&mut random, &robot);
        let [q, dq, ddq] = [3.0, 4.0, 9.0].map(|size| random.vector(n, size));
        let expected = link_torques(&robot, &parameters, design.gravity, [&q, &dq, &ddq]);
        let torques = inverse(&model, &parameters, &q, &dq, &ddq);
        assert!(difference(&torques, &expected) < TOLERANCE, "{seed}");

        let mut regressor = vec![f64::NAN; n * parameters.len()];
        model.regressor(&mut Workspace::new(), &q, &dq, &ddq, &mut regressor);
        assert!(difference(&multiply(&regressor, &parameters), &expected) < TOLERANCE, "{seed}");
    }
}

/// Column j of the mass matrix is the torque of a unit acceleration of joint j, at rest and without
/// gravity.
#[test]
fn mass_matrix_is_the_plain_one() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = link_parameters(&mut random, &robot);
        let (q, rest) = (random.vector(n, 3.0), vec![0.0; n]);
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|j| {
                let mut unit = rest.clone();
                unit[j] = 1.0;
                link_torques(&robot, &parameters, [0.0; 3], [&q, &rest, &unit])
            })
            .collect();
        let expected: Vec<f64> = (0..n * n).map(|k| columns[k % n][k / n]).collect();
        assert!(difference(&mass_matrix(&model, &parameters, &q), &expected) < TOLERANCE);
    }
}

/// M q̈ + h − τ, over the size of its terms: what a solution may miss by whatever its condition.
#[test]
fn direct_dynamics_solves_the_equation_of_motion() {
    for (mut random, robot) in random_robots(ROBOTS) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let parameters = physical_parameters(&mut random, &robot);
        let [q, dq, tau] = [3.0, 4.0, 30.0].map(|size| random.vector(n, size));
        let mut workspace = Workspace::new();
        let [mut ddq, mut bias] = [vec![f64::NAN; n], vec![f64::NAN; n]];
        model.direct_dynamics(&mut workspace, &parameters, &q, &dq, &tau, &mut ddq).unwrap();
        model.bias(&mut workspace, &parameters, &q, &dq, &mut bias);
        let mass = DMatrix::from_row_slice(n, n, &mass_matrix(&model, &parameters, &q));
        let [ddq, bias, tau] = [ddq, bias, tau].map(DVector::from_vec);
        let missed = (&mass * &ddq + &bias - &tau).amax();
        let size = mass.amax() * ddq.amax() + bias.amax() + tau.amax();
        assert!(missed < TOLERANCE * size, "{missed} of {size}");
    }
}

/// Lanes do not affect each other. A torque of 0 may have another sign if the arm in the next lane
/// has links that this one does not have.
#[test]
fn every_lane_has_the_bits_of_an_evaluation_alone() {
    const L: usize = 4;
    for (mut random, robot) in random_robots(ROBOTS) {
        let (n, model) = (robot.joints(), Model::new(&robot));
        let mut parameters: [Vec<f64>; L] =
            core::array::from_fn(|_| physical_parameters(&mut random, &robot));
        // The outer links of one arm have no inertia; their drives do.
        for joint in random.below(n + 1)..n {
            let first =
                robot.parameters().column(ParameterKind::Xx, JointIndex::new(joint)).unwrap();
            if robot.chain()[joint].drive_inertia {
                parameters[0][first..first + 10].fill(0.0);
            }
        }
        let p = parameters[0].len();
        let states: [[Vec<f64>; 4]; L] =
            core::array::from_fn(|_| [3.0, 4.0, 9.0, 30.0].map(|size| random.vector(n, size)));
        fn side_by_side(value: &dyn Fn(usize) -> Vec<f64>) -> Vec<Lanes<4>> {
            let lanes: [Vec<f64>; L] = core::array::from_fn(value);
            (0..lanes[0].len()).map(|k| Lanes::from_fn(|l| lanes[l][k])).collect()
        }
        let wide_parameters = side_by_side(&|l| parameters[l].clone());
        let [q, dq, ddq, tau] = [0, 1, 2, 3].map(|k| side_by_side(&|l| states[l][k].clone()));
        let none = Lanes::constant(f64::NAN);
        let mut wide = Workspace::new();
        let [mut torque, mut acceleration] = [vec![none; n], vec![none; n]];
        let [mut regressor, mut mass] = [vec![none; n * p], vec![none; n * n]];
        model.inverse_dynamics(&mut wide, &wide_parameters, &q, &dq, &ddq, &mut torque);
        model
            .direct_dynamics(&mut wide, &wide_parameters, &q, &dq, &tau, &mut acceleration)
            .unwrap();
        model.regressor(&mut wide, &q, &dq, &ddq, &mut regressor);
        model.mass_matrix(&mut wide, &wide_parameters, &q, &mut mass);
        for (l, ([q, dq, ddq, tau], parameters)) in states.iter().zip(&parameters).enumerate() {
            let mut alone = Workspace::new();
            let [mut one_torque, mut one_acceleration] = [vec![f64::NAN; n], vec![f64::NAN; n]];
            let [mut one_regressor, mut one_mass] = [vec![f64::NAN; n * p], vec![f64::NAN; n * n]];
            model.inverse_dynamics(&mut alone, parameters, q, dq, ddq, &mut one_torque);
            model
                .direct_dynamics(&mut alone, parameters, q, dq, tau, &mut one_acceleration)
                .unwrap();
            model.regressor(&mut alone, q, dq, ddq, &mut one_regressor);
            model.mass_matrix(&mut alone, parameters, q, &mut one_mass);
            let pairs = [
                (&torque, one_torque),
                (&acceleration, one_acceleration),
                (&regressor, one_regressor),
                (&mass, one_mass),
            ];
            for (many, one) in pairs {
                let lane: Vec<f64> = many.iter().map(|lanes| lanes.0[l]).collect();
                assert_eq!(lane, one);
            }
        }
    }
}
