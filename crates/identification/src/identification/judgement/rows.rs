//! Matrices in result files.

use core::fmt::{LowerExp, Write as _};
use core::ops::Range;
use core::str::FromStr;

use nalgebra::DMatrix;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Numbers in rows, in single or double precision. JSON stores each row as one text, because
/// separate numbers would take three times the space in an indented file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MatrixRows<T>(Vec<Vec<T>>);

/// No rows, for any number type.
impl<T> Default for MatrixRows<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl MatrixRows<f64> {
    /// Takes the rows of a matrix.
    pub(super) fn from_matrix(matrix: &DMatrix<f64>) -> Self {
        Self(matrix.row_iter().map(|row| row.iter().copied().collect()).collect())
    }

    /// Returns the numbers in single precision.
    #[expect(clippy::cast_possible_truncation, reason = "to single precision")]
    pub(super) fn to_single(&self) -> MatrixRows<f32> {
        let single = |row: &Vec<f64>| row.iter().map(|value| *value as f32).collect();
        MatrixRows(self.0.iter().map(single).collect())
    }

    /// Takes the lower triangle of a matrix.
    pub(super) fn lower_triangle(matrix: &DMatrix<f64>) -> Self {
        let row = |k| matrix.row(k).iter().take(k + 1).copied().collect();
        Self((0..matrix.nrows()).map(row).collect())
    }
}

impl<T: Copy + Into<f64>> MatrixRows<T> {
    /// Returns the number of rows.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns the matrix of this shape.
    pub(super) fn matrix(&self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |row, column| self.get(row, column))
    }

    /// Returns one number.
    fn get(&self, row: usize, column: usize) -> f64 {
        self.0[row][column].into()
    }

    /// Returns true if there are `rows` rows, and row k has `length(k)` numbers.
    pub(super) fn has_shape(&self, rows: usize, length: impl Fn(usize) -> usize) -> bool {
        self.0.len() == rows && self.0.iter().enumerate().all(|(k, row)| row.len() == length(k))
    }

    /// Returns part of the symmetric matrix whose lower triangle is stored here.
    pub(super) fn symmetric_part(&self, part: Range<usize>) -> DMatrix<f64> {
        DMatrix::from_fn(part.len(), part.len(), |i, j| {
            self.get(part.start + i.max(j), part.start + i.min(j))
        })
    }
}

impl<T: LowerExp> Serialize for MatrixRows<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|row: &Vec<T>| {
            let mut text = String::new();
            for (k, value) in row.iter().enumerate() {
                // Writing to a String cannot fail.
                let _ = write!(text, "{}{value:e}", if k > 0 { " " } else { "" });
            }
            text
        }))
    }
}

impl<'de, T: FromStr> Deserialize<'de> for MatrixRows<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let number = |text: &str| {
            text.parse()
                .map_err(|_| D::Error::custom(format!("`{text}` in a row of numbers is none")))
        };
        let rows = Vec::<String>::deserialize(deserializer)?;
        let rows = rows.iter().map(|row| row.split_whitespace().map(number).collect());
        Ok(Self(rows.collect::<Result<_, _>>()?))
    }
}
