//! Dynamics of one robot, prepared for evaluation.

use super::drives::DriveTerms;
use super::inertia::Inertia;
use super::regressor_columns::RegressorColumns;
use crate::numeric::Scalar;
use crate::robot::{
    Hysteresis, Joint, JointIndex, KnownTorque, Parameter, ParameterKind, ParameterTable, Robot,
    SignModel,
};
use crate::sample::FEW_JOINTS;

/// Source of the load that friction grows with.
#[derive(Clone, Debug)]
pub(super) enum FrictionLoad {
    /// The load of the parameters with which the torques are computed.
    OfParameters,
    /// The load of an arm with these standard parameters. Torques are then linear in the
    /// parameters.
    Of(Vec<f64>),
}

/// Dynamics of one robot, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Model {
    pub(super) chain: Vec<Joint>,
    pub(super) gravity_m_s2: [f64; 3],
    parameter_table: ParameterTable,
    /// Column of each link's XX; its other nine parameters follow.
    pub(super) first_columns: Vec<usize>,
    pub(super) drives: DriveTerms,
    /// Load, if friction grows with one.
    pub(super) load: Option<FrictionLoad>,
    /// Known torque of each joint; empty if no joint has one.
    pub(super) known_torques: Vec<Option<KnownTorque>>,
    pub(super) all_columns: RegressorColumns,
    /// Hysteresis state before a motion; `None` without friction with hysteresis.
    history: Option<Hysteresis>,
    /// Joints without a recorded torque, ascending.
    missing_torques: Vec<JointIndex>,
}

impl Model {
    /// Creates the model of a robot.
    pub fn new(robot: &Robot) -> Self {
        let table = robot.parameters().clone();
        let is_first = |(column, parameter): (usize, &Parameter)| {
            (parameter.kind == ParameterKind::Xx).then_some(column)
        };
        let first_columns: Vec<usize> =
            table.parameters().iter().enumerate().filter_map(is_first).collect();
        let drives = DriveTerms::new(robot);
        let known_torques = match robot.known_torques() {
            tables if tables.iter().any(Option::is_some) => tables.to_vec(),
            _ => Vec::new(),
        };
        let columns: Vec<usize> = (0..table.names().len()).collect();
        let all_columns =
            RegressorColumns::new(&first_columns, &drives, columns.len(), &columns, true);
        Self {
            chain: robot.chain().to_vec(),
            gravity_m_s2: robot.gravity_m_s2(),
            first_columns,
            parameter_table: table,
            load: drives.feel_loads().then_some(FrictionLoad::OfParameters),
            drives,
            known_torques,
            all_columns,
            history: Hysteresis::from_robot(robot),
            missing_torques: robot.recorded_torque().missing_joints().to_vec(),
        }
    }

    /// Returns the number of joints, n.
    pub fn joints(&self) -> usize {
        self.chain.len()
    }

    /// Returns true if half of the scratch memory is enough for the arm.
    #[inline(always)]
    pub(super) fn has_few_joints(&self) -> bool {
        self.chain.len() <= FEW_JOINTS
    }

    /// The joints from base to tip.
    pub fn chain(&self) -> &[Joint] {
        &self.chain
    }

    /// Names of the p standard parameters, in the order of the regressor's columns.
    pub fn parameter_names(&self) -> &[String] {
        self.parameter_table.names()
    }

    /// The standard parameters themselves.
    pub fn parameters(&self) -> &ParameterTable {
        &self.parameter_table
    }

    /// Returns the same model with another law for the sign of Coulomb friction.
    #[must_use]
    pub fn with_sign_model(mut self, sign_model: SignModel) -> Self {
        self.drives.set_sign_model(sign_model);
        self.all_columns.set_sign_model(sign_model);
        self
    }

    /// Returns the same model with friction laws that differ as much as possible at speeds of about
    /// 1 rad/s or m/s, and loads of an arm that has all of them. Structure decides which parameters
    /// act together; the width of a law does not.
    #[must_use]
    pub fn with_plain_friction(self) -> Self {
        let mut model = self.with_sign_model(SignModel::Sign);
        model.drives.set_stribeck_speed(1.0);
        model.all_columns.set_stribeck_speed(1.0);
        let ones = vec![1.0; model.parameter_names().len()];
        model.with_load(ones)
    }

    /// Returns the acceleration of gravity in the base \[m/s²\].
    pub fn gravity_m_s2(&self) -> [f64; 3] {
        self.gravity_m_s2
    }

    /// Returns the same model with another acceleration of gravity in the base \[m/s²\].
    #[must_use]
    pub fn with_gravity(mut self, gravity_m_s2: [f64; 3]) -> Self {
        self.gravity_m_s2 = gravity_m_s2;
        self
    }

    /// Returns the same model with another geometry at one joint, counted from 0, of the same kind.
    #[must_use]
    pub fn with_joint(mut self, index: usize, joint: Joint) -> Self {
        self.chain[index] = joint;
        self
    }

    /// Returns the joints without a recorded torque, ascending. The model has their torque, but no
    /// record does.
    pub fn missing_torques(&self) -> &[JointIndex] {
        &self.missing_torques
    }

    /// Returns the hysteresis of the friction before a motion; `None` if no joint has any.
    pub fn history(&self) -> Option<Hysteresis> {
        self.history.clone()
    }

    /// Returns joint (counted from 0) and column of each hysteresis coefficient.
    pub fn hysteresis(&self) -> impl Iterator<Item = (usize, usize)> {
        self.drives.hysteresis()
    }

    /// Returns the known torque on a joint, counted from 0, in addition to gravity and drive, at
    /// several positions side by side.
    pub fn known_torque<T: Scalar>(&self, joint: usize, position: T) -> Option<T> {
        Some(self.known_torques.get(joint)?.as_ref()?.torque(position))
    }

    /// Subtracts the known torques, which the drives do not have to produce.
    #[inline(always)]
    pub(super) fn take_off_known<T: Scalar>(&self, q: &[T], torques: &mut [T]) {
        for ((tables, q), torque) in self.known_torques.iter().zip(q).zip(torques) {
            if let Some(known_value) = tables {
                *torque -= known_value.torque(*q);
            }
        }
    }

    #[inline(always)]
    pub(super) fn link<T: Scalar>(&self, parameters: &[T], link: usize) -> Inertia<T> {
        let first = self.first_columns[link];
        let mut ten = [T::zero(); 10];
        ten.copy_from_slice(&parameters[first..first + 10]);
        Inertia::from_parameters(&ten)
    }

    /// Returns the number of links up to the last one with inertia. Links after it need no torque.
    #[inline(always)]
    pub(super) fn heavy_links<T: Scalar>(&self, parameters: &[T]) -> usize {
        let has_inertia =
            |first: &usize| parameters[*first..*first + 10].iter().any(|value| !value.is_zero());
        self.first_columns.iter().rposition(has_inertia).map_or(0, |last| last + 1)
    }

    pub(super) fn check_joints<T>(&self, slice: &[T]) {
        assert_eq!(slice.len(), self.joints(), "one entry per joint");
    }

    pub(super) fn assert_parameter_count<T>(&self, slice: &[T]) {
        assert_eq!(
            slice.len(),
            self.parameter_table.names().len(),
            "one entry per standard parameter"
        );
    }
}
