//! Base parameters of a robot, and the regrouping of its standard parameters into them.

use nalgebra::{DMatrix, DVector};

use super::error::{BaseParametersError, UnknownBaseParameter};
use super::expression::format_sum;
use super::observation::random_observation;
use super::selection::select_columns;
use crate::dynamics::model::Model;
use crate::numeric::Scalar;
use crate::robot::{Joint, JointKind, Parameter, ParameterKind};

/// Base parameters of a robot: the independent columns of the regressor. Each stands with the
/// parameters whose effect cannot be distinguished from its own, after Gautier, *Numerical
/// calculation of the base inertial parameters of robots* (1991).
///
/// The choice of columns follows the closed-form rules of Khalil and Dombre, ch. 9.4. They regroup
/// YY, MZ and M of a revolute link, and the inertia of a prismatic one, into the links before it.
/// They regroup Ia into ZZ if the two cannot be distinguished.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseParameters {
    names: Vec<String>,
    columns: Vec<usize>,
    without_effect: Vec<String>,
    /// b × p.
    regrouping: DMatrix<f64>,
    standard_names: Vec<String>,
}

impl BaseParameters {
    /// Computes the base parameters of a model by a QR factorisation of its regressor. The
    /// regressor is stacked over random motions with a fixed seed.
    pub fn compute(model: &Model) -> Result<Self, BaseParametersError> {
        let parameters = model.parameters().parameters();
        let mut preference: Vec<usize> = (0..parameters.len()).collect();
        preference.sort_by_key(|&column| rank_of_choice(parameters[column], model.chain()));
        let mut selection = select_columns(&random_observation(model), &preference)?;
        // If a load is always the same, part of it acts as Coulomb friction. The arm's own
        // parameters decide its size, so no coefficient applies to every arm.
        for (column, parameter) in parameters.iter().enumerate() {
            let by_load = parameter.kind == ParameterKind::FcLoad;
            if by_load
                && !selection.basis.contains(&column)
                && !selection.without_effect.contains(&column)
            {
                selection.regrouping.column_mut(column).fill(0.0);
                selection.without_effect.push(column);
            }
        }

        let standard_names = model.parameter_names().to_vec();
        let without = selection.without_effect.iter();
        Ok(Self {
            names: selection
                .basis
                .iter()
                .enumerate()
                .map(|(row, &column): (usize, &usize)| {
                    let terms = selection.regrouping.row(row).iter().filter(|c| **c != 0.0).count();
                    let mark = if terms > 1 { "r" } else { "" };
                    format!("{}{mark}", standard_names[column])
                })
                .collect(),
            without_effect: without.map(|&column| standard_names[column].clone()).collect(),
            columns: selection.basis,
            regrouping: selection.regrouping,
            standard_names,
        })
    }

    /// Returns the names of the b base parameters, in the order of the regressor's columns. A name
    /// is that of the standard parameter whose column is kept, with an `r` if others are regrouped
    /// into it.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the regressor's column of each base parameter, ascending.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Returns the names of the standard parameters that no motion and no gravity can identify. It
    /// includes those that cannot be distinguished from Coulomb friction: shares of a load that is
    /// always the same.
    pub fn without_effect(&self) -> &[String] {
        &self.without_effect
    }

    /// Returns the b × p matrix K with base = K · standard.
    pub fn regrouping(&self) -> &DMatrix<f64> {
        &self.regrouping
    }

    /// Returns the position of a base parameter by its name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }

    /// Returns the position of a base parameter that the robot must have.
    pub fn find_required(&self, name: &str) -> Result<usize, UnknownBaseParameter> {
        let names = || self.names.join(" ");
        self.find(name)
            .ok_or_else(|| UnknownBaseParameter { name: name.to_owned(), available_names: names() })
    }

    /// Returns the expression of a base parameter:
    /// `zz1 + ia1 + yy2 + yy3 + 0.07 mz3 + 0.05185 (m3+m4)`.
    pub fn expression(&self, name: &str) -> Option<String> {
        let row = self.find(name)?;
        let name_column = self.columns[row];
        // The parameter that gives the name comes first.
        let others = (0..self.standard_names.len()).filter(|column| *column != name_column);
        let terms = core::iter::once(name_column).chain(others).filter_map(|column| {
            let coefficient = self.regrouping[(row, column)];
            (coefficient != 0.0).then(|| (coefficient, self.standard_names[column].as_str()))
        });
        Some(format_sum(terms))
    }

    /// Returns the b base values of p standard values.
    ///
    /// # Panics
    /// If `standard` does not have p entries.
    pub fn to_base(&self, standard: &[f64]) -> Vec<f64> {
        (&self.regrouping * DVector::from_column_slice(standard)).as_slice().to_vec()
    }

    /// Returns p standard values with the same dynamics as the given base values. Each value is at
    /// the column that it is named after; the others are 0.
    pub fn to_standard<N: AsRef<str>>(
        &self,
        values: impl IntoIterator<Item = (N, f64)>,
    ) -> Result<Vec<f64>, UnknownBaseParameter> {
        let mut standard = vec![0.0; self.standard_names.len()];
        for (name, value) in values {
            standard[self.columns[self.find_required(name.as_ref())?]] = value;
        }
        Ok(standard)
    }

    /// Copies the base parameters' columns of a regressor, from n × p to n × b, both row-major.
    ///
    /// # Panics
    /// If the slices' lengths do not match.
    pub fn select_columns<T: Scalar>(&self, regressor: &[T], out: &mut [T]) {
        let (p, b) = (self.standard_names.len(), self.columns.len());
        assert_eq!(regressor.len() * b, out.len() * p, "the same number of rows");
        for (from, to) in regressor.chunks_exact(p).zip(out.chunks_exact_mut(b)) {
            for (to, column) in to.iter_mut().zip(&self.columns) {
                *to = from[*column];
            }
        }
    }
}

/// Returns the rank in which a parameter is chosen; later ones are regrouped into earlier ones.
fn rank_of_choice(parameter: Parameter, chain: &[Joint]) -> u8 {
    use ParameterKind::{
        Fc, FcLoad, FcMotor, Fh, Fs, Fv, FvAsymmetric, FvCubic, FvMotor, FvQuadratic, Ia, M, Mx,
        My, Mz, Off, Xx, Xy, Xz, Yy, Yz, Zz,
    };

    match (parameter.kind, chain[parameter.joint].kind) {
        // Friction and offsets come first, so that inertia is regrouped into them and not the
        // reverse. This happens only on a prismatic axis along gravity, whose weight is a constant
        // force.
        (Fv | FvQuadratic | FvCubic | FvAsymmetric | Fc | FcLoad | Fs | Fh | Off, _)
        | (FvMotor | FcMotor, _) => 0,
        (Xx | Xy | Xz | Yz | Zz | Mx | My, JointKind::Revolute) => 1,
        (Mx | My | Mz | M, JointKind::Prismatic) => 1,
        (Ia, _) => 2,
        (Yy | Mz | M, JointKind::Revolute) => 3,
        (Xx | Xy | Xz | Yy | Yz | Zz, JointKind::Prismatic) => 3,
    }
}
