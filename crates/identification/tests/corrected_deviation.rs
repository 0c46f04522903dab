//! Standard deviations against many repetitions of the same experiment with known parameters.

use core::f64::consts::TAU;

use didim_identification::regression::{LjungBox, Observations, ResidualAnalysis, RowFilter};
use didim_identification::signal::ParallelDecimation;
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const JOINTS: usize = 3;
const PARAMETERS: usize = 12;
const FACTOR: usize = 25;
/// Of each joint, after decimation.
const ROWS: usize = 280;
/// The same in a short record: with 12 parameters, twelve independent rows for each.
const FEW_ROWS: usize = 60;

struct Noise {
    random: ChaCha8Rng,
    /// Correlation from one unfiltered sample to the next.
    memory: f64,
    last: Vec<f64>,
}

impl Noise {
    fn new(seed: u64, memory: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let last = (0..JOINTS).map(|_| StandardNormal.sample(&mut random)).collect();
        Self { random, memory, last }
    }

    /// The next sample of every joint, of variance 1; the last two joints share some of it.
    fn next(&mut self) -> Vec<f64> {
        let fresh = (1.0 - self.memory * self.memory).sqrt();
        for last in &mut self.last {
            let normal: f64 = StandardNormal.sample(&mut self.random);
            *last = self.memory * *last + fresh * normal;
        }
        let mut values = self.last.clone();
        values[2] = 0.6 * values[1] + 0.8 * values[2];
        values
    }
}

/// Signals of every joint, filtered and decimated: the rows of each joint together.
fn rows(
    count: usize,
    decimation: &ParallelDecimation,
    mut next: impl FnMut(usize) -> Vec<f64>,
) -> DVector<f64> {
    let margin = 20 * FACTOR;
    let samples = count * FACTOR + 2 * margin;
    let mut signals = vec![Vec::new(); JOINTS];
    for k in 0..samples {
        for (signal, value) in signals.iter_mut().zip(next(k)) {
            signal.push(value);
        }
    }
    let rows = signals.iter_mut().flat_map(|signal| {
        decimation.filter(signal).unwrap();
        decimation
            .kept_samples(margin..margin + count * FACTOR)
            .map(|k| signal[k])
            .collect::<Vec<_>>()
    });
    DVector::from_iterator(count * JOINTS, rows)
}

/// Columns like those of an arm: something slow, and something that jumps with its sign.
fn matrix(count: usize, decimation: &ParallelDecimation) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = (0..PARAMETERS)
        .map(|c| {
            rows(count, decimation, |k| {
                let t = TAU * k as f64 / (count * FACTOR) as f64;
                (0..JOINTS)
                    .map(|joint: usize| {
                        let slow = (t * (3.0 + 1.3 * c as f64 + joint as f64)).sin();
                        let jump = (t * (7.0 + 0.7 * c as f64)).cos().signum();
                        // A parameter is of one joint, and of the one before as well if it is odd.
                        let of_joint =
                            joint == c % JOINTS || (c % 2 == 1 && joint + 1 == c % JOINTS);
                        if of_joint { slow + 0.5 * jump } else { 0.0 }
                    })
                    .collect()
            })
        })
        .collect();
    DMatrix::from_columns(&columns)
}

struct Scatter {
    /// Root mean square of (estimate − truth)/σ, classical and corrected.
    classical: f64,
    corrected: f64,
    /// Share of the estimates within 2 and 3 corrected σ.
    within: [f64; 2],
    /// The probability that every joint's residuals are white noise, of all repetitions.
    whiteness: Vec<f64>,
}

fn scatter(count: usize, memory: f64, repetitions: u64) -> Scatter {
    let decimation = ParallelDecimation::chebyshev1(8, 0.05, 0.8, FACTOR).unwrap();
    let x = matrix(count, &decimation);
    let noise_power = |ratio| decimation.noise_power(ratio);
    let filter = RowFilter::new(count, decimation.cutoff_ratio(), noise_power);
    let truth = DVector::from_fn(PARAMETERS, |c, _| 1.0 + c as f64);
    let (mut sums, mut whiteness) = ([0.0; 4], Vec::new());
    for seed in 0..repetitions {
        let mut noise = Noise::new(seed, memory);
        let noise = rows(count, &decimation, |_| {
            noise.next().iter().zip([1.0, 0.7, 1.5]).map(|(value, size)| size * value).collect()
        });
        let y = &x * &truth + noise;
        let observations = Observations::new(x.clone(), y, JOINTS).unwrap();
        let levels = observations.noise_levels(&observations.solve_ordinary().unwrap().residuals);
        let solution = observations.solve_weighted(&levels).unwrap();
        let analysis = ResidualAnalysis::new(&observations, &solution, &filter);
        let corrected = analysis.covariance();
        let tests = analysis.spectrum().ljung_box_per_joint();
        whiteness.extend(tests.iter().map(LjungBox::probability));
        for c in 0..PARAMETERS {
            let deviation = solution.parameters[c] - truth[c];
            let z = deviation / corrected[(c, c)].sqrt();
            sums[0] += deviation * deviation / solution.covariance[(c, c)];
            sums[1] += z * z;
            sums[2] += f64::from(u8::from(z.abs() <= 2.0));
            sums[3] += f64::from(u8::from(z.abs() <= 3.0));
        }
    }
    let [classical, corrected, two, three] =
        sums.map(|sum| sum / (repetitions as f64 * PARAMETERS as f64));
    let within = [two, three];
    Scatter { classical: classical.sqrt(), corrected: corrected.sqrt(), within, whiteness }
}

/// 400 repetitions of 12 parameters: the standard error of a root mean square is about 0.011, of
/// the share within 2 σ about 0.4 %, of that within 3 σ about 0.1 %.
fn check(memory: f64, classical: core::ops::Range<f64>) -> Scatter {
    let study = scatter(ROWS, memory, 400);
    println!("{:.3} {:.3} {:?}", study.classical, study.corrected, study.within);
    assert!(classical.contains(&study.classical), "classical {}", study.classical);
    assert!((study.corrected - 1.0).abs() < 0.06, "corrected {}", study.corrected);
    assert!((study.within[0] - 0.9545).abs() < 0.02, "within 2: {}", study.within[0]);
    assert!(study.within[1] > 0.99, "within 3: {}", study.within[1]);
    study
}

/// White noise that passed the filter: the classical σ is small by √(1/0.8) = 1.12.
#[test]
fn corrects_for_the_decimation_filter() {
    let mut whiteness = check(0.0, 1.09..1.15).whiteness;
    // Kolmogorov's statistic of 1200 probabilities, which are uniform: above 1.63/√1200 = 0.047 in
    // one of a hundred.
    whiteness.sort_by(f64::total_cmp);
    let count = whiteness.len() as f64;
    let steps = whiteness.iter().enumerate();
    let distance = |(k, p): (usize, &f64)| (p - (k as f64 + 0.5) / count).abs() + 0.5 / count;
    let distance = steps.map(distance).fold(0.0, f64::max);
    let below = |level: f64| whiteness.iter().filter(|p| **p < level).count() as f64 / count;
    println!("{distance:.3} from uniform; {:.4} {:.4} {:.4}", below(0.01), below(0.05), below(0.2));
    assert!(distance < 1.63 / count.sqrt(), "{distance}");
    // Standard errors of 0.3 and 0.6 %.
    assert!(below(0.01) < 0.02 && (0.03..0.07).contains(&below(0.05)), "{}", below(0.05));
}

/// Noise that remembers 1.5 rows.
#[test]
fn corrects_for_coloured_noise() {
    let study = check((-1.0 / (1.5 * FACTOR as f64)).exp(), 1.4..2.2);
    assert!(study.whiteness.iter().all(|p| *p < 1e-3));
}

/// As few rows as the verdict allows: σ is uncertain itself then, and the deviations are wider than
/// normal ones, but it is no lie.
#[test]
fn corrects_in_short_records_too() {
    for memory in [0.0, (-1.0 / (1.5 * FACTOR as f64)).exp()] {
        let study = scatter(FEW_ROWS, memory, 400);
        println!("{:.3} {:.3} {:?}", study.classical, study.corrected, study.within);
        assert!((0.9..1.2).contains(&study.corrected), "corrected {}", study.corrected);
        assert!(study.within[0] > 0.88, "within 2: {}", study.within[0]);
    }
}
