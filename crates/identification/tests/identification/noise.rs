//! White noise on the torque: the standard deviations are as wide as the scatter of the estimates.

use didim_identification::identification::{
    Experiment, Method, Selection, filtered_motion, identify, observation_matrix,
};
use didim_identification::regression::Observations;
use nalgebra::DVector;

use crate::common::arm::{Arm, Random, options, signals};

const DRAWS: usize = 300;
/// Noise level per joint \[N·m\]. The levels are estimated from ordinary residuals, into which a
/// noisy joint carries its parameter errors; with few rows and levels far apart, that of the
/// quietest joint would come out too high.
const NOISE: [f64; 3] = [0.3, 0.2, 0.15];

/// Mean of z² per parameter over the draws; 1 when σ is right. With 300 draws its own standard
/// deviation is √(2/300) = 0.082.
struct Scatter {
    squares: Vec<f64>,
}

impl Scatter {
    fn new(parameters: usize) -> Self {
        Self { squares: vec![0.0; parameters] }
    }

    fn add(&mut self, values: impl Iterator<Item = (f64, f64)>, truth: &[f64]) {
        for ((sum, (value, sigma)), truth) in self.squares.iter_mut().zip(values).zip(truth) {
            *sum += ((value - truth) / sigma).powi(2) / DRAWS as f64;
        }
    }

    fn check(&self, expected: f64, what: &str) {
        let four = 4.0 * (2.0 / DRAWS as f64).sqrt() * expected;
        for (parameter, mean) in self.squares.iter().enumerate() {
            assert!(
                (mean - expected).abs() < four,
                "{what}: z² of parameter {parameter} is {mean:.3} instead of {expected} ± {four:.3}"
            );
        }
        let total_mean = self.squares.iter().sum::<f64>() / self.squares.len() as f64;
        assert!(
            (total_mean - expected).abs() < 0.5 * four,
            "{what}: mean z² is {total_mean:.3} instead of {expected}"
        );
    }
}

#[test]
fn ordinary_and_weighted_deviations_cover_white_noise() {
    let mut random = Random(5);
    let arm = Arm::random(&mut random, 3);
    let options = options(20.0, 0.8, 10);
    let position = arm.positions(&mut random, 4000, 400.0, 3.0);
    let silent = signals(400.0, position.clone(), position);
    let experiment = Experiment::joint_side(&silent).unwrap();
    let motion = filtered_motion(&arm.robot, &experiment, &options.position_filter).unwrap();
    let decimation = options.decimation_filter.design().unwrap();
    let selection = Selection::new(&arm.robot, &arm.base, None).unwrap();
    let matrix = observation_matrix(&arm.model, &selection, &motion, &decimation, 0..4000).unwrap();
    let truth = arm.true_base();
    let exact = &matrix * DVector::from_column_slice(&truth);

    let (mut ordinary, mut weighted) = (Scatter::new(truth.len()), Scatter::new(truth.len()));
    let rows = matrix.nrows() / 3;
    for _ in 0..DRAWS {
        let noisy =
            DVector::from_fn(exact.len(), |k, _| exact[k] + NOISE[k / rows] * random.normal());
        let observations = Observations::new(matrix.clone(), noisy, 3).unwrap();
        let first = observations.solve_ordinary().unwrap();
        let second =
            observations.solve_weighted(&observations.noise_levels(&first.residuals)).unwrap();
        for (scatter, solution) in [(&mut ordinary, first), (&mut weighted, second)] {
            let sigma = solution.standard_deviations();
            let values = solution.parameters.iter().copied().zip(sigma.iter().copied());
            scatter.add(values, &truth);
        }
    }
    ordinary.check(1.0, "ordinary");
    weighted.check(1.0, "weighted");
}

/// Through the whole method: white noise of every sample comes out of the decimation filter with
/// correlation between rows, so the classical σ is small by √(1/0.8). The corrected one is not.
#[test]
fn only_corrected_deviations_cover_noise_behind_the_decimation() {
    let mut random = Random(6);
    let arm = Arm::random(&mut random, 2);
    let options = options(20.0, 0.8, 8);
    let position = arm.positions(&mut random, 3200, 400.0, 3.0);
    let silent = signals(400.0, position.clone(), position.clone());
    let experiment = Experiment::joint_side(&silent).unwrap();
    let motion = filtered_motion(&arm.robot, &experiment, &options.position_filter).unwrap();
    let exact = arm.torques(&motion);
    let truth = arm.true_base();

    let (mut classical, mut corrected) = (Scatter::new(truth.len()), Scatter::new(truth.len()));
    for _ in 0..DRAWS {
        let noisy = exact.iter().zip(NOISE).map(|(torque, level)| {
            torque.iter().map(|tau| tau + level * random.normal()).collect()
        });
        let signals = signals(400.0, position.clone(), noisy.collect());
        let experiment = Experiment::joint_side(&signals).unwrap();
        let estimate = identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options)
            .unwrap()
            .estimate;
        let parameters = estimate.parameters.iter();
        let values = parameters.clone().map(|p| (p.value, p.classical_standard_deviation));
        classical.add(values, &truth);
        corrected.add(parameters.map(|p| (p.value, p.standard_deviation)), &truth);
    }
    classical.check(1.0 / 0.8, "classical");
    corrected.check(1.0, "corrected");
}
