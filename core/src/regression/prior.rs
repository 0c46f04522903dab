//! What the data say of freedoms that the model does not have, where something is known of them
//! beforehand.

use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector};

use super::analysis::ResidualAnalysis;
use super::error::RegressionError;
use super::further::{FurtherColumns, gram_of_joint, spread};
use super::products::{product, symmetric_product};
use super::spectra::Spectra;
use super::spectrum::ResidualSpectrum;

/// Of the independent rows, the share that must be left over by all that is fitted: with fewer, the noise is
/// taken for larger by no more than its inverse.
const LEAST_LEFT_OVER: f64 = 0.2;

/// Of its variance beforehand, the least share that the data take away of a freedom of which they say anything.
const TOLD: f64 = 1e-3;

/// `y = X θ + C η + ε`, solved for θ and η together with what is known of η beforehand.
#[derive(Clone, Debug)]
pub struct JointSolution {
    /// What the freedoms would add to θ (b).
    pub change: DVector<f64>,
    /// η, in its prior standard deviations (m).
    pub freedoms: DVector<f64>,
    /// Covariance of θ and η together ((b + m) × (b + m)), η in the same unit.
    pub covariance: DMatrix<f64>,
    /// Covariance of the weighted solution by the noise that is left (b × b).
    pub noise: DMatrix<f64>,
    /// How much more uncertain the parameters are by the colour of what is left than by white noise of the
    /// same size, in the median; at least 1.
    pub colour: f64,
}

impl JointSolution {
    /// Covariance of θ (b × b) where the noise is so many times as uncertain as white noise by its
    /// [`colour`](Self::colour), and what was known beforehand is not: with N = A + D the information of data and prior,
    /// `N⁻¹ (c² A + D) N⁻¹ = c² N⁻¹ − (c² − 1) N⁻¹ D N⁻¹`, D being 1 of each freedom.
    pub(crate) fn coloured_covariance(&self) -> DMatrix<f64> {
        let (own, freedoms) = (self.change.len(), self.freedoms.len());
        let square = self.colour * self.colour;
        let told_beforehand = self.covariance.view((0, own), (own, freedoms));
        let white = self.covariance.view((0, 0), (own, own));
        white * square - told_beforehand * told_beforehand.transpose() * (square - 1.0)
    }

    /// The same without what was stated of those freedoms that the data contradict by more than `limit` standard deviations
    /// of both, the furthest first: what is known of them then are the data alone. `stated` says of which freedoms
    /// something was.
    ///
    /// With N the information, taking the prior of the freedom k out leaves `N − eₖ eₖᵀ`, whose inverse is
    /// `P + pₖ pₖᵀ/(1 − Pₖₖ)`, pₖ being a column of P (Sherman and Morrison, 1950), and a mean that is `pₖ ηₖ/(1 − Pₖₖ)` further.
    #[must_use]
    pub(crate) fn without_contradicted(&self, stated: &[bool], limit: f64) -> Self {
        let mut found = self.clone();
        let own = found.change.len();
        let mut left: Vec<usize> = (0..stated.len()).filter(|k| stated[*k]).collect();
        loop {
            let deviations = |k: &usize| {
                let told = 1.0 - found.covariance[(own + k, own + k)];
                let variance = found.colour.powi(2) * (1.0 - told) / told;
                let value = found.freedoms[*k] / told;
                // Of what they tell next to nothing, rounding would decide.
                if told > TOLD { value.abs() / (1.0 + variance).sqrt() } else { 0.0 }
            };
            let furthest =
                left.iter().copied().max_by(|a, b| deviations(a).total_cmp(&deviations(b)));
            let Some(k) = furthest.filter(|k| deviations(k) > limit) else { return found };
            left.retain(|other| *other != k);
            let column = found.covariance.column(own + k).into_owned();
            let told = 1.0 - column[own + k];
            let further = found.freedoms[k] / told;
            found.change.axpy(further, &column.rows(0, own), 1.0);
            found.freedoms.axpy(further, &column.rows(own, column.len() - own), 1.0);
            found.covariance.ger(1.0 / told, &column, &column, 1.0);
        }
    }

    /// How far a model without the freedoms may be off, by the rows X of its parameters and C of theirs:
    /// the sum over these rows of the squares of `X Δθ + C η` and of what is open of it.
    pub(crate) fn squared_error(
        &self,
        rows: DMatrixView<'_, f64>,
        further: DMatrixView<'_, f64>,
    ) -> f64 {
        let off = rows * &self.change + further * &self.freedoms;
        // Many act on other joints alone.
        let all = rows.column_iter().chain(further.column_iter()).enumerate();
        let acts = all.filter(|(_, column)| column.iter().any(|value| *value != 0.0));
        let (acting, columns): (Vec<usize>, Vec<_>) = acts.unzip();
        if columns.is_empty() {
            return 0.0;
        }
        let columns = DMatrix::from_columns(&columns);
        let covariance = self.covariance.select_rows(&acting).select_columns(&acting);
        off.norm_squared() + symmetric_product(&columns, &columns).dot(&covariance)
    }

    /// The median of that sum over what is open, from AᵀA of the rows A = [X C]. Where one combination of parameters
    /// is open that the data do not tell, the mean is half as large again: it is that of a few large errors.
    ///
    /// The sum has the mean and the variance of a scaled chi-squared variable (Satterthwaite, *An approximate distribution
    /// of estimates of variance components*, 1946) whose median Wilson and Hilferty (*The distribution of chi-square*, 1931) give.
    pub(crate) fn median_squared_error(&self, gram: &DMatrix<f64>) -> f64 {
        let off: Vec<f64> = self.change.iter().chain(&self.freedoms).copied().collect();
        let off = DVector::from_vec(off);
        let along = gram * &off;
        let spread = product(gram, &self.covariance);
        let mean = spread.trace() + off.dot(&along);
        let squares = spread.component_mul(&spread.transpose()).sum();
        let variance = 2.0 * squares + 4.0 * along.dot(&(&self.covariance * &along));
        // 0, or of no covariance at all.
        if mean <= 0.0 {
            return mean;
        }
        let degrees_of_freedom = 2.0 * mean * mean / variance;
        mean * (1.0 - 2.0 / (9.0 * degrees_of_freedom)).max(0.0).powi(3)
    }
}

/// What columns C beside X have in common with it and with each other.
#[derive(Clone, Debug)]
pub struct JointProducts {
    /// Of each joint `AᵀA` of the rows A = (X C ρ), the residuals ρ last, over the frequencies that the filter lets pass.
    /// The noise there is taken for white, not of the residuals' colour: what the model lacks is at the
    /// frequencies of the motion, and is no noise that the others could outweigh.
    passed: Vec<DMatrix<f64>>,
    /// Of each joint `CᵀC` (m × m).
    pub squares: Vec<DMatrix<f64>>,
    /// K: how far the estimate moves with a unit of each column (b × m).
    pub moved: DMatrix<f64>,
}

impl ResidualAnalysis<'_> {
    /// What further columns (r × m, unweighted) have in common with X, with the residuals and with each other: one joint at a
    /// time, which bounds the memory.
    pub fn products(&self, further: &dyn FurtherColumns) -> JointProducts {
        let matrix = self.system.matrix();
        let (own, count) = (matrix.ncols(), further.count());
        let mut products = JointProducts {
            passed: Vec::new(),
            squares: Vec::new(),
            moved: DMatrix::zeros(own, count),
        };
        for joint in 0..self.system.joints() {
            let columns = further.of_joint(joint);
            let residuals = self.system.joint_of(&self.solution.residuals, joint);
            let signals = (matrix.of_joint(joint).map(|(_, values)| values))
                .chain(columns.iter().map(|column| &*column.values))
                .chain([residuals.as_slice()]);
            let mut passed = Spectra::of_signals(self.filter, signals.collect()).passed_gram();
            let acting = matrix.columns_of(joint);
            for (at, column) in (acting.len()..).zip(&columns) {
                passed.row_mut(at).scale_mut(column.factor);
                passed.column_mut(at).scale_mut(column.factor);
            }
            let numbers: Vec<usize> = columns.iter().map(|column| column.number).collect();
            let places = acting.iter().copied().chain(numbers.iter().map(|number| own + number));
            let places: Vec<usize> = places.chain([own + count]).collect();
            products.passed.push(spread(&passed, &places, own + count + 1));

            let gram = gram_of_joint(matrix, joint, &columns);
            let with_own = gram.view((0, acting.len()), (acting.len(), columns.len()));
            let shifts = self.estimate_shifts(joint, &with_own.into_owned());
            for (shift, column) in shifts.column_iter().zip(&numbers) {
                let mut to = products.moved.column_mut(*column);
                to += shift;
            }
            let first = acting.len();
            let among = gram.view((first, first), (columns.len(), columns.len())).into_owned();
            products.squares.push(spread(&among, &numbers, count));
        }
        products
    }

    /// Solves for the parameters together with the coefficients of `further` columns (r × m,
    /// unweighted), which beforehand are 0 with a standard deviation of 1 and independent; `products` are theirs.
    ///
    /// The noise is that of the residuals, of each joint on its own and never with a smaller standard
    /// deviation than `floors`, white within what the filter lets pass; of `copies` rows that say the same, one counts.
    ///
    /// # Errors
    /// [`RegressionError::OutOfRange`] when the equation cannot be solved.
    pub fn with_prior(
        &self,
        further: &dyn FurtherColumns,
        products: &JointProducts,
        floors: &[f64],
        copies: f64,
    ) -> Result<JointSolution, RegressionError> {
        let own = self.system.matrix().ncols();
        let mut before = self.spectrum().clone();
        before.raise_to(floors);
        let Solved { change, freedoms, covariance } = solved(products, own, &before, copies)?;
        // What the data tell of the freedoms takes as many rows.
        let told: f64 = (own..covariance.ncols()).map(|k| 1.0 - covariance[(k, k)]).sum();
        let rows = before.independent_rows() - own as f64;
        drop(before);
        let share = ((rows - told) / rows).clamp(LEAST_LEFT_OVER, 1.0);
        let mut remaining = self.solution.residuals.clone();
        self.system.matrix().add_times(-1.0, &change, remaining.as_mut_slice());
        remaining -= further.times(&freedoms);
        remaining /= share.sqrt();
        let left = ResidualSpectrum::fit(self.system, &self.leverage, &remaining, self.filter);
        drop(remaining);
        let mut raised = left.clone();
        raised.raise_to(floors);
        let covariances = self.covariances_by(&[&left, &raised.whitened(), &raised]);
        let colour = median_ratio(&covariances[0], &covariances[1]);
        let noise = &covariances[2] * copies;
        // Once more, with the noise that the freedoms leave.
        let Solved { change, freedoms, covariance } = solved(products, own, &raised, copies)?;
        Ok(JointSolution { change, freedoms, covariance, noise, colour })
    }

    /// `ZᵀVZ` with the noise of each of these spectra.
    pub(super) fn covariances_by(&self, spectra: &[&ResidualSpectrum<'_>]) -> Vec<DMatrix<f64>> {
        // Z = Ω^{-1/2} Q R⁻ᵀ, so that the transforms of Q do.
        let r_inverse = &self.solution.r_inverse;
        let size = r_inverse.ncols();
        let mut of_basis = vec![DMatrix::zeros(size, size); spectra.len()];
        self.basis_spectra.for_each_block(|block| {
            for (sum, spectrum) in of_basis.iter_mut().zip(spectra) {
                let levels = &self.solution.noise_levels;
                *sum += spectrum.covariance_in(block, levels);
            }
        });
        let covariance = |of_basis: DMatrix<f64>| {
            let covariance = product(&product(r_inverse, &of_basis), &r_inverse.transpose());
            (&covariance + covariance.transpose()) * 0.5
        };
        of_basis.into_iter().map(covariance).collect()
    }
}

/// One solution of all together.
struct Solved {
    change: DVector<f64>,
    freedoms: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// What the parameters change by, the freedoms, and their covariance, with white noise of the mean power of each joint.
fn solved(
    products: &JointProducts,
    own: usize,
    spectrum: &ResidualSpectrum<'_>,
    copies: f64,
) -> Result<Solved, RegressionError> {
    let all = own + products.moved.ncols();
    let mut gram = DMatrix::zeros(all + 1, all + 1);
    for (joint, of_joint) in products.passed.iter().enumerate() {
        gram += of_joint / (spectrum.mean_power(joint) * copies);
    }
    let right = gram.view((0, all), (all, 1)).into_owned();
    // Parameters of all sizes: each column by its own length.
    let scale = DVector::from_fn(all, |k, _| match gram[(k, k)].sqrt() {
        length if k < own && length > 0.0 => 1.0 / length,
        _ => 1.0,
    });
    let mut normal = DMatrix::from_fn(all, all, |i, j| scale[i] * gram[(i, j)] * scale[j]);
    for k in own..all {
        normal[(k, k)] += 1.0;
    }
    let factor = Cholesky::new(normal).ok_or(RegressionError::OutOfRange)?;
    let found = factor.solve(&right.column(0).component_mul(&scale)).component_mul(&scale);
    let mut covariance = factor.inverse();
    for (mut column, by) in covariance.column_iter_mut().zip(&scale) {
        column.component_mul_assign(&scale);
        column.scale_mut(*by);
    }
    let (change, freedoms) = (found.rows(0, own), found.rows(own, all - own));
    Ok(Solved { change: change.into_owned(), freedoms: freedoms.into_owned(), covariance })
}

/// The median ratio of the standard deviations of two covariances, at least 1.
fn median_ratio(one: &DMatrix<f64>, other: &DMatrix<f64>) -> f64 {
    let (one, other) = (one.diagonal(), other.diagonal());
    let mut ratios: Vec<f64> = (one.iter().zip(other.iter()))
        .map(|(one, other)| (one / other).sqrt())
        .filter(|ratio| ratio.is_finite())
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).map_or(1.0, |median| median.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One parameter and two freedoms: of the first the data have 40 of what was stated, as told by a tenth of its variance, and
    /// of the second nothing that contradicts. The prior of the first is taken out of all.
    #[test]
    fn what_contradicts_is_known_by_the_data_alone() {
        let information =
            DMatrix::from_row_slice(3, 3, &[4.0, 0.2, 0.1, 0.2, 0.15, 0.05, 0.1, 0.05, 0.2]);
        let right = DVector::from_vec(vec![1.0, 4.0, 0.3]);
        let solved = |prior: [f64; 3]| {
            let all = &information + DMatrix::from_diagonal(&DVector::from_vec(prior.to_vec()));
            let covariance = all.try_inverse().unwrap();
            let mean = &covariance * &right;
            JointSolution {
                change: mean.rows(0, 1).into_owned(),
                freedoms: mean.rows(1, 2).into_owned(),
                covariance,
                noise: DMatrix::zeros(0, 0),
                colour: 1.0,
            }
        };
        let (before, alone) = (solved([0.0, 1.0, 1.0]), solved([0.0, 0.0, 1.0]));
        let found = before.without_contradicted(&[true, true], 3.0);
        assert!((found.covariance - &alone.covariance).amax() < 1e-12);
        assert!((found.freedoms - &alone.freedoms).amax() < 1e-12);
        assert!((found.change - &alone.change).amax() < 1e-12);
        for same in [
            before.without_contradicted(&[false, true], 3.0),
            before.without_contradicted(&[true, true], 30.0),
        ] {
            assert_eq!(same.freedoms, before.freedoms);
        }
    }

    /// Of a chi-squared variable of one degree of freedom, and of many.
    #[test]
    fn few_open_combinations_have_a_median_below_the_mean() {
        let solution = |size: usize, off: f64| JointSolution {
            change: DVector::from_element(size, off),
            freedoms: DVector::zeros(0),
            covariance: DMatrix::identity(size, size) * 4.0,
            noise: DMatrix::zeros(0, 0),
            colour: 1.0,
        };
        let median = |size: usize, off: f64| {
            solution(size, off).median_squared_error(&DMatrix::identity(size, size))
        };
        // scipy.stats.chi2.median(1) = 0.45494, of 100: 99.3341.
        assert!((median(1, 0.0) / (4.0 * 0.45494) - 1.0).abs() < 0.04);
        assert!((median(100, 0.0) / (4.0 * 99.3341) - 1.0).abs() < 1e-4);
        // scipy.stats.ncx2.median(3, 3 · 25/4) = 20.767.
        assert!((median(3, 5.0) / (4.0 * 20.767) - 1.0).abs() < 0.02);
        assert!(median(2, 0.0) < median(2, 1.0));
    }
}
