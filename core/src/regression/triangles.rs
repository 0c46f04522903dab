//! The rows of each joint by their triangles, and what solves them (Golub & Van Loan, *Matrix
//! Computations*, section 5.3).

use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::rank;

/// The rows of each joint in X and y, `[X_j y_j] = Q_j T_j`, by T_j alone: all that weights of joints
/// leave of an equation (Golub & Van Loan, section 5.1.9 on factoring rows in blocks).
#[derive(Clone, Debug)]
pub(super) struct Triangles(Vec<DMatrix<f64>>);

impl Triangles {
    /// Of X (r × b) and y (r), r = n N.
    pub(super) fn of(matrix: &DMatrix<f64>, measurements: &DVector<f64>, joints: usize) -> Self {
        let (columns, rows) = (matrix.ncols(), matrix.nrows() / joints);
        let triangle = |joint| {
            let x = matrix.rows(joint * rows, rows);
            // A joint feels what hangs on it: the other columns are 0.
            let felt: Vec<usize> = (0..columns)
                .filter(|&column| x.column(column).iter().any(|value| *value != 0.0))
                .collect();
            let mut block = DMatrix::zeros(rows, felt.len() + 1);
            for (mut to, &from) in block.column_iter_mut().zip(&felt) {
                to.copy_from(&x.column(from));
            }
            block.set_column(felt.len(), &measurements.rows(joint * rows, rows));
            let compact = block.qr().unpack_r();
            let mut triangle = DMatrix::zeros(compact.nrows(), columns + 1);
            for (from, &to) in compact.column_iter().zip(felt.iter().chain([&columns])) {
                triangle.set_column(to, &from);
            }
            triangle
        };
        Self((0..joints).map(triangle).collect())
    }

    /// One below the other, each times a factor: `[X y]` of fewer rows.
    pub(super) fn scaled(&self, factors: &[f64]) -> DMatrix<f64> {
        let rows: usize = self.0.iter().map(DMatrix::nrows).sum();
        let columns = self.0.first().map_or(0, DMatrix::ncols);
        let mut stacked = DMatrix::zeros(rows.max(columns), columns);
        let mut first = 0;
        for (triangle, factor) in self.0.iter().zip(factors) {
            let mut part = stacked.rows_mut(first, triangle.nrows());
            part.copy_from(triangle);
            part *= *factor;
            first += triangle.nrows();
        }
        stacked
    }

    /// Least squares with each joint's `rows / n` rows times its weight.
    pub(super) fn factor(&self, rows: usize, weights: &[f64]) -> Result<Factor, RegressionError> {
        let columns = self.0.first().map_or(0, |triangle| triangle.ncols() - 1);
        let triangle = self.scaled(weights).qr().unpack_r();
        let (r, rhs) = (triangle.view((0, 0), (columns, columns)), triangle.column(columns));
        let (r, rhs) = (r.into_owned(), rhs.rows(0, columns));
        let r_inverse = r.solve_upper_triangular(&DMatrix::identity(columns, columns));
        rank::check(&r, r_inverse.as_ref(), rows)?;
        let singular_values = rank::singular_values(&r)?;
        match (r.solve_upper_triangular(&rhs), r_inverse) {
            (Some(parameters), Some(r_inverse)) => {
                Ok(Factor { parameters, r_inverse, singular_values })
            }
            _ => Err(RegressionError::OutOfRange),
        }
    }
}

/// What the QR decomposition of a tall matrix of full rank gives.
pub(super) struct Factor {
    pub(super) parameters: DVector<f64>,
    pub(super) r_inverse: DMatrix<f64>,
    pub(super) singular_values: Vec<f64>,
}
