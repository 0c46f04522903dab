//! Joint estimation of parameters and of nuisance parameters with prior knowledge.

use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::analysis::ResidualAnalysis;
use super::cholesky::CholeskyFactor;
use super::error::RegressionError;
use super::further::{FurtherColumns, expand_columns, gram_of_joint};
use super::heavy_tails::HeavyTails;
use super::limits::RegressionLimits;
use super::products::{matrix_product, symmetric_product};
use super::spectra::Spectra;
use super::spectrum::ResidualSpectrum;

/// Solution of `y = X θ + C η + ε` for θ and η together, with prior knowledge of η.
#[derive(Clone, Debug)]
pub struct JointSolution {
    /// Change of θ due to the nuisance parameters (b).
    pub parameter_change: DVector<f64>,
    /// Nuisance parameters η, in units of their prior standard deviations (m).
    pub nuisance_parameters: DVector<f64>,
    /// Covariance of θ and η together ((b + m) × (b + m)); η has the same units.
    pub covariance: DMatrix<f64>,
    /// Covariance of the weighted solution due to the residual noise (b × b).
    pub noise: DMatrix<f64>,
    /// Factor by which the colour of the residuals increases the uncertainty of the parameters,
    /// compared with white noise of the same power. It is the median over the parameters, and at
    /// least 1.
    pub colour_factor: f64,
}

impl JointSolution {
    /// Returns the covariance of θ (b × b) with coloured noise. The
    /// [`colour_factor`](Self::colour_factor) scales the uncertainty by noise relative to white
    /// noise, but not that of the prior. The information of data and prior is N = A + D. The
    /// covariance is `N⁻¹ (c² A + D) N⁻¹ = c² N⁻¹ − (c² − 1) N⁻¹ D N⁻¹`. D is 1 for each nuisance
    /// parameter.
    pub(crate) fn coloured_covariance(&self) -> DMatrix<f64> {
        let (own, nuisance) = (self.parameter_change.len(), self.nuisance_parameters.len());
        let square = self.colour_factor * self.colour_factor;
        let prior_covariance = self.covariance.view((0, own), (own, nuisance));
        let white = self.covariance.view((0, 0), (own, own));
        white * square - prior_covariance * prior_covariance.transpose() * (square - 1.0)
    }

    /// Returns the probability that noise alone causes nuisance parameters at least as large as
    /// these, if their true values are 0.
    ///
    /// With the covariance P of the nuisance parameters, their estimate then has the covariance
    /// `c² (P − P P)`, because the prior adds no noise. Its quadratic form is χ²-distributed.
    /// Combinations on which the data have no information do not count.
    pub(crate) fn probability(&self, nuisance: &[usize]) -> f64 {
        let (own, all) = (self.parameter_change.len(), self.covariance.ncols());
        let posterior = self.covariance.view((own, own), (all - own, all - own));
        let rows = posterior.select_rows(nuisance);
        let of_group = rows.select_columns(nuisance);
        let eigen = of_group.clone().symmetric_eigen();
        let informed: Vec<usize> = (0..nuisance.len())
            .filter(|k| 1.0 - eigen.eigenvalues[*k] > RegressionLimits::DEFAULT.min_certainty)
            .collect();
        let basis = eigen.eigenvectors.select_columns(&informed);
        let noise = basis.tr_mul(&((of_group - &rows * rows.transpose()) * &basis));
        let estimates = basis.tr_mul(&self.nuisance_parameters.select_rows(nuisance));
        let Some(factor) = Cholesky::new(noise) else { return 1.0 };
        let square = estimates.dot(&factor.solve(&estimates)) / self.colour_factor.powi(2);
        ChiSquared::new(informed.len() as f64).map_or(1.0, |of| of.sf(square))
    }

    /// Replaces the priors of configured nuisance parameters by ones with heavy tails
    /// ([`HeavyTails`]). `configured` marks these nuisance parameters.
    ///
    /// Without the prior of one parameter, the solution has its estimate by the data alone. Its
    /// posterior with heavy tails follows in one dimension, over all its modes, and the solution
    /// takes over its mean and variance (expectation propagation: Minka, *UAI*, 2001). The others
    /// follow by their correlation. Several wrong values change each other's estimates, so this is
    /// repeated until nothing changes.
    #[must_use]
    pub(crate) fn with_heavy_tails(&self, configured: &[bool]) -> Self {
        let mut solution = self.clone();
        let own = solution.parameter_change.len();
        let places: Vec<usize> = (0..configured.len()).filter(|k| configured[*k]).collect();
        // Precision of each prior, and the product with its mean.
        let mut priors = vec![[1.0, 0.0]; configured.len()];
        for _ in 0..MOST_SWEEPS {
            let mut largest_change: f64 = 0.0;
            for &k in &places {
                let variance = solution.covariance[(own + k, own + k)];
                let mean = solution.nuisance_parameters[k];
                let Some([of_data, information]) = solution.without_prior(k, priors[k]) else {
                    continue;
                };
                let data = HeavyTails { mean: of_data, variance: 1.0 / information };
                let [new_mean, new_variance] = data.posterior(solution.colour_factor);
                priors[k] = [
                    1.0 / new_variance - information,
                    new_mean / new_variance - of_data * information,
                ];
                solution.set_moments(k, [new_mean, new_variance]);
                let wider = new_variance.sqrt() - variance.sqrt();
                let change = (new_mean - mean).abs().max(wider.abs());
                largest_change = largest_change.max(change / new_variance.sqrt());
            }
            if largest_change < SETTLED {
                break;
            }
        }
        solution
    }

    /// Takes the priors from the configured nuisance parameters that the data contradict by more
    /// than `limit` standard deviations, the most contradicted one first. Without this order, one
    /// wrong value makes the data contradict those that are correlated with it.
    pub(crate) fn without_contradicted(&self, configured: &[bool], limit: f64) -> FreedSolution {
        let mut freed =
            FreedSolution { solution: self.clone(), has_prior: vec![true; configured.len()] };
        loop {
            let places = (0..configured.len()).filter(|k| configured[*k] && freed.has_prior[*k]);
            let contradictions = places.filter_map(|k| Some((k, freed.contradiction(k)?)));
            let most = contradictions.max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((k, _)) = most.filter(|(_, size)| *size > limit) else { return freed };
            if let Some([mean, information]) = freed.solution.without_prior(k, [1.0, 0.0]) {
                freed.solution.set_moments(k, [mean, 1.0 / information]);
            }
            freed.has_prior[k] = false;
        }
    }

    /// Returns the mean of a nuisance parameter without its own prior, and the information on it.
    /// The precision of the prior and its product with the mean are given. Returns `None` if the
    /// data do not determine it.
    fn without_prior(
        &self,
        nuisance: usize,
        [precision, weighted_mean]: [f64; 2],
    ) -> Option<[f64; 2]> {
        let own = self.parameter_change.len();
        let variance = self.covariance[(own + nuisance, own + nuisance)];
        // A difference of nearly equal numbers would consist of rounding errors.
        let certainty = 1.0 - variance * precision;
        (certainty > RegressionLimits::DEFAULT.min_certainty).then(|| {
            let information = certainty / variance;
            let mean = self.nuisance_parameters[nuisance];
            [(mean / variance - weighted_mean) / information, information]
        })
    }

    /// Gives a nuisance parameter another mean and variance; the others follow by their
    /// correlation with it.
    fn set_moments(&mut self, nuisance: usize, [mean, variance]: [f64; 2]) {
        let own = self.parameter_change.len();
        let before = self.covariance[(own + nuisance, own + nuisance)];
        let shift = mean - self.nuisance_parameters[nuisance];
        let slope = self.covariance.column(own + nuisance) / before;
        self.parameter_change.axpy(shift, &slope.rows(0, own), 1.0);
        self.nuisance_parameters.axpy(shift, &slope.rows(own, slope.len() - own), 1.0);
        self.covariance.ger(variance - before, &slope, &slope, 1.0);
    }

    /// Returns the possible squared error of a model without the nuisance parameters. X are the
    /// rows of its parameters and C those of the nuisance parameters. The result is the sum over
    /// these rows of the squares of `X Δθ + C η` and of its posterior standard deviation.
    pub(crate) fn squared_error(
        &self,
        rows: DMatrixView<'_, f64>,
        further: DMatrixView<'_, f64>,
    ) -> f64 {
        let off = rows * &self.parameter_change + further * &self.nuisance_parameters;
        // Columns that do not act on these rows are skipped.
        let all_columns = rows.column_iter().chain(further.column_iter()).enumerate();
        let acts = all_columns.filter(|(_, column)| column.iter().any(|value| *value != 0.0));
        let (acting, columns): (Vec<usize>, Vec<_>) = acts.unzip();
        if columns.is_empty() {
            return 0.0;
        }
        let columns = DMatrix::from_columns(&columns);
        let covariance = self.covariance.select_rows(&acting).select_columns(&acting);
        off.norm_squared() + symmetric_product(&columns, &columns).dot(&covariance)
    }

    /// Returns the posterior median of the sum in [`squared_error`](Self::squared_error), from AᵀA
    /// of the rows A = [X C]. The mean would be about twice as large if the data leave a single
    /// combination of parameters undetermined, because a few large errors dominate it.
    ///
    /// The sum has the mean and the variance of a scaled chi-squared variable (Satterthwaite, *An
    /// approximate distribution of estimates of variance components*, 1946). Wilson and Hilferty
    /// (*The distribution of chi-square*, 1931) give its median.
    pub(crate) fn median_squared_error(&self, gram: &DMatrix<f64>) -> f64 {
        let off: Vec<f64> =
            self.parameter_change.iter().chain(&self.nuisance_parameters).copied().collect();
        let off = DVector::from_vec(off);
        let along = gram * &off;
        let spread = matrix_product(gram, &self.covariance);
        let mean = spread.trace() + off.dot(&along);
        let squares = spread.component_mul(&spread.transpose()).sum();
        let variance = 2.0 * squares + 4.0 * along.dot(&(&self.covariance * &along));
        // The approximation requires a positive mean.
        if mean <= 0.0 {
            return mean;
        }
        let degrees_of_freedom = 2.0 * mean * mean / variance;
        mean * (1.0 - 2.0 / (9.0 * degrees_of_freedom)).max(0.0).powi(3)
    }
}

/// Solution without the priors of the configured values that the data contradict.
#[derive(Clone, Debug)]
pub(crate) struct FreedSolution {
    pub(crate) solution: JointSolution,
    /// For each nuisance parameter.
    has_prior: Vec<bool>,
}

impl FreedSolution {
    /// Returns true for a nuisance parameter without its prior.
    pub(crate) fn is_contradicted(&self, nuisance: usize) -> bool {
        !self.has_prior[nuisance]
    }

    /// Returns by how many standard deviations, of the data and of the prior together, the data
    /// contradict the prior of a nuisance parameter.
    fn contradiction(&self, nuisance: usize) -> Option<f64> {
        let [mean, deviation] = self.by_data(nuisance)?;
        Some(mean.abs() / deviation.hypot(1.0))
    }

    /// Returns mean and standard deviation of a nuisance parameter by the data alone, in units of
    /// its prior standard deviation. Returns `None` if the data do not determine it.
    pub(crate) fn by_data(&self, nuisance: usize) -> Option<[f64; 2]> {
        let precision = if self.has_prior[nuisance] { 1.0 } else { 0.0 };
        let [mean, information] = self.solution.without_prior(nuisance, [precision, 0.0])?;
        Some([mean, self.solution.colour_factor / information.sqrt()])
    }
}

/// Largest number of passes over the nuisance parameters with heavy tails.
const MOST_SWEEPS: usize = 20;

/// Largest change of a mean or a standard deviation in the last pass \[standard deviations\].
const SETTLED: f64 = 0.01;

/// Products of additional columns C with X and with each other.
#[derive(Clone, Debug)]
pub struct JointProducts {
    /// Matrix `AᵀA` of each joint over the frequencies that the filter passes. The rows are A = (X
    /// C ρ), with the residuals ρ last. The noise at these frequencies is assumed to be white,
    /// without the colour of the residuals, because the model error has the frequencies of the
    /// motion. Noise at other frequencies must not reduce its weight.
    passband_products: Vec<DMatrix<f64>>,
    /// `CᵀC` of each joint (m × m).
    pub column_products: Vec<DMatrix<f64>>,
    /// Sensitivity K: the shift of the estimate per unit of each column (b × m).
    pub sensitivity: DMatrix<f64>,
}

impl ResidualAnalysis<'_> {
    /// Returns the products of further columns (r × m, unweighted) with X, with the residuals and
    /// with each other. Joints are processed one at a time, which limits the memory.
    pub fn products(&self, further: &dyn FurtherColumns) -> JointProducts {
        let matrix = self.system.matrix();
        let (own, count) = (matrix.ncols(), further.count());
        let mut products = JointProducts {
            passband_products: Vec::new(),
            column_products: Vec::new(),
            sensitivity: DMatrix::zeros(own, count),
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
            products.passband_products.push(expand_columns(&passed, &places, own + count + 1));

            let gram = gram_of_joint(matrix, joint, &columns);
            let with_own = gram.view((0, acting.len()), (acting.len(), columns.len()));
            let shifts = self.estimate_shifts(joint, &with_own.into_owned());
            for (shift, column) in shifts.column_iter().zip(&numbers) {
                let mut target = products.sensitivity.column_mut(*column);
                target += shift;
            }
            let first = acting.len();
            let among = gram.view((first, first), (columns.len(), columns.len())).into_owned();
            products.column_products.push(expand_columns(&among, &numbers, count));
        }
        products
    }

    /// Solves for the parameters together with the coefficients of `further` columns (r × m,
    /// unweighted). The prior of the coefficients is independent, with mean 0 and standard
    /// deviation 1. `products` are the products of these columns.
    ///
    /// The noise level of each joint is that of its residuals, but at least that of `floors`. The
    /// noise is assumed to be white within the filter's passband.
    ///
    /// # Errors
    /// [`RegressionError::OutOfRange`] if the equation cannot be solved.
    pub fn with_prior(
        &self,
        further: &dyn FurtherColumns,
        products: &JointProducts,
        floors: &[f64],
    ) -> Result<JointSolution, RegressionError> {
        let width = self.system.matrix().ncols();
        let mut before = self.spectrum().clone();
        before.raise_to(floors);
        let PriorSolution { parameter_change: change, nuisance_parameters: nuisance, covariance } =
            solve_with_prior(products, width, &before, self.repeats)?;
        // Identified nuisance parameters use up one independent row each, in proportion to their
        // certainty.
        let certainty: f64 = (width..covariance.ncols()).map(|k| 1.0 - covariance[(k, k)]).sum();
        let rows = before.independent_rows() - width as f64;
        drop(before);
        let share =
            ((rows - certainty) / rows).clamp(RegressionLimits::DEFAULT.min_residual_share, 1.0);
        let mut remaining = self.solution.residuals.clone();
        self.system.matrix().add_times(-1.0, &change, remaining.as_mut_slice());
        remaining -= further.weighted_sum(&nuisance);
        remaining /= share.sqrt();
        let spectrum = self.spectrum_of(&self.leverage, &remaining);
        drop(remaining);
        let mut raised = spectrum.clone();
        let is_raised = raised.raise_to(floors);
        let white = raised.to_white();
        let spectra = [&spectrum, &white, &raised];
        let mut covariances = self.covariances_by(&spectra[..if is_raised { 3 } else { 2 }]);
        let colour = median_ratio(&covariances[0], &covariances[1]);
        // Solves again with the noise that remains after subtracting the nuisance parameters.
        let PriorSolution { parameter_change: change, nuisance_parameters: nuisance, covariance } =
            solve_with_prior(products, width, &raised, self.repeats)?;
        Ok(JointSolution {
            parameter_change: change,
            nuisance_parameters: nuisance,
            covariance,
            noise: covariances.swap_remove(if is_raised { 2 } else { 0 }),
            colour_factor: colour,
        })
    }

    /// Returns `ZᵀVZ` with the noise of each of these spectra.
    pub(super) fn covariances_by(&self, spectra: &[&ResidualSpectrum<'_>]) -> Vec<DMatrix<f64>> {
        // Z = Ω^{-1/2} Q R⁻ᵀ, so the transforms of Q suffice.
        let r_inverse = &self.solution.r_inverse;
        let size = r_inverse.ncols();
        let mut of_basis = vec![DMatrix::zeros(size, size); spectra.len()];
        self.basis_spectra.for_each_block(|block| {
            for (sum, spectrum) in of_basis.iter_mut().zip(spectra) {
                let levels = &self.solution.noise_levels;
                *sum += spectrum.covariance_in(block, levels);
            }
        });
        of_basis
            .into_iter()
            .map(|of_basis: DMatrix<f64>| {
                let covariance =
                    matrix_product(&matrix_product(r_inverse, &of_basis), &r_inverse.transpose());
                (&covariance + covariance.transpose()) * (0.5 * self.repeats)
            })
            .collect()
    }
}

/// Solution for parameters and nuisance parameters together.
struct PriorSolution {
    parameter_change: DVector<f64>,
    nuisance_parameters: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// Returns the change of the parameters, the nuisance parameters and their covariance. The noise of
/// each joint is white, with its mean power.
fn solve_with_prior(
    products: &JointProducts,
    own: usize,
    spectrum: &ResidualSpectrum<'_>,
    repeats: f64,
) -> Result<PriorSolution, RegressionError> {
    let width = own + products.sensitivity.ncols();
    let mut gram = DMatrix::zeros(width + 1, width + 1);
    for (joint, of_joint) in products.passband_products.iter().enumerate() {
        gram += of_joint / (spectrum.mean_power(joint) * repeats);
    }
    let right = gram.view((0, width), (width, 1)).into_owned();
    // Parameters differ in size, so each column is scaled by its own length.
    let scale = DVector::from_fn(width, |k, _| match gram[(k, k)].sqrt() {
        length if k < own && length > 0.0 => 1.0 / length,
        _ => 1.0,
    });
    let mut normal = DMatrix::from_fn(width, width, |i, j| scale[i] * gram[(i, j)] * scale[j]);
    for k in own..width {
        normal[(k, k)] += 1.0;
    }
    let factor = CholeskyFactor::new(normal).ok_or(RegressionError::OutOfRange)?;
    let mut solution = right.column(0).component_mul(&scale);
    factor.solve(solution.as_mut_slice());
    solution.component_mul_assign(&scale);
    let mut covariance = factor.inverse();
    for (mut column, by) in covariance.column_iter_mut().zip(&scale) {
        column.component_mul_assign(&scale);
        column.scale_mut(*by);
    }
    let (change, nuisance) = (solution.rows(0, own), solution.rows(own, width - own));
    Ok(PriorSolution {
        parameter_change: change.into_owned(),
        nuisance_parameters: nuisance.into_owned(),
        covariance,
    })
}

/// Returns the median ratio of the standard deviations of two covariances, at least 1.
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

    /// Two parameters, one of them wrong by 30 tolerances; the data determine both.
    fn one_wrong_of_two() -> JointSolution {
        let information = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let of_data = DVector::from_vec(vec![30.0, 0.0]);
        let normal = &information + DMatrix::identity(2, 2);
        let covariance = normal.try_inverse().unwrap();
        JointSolution {
            parameter_change: DVector::zeros(0),
            nuisance_parameters: &covariance * (&information * of_data),
            covariance,
            noise: DMatrix::zeros(0, 0),
            colour_factor: 1.0,
        }
    }

    #[test]
    fn one_wrong_value_leaves_the_other_at_its_tolerance() {
        let joint = one_wrong_of_two();
        let tailed = joint.with_heavy_tails(&[true, true]);
        let [wrong, right] = [0, 1].map(|k| tailed.nuisance_parameters[k]);
        assert!((28.0..31.0).contains(&wrong), "{wrong}");
        assert!(right.abs() < 1.0, "{right}");
        assert!(tailed.covariance[(1, 1)] < 1.0);
        assert!(tailed.covariance.clone().cholesky().is_some());
        let unchanged = joint.with_heavy_tails(&[false, false]);
        assert_eq!(unchanged.nuisance_parameters, joint.nuisance_parameters);
    }

    /// With both priors, the data also seem to contradict the right value.
    #[test]
    fn a_wrong_value_accuses_no_other() {
        let joint = one_wrong_of_two();
        let all = joint.without_contradicted(&[false, false], 3.0);
        let [[wrong, _], [right, deviation]] = [0, 1].map(|k| all.by_data(k).unwrap());
        assert!(wrong > 20.0 && right.abs() > 3.0 * deviation.hypot(1.0), "{wrong} {right}");
        let freed = joint.without_contradicted(&[true, true], 3.0);
        let [[wrong, _], [right, _]] = [0, 1].map(|k| freed.by_data(k).unwrap());
        assert!((wrong - 30.0).abs() < 1e-9 && right.abs() < 1e-9, "{wrong} {right}");
    }

    /// Chi-squared variable of one degree of freedom, and of many.
    #[test]
    fn few_open_combinations_have_a_median_below_the_mean() {
        let solution = |size: usize, off: f64| JointSolution {
            parameter_change: DVector::from_element(size, off),
            nuisance_parameters: DVector::zeros(0),
            covariance: DMatrix::identity(size, size) * 4.0,
            noise: DMatrix::zeros(0, 0),
            colour_factor: 1.0,
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
