//! M-estimates against statsmodels (`golden/robust.py`), and what they must do to noise.

use didim_identification::regression::{
    Observations, RegressionError, ResidualAnalysis, RobustLoss, RobustSolution, RowFilter,
};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const LOSSES: [(&str, RobustLoss); 2] = [
    ("huber", RobustLoss::Huber { tuning: 1.345 }),
    ("bisquare", RobustLoss::Bisquare { tuning: 4.685 }),
];

fn robust(system: &Observations, loss: RobustLoss) -> RobustSolution {
    system.fit_robust(loss, &system.robust_noise_levels(loss).unwrap()).unwrap()
}

#[test]
fn parameters_and_covariance_agree_with_statsmodels() {
    let golden: toml::Table = include_str!("golden/robust.toml").parse().unwrap();
    let floats = |value: &toml::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect()
    };
    let y = DVector::from_vec(floats(&golden["y"]));
    let scale = [1.0, 10.0, 0.1, 1.0];
    let x = DMatrix::from_fn(y.len(), 4, |r, c| {
        (((r * r * 31 + r * c * 17 + c * 7) % 211) as f64 / 211.0 - 0.5) * scale[c]
    });
    let system = Observations::new(x, y, 1).unwrap();
    for (name, loss) in LOSSES {
        let solution = robust(&system, loss);
        // The iteration ends at 1e-6 standard deviations, the next step is a small part of that.
        let deviations = solution.solution.standard_deviations();
        let expected = DVector::from_vec(floats(&golden[name]["parameters"]));
        let difference = (&solution.solution.parameters - expected).component_div(&deviations);
        assert!(difference.amax() < 1e-6, "{name}: {}", difference.amax());
        let expected = DMatrix::from_vec(4, 4, floats(&golden[name]["covariance"]));
        let difference = (&solution.solution.covariance - &expected).component_div(&expected);
        assert!(difference.amax() < 1e-5, "{name}: {}", difference.amax());
        let downweighted = golden[name]["downweighted"].as_integer().unwrap();
        assert_eq!(i64::try_from(solution.downweighted_rows_per_joint[0]).unwrap(), downweighted);
    }
}

const JOINTS: usize = 3;
const ROWS: usize = 150;
const PARAMETERS: usize = 8;
const REPETITIONS: u64 = 300;
/// Noise level of each joint.
const NOISE: [f64; JOINTS] = [1.0, 0.3, 2.0];

fn matrix() -> DMatrix<f64> {
    DMatrix::from_fn(JOINTS * ROWS, PARAMETERS, |r, c| {
        let t = (r % ROWS) as f64 / ROWS as f64 * core::f64::consts::TAU;
        let of_joint = r / ROWS == c % JOINTS || (c % 2 == 1 && r / ROWS + 1 == c % JOINTS);
        if of_joint {
            (t * (1.0 + 0.7 * c as f64)).sin() + 0.3 * (t * 3.0).cos().signum()
        } else {
            0.0
        }
    })
}

/// The equation with normal errors, and every so many rows with one that is 30 times as large.
fn equation(seed: u64, outliers_every: Option<usize>) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let x = matrix();
    let truth = DVector::from_element(PARAMETERS, 1.0);
    let noise = DVector::from_fn(x.nrows(), |row, _| {
        let normal: f64 = StandardNormal.sample(&mut random);
        let outlier = outliers_every.is_some_and(|every| row % every == every / 2);
        NOISE[row / ROWS] * if outlier { 30.0 + normal } else { normal }
    });
    let y = &x * truth + noise;
    Observations::new(x, y, JOINTS).unwrap()
}

fn plain(system: &Observations) -> didim_identification::regression::Solution {
    let levels = system.noise_levels(&system.solve_ordinary().unwrap().residuals);
    system.solve_weighted(&levels).unwrap()
}

/// With normal errors, a loss of 5 % of efficiency makes the estimates differ from least squares by
/// √(1/0.95 − 1) = 0.23 of their standard deviations (rms); their own scatter is what they say.
/// With outliers in 4 % of the rows, all to one side, least squares is wrong.
#[test]
fn the_scatter_is_what_the_deviations_say() {
    let filter = RowFilter::new(ROWS, 1.0, |_| 1.0);
    for (name, loss) in LOSSES {
        for outliers in [None, Some(25)] {
            let (mut own, mut corrected, mut squares, mut difference) = (0.0, 0.0, 0.0, 0.0);
            for seed in 0..REPETITIONS {
                let system = equation(seed, outliers);
                let (found, least) = (robust(&system, loss), plain(&system));
                let analysis =
                    ResidualAnalysis::new(&found.pseudo_equation, &found.solution, &filter);
                let covariance = analysis.covariance();
                let sigma = found.solution.standard_deviations();
                for c in 0..PARAMETERS {
                    let (value, other) = (found.solution.parameters[c], least.parameters[c]);
                    own += ((value - 1.0) / sigma[c]).powi(2);
                    corrected += (value - 1.0).powi(2) / covariance[(c, c)];
                    squares += (other - 1.0).powi(2) / least.covariance[(c, c)];
                    difference += ((value - other) / sigma[c]).powi(2);
                }
            }
            let count = REPETITIONS as f64 * PARAMETERS as f64;
            let [own, corrected, squares, spread] =
                [own, corrected, squares, difference].map(|sum: f64| (sum / count).sqrt());
            println!(
                "{name}, {outliers:?}: {own:.3}, corrected {corrected:.3}, least squares \
                 {squares:.3}, {spread:.3} apart"
            );
            match outliers {
                // 2400 values: 1.4 % of their rms.
                None => {
                    assert!((own - 1.0).abs() < 0.06 && (corrected - 1.0).abs() < 0.08, "{name}");
                    assert!((0.18..0.28).contains(&spread), "{name}: {spread}");
                }
                // One-sided outliers still pull at Huber's estimate, at the bisquare's they do not.
                Some(_) => {
                    let most = if name == "huber" { 1.5 } else { 1.1 };
                    assert!(own < most && corrected < most, "{name}: {own} {corrected}");
                    assert!(spread > 3.0, "{name}: {spread}");
                }
            }
        }
    }
}

#[test]
fn with_infinite_tuning_it_is_least_squares() {
    let system = equation(1, Some(25));
    for loss in [
        RobustLoss::Huber { tuning: f64::INFINITY },
        RobustLoss::Bisquare { tuning: f64::INFINITY },
        RobustLoss::Huber { tuning: 1e9 },
    ] {
        let (found, plain) = (robust(&system, loss), plain(&system));
        let difference = (&found.solution.parameters - &plain.parameters).norm();
        assert!(difference < 1e-12 * plain.parameters.norm(), "{loss:?}: {difference}");
        let difference = (&found.solution.covariance - &plain.covariance).norm();
        assert!(difference < 1e-12 * plain.covariance.norm(), "{loss:?}: {difference}");
        assert_eq!(found.downweighted_rows_per_joint, [0; JOINTS]);
    }
}

#[test]
fn an_exact_equation_has_no_outliers() {
    let x = matrix();
    let y = &x * DVector::from_element(PARAMETERS, 1.0);
    let system = Observations::new(x, y, JOINTS).unwrap();
    for (name, loss) in LOSSES {
        let solution = robust(&system, loss);
        assert!((solution.solution.parameters.add_scalar(-1.0)).amax() < 1e-12, "{name}");
        assert_eq!(solution.downweighted_rows_per_joint, [0; JOINTS]);
    }
}

#[test]
fn a_tuning_that_leaves_nothing_is_refused() {
    let system = equation(1, None);
    for tuning in [0.0, -1.0, f64::NAN] {
        let error = system.fit_robust(RobustLoss::Huber { tuning }, &NOISE).unwrap_err();
        assert!(matches!(error, RegressionError::Tuning { .. }), "{error}");
    }
    let error = system.fit_robust(RobustLoss::Bisquare { tuning: 0.05 }, &NOISE).unwrap_err();
    assert!(matches!(error, RegressionError::NotSettled { .. }), "{error}");
}
