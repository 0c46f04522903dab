//! Parameters of the arm in the order of the observer's columns.

use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::{ParameterKind, Robot};
use nalgebra::{DMatrix, DVector};

use super::error::ObserverError;
use crate::identification::{KnownArm, Selection};

/// Parameters with a column: the identified ones, and those with a fixed value, whose uncertainty
/// is 0.
pub(super) struct ArmParameters {
    /// Column of each parameter in the regressor.
    pub(super) columns: Vec<usize>,
    /// Kind of each parameter.
    pub(super) kinds: Vec<ParameterKind>,
    /// Values (b).
    pub(super) values: Vec<f64>,
    /// Covariance (b × b).
    pub(super) covariance: DMatrix<f64>,
    /// All standard parameters with the same torques.
    pub(super) standard: Vec<f64>,
}

impl ArmParameters {
    /// Takes the parameters of a result.
    ///
    /// # Errors
    /// [`ObserverError::Parameters`] and [`ObserverError::NoCovariance`].
    pub(super) fn new(
        robot: &Robot,
        base: &BaseParameters,
        arm: &KnownArm<'_>,
    ) -> Result<Self, ObserverError> {
        let KnownArm { model, covariance } = arm;
        let names: Vec<String> = model.parameters.iter().map(|(name, _)| (*name).into()).collect();
        let mut selection = Selection::new(robot, base, Some(&names))?;
        selection.keep_values(base, model.fixed_parameters.iter().copied())?;
        let identified = covariance.and_then(|of| of.matrix(names.len()));
        let identified = identified.ok_or(ObserverError::NoCovariance)?;
        let identified = model.reorder_covariance(&selection, &identified);
        let values = model.values(&selection);
        let count = values.len() + selection.fixed().len();
        let mut complete = DMatrix::zeros(count, count);
        complete.view_mut((0, 0), identified.shape()).copy_from(&identified);
        let fixed = || selection.fixed().iter().copied();
        let columns: Vec<usize> =
            selection.columns().iter().copied().chain(fixed().map(|(column, _)| column)).collect();
        let table = robot.parameters().parameters();
        Ok(Self {
            kinds: columns.iter().map(|column| table[*column].kind).collect(),
            standard: selection.to_standard(&DVector::from_column_slice(values.as_slice())),
            values: values.iter().copied().chain(fixed().map(|(_, value)| value)).collect(),
            covariance: complete,
            columns,
        })
    }
}
