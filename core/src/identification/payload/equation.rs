//! Which sums of a load's ten parameters an arm shows, and what they do to the torques.

use nalgebra::{DMatrix, DVector};

use super::error::PayloadError;
use crate::dynamics::{BaseParameters, format_sum, select};
use crate::regression::RegressionError;
use crate::robot::{JointKind, ParameterKind, Robot};

/// How early a parameter is chosen, by its place among the ten: mass and centre, which are asked for first, then inertia; the later ones are
/// regrouped into the earlier.
const PREFERENCE: [usize; 10] = [9, 6, 7, 8, 0, 1, 2, 3, 4, 5];

/// The sums of the ten parameters that motions of an arm show, as [`BaseParameters`] are those of a whole arm.
pub struct LoadSums {
    /// k × 10: sums = S φ.
    pub(super) regrouping: DMatrix<f64>,
    /// Of each sum the parameter whose column stands for it, ascending.
    chosen: Vec<usize>,
    /// Parameters that no motion shows.
    without_effect: Vec<usize>,
    /// b' × k: how base parameters of the selection change with each sum.
    change: DMatrix<f64>,
}

impl LoadSums {
    /// Of the last link, where all that a load changes is among the base parameters that are identified.
    ///
    /// # Errors
    /// [`PayloadError::NotIdentified`], [`PayloadError::Unseen`] and [`PayloadError::Ambiguous`].
    pub fn of(
        robot: &Robot,
        base: &BaseParameters,
        identified: &[String],
    ) -> Result<Self, PayloadError> {
        let last = robot.joints() - 1;
        let column = |kind| robot.parameters().column(kind, last);
        // A link has all ten.
        let columns: Vec<usize> = ParameterKind::LINK.into_iter().filter_map(column).collect();
        let all = base.regrouping().select_columns(&columns);
        let is_changed = |row: &usize| all.row(*row).iter().any(|entry| *entry != 0.0);
        let missing = (0..all.nrows()).filter(is_changed).map(|row| &base.names()[row]);
        let names: Vec<String> =
            missing.filter(|name| !identified.contains(name)).cloned().collect();
        if !names.is_empty() {
            return Err(PayloadError::NotIdentified { names });
        }
        let sums = select(&all, &PREFERENCE)?;
        if sums.kept.is_empty() {
            return Err(PayloadError::Unseen);
        }
        let rows: Vec<usize> = identified.iter().filter_map(|name| base.find(name)).collect();
        Ok(Self {
            change: all.select_rows(&rows).select_columns(&sums.kept),
            regrouping: sums.regrouping,
            chosen: sums.kept,
            without_effect: sums.without_effect,
        })
    }

    /// Those of them that a record tells from each other, by the observation matrix of its motion (r × b'): the others are regrouped into
    /// these, or have no effect there.
    ///
    /// # Errors
    /// [`PayloadError::Unseen`].
    pub fn told_by(self, matrix: &DMatrix<f64>) -> Result<Self, PayloadError> {
        let preference = PREFERENCE.into_iter().filter_map(|parameter| self.place(parameter));
        // Where rounding decides, the regression says what is wrong.
        let preference: Vec<usize> = preference.collect();
        let Ok(told) = select(&self.along(matrix), &preference) else { return Ok(self) };
        if told.kept.is_empty() {
            return Err(PayloadError::Unseen);
        }
        Ok(Self {
            regrouping: told.regrouping * self.regrouping,
            chosen: told.kept.iter().map(|sum| self.chosen[*sum]).collect(),
            change: self.change.select_columns(&told.kept),
            ..self
        })
    }

    /// What each sum is, the parameter that stands for it first: `xx - yy`.
    pub(super) fn names(&self) -> Vec<String> {
        let symbols = ParameterKind::LINK.map(ParameterKind::symbol);
        let name = |(row, chosen): (usize, &usize)| {
            let others = (0..symbols.len()).filter(|column| column != chosen);
            let terms = core::iter::once(*chosen).chain(others);
            let terms = terms.map(|column| (self.regrouping[(row, column)], symbols[column]));
            format_sum(terms.filter(|(coefficient, _)| *coefficient != 0.0))
        };
        self.chosen.iter().enumerate().map(name).collect()
    }

    /// The unit of each sum: those of a link are the same at any joint.
    pub(super) fn units(&self) -> impl Iterator<Item = &'static str> {
        self.chosen.iter().map(|chosen| ParameterKind::LINK[*chosen].unit(JointKind::Revolute))
    }

    /// The parameter of the last link whose column of the regressor is that of each sum.
    pub fn kinds(&self) -> impl Iterator<Item = ParameterKind> {
        self.chosen.iter().map(|chosen| ParameterKind::LINK[*chosen])
    }

    /// Those of the ten that no motion shows, and those that this record does not tell by themselves.
    pub(super) fn untold(&self) -> [Vec<&'static str>; 2] {
        let symbol = |&parameter: &usize| ParameterKind::LINK[parameter].symbol();
        let is_open = |parameter: &usize| {
            !self.without_effect.contains(parameter) && self.alone(*parameter).is_none()
        };
        [
            self.without_effect.iter().map(symbol).collect(),
            (0..10).filter(is_open).map(|parameter| symbol(&parameter)).collect(),
        ]
    }

    /// The base parameters (b') of an arm with this load, from those without.
    pub(super) fn loaded(&self, arm: &DVector<f64>, values: &DVector<f64>) -> DVector<f64> {
        arm + &self.change * values
    }

    /// Z (r × k): the torques of each sum, along the motion of this observation matrix (r × b').
    pub(super) fn along(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        matrix * &self.change
    }

    /// The failure of a regression, with columns called by their names.
    pub(super) fn named(&self, error: RegressionError) -> PayloadError {
        match error {
            RegressionError::ZeroColumns { columns }
            | RegressionError::DependentColumns { columns } => PayloadError::NotTold {
                names: columns.into_iter().filter_map(|k| self.names().get(k).cloned()).collect(),
            },
            other => PayloadError::Regression(other),
        }
    }

    /// The sum that a parameter of the ten stands for.
    fn place(&self, parameter: usize) -> Option<usize> {
        self.chosen.iter().position(|chosen| *chosen == parameter)
    }

    /// Whether a parameter of the ten is a sum by itself, and which.
    pub(super) fn alone(&self, parameter: usize) -> Option<usize> {
        let row = self.place(parameter)?;
        let terms = self.regrouping.row(row).iter().filter(|entry| **entry != 0.0).count();
        (terms == 1).then_some(row)
    }

    /// The ten (φ, and their covariance) where the sums are these: those that are alone, every other 0.
    pub(super) fn ten(
        &self,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let alone: Vec<Option<usize>> = (0..10).map(|k| self.alone(k)).collect();
        let value = |k: usize, _| alone[k].map_or(0.0, |row| values[row]);
        let both = |i: usize, j: usize| Some(covariance[(alone[i]?, alone[j]?)]);
        let covariance = DMatrix::from_fn(10, 10, |i, j| both(i, j).unwrap_or_default());
        (DVector::from_fn(10, value), covariance)
    }
}
