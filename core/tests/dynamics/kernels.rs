//! Fast kernels against the plain ones, on random robots.

use didim_core::dual::Dual;
use didim_core::dynamics::{Model, Workspace};
use didim_core::scalar::Scalar;

use crate::arms::{Design, Random, difference, random_robots};

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
        let robot = design.robot();
        let model = Model::new(&robot);
        let (n, p) = (model.joints(), model.parameter_names().len());
        // Any parameters, physical or not, and some links without any.
        let mut parameters = random.vector(p, 1.0);
        for link in (0..n).filter(|_| random.chance(0.2)) {
            parameters[10 * link..10 * link + 10].fill(0.0);
        }
        let [q, dq, ddq] = [3.0, 4.0, 9.0].map(|size| random.vector(n, size));
        let constants: Vec<_> =
            parameters.iter().map(|&value| Dual::<1>::constant(value)).collect();
        let derivative = |of_velocity: bool, joint: usize| -> Vec<f64> {
            let lift = |values: &[f64], varied: bool| -> Vec<Dual<1>> {
                let dual = |(j, &value): (usize, &f64)| {
                    if varied && j == joint {
                        Dual::variable(value, 0)
                    } else {
                        Dual::constant(value)
                    }
                };
                values.iter().enumerate().map(dual).collect()
            };
            let [q, dq, ddq] = [lift(&q, !of_velocity), lift(&dq, of_velocity), lift(&ddq, false)];
            let mut tau = vec![Dual::constant(0.0); n];
            model.inverse_dynamics(&mut Workspace::new(), &constants, &q, &dq, &ddq, &mut tau);
            tau.iter().map(|tau| tau.slope[0]).collect()
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
