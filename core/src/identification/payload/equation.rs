//! Which sums of a load's ten parameters an arm shows, and what they do to the torques.

use nalgebra::{DMatrix, DVector};

use super::error::PayloadError;
use crate::dynamics::{BaseParameters, format_sum, select};
use crate::identification::given::Context;
use crate::regression::RegressionError;
use crate::robot::{ParameterKind, Robot};

/// How early a parameter is chosen, by its place among the ten: mass and centre, which are asked for first, then inertia; the later ones are
/// regrouped into the earlier.
const PREFERENCE: [usize; 10] = [9, 6, 7, 8, 0, 1, 2, 3, 4, 5];

/// The sums of the ten parameters that motions of an arm show, as [`BaseParameters`] are those of a whole arm.
pub(super) struct LoadSums {
    /// k × 10: sums = S φ.
    pub(super) regrouping: DMatrix<f64>,
    /// Of each sum the parameter whose column stands for it, ascending.
    pub(super) chosen: Vec<usize>,
    /// What each sum is: `xx - yy`.
    pub(super) names: Vec<String>,
    /// Parameters that no motion shows.
    pub(super) without_effect: Vec<usize>,
    /// b' × k: how base parameters of the selection change with each sum.
    change: DMatrix<f64>,
}

impl LoadSums {
    /// Of the last link, where all that a load changes is identified.
    ///
    /// # Errors
    /// [`PayloadError::NotIdentified`], [`PayloadError::Unseen`] and [`PayloadError::Ambiguous`].
    pub(super) fn of(
        robot: &Robot,
        base: &BaseParameters,
        context: &Context<'_>,
    ) -> Result<Self, PayloadError> {
        let last = robot.joints() - 1;
        let column = |kind| robot.parameters().column(kind, last);
        // A link has all ten.
        let columns: Vec<usize> = ParameterKind::LINK.into_iter().filter_map(column).collect();
        let all = base.regrouping().select_columns(&columns);
        let is_changed = |row: &usize| all.row(*row).iter().any(|entry| *entry != 0.0);
        let identified = context.selection.names();
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
        let symbols = ParameterKind::LINK.map(ParameterKind::symbol);
        let name = |row: usize| {
            // The parameter that stands for the sum is named first.
            let kept = sums.kept[row];
            let others = (0..symbols.len()).filter(|column| *column != kept);
            let terms = core::iter::once(kept).chain(others);
            let terms = terms.map(|column| (sums.regrouping[(row, column)], symbols[column]));
            format_sum(terms.filter(|(coefficient, _)| *coefficient != 0.0))
        };
        let rows: Vec<usize> = identified.iter().filter_map(|name| base.find(name)).collect();
        Ok(Self {
            names: (0..sums.kept.len()).map(name).collect(),
            change: all.select_rows(&rows).select_columns(&sums.kept),
            regrouping: sums.regrouping,
            chosen: sums.kept,
            without_effect: sums.without_effect,
        })
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
                names: columns.into_iter().filter_map(|k| self.names.get(k).cloned()).collect(),
            },
            other => PayloadError::Regression(other),
        }
    }

    /// Whether a parameter of the ten is a sum by itself, and which.
    pub(super) fn alone(&self, parameter: usize) -> Option<usize> {
        let row = self.chosen.iter().position(|chosen| *chosen == parameter)?;
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
