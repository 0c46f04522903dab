//! Matrices in the files of results.

use core::fmt::{LowerExp, Write as _};
use core::ops::Range;
use core::str::FromStr;

use nalgebra::DMatrix;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Numbers in rows, in single or double precision. In JSON each row is one text: numbers apart would take three times the
/// room in an indented file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rows<T>(Vec<Vec<T>>);

/// No rows, whatever their numbers are.
impl<T> Default for Rows<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> From<Vec<Vec<T>>> for Rows<T> {
    fn from(rows: Vec<Vec<T>>) -> Self {
        Self(rows)
    }
}

impl Rows<f32> {
    /// The first so many numbers of each row of a matrix, in single precision.
    #[expect(clippy::cast_possible_truncation, reason = "to single precision")]
    pub(super) fn of(matrix: &DMatrix<f64>, length: impl Fn(usize) -> usize) -> Self {
        Self::taken(matrix, length, |value| value as f32)
    }
}

impl Rows<f64> {
    /// The lower triangle of a matrix.
    pub(super) fn lower_triangle(matrix: &DMatrix<f64>) -> Self {
        Self::taken(matrix, |row| row + 1, |value| value)
    }
}

impl<T: Copy + Into<f64>> Rows<T> {
    fn taken(
        matrix: &DMatrix<f64>,
        length: impl Fn(usize) -> usize,
        to: impl Fn(f64) -> T,
    ) -> Self {
        let row = |k| matrix.row(k).iter().take(length(k)).map(|value| to(*value)).collect();
        Self((0..matrix.nrows()).map(row).collect())
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// One number.
    pub(super) fn at(&self, row: usize, column: usize) -> f64 {
        self.0[row][column].into()
    }

    /// Whether it has so many rows of such lengths.
    pub(super) fn has_shape(&self, rows: usize, length: impl Fn(usize) -> usize) -> bool {
        self.0.len() == rows && self.0.iter().enumerate().all(|(k, row)| row.len() == length(k))
    }

    /// Part of the symmetric matrix whose lower triangle this is.
    pub(super) fn symmetric(&self, part: Range<usize>) -> DMatrix<f64> {
        DMatrix::from_fn(part.len(), part.len(), |i, j| {
            self.at(part.start + i.max(j), part.start + i.min(j))
        })
    }
}

impl<T: LowerExp> Serialize for Rows<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text = |row: &Vec<T>| {
            let mut text = String::new();
            for (k, value) in row.iter().enumerate() {
                // Writing to a String cannot fail.
                let _ = write!(text, "{}{value:e}", if k > 0 { " " } else { "" });
            }
            text
        };
        serializer.collect_seq(self.0.iter().map(text))
    }
}

impl<'de, T: FromStr> Deserialize<'de> for Rows<T> {
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
