//! Inverse and direct dynamics, regressor, mass matrix and base parameters.
//!
//! A [`Model`] is immutable and shared; a [`Workspace`] holds all scratch memory of one thread. No
//! algorithm allocates. All are generic over [`Scalar`], and linear in the standard parameters:
//! inertia about the origin of the link's frame, first moments, mass, drive inertia and friction.

mod base;
mod direct;
mod drives;
mod inertia;
mod inverse;
mod kinematics;
mod mass_matrix;
mod partials;
mod regressor;
mod variation;
mod vector;

pub use base::{BaseParameters, BaseParametersError, UnknownBaseParameter};
pub use direct::NotPositiveDefinite;
pub use regressor::RegressorColumns;
pub(crate) use variation::{Variation, VariationWorkspace};

use direct::Factor;
use drives::Drives;
use inertia::Inertia;
use kinematics::{Motion, Pose};

use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::robot::{Joint, Parameter, ParameterKind, ParameterTable, Robot, SignModel};

/// The dynamics of one robot, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Model {
    chain: Vec<Joint>,
    gravity_m_s2: [f64; 3],
    table: ParameterTable,
    /// Column of each link's XX; its other nine parameters follow.
    first_columns: Vec<usize>,
    drives: Drives,
    all_columns: RegressorColumns,
}

impl Model {
    /// The model of a robot.
    pub fn new(robot: &Robot) -> Self {
        let table = robot.parameters().clone();
        let is_first = |(column, parameter): (usize, &Parameter)| {
            (parameter.kind == ParameterKind::Xx).then_some(column)
        };
        let first_columns: Vec<usize> =
            table.parameters().iter().enumerate().filter_map(is_first).collect();
        let drives = Drives::new(robot);
        let all: Vec<usize> = (0..table.names().len()).collect();
        let all_columns = RegressorColumns::new(&first_columns, &drives, all.len(), &all, true);
        Self {
            chain: robot.chain().to_vec(),
            gravity_m_s2: robot.gravity_m_s2(),
            first_columns,
            table,
            drives,
            all_columns,
        }
    }

    /// Number of joints, n.
    pub fn joints(&self) -> usize {
        self.chain.len()
    }

    /// The joints from base to tip.
    pub fn chain(&self) -> &[Joint] {
        &self.chain
    }

    /// Names of the p standard parameters, in the order of the regressor's columns.
    pub fn parameter_names(&self) -> &[String] {
        self.table.names()
    }

    /// The standard parameters themselves.
    pub fn parameters(&self) -> &ParameterTable {
        &self.table
    }

    /// The same model with another law for the sign of Coulomb friction.
    #[must_use]
    pub fn with_sign_model(mut self, sign_model: SignModel) -> Self {
        self.drives.set_sign_model(sign_model);
        self.all_columns.set_sign_model(sign_model);
        self
    }

    #[inline(always)]
    fn link<T: Scalar>(&self, parameters: &[T], link: usize) -> Inertia<T> {
        let first = self.first_columns[link];
        let mut ten = [T::zero(); 10];
        ten.copy_from_slice(&parameters[first..first + 10]);
        Inertia::from_parameters(&ten)
    }

    /// How many links there are up to the last with inertia: those beyond take no torque.
    fn heavy_links<T: Scalar>(&self, parameters: &[T]) -> usize {
        let has_inertia =
            |first: &usize| parameters[*first..*first + 10].iter().any(|value| !value.is_zero());
        self.first_columns.iter().rposition(has_inertia).map_or(0, |last| last + 1)
    }

    fn check_joints<T>(&self, slice: &[T]) {
        assert_eq!(slice.len(), self.joints(), "one entry per joint");
    }

    fn check_parameters<T>(&self, slice: &[T]) {
        assert_eq!(slice.len(), self.table.names().len(), "one entry per standard parameter");
    }
}

/// All scratch memory of the algorithms; one serves robots of every size.
#[derive(Clone, Debug)]
pub struct Workspace<T> {
    poses: [Pose<T>; MAX_JOINTS],
    motions: [Motion<T>; MAX_JOINTS],
    /// Of the mass matrix of the last direct dynamics that had no error.
    factor: Factor<T>,
}

impl<T: Scalar> Workspace<T> {
    /// Scratch memory for one thread.
    pub fn new() -> Self {
        Self {
            poses: [Pose::identity(); MAX_JOINTS],
            motions: [Motion::zero(); MAX_JOINTS],
            factor: Factor::zero(),
        }
    }
}

impl<T: Scalar> Default for Workspace<T> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{Lanes, WIDTH};

    type Four = Lanes<WIDTH>;

    /// The kernels as they are compiled for the baseline, called beside the choice.
    #[test]
    fn every_instruction_set_gives_the_same() {
        let file = include_str!("../../../config/robots/tx40-physical.toml");
        let robot = Robot::from_toml(file).unwrap();
        let model = Model::new(&robot);
        let n = model.joints();
        let parameters: Vec<_> = robot
            .nominal()
            .unwrap()
            .standard()
            .iter()
            .map(|&value| Four::constant(value))
            .collect();
        let [mut chosen, mut plain] = [[Four::zero(); MAX_JOINTS]; 2];
        let size = n * parameters.len();
        let [mut chosen_matrix, mut plain_matrix] =
            [vec![Four::zero(); size], vec![Four::zero(); size]];
        let mut ws = Workspace::new();
        let mut compared = 0;
        let mut same = |chosen: &[Four], plain: &[Four]| {
            for (chosen, plain) in chosen.iter().zip(plain) {
                for (chosen, plain) in chosen.0.iter().zip(plain.0) {
                    assert!((chosen - plain).abs() <= 1e-9 * plain.abs(), "{chosen}, {plain}");
                    compared += 1;
                }
            }
        };
        for k in 0..50 {
            let state = |what: i32| -> Vec<Four> {
                let value = |joint: usize, lane: usize| {
                    (f64::from(what + 4 * k) + joint as f64 + 7.0 * lane as f64).sin()
                };
                (0..n).map(|joint| Four::from_fn(|lane| value(joint, lane) * 5.0)).collect()
            };
            let [q, dq, ddq, tau] = [0, 1, 2, 3].map(state);
            let (chosen, plain) = (&mut chosen[..n], &mut plain[..n]);
            model.direct_dynamics(&mut ws, &parameters, &q, &dq, &tau, chosen).unwrap();
            model.solve_inward(&mut ws, &parameters, &[], &q, &dq, &tau, plain).unwrap();
            same(chosen, plain);
            model.regressor(&mut ws, &q, &dq, &ddq, &mut chosen_matrix);
            model.place(&mut ws, &q);
            let columns = &model.all_columns;
            model.regressor_of_poses(&mut ws, columns, &dq, &ddq, &mut plain_matrix);
            same(&chosen_matrix, &plain_matrix);
        }
        assert_eq!(compared, 50 * 4 * (n + size));
    }
}
