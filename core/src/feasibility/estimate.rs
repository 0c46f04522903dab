//! The estimate that consistent parameters have to agree with.

use nalgebra::{DMatrix, DVector};

use super::error::FeasibilityError;
use crate::dynamics::BaseParameters;
use crate::robot::{Parameter, ParameterKind};

/// How well a nominal value is known, relative to it: as the prior of nominal bodies.
const KEPT: f64 = 0.3;
/// A nominal value of nothing is known to this, in its unit.
const KEPT_AT_ZERO: f64 = 1e-6;

/// An estimate of base parameters. A base parameter that is neither identified nor held has to be one that the model
/// may lack: a friction term, offset or drive inertia that nothing is regrouped into is 0 then.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<'a> {
    /// Names of the identified base parameters.
    pub names: &'a [String],
    /// Their values \[SI\].
    pub values: &'a [f64],
    /// Their corrected covariance.
    pub covariance: &'a DMatrix<f64>,
    /// Base parameters that were not identified but kept at a value.
    pub held: &'a [Held],
}

/// A base parameter that was kept at a value, such as the nominal one, and how far it may be from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// Its name.
    pub name: String,
    /// The value at which it was kept \[SI\].
    pub value: f64,
    /// Standard deviation of that value.
    pub deviation: f64,
}

impl Held {
    /// A base parameter that was kept at its nominal value.
    pub fn nominal(name: String, value: f64) -> Self {
        Self { name, value, deviation: (KEPT * value.abs()).max(KEPT_AT_ZERO) }
    }
}

/// The rows of the problem: base parameters with values and covariance, those that are held after the others.
#[derive(Debug)]
pub(super) struct Rows {
    pub(super) names: Vec<String>,
    /// b × p: base = B · standard.
    pub(super) regrouping: DMatrix<f64>,
    /// The regressor column of each.
    columns: Vec<usize>,
    pub(super) values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Columns of what the identified model lacks.
    pub(super) absent: Vec<usize>,
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
        let held = estimate.held;
        let names: Vec<String> =
            estimate.names.iter().chain(held.iter().map(|held| &held.name)).cloned().collect();
        let values = estimate.values.iter().copied().chain(held.iter().map(|held| held.value));
        let values = DVector::from_iterator(names.len(), values);
        let mut covariance = estimate.covariance.clone().resize(names.len(), names.len(), 0.0);
        for (row, held) in (identified..).zip(held) {
            covariance[(row, row)] = held.deviation.max(0.0).powi(2);
        }

        let mut indices: Vec<usize> = Vec::new();
        for (row, name) in names.iter().enumerate() {
            let index = base.require(name)?;
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
        Ok(Self { names, regrouping, columns, values, covariance, absent })
    }

    /// The row that is named after a standard parameter.
    pub(super) fn own(&self, column: usize) -> Option<usize> {
        self.columns.iter().position(|own| *own == column)
    }

    /// Whether a row is one standard parameter and nothing else.
    pub(super) fn is_alone(&self, row: usize) -> bool {
        self.regrouping.row(row).iter().filter(|c| **c != 0.0).count() == 1
    }

    /// How large Σ weight · row is: its value, or its standard deviation where that is more.
    pub(super) fn size(&self, weights: &[(usize, f64)]) -> f64 {
        let value: f64 = weights.iter().map(|&(row, weight)| weight * self.values[row]).sum();
        let variance: f64 = weights
            .iter()
            .flat_map(|&(i, a)| weights.iter().map(move |&(j, b)| (i, j, a * b)))
            .map(|(i, j, weight)| weight * self.covariance[(i, j)])
            .sum();
        value.max(variance.max(0.0).sqrt())
    }

    /// The standard deviation of a row.
    pub(super) fn deviation(&self, row: usize) -> f64 {
        self.covariance[(row, row)].sqrt()
    }
}
