//! Correlation of the parameter errors.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::MatrixRows;

/// Covariance of the parameters of a result, in their units and order, corrected for the colour of
/// the residuals. It is used to find a consistent model and a payload. JSON stores the rows of its
/// lower triangle, one text each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct ParameterCovariance(#[schemars(with = "Vec<String>")] MatrixRows<f64>);

impl ParameterCovariance {
    /// Creates the covariance from a symmetric matrix.
    pub fn from_symmetric(matrix: &DMatrix<f64>) -> Self {
        Self(MatrixRows::lower_triangle(matrix))
    }

    /// Returns the covariance of this number of parameters (b × b). Returns `None` if the size
    /// differs or a number is not finite.
    pub fn matrix(&self, parameters: usize) -> Option<DMatrix<f64>> {
        let fits = self.0.has_shape(parameters, |row| row + 1);
        let matrix = fits.then(|| self.0.symmetric_part(0..parameters));
        matrix.filter(|matrix| matrix.iter().all(|value| value.is_finite()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize, Deserialize)]
    struct Stored {
        covariance: ParameterCovariance,
    }

    #[test]
    fn what_is_stored_is_read_to_the_bit() {
        let matrix = DMatrix::from_fn(3, 3, |i, j| 1.0 / (1.0 + i as f64 + j as f64));
        let stored = Stored { covariance: ParameterCovariance::from_symmetric(&matrix) };
        let stored = toml::to_string(&stored).unwrap();
        let read: Stored = toml::from_str(&stored).unwrap();
        assert_eq!(read.covariance.matrix(3), Some(matrix));
        assert_eq!(read.covariance.matrix(2), None);
        let broken: Stored = toml::from_str("covariance = ['1', '0 inf']").unwrap();
        assert_eq!(broken.covariance.matrix(2), None);
        assert!(toml::from_str::<Stored>("covariance = ['one']").is_err());
    }
}
