//! Positive definite matrix that is a linear function of standard parameters: a link's
//! pseudo-inertia, a friction coefficient (1 × 1), or the viscous friction of coupled joints.

use nalgebra::{DMatrix, DVector, Matrix4};

use super::body::Body;

/// Length of a direction, relative to the longest one, below which the direction is linearly
/// dependent.
const DEPENDENT_LENGTH: f64 = 1e-9;

/// Positive definite matrix P. Symmetric n × n matrices are stored as vectors svec(P) of s = n
/// (n+1)/2 entries: the upper triangle by columns, with a factor √2 off the diagonal. So ‖svec(P)‖
/// is the Frobenius norm of P.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Factor L⁰ of the prior P⁰ = L⁰ L⁰ᵀ.
    pub(super) prior: DMatrix<f64>,
    /// Columns of the standard parameters that the block contributes to.
    pub(super) columns: Vec<usize>,
    /// Matrix that maps svec(P) to the block's contribution to these parameters.
    pub(super) parameter_map: DMatrix<f64>,
    /// Basis (s × d) of the permitted vectors svec(P); `None` if every vector is permitted.
    subspace: Option<DMatrix<f64>>,
}

impl Block {
    /// Creates the block of a link from its ten columns in the order of [`Body::parameters`].
    /// Returns `None` if the prior is not a physically consistent body.
    pub(super) fn link(columns: [usize; 10], prior: &Body) -> Option<Self> {
        let pseudo = prior.pseudo_inertia();
        let spread: Vec<DVector<f64>> = (0..10)
            .map(|k| {
                let unit = DVector::from_fn(10, |i, _| f64::from(u8::from(i == k)));
                let unit = Matrix4::from_iterator(matrix(&unit, 4).iter().copied());
                DVector::from_row_slice(&Body::from_pseudo_inertia(&unit).parameters())
            })
            .collect();
        Some(Self {
            prior: factor(&DMatrix::from_fn(4, 4, |i, j| pseudo[(i, j)]))?,
            columns: columns.to_vec(),
            parameter_map: DMatrix::from_columns(&spread),
            subspace: None,
        })
    }

    /// Creates the block of a positive number, with its contribution per unit to each standard
    /// parameter.
    pub(super) fn from_scalar(added: &[(usize, f64)], prior: f64) -> Option<Self> {
        let weights: Vec<f64> = added.iter().map(|(_, weight)| *weight).collect();
        Some(Self {
            prior: factor(&DMatrix::from_element(1, 1, prior))?,
            columns: added.iter().map(|(column, _)| *column).collect(),
            parameter_map: DMatrix::from_column_slice(weights.len(), 1, &weights),
            subspace: None,
        })
    }

    /// Creates the block P = Σ parameter · matrix. If the matrices are dependent, the parameters
    /// are the smallest that give P. If they do not span all symmetric matrices, P stays within
    /// their span.
    pub(super) fn from_sum(terms: &[(usize, DMatrix<f64>)], prior: &DMatrix<f64>) -> Option<Self> {
        let vectors: Vec<DVector<f64>> =
            terms.iter().map(|(_, term)| symmetric_vector(term)).collect();
        let svd = DMatrix::from_columns(&vectors).svd(true, true);
        let least = DEPENDENT_LENGTH * svd.singular_values.max();
        let rank = svd.rank(least);
        let spanned = svd.u.as_ref()?.columns(0, rank).into_owned();
        Some(Self {
            prior: factor(prior)?,
            columns: terms.iter().map(|(column, _)| *column).collect(),
            subspace: (rank < spanned.nrows()).then_some(spanned),
            parameter_map: svd.pseudo_inverse(least).ok()?,
        })
    }

    /// Returns n.
    pub(super) fn size(&self) -> usize {
        self.prior.nrows()
    }

    /// Returns a basis (s × d) of the directions in which P = M Mᵀ may change. It is orthonormal in
    /// the vectors of M⁻¹ δP M⁻ᵀ.
    pub(super) fn tangent(&self, m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let Some(subspace) = &self.subspace else {
            let s = self.parameter_map.ncols();
            return Some(DMatrix::identity(s, s));
        };
        let inverse = m.solve_lower_triangular(&DMatrix::identity(self.size(), self.size()))?;
        Some((congruence_map(&inverse) * subspace).qr().q())
    }
}

/// Returns the lower triangular factor L of P = L Lᵀ. Returns `None` if P is not positive definite
/// or an entry is not finite.
pub(super) fn factor(p: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let factor = p.clone().cholesky()?.unpack();
    factor.iter().all(|entry| entry.is_finite()).then_some(factor)
}

/// Returns the positions of the s entries of svec: the upper triangle by columns.
fn entry_positions(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(|j| (0..=j).map(move |i| (i, j)))
}

/// Returns svec of a symmetric matrix.
pub(super) fn symmetric_vector(p: &DMatrix<f64>) -> DVector<f64> {
    let entries = entry_positions(p.nrows())
        .map(|(i, j)| if i == j { p[(i, j)] } else { core::f64::consts::SQRT_2 * p[(i, j)] });
    DVector::from_vec(entries.collect())
}

/// Returns the symmetric n × n matrix of a vector svec.
pub(super) fn matrix(vector: &DVector<f64>, n: usize) -> DMatrix<f64> {
    let mut p = DMatrix::zeros(n, n);
    for ((i, j), entry) in entry_positions(n).zip(vector.iter()) {
        let entry = if i == j { *entry } else { *entry / core::f64::consts::SQRT_2 };
        p[(i, j)] = entry;
        p[(j, i)] = entry;
    }
    p
}

/// Returns the s × s matrix that maps svec(Y) to svec(M Y Mᵀ).
pub(super) fn congruence_map(m: &DMatrix<f64>) -> DMatrix<f64> {
    let s = m.nrows() * (m.nrows() + 1) / 2;
    let columns: Vec<DVector<f64>> = (0..s)
        .map(|k| {
            let unit = DVector::from_fn(s, |i, _| f64::from(u8::from(i == k)));
            symmetric_vector(&(m * matrix(&unit, m.nrows()) * m.transpose()))
        })
        .collect();
    DMatrix::from_columns(&columns)
}
