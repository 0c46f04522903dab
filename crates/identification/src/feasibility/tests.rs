//! Comparison of two links and single numbers with an independent implementation
//! (`crates/identification/tests/golden/feasibility.toml`).

use nalgebra::{DMatrix, DVector, Matrix4};
use toml::Value;

use super::block::Block;
use super::body::Body;
use super::error::FeasibilityError;
use super::estimate::{Estimate, FixedParameter, Rows};
use super::newton::Minimum;
use super::posterior::Posterior;
use super::prior::Prior;
use super::problem::{Problem, divergence};
use super::solve::{build_problem, column_class};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};

/// Position of each parameter of a link in the golden file's order: mass, first moments, inertia xx
/// xy yy xz yz zz.
const PLACES: [usize; 10] = [4, 5, 7, 6, 8, 9, 1, 2, 3, 0];

fn golden() -> toml::Table {
    toml::from_str(include_str!("../../tests/golden/feasibility.toml")).unwrap()
}

fn vector(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|entry| entry.as_float().unwrap()).collect()
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(vector).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn body(value: &Value) -> Body {
    Body::from_pseudo_inertia(&Matrix4::from_iterator(matrix(value).iter().copied()))
}

/// Returns a turret with one link that it lifts.
fn turret() -> Robot {
    let joint = |alpha: f64| {
        format!(
            "[[joint]]\ntype = \"revolute\"\nalpha_deg = {alpha:?}\nd_m = 0.0\ntheta_deg = \
             0.0\nr_m = 0.0\n\
             drive_inertia = true\nposition_min_deg = -90.0\nposition_max_deg = \
             90.0\nvelocity_max_rad_s = 1.0\n\
             torque_max_nm = 1.0\n"
        )
    };
    let text = format!(
        "name = \"turret\"\ngravity_m_s2 = [0.0, 0.0, -9.81]\n{}{}[transmission]\nrows = [[1.0, \
         0.0], [0.0, 1.0]]\n\
         [friction]\nviscous = true\ncoulomb = false\noffset = false\n",
        joint(0.0),
        joint(90.0)
    );
    Robot::from_toml(&text).unwrap()
}

/// Golden problem, with the parameters in this package's order.
struct Turret {
    golden: toml::Table,
    robot: Robot,
    base: BaseParameters,
    names: Vec<String>,
    prior: Prior,
}

impl Turret {
    fn new() -> Self {
        let (golden, robot) = (golden(), turret());
        let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
        let names = golden["base"].as_array().unwrap().iter().map(|name| {
            let name = name.as_str().unwrap();
            let regrouped = format!("{name}r");
            if base.find(name).is_some() { name.to_owned() } else { regrouped }
        });
        let names = names.collect();
        let link_bodies = golden["prior"].as_array().unwrap().iter().map(body).collect();
        let mut prior = Prior::geometric(&robot, 13.0).unwrap();
        prior.link_bodies = link_bodies;
        Self { golden, robot, base, names, prior }
    }

    /// Returns the values of a golden vector in the order of the columns.
    fn ours<T: Clone>(&self, theirs: &[T]) -> Vec<T> {
        let names = self.golden["parameters"].as_array().unwrap();
        let place =
            |name: &String| names.iter().position(|own| own.as_str() == Some(name)).unwrap();
        self.robot.parameters().names().iter().map(|name| theirs[place(name)].clone()).collect()
    }

    fn rows(&self, case: &str) -> Rows {
        let covariance = matrix(&self.golden["covariance"]);
        let values = vector(&self.golden[case]["beta"]);
        let names = &self.names;
        let estimate = Estimate { names, values: &values, covariance: &covariance, fixed: &[] };
        Rows::new(&self.base, self.robot.parameters().parameters(), &estimate).unwrap()
    }

    /// Returns the problem with the golden priors of ia1, ia2, fv1 and fv2.
    fn problem(&self, rows: &Rows) -> Problem {
        let mut problem = build_problem(&self.robot, rows, &self.prior).unwrap();
        assert_eq!(problem.blocks.len(), 6);
        for (name, prior) in
            ["ia1", "ia2", "fv1", "fv2"].iter().zip(vector(&self.golden["scalars"]))
        {
            let column = self.robot.parameters().find(name).unwrap();
            let own_block =
                problem.blocks.iter_mut().find(|block| block.columns == [column]).unwrap();
            *own_block = Block::from_scalar(&[(column, 1.0)], prior).unwrap();
        }
        problem
    }
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found:e} instead of {expected:e}");
}

#[test]
fn two_links_are_those_of_the_independent_implementation() {
    let turret = Turret::new();
    for case in ["feasible", "infeasible"] {
        let rows = turret.rows(case);
        let problem = turret.problem(&rows);
        for golden in turret.golden[case]["results"].as_array().unwrap() {
            let number = |key: &str| golden[key].as_float().unwrap();
            let weight = number("weight");
            let minimum = problem.minimise(weight).unwrap();
            let objective = problem.objective(&minimum.point, weight);
            close(objective / number("objective"), 1.0, 1e-8);
            close(problem.cost(&minimum.point), number("cost"), 2e-6 * (1.0 + number("cost")));

            let posterior = Posterior::new(&minimum, weight).unwrap();
            let effective = posterior.effective_parameters;
            close(effective, number("effective_parameters"), 1e-5 * effective);
            let ours = |key: &str| turret.ours(&vector(&golden[key]));
            let values = problem.parameters(&minimum.point);
            for column in 0..values.len() {
                let deviation = ours("deviations")[column];
                close(values[column], ours("standard")[column], 1e-4 * deviation);
                close(posterior.deviations[column], deviation, 1e-4 * deviation);
                close(posterior.data_shares[column], ours("shares")[column], 1e-4);
            }
            let divergences: Vec<f64> = minimum.point.factors.iter().map(divergence).collect();
            let sum: f64 = vector(&golden["divergences"]).iter().sum();
            close(divergences.iter().sum(), sum, 1e-5 * (1.0 + sum));
            close(divergences[1], vector(&golden["divergences"])[1], 1e-4);
        }
    }
}

/// The only violated condition is xx2 + zz2 ≥ 0, so the least cost is known in closed form.
#[test]
fn the_cost_of_impossible_links_falls_to_its_known_infimum() {
    let turret = Turret::new();
    let problem = turret.problem(&turret.rows("infeasible"));
    let infimum = turret.golden["infimum_of_cost"].as_float().unwrap();
    for weight in [1.0, 1e-2, 1e-4] {
        let minimum = problem.minimise(weight).unwrap();
        let above = problem.cost(&minimum.point) - infimum;
        assert!(above > 0.0 && above < weight * problem.barrier_parameter(), "{weight}: {above}");
    }
}

/// F by another formula: D as a sum of squares of a logarithmic Cholesky factor. Q = U Uᵀ, with U
/// upper triangular and eᵈ on its diagonal. F is convex, so the point is its minimum if all small
/// changes of U raise F.
#[test]
fn the_minimum_is_one_in_other_coordinates() {
    let turret = Turret::new();
    let problem = turret.problem(&turret.rows("feasible"));
    let Minimum { point, .. } = problem.minimise(2.0).unwrap();
    let flip = |m: &DMatrix<f64>| {
        let n = m.nrows();
        DMatrix::from_fn(n, n, |i, j| m[(n - 1 - i, n - 1 - j)])
    };
    let upper: Vec<DMatrix<f64>> = point
        .factors
        .iter()
        .map(|l| flip(&flip(&(l * l.transpose())).cholesky().unwrap().unpack()))
        .collect();
    let objective = |upper: &[DMatrix<f64>]| {
        let mut values = DVector::zeros(problem.whitened_columns.ncols());
        let mut far = 0.0;
        for (block, u) in problem.blocks.iter().zip(upper) {
            for (i, j) in (0..u.nrows()).flat_map(|i| (i..u.nrows()).map(move |j| (i, j))) {
                let d = u[(i, j)].ln();
                far += if i == j { (2.0 * d).exp() - 2.0 * d - 1.0 } else { u[(i, j)] * u[(i, j)] };
            }
            let half = &block.prior * u;
            let added =
                &block.parameter_map * super::block::symmetric_vector(&(&half * half.transpose()));
            block.columns.iter().zip(added.iter()).for_each(|(&at, added)| values[at] += added);
        }
        (&problem.whitened_columns * values - &problem.target).norm_squared() + 2.0 * far
    };
    let least = objective(&upper);
    close(least, problem.objective(&point, 2.0), 1e-12 * least);
    for block in 0..upper.len() {
        for entry in 0..upper[block].len() {
            let (i, j) = (entry % upper[block].nrows(), entry / upper[block].nrows());
            for step in [-1e-3, 1e-3] {
                let mut shifted = upper.clone();
                shifted[block][(i, j)] += if i <= j { step } else { 0.0 };
                assert!(i > j || objective(&shifted) > least, "block {block} ({i}, {j})");
            }
        }
    }
}

#[test]
fn where_values_come_from_follows_from_the_regrouping() {
    let turret = Turret::new();
    let rows = turret.rows("feasible");
    let expected: Vec<&str> = turret.golden["class"]
        .as_array()
        .unwrap()
        .iter()
        .map(|class| class.as_str().unwrap())
        .collect();
    for (column, expected) in turret.ours(&expected).into_iter().enumerate() {
        assert_eq!(
            format!("{:?}", column_class(&rows, column)).to_lowercase(),
            expected,
            "{column}"
        );
    }
}

/// 2 (s − β̂)/σ² + λ/s⁰ − λ/s = 0.
#[test]
fn a_single_number_has_its_closed_form() {
    let golden = &golden()["scalar"];
    let number = |key: &str| golden[key].as_float().unwrap();
    let variance = DMatrix::from_element(1, 1, number("deviation").powi(2));
    let unit = DMatrix::from_element(1, 1, 1.0);
    let values = DVector::from_element(1, number("beta"));
    let (whitened, target) = Problem::whiten(&unit, &values, &variance).unwrap();
    let blocks = vec![Block::from_scalar(&[(0, 1.0)], number("prior")).unwrap()];
    let problem = Problem { blocks, free_columns: Vec::new(), whitened_columns: whitened, target };
    let minimum = problem.minimise(number("weight")).unwrap();
    close(problem.parameters(&minimum.point)[0] / number("solution"), 1.0, 1e-7);
}

#[test]
fn a_body_and_its_distance_are_those_of_the_independent_implementation() {
    let golden = &golden()["divergence"];
    let (found, prior) = (body(&golden["body"]), body(&golden["prior"]));
    let expected = vector(&golden["parameters"]);
    for (found, place) in found.parameters().into_iter().zip(PLACES) {
        close(found, expected[place], 1e-15);
    }
    assert_eq!(Body::from_parameters(found.parameters()), found);
    close(
        (found.pseudo_inertia() - Matrix4::from_iterator(matrix(&golden["body"]).iter().copied()))
            .amax(),
        0.0,
        1e-16,
    );

    let whitened = matrix(&golden["whitened"]);
    let factor = whitened.clone().cholesky().unwrap().unpack();
    close(divergence(&factor), golden["value"].as_float().unwrap(), 1e-12);
    let least = whitened.symmetric_eigenvalues().min();
    close(found.eigenvalue_relative_to(&prior).unwrap(), least, 1e-12);
    close(prior.eigenvalue_relative_to(&prior).unwrap(), 1.0, 1e-12);
}

#[test]
fn cylinders_between_frames_are_those_of_the_rule() {
    let golden = &golden()["tx40"];
    let robot = Robot::from_toml(include_str!("../../../../config/robots/tx40.toml")).unwrap();
    let prior = Prior::geometric(&robot, golden["total_mass_kg"].as_float().unwrap()).unwrap();
    let expected = matrix(&golden["links"]);
    for (link, body) in prior.link_bodies().iter().enumerate() {
        for (found, place) in body.parameters().into_iter().zip(PLACES) {
            close(found, expected[(link, place)], 1e-14);
        }
        assert!(body.is_possible());
    }
}

/// A ball that is moved off the origin, and one whose inertia breaks the triangle inequality.
#[test]
fn a_body_is_possible_by_its_centre_and_its_triangle() {
    let (mass, c) = (2.0, nalgebra::Vector3::new(0.3, -0.2, 0.5));
    let ball = Body::cylinder(mass, 0.1, 0.1 * 3.0_f64.sqrt(), c, nalgebra::Vector3::z());
    close(ball.least_extent().unwrap(), 1.0 / 3.0, 1e-13);
    close((ball.centre_of_mass_m().unwrap() - c).amax(), 0.0, 1e-15);
    let inertia = ball.inertia_about_centre().unwrap();
    close((inertia - nalgebra::Matrix3::identity() * (mass * 0.01 / 2.0)).amax(), 0.0, 1e-15);

    let mut broken = ball;
    broken.inertia[(2, 2)] += 2.01 * inertia[(2, 2)];
    assert!(!broken.is_possible() && broken.eigenvalue_relative_to(&ball).unwrap() < 0.0);
    let weightless = Body { mass_kg: 0.0, ..ball };
    assert!(!weightless.is_possible() && weightless.centre_of_mass_m().is_none());
    assert!(ball.eigenvalue_relative_to(&broken).is_none());
}

/// Parameters of the bodies cannot be left out. A friction term can, and is 0 then.
#[test]
fn what_was_not_identified_is_named_or_absent_or_held() {
    let turret = Turret::new();
    let rows = turret.rows("feasible");
    let parameters = turret.robot.parameters();
    let without = |left_out: &str, fixed_value: &[FixedParameter]| {
        let keep: Vec<usize> = (0..10).filter(|&k| turret.names[k] != left_out).collect();
        let names: Vec<String> = keep.iter().map(|&k| turret.names[k].clone()).collect();
        let values: Vec<f64> = keep.iter().map(|&k| rows.values[k]).collect();
        let covariance = rows.covariance.select_rows(&keep).select_columns(&keep);
        let estimate = Estimate {
            names: &names,
            values: &values,
            covariance: &covariance,
            fixed: fixed_value,
        };
        Rows::new(&turret.base, parameters.parameters(), &estimate)
    };
    let refused = without("mx2", &[]).unwrap_err();
    assert_eq!(refused, FeasibilityError::LeftOut { names: vec!["mx2".into()] });

    let absent = without("fv2", &[]).unwrap();
    assert_eq!(
        absent.absent_columns,
        [parameters.column(ParameterKind::Fv, JointIndex::new(1)).unwrap()]
    );
    assert_eq!(build_problem(&turret.robot, &absent, &turret.prior).unwrap().blocks.len(), 5);

    let fixed = FixedParameter { name: "mx2".into(), value: 1.0, deviation: 0.03 };
    let consistent = without("mx2", core::slice::from_ref(&fixed)).unwrap();
    assert_eq!(consistent.names[9], "mx2");
    close(consistent.deviation(9), 0.03, 1e-17);
    let twice = without("fv2", core::slice::from_ref(&fixed)).unwrap_err();
    assert_eq!(twice, FeasibilityError::Repeated { name: "mx2".into() });
}
