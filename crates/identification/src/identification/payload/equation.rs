//! Identifiable sums of a load's ten parameters for an arm, and their effect on the torques.

use nalgebra::{DMatrix, DVector};

use super::error::PayloadError;
use crate::regression::RegressionError;
use didim_dynamics::dynamics::{BaseParameters, format_sum, select_columns};
use didim_dynamics::robot::{JointIndex, JointKind, NamedFrame, ParameterKind, Robot};

/// Order in which load parameters are chosen to represent the sums, by index among the ten. Mass
/// and centre come first, because they are most useful, then inertia. Later parameters are
/// regrouped into earlier ones.
const CHOICE_ORDER: [usize; 10] = [9, 6, 7, 8, 0, 1, 2, 3, 4, 5];

/// Sums of the ten load parameters that are identifiable from motions of an arm, like
/// [`BaseParameters`] for a complete arm.
#[derive(Clone)]
pub struct LoadSums {
    /// Matrix S (k × 10) with sums = S φ.
    pub(super) regrouping: DMatrix<f64>,
    /// Load parameter whose regressor column represents each sum, ascending.
    chosen_parameters: Vec<usize>,
    /// Load parameters without effect on any torque of the arm.
    without_effect: Vec<usize>,
    /// Change of the selected base parameters per unit of each sum (b' × k).
    base_parameter_change: DMatrix<f64>,
}

impl LoadSums {
    /// Creates the sums of the last link. All base parameters that a load changes must be
    /// identified.
    ///
    /// # Errors
    /// [`PayloadError::NotIdentified`], [`PayloadError::Unseen`] and [`PayloadError::Ambiguous`].
    pub fn new(
        robot: &Robot,
        base: &BaseParameters,
        identified: &[String],
    ) -> Result<Self, PayloadError> {
        let last = robot.joints() - 1;
        let column = |kind| robot.parameters().column(kind, JointIndex::new(last));
        // A link has all ten parameters.
        let columns: Vec<usize> = ParameterKind::LINK.into_iter().filter_map(column).collect();
        let load_columns = base.regrouping().select_columns(&columns);
        let is_changed = |row: &usize| load_columns.row(*row).iter().any(|entry| *entry != 0.0);
        let missing = (0..load_columns.nrows()).filter(is_changed).map(|row| &base.names()[row]);
        let names: Vec<String> =
            missing.filter(|name| !identified.contains(name)).cloned().collect();
        if !names.is_empty() {
            return Err(PayloadError::NotIdentified { names });
        }
        let sums = select_columns(&load_columns, &CHOICE_ORDER)?;
        if sums.basis.is_empty() {
            return Err(PayloadError::Unseen);
        }
        let rows: Vec<usize> = identified.iter().filter_map(|name| base.find(name)).collect();
        Ok(Self {
            base_parameter_change: load_columns.select_rows(&rows).select_columns(&sums.basis),
            regrouping: sums.regrouping,
            chosen_parameters: sums.basis,
            without_effect: sums.without_effect,
        })
    }

    /// Returns the sums that a record distinguishes, according to the observation matrix of its
    /// motion (r × b'). The other sums are regrouped into these, or have no effect in this record.
    ///
    /// # Errors
    /// [`PayloadError::Unseen`].
    pub fn identifiable_by(self, matrix: &DMatrix<f64>) -> Result<Self, PayloadError> {
        let preference =
            CHOICE_ORDER.into_iter().filter_map(|parameter| self.sum_of_parameter(parameter));
        // If the choice fails because of rounding, the regression reports the error.
        let preference: Vec<usize> = preference.collect();
        let Ok(identifiable) = select_columns(&self.sum_torques(matrix), &preference) else {
            return Ok(self);
        };
        if identifiable.basis.is_empty() {
            return Err(PayloadError::Unseen);
        }
        Ok(Self {
            regrouping: identifiable.regrouping * self.regrouping,
            chosen_parameters: identifiable
                .basis
                .iter()
                .map(|sum| self.chosen_parameters[*sum])
                .collect(),
            base_parameter_change: self.base_parameter_change.select_columns(&identifiable.basis),
            ..self
        })
    }

    /// Returns the expression of each sum, its representative parameter first: `xx - yy`.
    pub(super) fn names(&self) -> Vec<String> {
        let symbols = ParameterKind::LINK.map(ParameterKind::symbol);
        self.chosen_parameters
            .iter()
            .enumerate()
            .map(|(row, chosen): (usize, &usize)| {
                let others = (0..symbols.len()).filter(|column| column != chosen);
                let terms = core::iter::once(*chosen).chain(others);
                let terms = terms.map(|column| (self.regrouping[(row, column)], symbols[column]));
                format_sum(terms.filter(|(coefficient, _)| *coefficient != 0.0))
            })
            .collect()
    }

    /// Returns the unit of each sum. Units of a link are the same at any joint.
    pub(super) fn units(&self) -> impl Iterator<Item = &'static str> {
        self.chosen_parameters
            .iter()
            .map(|chosen| ParameterKind::LINK[*chosen].unit(JointKind::Revolute))
    }

    /// Returns the parameter of the last link that represents each sum.
    pub fn kinds(&self) -> impl Iterator<Item = ParameterKind> {
        self.chosen_parameters.iter().map(|chosen| ParameterKind::LINK[*chosen])
    }

    /// Returns the load parameters that no motion makes identifiable, and those that this record
    /// does not identify separately.
    pub(super) fn unidentifiable(&self) -> [Vec<&'static str>; 2] {
        let symbol = |&parameter: &usize| ParameterKind::LINK[parameter].symbol();
        let is_open = |parameter: &usize| {
            !self.without_effect.contains(parameter) && self.separate_sum(*parameter).is_none()
        };
        [
            self.without_effect.iter().map(symbol).collect(),
            (0..10).filter(is_open).map(|parameter| symbol(&parameter)).collect(),
        ]
    }

    /// Returns the base parameters (b') of an arm with this load, from those of the arm without it.
    pub(super) fn loaded_parameters(
        &self,
        arm: &DVector<f64>,
        values: &DVector<f64>,
    ) -> DVector<f64> {
        arm + &self.base_parameter_change * values
    }

    /// Returns the same sums for parameters in another frame, and the matrix (k × k) that converts
    /// values of these sums to those. Returns `None` if rounding does not allow to choose the sums.
    pub(super) fn in_frame(&self, frame: &NamedFrame) -> Option<(Self, DMatrix<f64>)> {
        let count = self.chosen_parameters.len();
        if frame.is_model_frame() {
            return Some((self.clone(), DMatrix::identity(count, count)));
        }
        let unit = |k: usize| core::array::from_fn(|entry| if entry == k { 1.0 } else { 0.0 });
        let columns = (0..10).map(|k| frame.parameters_in_link(unit(k)));
        let conversion = DMatrix::from_iterator(10, 10, columns.flatten());
        let expressed = &self.regrouping * conversion;
        let sums = select_columns(&expressed, &CHOICE_ORDER).ok()?;
        let to_these = expressed.select_columns(&sums.basis);
        Some((
            Self {
                base_parameter_change: &self.base_parameter_change * &to_these,
                regrouping: sums.regrouping,
                chosen_parameters: sums.basis,
                without_effect: sums.without_effect,
            },
            to_these.try_inverse()?,
        ))
    }

    /// Returns Z (r × k): the torque of a unit of each sum along the motion of this observation
    /// matrix (r × b').
    pub(super) fn sum_torques(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        matrix * &self.base_parameter_change
    }

    /// Converts a regression failure, with names of sums in place of column numbers.
    pub(super) fn regression_failure(&self, error: RegressionError) -> PayloadError {
        match error {
            RegressionError::ZeroColumns { columns }
            | RegressionError::DependentColumns { columns } => PayloadError::NotIdentifiable {
                names: columns.into_iter().filter_map(|k| self.names().get(k).cloned()).collect(),
            },
            other => PayloadError::Regression(other),
        }
    }

    /// Returns the sum that a load parameter represents.
    fn sum_of_parameter(&self, parameter: usize) -> Option<usize> {
        self.chosen_parameters.iter().position(|chosen| *chosen == parameter)
    }

    /// Returns the sum that consists of this load parameter alone, if there is one.
    pub(super) fn separate_sum(&self, parameter: usize) -> Option<usize> {
        let row = self.sum_of_parameter(parameter)?;
        let terms = self.regrouping.row(row).iter().filter(|entry| **entry != 0.0).count();
        (terms == 1).then_some(row)
    }

    /// Returns the ten load parameters φ and their covariance. A load parameter that alone forms an
    /// identified sum has the value of that sum. All others are 0.
    pub(super) fn load_parameters(
        &self,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let alone: Vec<Option<usize>> = (0..10).map(|k| self.separate_sum(k)).collect();
        let value = |k: usize, _| alone[k].map_or(0.0, |row| values[row]);
        let both = |i: usize, j: usize| Some(covariance[(alone[i]?, alone[j]?)]);
        let covariance = DMatrix::from_fn(10, 10, |i, j| both(i, j).unwrap_or_default());
        (DVector::from_fn(10, value), covariance)
    }
}
