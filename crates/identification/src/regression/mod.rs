//! Tall linear least squares with the statistics of its result (paper, section 3.1.2).
//!
//! The system is `y = X θ + ε` (equation 7), with the rows of each joint together (equation 8). The
//! documentation of every result states its matrix: **X**, the given observation matrix, or
//! **Ω^{-1/2} X**, with each joint's rows divided by its noise level.
//!
//! | | ordinary | weighted |
//! |---|---|---|
//! | minimises | ‖y − Xθ‖² | Σ_j ‖y_j − X_j θ‖²/σ_j² |
//! | covariance | sandwich, σ_j² from its own residuals | (Xᵀ Ω⁻¹ X)⁻¹ with the σ_j given |
//! | singular values | of X | of Ω^{-1/2} X |
//!
//! All solutions use Householder QR decompositions: first of the rows of each joint, then of the
//! stacked triangular factors. The normal equations would square the condition number; they are
//! used only where alternatives are compared.

mod analysis;
mod autocorrelation;
mod cholesky;
mod error;
mod exclusion;
mod extension;
mod fourier;
mod further;
mod heavy_tails;
mod limits;
mod ljung_box;
mod observation_matrix;
mod observations;
mod prior;
mod products;
mod rank;
mod residuals;
mod robust;
mod row_filter;
mod solution;
mod spectra;
mod spectrum;
mod spectrum_shape;
mod triangles;

pub use analysis::ResidualAnalysis;
pub use autocorrelation::{NoiseAutocorrelation, autocorrelation};
pub(crate) use cholesky::CholeskyFactor;
pub use error::RegressionError;
pub use exclusion::Exclusion;
pub use extension::Extension;
pub(crate) use further::gram_matrix;
pub use further::{FurtherColumn, FurtherColumns};
pub use limits::RegressionLimits;
pub use ljung_box::LjungBox;
pub use observation_matrix::ObservationMatrix;
pub use observations::Observations;
pub(crate) use prior::FreedSolution;
pub use prior::{JointProducts, JointSolution};
pub(crate) use products::{symmetric_product, transposed_times};
pub use residuals::ResidualStatistics;
pub(crate) use residuals::relative_errors;
pub use robust::{RobustLoss, RobustSolution};
pub use row_filter::RowFilter;
pub use solution::Solution;
pub use spectrum::ResidualSpectrum;
