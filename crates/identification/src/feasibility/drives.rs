//! Drive and friction parameters that cannot be negative, across couplings.
//!
//! A motor's inertia ia_m adds ia_m s sᵀ to the mass matrix, where s is the motion of the motor per
//! unit of each joint's motion. The model regroups the diagonal of this matrix into the inertias of
//! other joints' motors (`crates/dynamics/src/dynamics/drives.rs`). So a motor's own inertia has to
//! be positive. For a wrist whose motor 6 also turns with joint 5, ia5 = ia5′ + ia6. Viscous
//! friction dissipates power if and only if its matrix is positive definite. The diagonal of this
//! matrix contains fv of each joint, the other entries are those of coupled motors. Positive
//! friction of each single motor is a stronger condition and not required, because friction in
//! gears that two motors share need not be split in this way. Each fc is the friction of a separate
//! contact.

use nalgebra::DMatrix;

use super::assumptions::PriorAssumptions;
use super::block::Block;
use super::error::FeasibilityError;
use super::estimate::Rows;
use super::prior::Prior;
use didim_dynamics::robot::ParameterKind::{Fc, FcMotor, Fv, FvMotor, Ia, M, Zz};
use didim_dynamics::robot::{JointIndex, JointKind, Parameter, ParameterKind, Robot};

/// Drive and friction parameters of one robot and one estimate.
pub(super) struct DriveBlocks<'a> {
    pub(super) robot: &'a Robot,
    pub(super) rows: &'a Rows,
    pub(super) prior: &'a Prior,
}

impl DriveBlocks<'_> {
    /// Returns the blocks of all drive and friction parameters that cannot be negative.
    pub(super) fn positive_blocks(&self) -> Result<Vec<Block>, FeasibilityError> {
        let n = self.robot.joints();
        let mut blocks = Vec::new();
        for motor in 0..n {
            blocks.extend(self.inertia(motor)?);
            for kind in [Fc, FcMotor] {
                let column = self.column_if_present(kind, motor);
                blocks.extend(column.map(|column| self.scalar_block(column)).transpose()?);
            }
        }
        let mut waiting: Vec<usize> = (0..n).collect();
        while let Some(first) = waiting.first() {
            let together = self.coupled_with(*first);
            waiting.retain(|joint| !together.contains(joint));
            blocks.extend(self.viscous_block(&together)?);
        }
        Ok(blocks)
    }

    /// Returns the column of a parameter; `None` if the identified model does not contain it.
    fn column_if_present(&self, kind: ParameterKind, joint: usize) -> Option<usize> {
        let column = self.robot.parameters().column(kind, JointIndex::new(joint))?;
        (!self.rows.absent_columns.contains(&column)).then_some(column)
    }

    /// Returns the share of a motor's own inertia that the model regroups into the inertia of
    /// another joint's motor.
    fn regrouped_share(&self, motor: usize, joint: usize) -> f64 {
        let transmission = self.robot.transmission();
        let takes = motor != joint
            && !transmission.is_coupled(joint)
            && self.robot.parameters().column(Ia, JointIndex::new(joint)).is_some();
        if takes { transmission.direction(motor)[joint].powi(2) } else { 0.0 }
    }

    /// Returns the columns of drive inertias with a non-zero factor, each with that factor.
    fn drive_inertias(&self, factor: impl Fn(usize) -> f64) -> impl Iterator<Item = (usize, f64)> {
        let factors = (0..self.robot.joints()).map(move |joint| (joint, factor(joint)));
        factors
            .filter(|(_, factor)| *factor > 0.0)
            .filter_map(|(joint, factor)| Some((self.column_if_present(Ia, joint)?, factor)))
    }

    /// Returns the block of a motor's own inertia. It contributes to its own parameter and to those
    /// of other joints that the motor turns.
    fn inertia(&self, motor: usize) -> Result<Option<Block>, FeasibilityError> {
        let Some(column) = self.column_if_present(Ia, motor) else { return Ok(None) };
        let added = self.drive_inertias(|joint| self.regrouped_share(motor, joint));
        let added: Vec<_> = core::iter::once((column, 1.0)).chain(added).collect();
        let others: Vec<_> =
            self.drive_inertias(|other| self.regrouped_share(other, motor)).collect();
        let configured = self.prior.drive_inertia.get(motor).copied().flatten();
        let size = match configured.filter(|_| !self.is_alone(column)) {
            Some(declared) => declared,
            None => self.parameter_size(column, &others)?,
        };
        self.check_block(Block::from_scalar(&added, size), column).map(Some)
    }

    fn is_alone(&self, column: usize) -> bool {
        self.rows.row_of(column).is_some_and(|row| self.rows.is_alone(row))
    }

    /// Returns the magnitude of a positive parameter according to the estimate, without the
    /// contributions of `others`.
    fn parameter_size(
        &self,
        column: usize,
        others: &[(usize, f64)],
    ) -> Result<f64, FeasibilityError> {
        if self.is_alone(column) {
            let others = others.iter().filter(|(other, _)| self.is_alone(*other));
            let parts = others.map(|&(other, factor)| (other, -factor));
            let rows = core::iter::once((column, 1.0))
                .chain(parts)
                .filter_map(|(column, factor)| Some((self.rows.row_of(column)?, factor)));
            return Ok(self.rows.combination_size(&rows.collect::<Vec<_>>()));
        }
        let parameter = self.parameter(column);
        let Some((row, coefficient)) = self.sum_with(column, parameter) else {
            return Err(FeasibilityError::LeftOut { names: vec![parameter.to_string()] });
        };
        let size = self.rows.combination_size(&[(row, 1.0)]) / coefficient;
        if parameter.kind != Ia {
            return Ok(size);
        }
        // If the other terms make the sum negative, it gives no value for the drive. The link's
        // inertia may then give one.
        let body = &self.prior.link_bodies[parameter.joint];
        let link = match self.robot.chain()[parameter.joint].kind {
            JointKind::Revolute => body.inertia[(2, 2)],
            JointKind::Prismatic => body.mass_kg,
        };
        let is_positive = self.rows.values[row] > self.rows.deviation(row);
        Ok(PriorAssumptions::DEFAULT.sum_share * if is_positive { size } else { size.max(link) })
    }

    /// Returns the row of a sum that contains a parameter without its own row, and the coefficient
    /// of the parameter. It is the row of the link that a drive moves, or else the row with the
    /// largest coefficient.
    fn sum_with(&self, column: usize, parameter: Parameter) -> Option<(usize, f64)> {
        let coefficients = self.rows.regrouping.column(column);
        let mut of_link = [Zz, M].into_iter().filter_map(|kind| {
            let row = self.rows.row_of(self.robot.parameters().column(kind, parameter.joint)?)?;
            Some((row, coefficients[row]))
        });
        let terms = coefficients.iter().copied().enumerate();
        let most = terms.filter(|(_, own)| *own > 0.0).max_by(|(_, a), (_, b)| a.total_cmp(b));
        of_link.find(|(_, own)| *own > 0.0).or(most)
    }

    fn scalar_block(&self, column: usize) -> Result<Block, FeasibilityError> {
        self.check_block(
            Block::from_scalar(&[(column, 1.0)], self.parameter_size(column, &[])?),
            column,
        )
    }

    /// Returns the joints that coupled motors with viscous friction connect to a joint, including
    /// the joint itself.
    fn coupled_with(&self, joint: usize) -> Vec<usize> {
        let mut together = vec![joint];
        let mut next = 0;
        while let Some(&at) = together.get(next) {
            next += 1;
            for motor in
                (0..self.robot.joints()).filter(|m| self.column_if_present(FvMotor, *m).is_some())
            {
                let row = self.robot.transmission().row(motor);
                if row[at] == 0.0 {
                    continue;
                }
                let coupled = (0..row.len()).filter(|&joint| row[joint] != 0.0);
                let new: Vec<usize> = coupled.filter(|joint| !together.contains(joint)).collect();
                together.extend(new);
            }
        }
        together.sort_unstable();
        together
    }

    /// Returns the block of viscous friction of joints that coupled motors connect.
    fn viscous_block(&self, joints: &[usize]) -> Result<Option<Block>, FeasibilityError> {
        if let [joint] = joints {
            let column = self.column_if_present(Fv, *joint);
            return column.map(|column| self.scalar_block(column)).transpose();
        }
        let n = joints.len();
        let mut terms = Vec::new();
        let mut diagonal = DMatrix::zeros(n, n);
        for (at, &joint) in joints.iter().enumerate() {
            let Some(column) = self.column_if_present(Fv, joint) else {
                let name = Parameter { kind: Fv, joint: JointIndex::new(joint) }.to_string();
                return Err(FeasibilityError::LeftOut { names: vec![name] });
            };
            diagonal[(at, at)] = self.parameter_size(column, &[])?;
            let mut unit = DMatrix::zeros(n, n);
            unit[(at, at)] = 1.0;
            terms.push((column, unit));
        }
        let mut others = DMatrix::zeros(n, n);
        for &motor in joints {
            let Some(column) = self.column_if_present(FvMotor, motor) else { continue };
            let s = self.robot.transmission().direction(motor);
            let term =
                DMatrix::from_fn(
                    n,
                    n,
                    |i, j| {
                        if i == j { 0.0 } else { s[joints[i]] * s[joints[j]] }
                    },
                );
            if let Some(row) = self.rows.row_of(column) {
                others += &term * self.rows.values[row];
            }
            terms.push((column, term));
        }
        // Moves the prior towards the estimate as far as the matrix stays well inside the cone of
        // positive definite matrices.
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            others[(i, j)] / (diagonal[(i, i)] * diagonal[(j, j)]).sqrt()
        });
        let least = scaled.symmetric_eigenvalues().min();
        let part = if least < PriorAssumptions::DEFAULT.min_eigenvalue - 1.0 {
            (PriorAssumptions::DEFAULT.min_eigenvalue - 1.0) / least
        } else {
            1.0
        };
        let column = terms[0].0;
        self.check_block(Block::from_sum(&terms, &(diagonal + others * part)), column).map(Some)
    }

    /// Returns the block. Returns an error if there is none, because a parameter without a positive
    /// prior has invalid values.
    fn check_block(&self, block: Option<Block>, column: usize) -> Result<Block, FeasibilityError> {
        block.ok_or_else(|| FeasibilityError::NoValue { name: self.name(column) })
    }

    fn parameter(&self, column: usize) -> Parameter {
        self.robot.parameters().parameters()[column]
    }

    fn name(&self, column: usize) -> String {
        self.parameter(column).to_string()
    }
}
