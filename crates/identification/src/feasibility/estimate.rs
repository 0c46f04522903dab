//! Estimate of base parameters, with which consistent parameters have to agree.

use nalgebra::{DMatrix, DVector};

use super::assumptions::PriorAssumptions;
use super::error::FeasibilityError;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{Parameter, ParameterKind};

/// Estimate of base parameters. Every base parameter has to be identified or fixed, except friction
/// terms, offsets and drive inertias into which no other parameter is regrouped. These are then 0.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// Names of the identified base parameters.
    pub names: &'a [String],
    /// Values of the identified base parameters \[SI\].
    pub values: &'a [f64],
    /// Corrected covariance of the identified base parameters.
    pub covariance: &'a DMatrix<f64>,
    /// Base parameters that were not identified but fixed at a value.
    pub fixed: &'a [FixedParameter],
}

/// Base parameter that was fixed at a value, such as the nominal one, and the uncertainty of that
/// value.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedParameter {
    /// Its name.
    pub name: String,
    /// Fixed value \[SI\].
    pub value: f64,
    /// Standard deviation of the fixed value.
    pub deviation: f64,
}

impl FixedParameter {
    /// Creates a base parameter that was fixed at its nominal value.
    pub fn at_nominal(name: String, value: f64) -> Self {
        Self {
            name,
            value,
            deviation: (PriorAssumptions::DEFAULT.nominal_deviation * value.abs())
                .max(PriorAssumptions::DEFAULT.zero_deviation),
        }
    }
}

/// Rows of the problem: base parameters with values and covariance. Fixed ones follow the
/// identified ones.
#[derive(Debug)]
pub(super) struct Rows {
    pub(super) names: Vec<String>,
    /// Regrouping matrix B (b × p): base = B · standard.
    pub(super) regrouping: DMatrix<f64>,
    /// Regressor column of each row.
    columns: Vec<usize>,
    pub(super) values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Columns of the parameters that the identified model does not contain.
    pub(super) absent_columns: Vec<usize>,
}

impl Rows {
    pub(super) fn new(
        base: &BaseParameters,
        parameters: &[Parameter],
        estimate: &Estimate<'_>,
    ) -> Result<Self, FeasibilityError> {
        let identified = estimate.names.len();
        let (rows, columns) = estimate.covariance.shape();
        if [estimate.values.len(), rows, columns] != [identified; 3] {
            let values = estimate.values.len();
            return Err(FeasibilityError::Shape { names: identified, values, rows, columns });
        }
        let fixed = estimate.fixed;
        let names: Vec<String> = estimate
            .names
            .iter()
            .chain(fixed.iter().map(|fixed_value| &fixed_value.name))
            .cloned()
            .collect();
        let values = estimate
            .values
            .iter()
            .copied()
            .chain(fixed.iter().map(|fixed_value| fixed_value.value));
        let values = DVector::from_iterator(names.len(), values);
        let mut covariance = estimate.covariance.clone().resize(names.len(), names.len(), 0.0);
        for (row, fixed_value) in (identified..).zip(fixed) {
            covariance[(row, row)] = fixed_value.deviation.max(0.0).powi(2);
        }

        let mut indices: Vec<usize> = Vec::new();
        for (row, name) in names.iter().enumerate() {
            let index = base.find_required(name)?;
            if indices.contains(&index) {
                return Err(FeasibilityError::Repeated { name: name.clone() });
            }
            let finite =
                values[row].is_finite() && covariance.row(row).iter().all(|c| c.is_finite());
            if !finite || covariance[(row, row)] <= 0.0 {
                return Err(FeasibilityError::NoValue { name: name.clone() });
            }
            indices.push(index);
        }

        let (mut absent, mut left_out) = (Vec::new(), Vec::new());
        for index in (0..base.names().len()).filter(|index| !indices.contains(index)) {
            let column = base.columns()[index];
            let alone = base.regrouping().row(index).iter().filter(|c| **c != 0.0).count() == 1;
            if alone && !ParameterKind::LINK.contains(&parameters[column].kind) {
                absent.push(column);
            } else {
                left_out.push(base.names()[index].clone());
            }
        }
        if !left_out.is_empty() {
            return Err(FeasibilityError::LeftOut { names: left_out });
        }
        let columns = indices.iter().map(|&index| base.columns()[index]).collect();
        let regrouping = base.regrouping().select_rows(&indices);
        Ok(Self { names, regrouping, columns, values, covariance, absent_columns: absent })
    }

    /// Returns the row that is named after a standard parameter.
    pub(super) fn row_of(&self, column: usize) -> Option<usize> {
        self.columns.iter().position(|own| *own == column)
    }

    /// Returns true if a row consists of a single standard parameter.
    pub(super) fn is_alone(&self, row: usize) -> bool {
        self.regrouping.row(row).iter().filter(|c| **c != 0.0).count() == 1
    }

    /// Returns the size of Σ weight · row: its value, or its standard deviation if that is larger.
    pub(super) fn combination_size(&self, weights: &[(usize, f64)]) -> f64 {
        let value: f64 = weights.iter().map(|&(row, weight)| weight * self.values[row]).sum();
        let variance: f64 = weights
            .iter()
            .flat_map(|&(i, a)| weights.iter().map(move |&(j, b)| (i, j, a * b)))
            .map(|(i, j, weight)| weight * self.covariance[(i, j)])
            .sum();
        value.max(variance.max(0.0).sqrt())
    }

    /// Returns the standard deviation of a row.
    pub(super) fn deviation(&self, row: usize) -> f64 {
        self.covariance[(row, row)].sqrt()
    }
}
