//! Variance of a joint's external torque by the parameters.

use nalgebra::DMatrix;

/// Number of partial sums, which vector instructions compute together.
const PARTS: usize = 4;

/// Returns the scalar product.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; PARTS];
    let (a, b) = (a.chunks_exact(PARTS), b.chunks_exact(PARTS));
    let rest = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum::<f64>();
    for (a, b) in a.zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Covariance of the parameters that act on one joint.
#[derive(Clone, Debug)]
pub(super) struct RowCovariance {
    /// Places of the joint's entries.
    entries: Vec<usize>,
    /// Lower triangle, row by row, with doubled entries off the diagonal.
    triangle: Vec<f64>,
    /// The joint's entries of one sample.
    row: Vec<f64>,
}

impl RowCovariance {
    /// Selects the covariance of a joint's parameters. `entries` are joint and column of all
    /// entries.
    pub(super) fn new(covariance: &DMatrix<f64>, entries: &[(usize, usize)], joint: usize) -> Self {
        let places = entries.iter().enumerate().filter(|(_, (row, _))| *row == joint);
        let (entries, columns): (Vec<_>, Vec<_>) =
            places.map(|(place, (_, column))| (place, *column)).unzip();
        let mut triangle = Vec::with_capacity(entries.len() * (entries.len() + 1) / 2);
        for (a, row) in columns.iter().enumerate() {
            triangle.extend(columns[..a].iter().map(|column| 2.0 * covariance[(*row, *column)]));
            triangle.push(covariance[(*row, *row)]);
        }
        Self { row: vec![0.0; entries.len()], entries, triangle }
    }

    /// Returns the variance y Σ yᵀ of a joint with these entries.
    pub(super) fn variance(&mut self, values: &[f64]) -> f64 {
        for (value, place) in self.row.iter_mut().zip(&self.entries) {
            *value = values[*place];
        }
        let (mut variance, mut rest) = (0.0, self.triangle.as_slice());
        for a in 0..self.row.len() {
            let (weights, next) = rest.split_at(a + 1);
            variance += self.row[a] * dot(weights, &self.row[..=a]);
            rest = next;
        }
        variance.max(0.0)
    }
}
