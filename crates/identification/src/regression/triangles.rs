//! Triangular factors of each joint's rows, and least squares with them (Golub & Van Loan, *Matrix
//! Computations*, section 5.3).

use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::observation_matrix::ObservationMatrix;
use super::rank;

/// Triangular factors T_j of the rows of each joint in X and y, `[X_j y_j] = Q_j T_j`. An equation
/// with one weight per joint can be solved from these factors alone (Golub & Van Loan, section
/// 5.1.9 on factoring rows in blocks).
#[derive(Clone, Debug)]
pub(super) struct Triangles(Vec<DMatrix<f64>>);

impl Triangles {
    /// Computes the triangular factors of X (r × b) and y (r), r = n N.
    pub(super) fn new(matrix: &ObservationMatrix, measurements: &DVector<f64>) -> Self {
        let (columns, rows) = (matrix.ncols(), matrix.rows_per_joint());
        Self(
            (0..matrix.joints())
                .map(|joint| {
                    // Columns that act on the joint but are 0 along this motion are skipped.
                    let felt =
                        matrix.of_joint(joint).filter(|(_, x)| x.iter().any(|value| *value != 0.0));
                    let mut block = DMatrix::zeros(rows, felt.clone().count() + 1);
                    for (mut to, (_, from)) in block.column_iter_mut().zip(felt.clone()) {
                        to.copy_from_slice(from);
                    }
                    let last = block.ncols() - 1;
                    block.set_column(last, &measurements.rows(joint * rows, rows));
                    let compact = block.qr().unpack_r();
                    let mut triangle = DMatrix::zeros(compact.nrows(), columns + 1);
                    let places = felt.map(|(column, _)| column).chain([columns]);
                    for (from, to) in compact.column_iter().zip(places) {
                        triangle.set_column(to, &from);
                    }
                    triangle
                })
                .collect(),
        )
    }

    /// Stacks the triangular factors, each multiplied by a factor. The result represents the
    /// weighted `[X y]` with fewer rows.
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

    /// Solves least squares with a weight for the rows of each joint. `rows` is the number of rows
    /// of all joints.
    pub(super) fn factor(
        &self,
        rows: usize,
        weights: &[f64],
    ) -> Result<TriangularFactor, RegressionError> {
        let columns = self.0.first().map_or(0, |triangle| triangle.ncols() - 1);
        let triangle = self.scaled(weights).qr().unpack_r();
        let (r, rhs) = (triangle.view((0, 0), (columns, columns)), triangle.column(columns));
        let (r, rhs) = (r.into_owned(), rhs.rows(0, columns));
        let r_inverse = r.solve_upper_triangular(&DMatrix::identity(columns, columns));
        rank::check_rank(&r, r_inverse.as_ref(), rows)?;
        let singular_values = rank::singular_values(&r)?;
        match (r.solve_upper_triangular(&rhs), r_inverse) {
            (Some(parameters), Some(r_inverse)) => {
                Ok(TriangularFactor { parameters, r_inverse, singular_values })
            }
            _ => Err(RegressionError::OutOfRange),
        }
    }
}

/// Result of the QR decomposition of a tall matrix of full rank.
pub(super) struct TriangularFactor {
    pub(super) parameters: DVector<f64>,
    pub(super) r_inverse: DMatrix<f64>,
    pub(super) singular_values: Vec<f64>,
}
