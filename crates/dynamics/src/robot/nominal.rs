//! Parameter values that a robot's file states.

use super::ParameterTable;

/// Nominal parameter values. A set of base or essential parameters represents an arm with the same
/// dynamics whose other parameters are 0.
#[derive(Clone, Debug, PartialEq)]
pub struct NominalParameters {
    given_values: Vec<(String, f64)>,
    standard_parameters: Vec<f64>,
}

impl NominalParameters {
    pub(super) fn new(listed: Vec<(String, f64)>, standard: Vec<f64>) -> Self {
        Self { given_values: listed, standard_parameters: standard }
    }

    /// Returns the same parameters, each multiplied by `factor(name)`; `column` finds the column of
    /// a name.
    pub(super) fn scaled(
        mut self,
        column: impl Fn(&str) -> Option<usize>,
        mut factor: impl FnMut(&str) -> f64,
    ) -> Self {
        for (name, value) in &mut self.given_values {
            let factor = factor(name);
            *value *= factor;
            if let Some(standard) =
                column(name).and_then(|column| self.standard_parameters.get_mut(column))
            {
                *standard *= factor;
            }
        }
        self
    }

    /// Returns the values of the parameters that another table also has.
    pub(super) fn for_table(mut self, table: &ParameterTable) -> Self {
        self.standard_parameters = vec![0.0; table.names().len()];
        self.given_values.retain(|(name, value)| {
            let place =
                table.find(name).and_then(|column| self.standard_parameters.get_mut(column));
            place.map(|place| *place = *value).is_some()
        });
        self
    }

    /// The values as listed in the file (`zz1r` or `zz1`), in the order of the model's columns.
    pub fn given_values(&self) -> &[(String, f64)] {
        &self.given_values
    }

    /// Returns the value listed under exactly this name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.given_values.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
    }

    /// A value for every standard parameter, in the order of the model's columns; 0 where none is
    /// listed.
    pub fn standard_parameters(&self) -> &[f64] {
        &self.standard_parameters
    }
}
