//! Least squares against NumPy (`golden/least_squares.py`), and what must not change its result.

use didim_dynamics::robot::JointIndex;
use didim_identification::regression::{Observations, RegressionError, Solution};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use toml::Table;

const JOINTS: usize = 3;
const ROWS: usize = 40;
const COLUMNS: usize = 5;

fn golden() -> Table {
    include_str!("golden/least_squares.toml").parse().unwrap()
}

fn floats(table: &Table, key: &str) -> Vec<f64> {
    table[key].as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect()
}

/// The matrix of `golden/least_squares.py`.
fn matrix() -> DMatrix<f64> {
    let scale = [1.0, 10.0, 0.1, 1.0, 100.0];
    DMatrix::from_fn(JOINTS * ROWS, COLUMNS, |r, c| {
        (((r * r * 31 + r * c * 17 + c * 7) % 211) as f64 / 211.0 - 0.5) * scale[c]
    })
}

fn observations() -> Observations {
    let y = DVector::from_vec(floats(&golden(), "y"));
    Observations::new(matrix(), y, JOINTS).unwrap()
}

fn two_step(system: &Observations) -> Solution {
    let ordinary = system.solve_ordinary().unwrap();
    system.solve_weighted(&system.noise_levels(&ordinary.residuals)).unwrap()
}

fn relative_difference(actual: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(actual.len(), expected.len());
    actual.iter().zip(expected).fold(0.0, |m: f64, (a, e)| m.max((a - e).abs() / e.abs()))
}

#[test]
fn every_figure_agrees_with_numpy() {
    let golden = golden();
    let system = observations();
    let ordinary = system.solve_ordinary().unwrap();
    let levels = system.noise_levels(&ordinary.residuals);
    assert!(relative_difference(&levels, &floats(&golden, "noise_levels")) < 1e-12);
    let weighted = system.solve_weighted(&levels).unwrap();

    for (name, solution) in [("ordinary", ordinary), ("weighted", weighted)] {
        let expected = golden[name].as_table().unwrap();
        let statistics = system.residual_statistics(&solution.residuals);
        for (key, actual) in [
            ("parameters", solution.parameters.as_slice()),
            ("covariance", solution.covariance.as_slice()),
            ("singular_values", &solution.singular_values),
            ("relative_error_per_joint", &statistics.relative_error_per_joint),
            ("rms_per_joint", &statistics.rms_per_joint),
            ("durbin_watson_per_joint", &statistics.durbin_watson_per_joint),
        ] {
            let difference = relative_difference(actual, &floats(expected, key));
            assert!(difference < 1e-10, "{name} {key}: {difference}");
        }
        for (key, actual) in [
            ("condition_number", solution.condition_number()),
            ("relative_error", statistics.relative_error),
        ] {
            let expected = expected[key].as_float().unwrap();
            assert!((actual - expected).abs() < 1e-12 * expected, "{name} {key}: {actual}");
        }
    }
}

#[test]
fn weighting_by_one_common_level_is_ordinary() {
    let system = observations();
    let ordinary = system.solve_ordinary().unwrap();
    let weighted = system.solve_weighted(&[0.3; JOINTS]).unwrap();
    let difference =
        relative_difference(weighted.parameters.as_slice(), ordinary.parameters.as_slice());
    assert!(difference < 1e-12, "{difference}");
}

#[test]
fn zero_columns_are_named() {
    let mut x = matrix();
    for column in [1, 3] {
        x.column_mut(column).fill(0.0);
    }
    let y = observations().measurements().clone();
    let refused = Observations::new(x, y, JOINTS).unwrap().solve_ordinary();
    assert_eq!(refused, Err(RegressionError::ZeroColumns { columns: vec![1, 3] }));
}

#[test]
fn dependent_columns_are_named_and_no_others() {
    let y = observations().measurements().clone();
    // A column that repeats another in a different unit.
    let mut x = matrix();
    let copy = x.column(4) * 1e-6;
    x.column_mut(2).copy_from(&copy);
    let system = Observations::new(x, y.clone(), JOINTS).unwrap();
    let expected = RegressionError::DependentColumns { columns: vec![2, 4] };
    assert_eq!(system.solve_ordinary(), Err(expected.clone()));
    assert_eq!(system.solve_weighted(&[1.0, 2.0, 3.0]), Err(expected));
    // A column that is the sum of two others.
    let mut x = matrix();
    let sum = x.column(0) - 2.0 * x.column(3);
    x.column_mut(1).copy_from(&sum);
    let refused = Observations::new(x, y, JOINTS).unwrap().solve_ordinary();
    assert_eq!(refused, Err(RegressionError::DependentColumns { columns: vec![0, 1, 3] }));
}

#[test]
fn what_is_no_system_is_refused() {
    let (x, y) = (matrix(), observations().measurements().clone());
    let shape = Observations::new(x.clone(), y.rows(0, 119).into_owned(), JOINTS);
    assert!(matches!(shape, Err(RegressionError::Shape { measurements: 119, .. })));
    assert!(matches!(
        Observations::new(x.clone(), y.clone(), 7),
        Err(RegressionError::Shape { joints: 7, .. })
    ));
    assert!(Observations::new(x.clone(), y.clone(), 0).is_err());
    assert_eq!(
        Observations::new(DMatrix::identity(6, 6), DVector::repeat(6, 1.0), 2),
        Err(RegressionError::TooFewRows { rows: 6, columns: 6 })
    );

    let mut bad = x.clone();
    bad[(ROWS + 7, 2)] = f64::NAN;
    let refused = Observations::new(bad, y.clone(), JOINTS);
    assert_eq!(refused, Err(RegressionError::NotFinite { joint: JointIndex::new(1), row: 7 }));
    let mut bad = y.clone();
    bad[2 * ROWS] = f64::INFINITY;
    let refused = Observations::new(x.clone(), bad, JOINTS);
    assert_eq!(refused, Err(RegressionError::NotFinite { joint: JointIndex::new(2), row: 0 }));
    let mut silent = y.clone();
    silent.rows_mut(ROWS, ROWS).fill(0.0);
    let refused = Observations::new(x.clone(), silent, JOINTS);
    assert_eq!(refused, Err(RegressionError::NoMeasurement { joint: JointIndex::new(1) }));
    let huge = Observations::new(&x * 1e200, y.clone(), JOINTS).unwrap();
    assert_eq!(huge.solve_ordinary(), Err(RegressionError::OutOfRange));

    let system = Observations::new(x, y, JOINTS).unwrap();
    assert!(matches!(system.solve_weighted(&[1.0]), Err(RegressionError::Shape { .. })));
    for level in [0.0, -1.0, f64::INFINITY] {
        let refused = system.solve_weighted(&[1.0, level, 1.0]);
        assert_eq!(refused, Err(RegressionError::NoiseLevel { joint: JointIndex::new(1), level }));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn order_of_samples_changes_nothing(seed in prop::collection::vec(any::<u32>(), ROWS)) {
        let mut order: Vec<usize> = (0..ROWS).collect();
        order.sort_by_key(|&k| seed[k]);
        let rows: Vec<usize> = (0..JOINTS)
            .flat_map(|joint| order.iter().map(move |k| joint * ROWS + k))
            .collect();
        let system = observations();
        let permuted = Observations::new(
            system.matrix().dense().select_rows(&rows),
            system.measurements().select_rows(&rows),
            JOINTS,
        )
        .unwrap();
        let (a, b) = (two_step(&system), two_step(&permuted));
        prop_assert!(relative_difference(b.parameters.as_slice(), a.parameters.as_slice()) < 1e-12);
        prop_assert!(relative_difference(b.covariance.as_slice(), a.covariance.as_slice()) < 1e-11);
        prop_assert!(relative_difference(&b.singular_values, &a.singular_values) < 1e-12);
    }

    /// A column in another unit divides its parameter and standard deviation; a torque in another
    /// unit multiplies all of them.
    #[test]
    fn units_scale_parameters(
        powers in prop::collection::vec(-4..=4_i32, COLUMNS),
        torque in -3..=3_i32,
    ) {
        let system = observations();
        let torque = 10_f64.powi(torque);
        let units: Vec<f64> = powers.iter().map(|&p| 10_f64.powi(p)).collect();
        let diagonal = DMatrix::from_diagonal(&DVector::from_column_slice(&units));
        let x = system.matrix().dense() * diagonal;
        let scaled = Observations::new(x, system.measurements() * torque, JOINTS).unwrap();
        let (a, b) = (two_step(&system), two_step(&scaled));
        let back = |values: &DVector<f64>| -> Vec<f64> {
            values.iter().zip(&units).map(|(v, unit)| v * unit / torque).collect()
        };
        prop_assert!(relative_difference(&back(&b.parameters), a.parameters.as_slice()) < 1e-10);
        prop_assert!(
            relative_difference(
                &back(&b.standard_deviations()),
                a.standard_deviations().as_slice(),
            ) < 1e-10
        );
    }
}
