//! Limits of the regression.

/// Limits of the regression for rows, parameters and noise.
#[derive(Clone, Debug, PartialEq)]
pub struct RegressionLimits {
    /// Weight of a residual below which its row counts as downweighted \[1\]. Convention: one half.
    pub downweighted_share: f64,
    /// Smallest mean slope of ψ for which the remaining rows still determine the estimate \[1\].
    /// Derived: for normal errors and the usual tuning it is 0.82 (Huber) and 0.76 (bisquare).
    pub min_slope: f64,
    /// Largest share of the residual power at a frequency that the fit may remove \[1\].
    /// Convention: the rest still permits a judgement.
    pub max_explained_share: f64,
    /// Smallest share of the independent rows that has to remain after the fit \[1\]. Derived: the
    /// correction for the fit then raises the noise power by at most the inverse of this share.
    pub min_residual_share: f64,
    /// Smallest share of a nuisance parameter's prior variance that the data have to remove to
    /// count as informative \[1\]. Convention.
    pub min_certainty: f64,
    /// Smallest number of remaining degrees of freedom \[1\]. Derived: with 20, the relative error
    /// of a standard deviation is about a sixth.
    pub min_degrees_of_freedom: f64,
    /// Smallest number of rows per coefficient of a spectrum \[1\]. Convention: a short record does
    /// not contain enough information for a detailed spectrum.
    pub rows_per_coefficient: f64,
    /// Level of the F-test that leaves out inessential parameters \[1\]. Convention: one in twenty
    /// parameters that are zero stays.
    pub significance_level: f64,
}

impl RegressionLimits {
    /// The values that the program uses.
    pub const DEFAULT: Self = Self {
        downweighted_share: 0.5,
        min_slope: 0.2,
        max_explained_share: 0.9,
        min_residual_share: 0.2,
        min_certainty: 1e-3,
        min_degrees_of_freedom: 20.0,
        rows_per_coefficient: 8.0,
        significance_level: 0.05,
    };
}
