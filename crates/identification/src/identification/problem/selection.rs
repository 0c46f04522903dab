//! Selection of the identified base parameters.

use nalgebra::DVector;

use super::error::IdentificationError;
use crate::regression::RegressionError;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{ParameterKind, Robot};

/// Essential parameters: some or all base parameters, in the model's order, each with its regressor
/// column.
///
/// The regressor column of a base parameter is that of the standard parameter with the same name.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    names: Vec<String>,
    columns: Vec<usize>,
    kinds: Vec<ParameterKind>,
    is_regrouped: Vec<bool>,
    /// Further parameters with fixed values, by regressor column.
    fixed_columns: Vec<(usize, f64)>,
    /// Number of columns of the regressor.
    width: usize,
}

impl Selection {
    /// Selects the base parameters of `robot` with the given names, or all if `names` is `None`.
    ///
    /// # Errors
    /// [`IdentificationError::UnknownParameter`], [`IdentificationError::RepeatedParameter`],
    /// [`IdentificationError::NoParameter`], and [`IdentificationError::OtherBaseParameters`] if
    /// `base` belongs to another robot.
    pub fn new(
        robot: &Robot,
        base: &BaseParameters,
        names: Option<&[String]>,
    ) -> Result<Self, IdentificationError> {
        let mut chosen: Vec<usize> = match names {
            None => (0..base.names().len()).collect(),
            Some(names) => names
                .iter()
                .map(|name| {
                    base.find(name).ok_or_else(|| IdentificationError::UnknownParameter {
                        name: name.clone(),
                        available: base.names().to_vec(),
                    })
                })
                .collect::<Result<_, _>>()?,
        };
        chosen.sort_unstable();
        if let Some(pair) = chosen.windows(2).find(|pair| pair[0] == pair[1]) {
            let name = base.names()[pair[0]].clone();
            return Err(IdentificationError::RepeatedParameter { name });
        }
        if chosen.is_empty() {
            return Err(IdentificationError::NoParameter);
        }
        let names: Vec<String> = chosen.iter().map(|&index| base.names()[index].clone()).collect();
        let columns: Vec<usize> = chosen.iter().map(|&index| base.columns()[index]).collect();
        let table = robot.parameters();
        if names.iter().zip(&columns).any(|(name, &column)| table.find(name) != Some(column)) {
            let robot = robot.name().to_owned();
            return Err(IdentificationError::OtherBaseParameters { robot });
        }
        let kinds = columns.iter().map(|&column| table.parameters()[column].kind).collect();
        let terms =
            |&index: &usize| base.regrouping().row(index).iter().filter(|c| **c != 0.0).count();
        let regrouped = chosen.iter().map(|index| terms(index) > 1).collect();
        Ok(Self {
            names,
            columns,
            kinds,
            is_regrouped: regrouped,
            fixed_columns: Vec::new(),
            width: table.names().len(),
        })
    }

    /// Returns the selection without the parameters of a kind.
    pub(crate) fn without_kind(&self, kind: ParameterKind) -> Self {
        let is_other_kind = |index: &usize| self.kinds[*index] != kind;
        let selected: Vec<usize> = (0..self.kinds.len()).filter(is_other_kind).collect();
        Self {
            names: selected.iter().map(|&k| self.names[k].clone()).collect(),
            columns: selected.iter().map(|&k| self.columns[k]).collect(),
            kinds: selected.iter().map(|&k| self.kinds[k]).collect(),
            is_regrouped: selected.iter().map(|&k| self.is_regrouped[k]).collect(),
            fixed_columns: self.fixed_columns.clone(),
            width: self.width,
        }
    }

    /// Returns the names of the parameters, in the model's order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the regressor column of each parameter.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Returns the kind of each parameter.
    pub fn kinds(&self) -> &[ParameterKind] {
        &self.kinds
    }

    /// Returns for each parameter whether others are regrouped into it.
    pub(crate) fn regrouped(&self) -> &[bool] {
        &self.is_regrouped
    }

    /// Fixes further base parameters, which are not identified, at these values; all others are 0.
    ///
    /// # Errors
    /// [`IdentificationError::UnknownParameter`], [`IdentificationError::RepeatedParameter`], and
    /// [`IdentificationError::KeptAndIdentified`].
    pub(crate) fn keep_values<'a>(
        &mut self,
        base: &BaseParameters,
        fixed: impl Iterator<Item = (&'a str, f64)>,
    ) -> Result<(), IdentificationError> {
        self.fixed_columns.clear();
        for (name, value) in fixed {
            let index = base.find(name).ok_or_else(|| IdentificationError::UnknownParameter {
                name: name.to_owned(),
                available: base.names().to_vec(),
            })?;
            let column = base.columns()[index];
            let name = name.to_owned();
            if self.columns.contains(&column) {
                return Err(IdentificationError::KeptAndIdentified { name });
            }
            if self.fixed_columns.iter().any(|(own, _)| *own == column) {
                return Err(IdentificationError::RepeatedParameter { name });
            }
            self.fixed_columns.push((column, value));
        }
        Ok(())
    }

    /// Returns the parameters with fixed values, by regressor column.
    pub(crate) fn fixed(&self) -> &[(usize, f64)] {
        &self.fixed_columns
    }

    /// Returns standard parameters with these selected values and the fixed values; all others are
    /// 0.
    pub(crate) fn to_standard(&self, parameters: &DVector<f64>) -> Vec<f64> {
        let mut standard = vec![0.0; self.width];
        for &(column, value) in &self.fixed_columns {
            standard[column] = value;
        }
        for (&column, &value) in self.columns.iter().zip(parameters.iter()) {
            standard[column] = value;
        }
        standard
    }

    /// Returns the values of the selected parameters from those of all base parameters.
    pub(crate) fn of_base(&self, base: &BaseParameters, values: &[f64]) -> DVector<f64> {
        // Selection and base parameters identify a parameter by its regressor column.
        let selected = self.columns.iter().map(|column| {
            base.columns().binary_search(column).ok().and_then(|row| values.get(row).copied())
        });
        DVector::from_iterator(self.columns.len(), selected.map(Option::unwrap_or_default))
    }

    /// Converts a regression failure, with parameter names in place of column numbers.
    pub(crate) fn regression_failure(&self, error: RegressionError) -> IdentificationError {
        let named = |columns: Vec<usize>| -> Vec<String> {
            columns.iter().filter_map(|&column| self.names.get(column).cloned()).collect()
        };
        match error {
            RegressionError::TooFewRows { rows, columns } => {
                IdentificationError::TooFewRows { rows, parameters: columns }
            }
            RegressionError::ZeroColumns { columns } => {
                IdentificationError::NotExcited { parameters: named(columns) }
            }
            RegressionError::DependentColumns { columns } => {
                IdentificationError::RankDeficient { parameters: named(columns) }
            }
            RegressionError::NoMeasurement { joint } => IdentificationError::NoTorque { joint },
            other => IdentificationError::Regression(other),
        }
    }
}
