//! Matrices of limited precision in result files.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;
use nalgebra::DMatrix;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Numbers in rows, each a multiple of the scale of its row. JSON stores a row as one text: the
/// scale, a space, and the multiples in base64 as 16-bit integers, least significant byte first.
/// A number is exact to 1.5e-5 of the largest number of its row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ScaledRows(Vec<ScaledRow>);

#[derive(Clone, Debug, PartialEq)]
struct ScaledRow {
    scale: f32,
    multiples: Vec<i16>,
}

impl ScaledRow {
    /// Takes numbers; those that are not finite become 0, with a scale that is not finite.
    #[expect(clippy::cast_possible_truncation, reason = "at most the largest 16-bit integer")]
    fn from_numbers(numbers: &[f64]) -> Self {
        let largest = numbers.iter().fold(0.0, |largest: f64, number| match number.is_finite() {
            true => largest.max(number.abs()),
            false => f64::INFINITY,
        });
        let scale = (largest / f64::from(i16::MAX)) as f32;
        let multiple = |number: &f64| match scale > 0.0 {
            true => (number / f64::from(scale)).round() as i16,
            false => 0,
        };
        Self { scale, multiples: numbers.iter().map(multiple).collect() }
    }

    fn to_text(&self) -> String {
        let bytes: Vec<u8> = self.multiples.iter().flat_map(|of| of.to_le_bytes()).collect();
        format!("{:e} {}", self.scale, STANDARD_NO_PAD.encode(bytes))
    }

    /// Returns `None` if the text is damaged.
    fn from_text(text: &str) -> Option<Self> {
        let (scale, multiples) = text.split_once(' ')?;
        let bytes = STANDARD_NO_PAD.decode(multiples).ok()?;
        let (pairs, rest) = bytes.as_chunks::<2>();
        let multiples = pairs.iter().map(|pair| i16::from_le_bytes(*pair)).collect();
        rest.is_empty().then_some(Self { scale: scale.parse().ok()?, multiples })
    }
}

impl ScaledRows {
    /// Takes a matrix.
    pub(super) fn from_matrix(matrix: &DMatrix<f64>) -> Self {
        let row = |k| matrix.row(k).iter().copied().collect::<Vec<f64>>();
        Self((0..matrix.nrows()).map(|k| ScaledRow::from_numbers(&row(k))).collect())
    }

    /// Takes the lower triangle L of a covariance LLᵀ. The factor keeps the covariance positive,
    /// and the small variance of a sum of strongly correlated values. A direction whose variance
    /// rounding has made negative gets none. Empty if a variance is negative or not finite.
    pub(super) fn factor_of(covariance: &DMatrix<f64>) -> Self {
        let size = covariance.nrows();
        let diagonal = covariance.diagonal();
        if !diagonal.iter().all(|variance| variance.is_finite() && *variance >= 0.0) {
            return Self::default();
        }
        let mut factor = DMatrix::<f64>::zeros(size, size);
        for column in 0..size {
            let pivot = remainder(covariance, &factor, (column, column));
            if pivot <= f64::EPSILON * diagonal[column] {
                continue;
            }
            factor[(column, column)] = pivot.sqrt();
            for row in column + 1..size {
                factor[(row, column)] =
                    remainder(covariance, &factor, (row, column)) / factor[(column, column)];
            }
        }
        let row = |k: usize| factor.row(k).iter().take(k + 1).copied().collect::<Vec<f64>>();
        Self((0..size).map(|k| ScaledRow::from_numbers(&row(k))).collect())
    }

    /// Returns the number of rows.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if there are `rows` rows, and row k has `length(k)` numbers.
    pub(super) fn has_shape(&self, rows: usize, length: impl Fn(usize) -> usize) -> bool {
        let fits = |(k, row): (usize, &ScaledRow)| row.multiples.len() == length(k);
        self.0.len() == rows && self.0.iter().enumerate().all(fits)
    }

    /// Returns the matrix of these rows, with zeros after the end of a shorter one.
    pub(super) fn matrix(&self, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), columns, |row, column| {
            let ScaledRow { scale, multiples } = &self.0[row];
            multiples.get(column).map_or(0.0, |of| f64::from(*scale) * f64::from(*of))
        })
    }
}

/// Returns an element of a covariance without the contribution of the factor's earlier columns.
fn remainder(
    covariance: &DMatrix<f64>,
    factor: &DMatrix<f64>,
    (row, column): (usize, usize),
) -> f64 {
    let [own, other] = [row, column].map(|k| factor.view((k, 0), (1, column)));
    covariance[(row, column)] - own.dot(&other)
}

impl Serialize for ScaledRows {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(ScaledRow::to_text))
    }
}

impl<'de> Deserialize<'de> for ScaledRows {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let rows = Vec::<String>::deserialize(deserializer)?;
        let damaged = || D::Error::custom("a row is not a scale and numbers in base64");
        let row = |text: &String| ScaledRow::from_text(text).ok_or_else(damaged);
        Ok(Self(rows.iter().map(row).collect::<Result<_, _>>()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: &DMatrix<f64>, expected: &DMatrix<f64>, of_deviation: f64) {
        for (row, column) in
            (0..found.nrows()).flat_map(|i| (0..found.ncols()).map(move |j| (i, j)))
        {
            let unit = (expected[(row, row)] * expected[(column, column)]).sqrt();
            let error = (found[(row, column)] - expected[(row, column)]).abs() / unit;
            assert!(error < of_deviation, "{row} {column}: {error}");
        }
    }

    #[test]
    fn rows_are_read_as_they_were_written() {
        let matrix = DMatrix::from_row_slice(2, 3, &[1.0, -0.25, 1e-3, 0.0, 0.0, 0.0]);
        let rows = ScaledRows::from_matrix(&matrix);
        let text = toml::to_string(&std::collections::BTreeMap::from([("rows", &rows)])).unwrap();
        let read: std::collections::BTreeMap<String, ScaledRows> = toml::from_str(&text).unwrap();
        assert_eq!(read["rows"], rows);
        assert!((read["rows"].matrix(3) - matrix).amax() < 1.6e-5);
        for damaged in ["", "1", "1 !", "x AAA", "1 AA"] {
            assert_eq!(ScaledRow::from_text(damaged), None, "{damaged}");
        }
    }

    #[test]
    fn a_covariance_keeps_the_small_variance_of_a_sum() {
        // Two values of very different units, which are known a thousand times better as a sum.
        let (small, rho) = (1e-3, 1e-6 - 1.0);
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, small * rho, small * rho, small * small]);
        let factor = ScaledRows::factor_of(&matrix).matrix(2);
        let found = &factor * factor.transpose();
        close(&found, &matrix, 1e-4);
        let sum = |of: &DMatrix<f64>| {
            of[(0, 0)] + 2.0 * of[(0, 1)] / small + of[(1, 1)] / (small * small)
        };
        assert!((sum(&found) / sum(&matrix) - 1.0).abs() < 0.05, "{}", sum(&found));
    }

    #[test]
    fn a_direction_without_variance_has_none_and_a_negative_one_is_refused() {
        let matrix = DMatrix::from_row_slice(3, 3, &[4.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let factor = ScaledRows::factor_of(&matrix).matrix(3);
        assert!((&factor * factor.transpose() - matrix).amax() < 1e-3);
        let negative = DMatrix::from_diagonal_element(2, 2, -1.0);
        assert_eq!(ScaledRows::factor_of(&negative).len(), 0);
    }
}
