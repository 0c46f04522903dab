//! What of drives and friction cannot be negative, across couplings.
//!
//! A motor's inertia ia_m adds ia_m s sᵀ to the mass matrix, with its motion s per unit of each joint's, and the model
//! regroups its diagonal into the inertias of other joints' motors (`core/src/dynamics/drives.rs`). So a motor's own
//! inertia is what must be positive, and ia5 = ia5′ + ia6 of a wrist whose motor 6 also turns with joint 5.
//! Viscous friction takes power if and only if its matrix is positive definite: fv of each joint on its diagonal, and
//! beside it that of coupled motors. That each motor's own friction be positive would be more, and is not asked:
//! friction in gears that two motors share need not be split so. Each fc is the friction of a contact of its own.

use nalgebra::DMatrix;

use super::block::Block;
use super::error::FeasibilityError;
use super::estimate::Rows;
use super::prior::Prior;
use crate::robot::ParameterKind::{Fc, FcMotor, Fv, FvMotor, Ia, M, Zz};
use crate::robot::{JointKind, Parameter, ParameterKind, Robot};

/// A drive inertia that is known only in a sum with a link's is taken for this part of the sum.
const PART_OF_SUM: f64 = 0.3;
/// The least eigenvalue of a prior's friction matrix, its diagonal scaled to 1.
const LEAST_EIGENVALUE: f64 = 0.1;

/// Of one robot and one estimate.
pub(super) struct Drives<'a> {
    pub(super) robot: &'a Robot,
    pub(super) rows: &'a Rows,
    pub(super) prior: &'a Prior,
}

impl Drives<'_> {
    /// Everything of drives and friction that cannot be negative.
    pub(super) fn blocks(&self) -> Result<Vec<Block>, FeasibilityError> {
        let n = self.robot.joints();
        let mut blocks = Vec::new();
        for motor in 0..n {
            blocks.extend(self.inertia(motor)?);
            for kind in [Fc, FcMotor] {
                let column = self.present(kind, motor);
                blocks.extend(column.map(|column| self.scalar(column)).transpose()?);
            }
        }
        let mut waiting: Vec<usize> = (0..n).collect();
        while let Some(first) = waiting.first() {
            let together = self.coupled_with(*first);
            waiting.retain(|joint| !together.contains(joint));
            blocks.extend(self.viscous(&together)?);
        }
        Ok(blocks)
    }

    /// The column of a parameter that the identified model has.
    fn present(&self, kind: ParameterKind, joint: usize) -> Option<usize> {
        let column = self.robot.parameters().column(kind, joint)?;
        (!self.rows.absent.contains(&column)).then_some(column)
    }

    /// The part of a motor's own inertia that the model regroups into that of another joint's motor.
    fn regrouped(&self, motor: usize, joint: usize) -> f64 {
        let transmission = self.robot.transmission();
        let takes = motor != joint
            && !transmission.is_coupled(joint)
            && self.robot.parameters().column(Ia, joint).is_some();
        if takes { transmission.direction(motor)[joint].powi(2) } else { 0.0 }
    }

    /// The columns of drive inertias, each with a factor that is not 0.
    fn drive_inertias(&self, factor: impl Fn(usize) -> f64) -> impl Iterator<Item = (usize, f64)> {
        let factors = (0..self.robot.joints()).map(move |joint| (joint, factor(joint)));
        factors
            .filter(|(_, factor)| *factor > 0.0)
            .filter_map(|(joint, factor)| Some((self.present(Ia, joint)?, factor)))
    }

    /// A motor's own inertia: in its own parameter, and in those of joints that it also turns.
    fn inertia(&self, motor: usize) -> Result<Option<Block>, FeasibilityError> {
        let Some(column) = self.present(Ia, motor) else { return Ok(None) };
        let added = self.drive_inertias(|joint| self.regrouped(motor, joint));
        let added: Vec<_> = core::iter::once((column, 1.0)).chain(added).collect();
        let others: Vec<_> = self.drive_inertias(|other| self.regrouped(other, motor)).collect();
        let stated = self.prior.drive_inertia.get(motor).copied().flatten();
        let size = match stated.filter(|_| !self.is_alone(column)) {
            Some(stated) => stated,
            None => self.size(column, &others)?,
        };
        self.checked(Block::scalar(&added, size), column).map(Some)
    }

    fn is_alone(&self, column: usize) -> bool {
        self.rows.own(column).is_some_and(|row| self.rows.is_alone(row))
    }

    /// How large a positive parameter is by the estimate, without parts of `others` that stand in it.
    fn size(&self, column: usize, others: &[(usize, f64)]) -> Result<f64, FeasibilityError> {
        if self.is_alone(column) {
            let others = others.iter().filter(|(other, _)| self.is_alone(*other));
            let parts = others.map(|&(other, factor)| (other, -factor));
            let rows = core::iter::once((column, 1.0))
                .chain(parts)
                .filter_map(|(column, factor)| Some((self.rows.own(column)?, factor)));
            return Ok(self.rows.size(&rows.collect::<Vec<_>>()));
        }
        let parameter = self.parameter(column);
        let Some((row, coefficient)) = self.sum_with(column, parameter) else {
            return Err(FeasibilityError::LeftOut { names: vec![parameter.to_string()] });
        };
        let size = self.rows.size(&[(row, 1.0)]) / coefficient;
        if parameter.kind != Ia {
            return Ok(size);
        }
        // A sum that is negative, by what else is in it, says nothing of the drive: the link may.
        let body = &self.prior.bodies[parameter.joint];
        let link = match self.robot.chain()[parameter.joint].kind {
            JointKind::Revolute => body.inertia[(2, 2)],
            JointKind::Prismatic => body.mass_kg,
        };
        let is_positive = self.rows.values[row] > self.rows.deviation(row);
        Ok(PART_OF_SUM * if is_positive { size } else { size.max(link) })
    }

    /// The row with a parameter that is not one of its own, with its coefficient: that of the link that a drive moves,
    /// or the one that has most of it.
    fn sum_with(&self, column: usize, parameter: Parameter) -> Option<(usize, f64)> {
        let coefficients = self.rows.regrouping.column(column);
        let mut of_link = [Zz, M].into_iter().filter_map(|kind| {
            let row = self.rows.own(self.robot.parameters().column(kind, parameter.joint)?)?;
            Some((row, coefficients[row]))
        });
        let all = coefficients.iter().copied().enumerate();
        let most = all.filter(|(_, own)| *own > 0.0).max_by(|(_, a), (_, b)| a.total_cmp(b));
        of_link.find(|(_, own)| *own > 0.0).or(most)
    }

    fn scalar(&self, column: usize) -> Result<Block, FeasibilityError> {
        self.checked(Block::scalar(&[(column, 1.0)], self.size(column, &[])?), column)
    }

    /// The joints that coupled motors with viscous friction connect to one, itself among them.
    fn coupled_with(&self, joint: usize) -> Vec<usize> {
        let mut together = vec![joint];
        let mut next = 0;
        while let Some(&at) = together.get(next) {
            next += 1;
            for motor in (0..self.robot.joints()).filter(|m| self.present(FvMotor, *m).is_some()) {
                let row = self.robot.transmission().row(motor);
                if row[at] == 0.0 {
                    continue;
                }
                let turned = (0..row.len()).filter(|&joint| row[joint] != 0.0);
                let new: Vec<usize> = turned.filter(|joint| !together.contains(joint)).collect();
                together.extend(new);
            }
        }
        together.sort_unstable();
        together
    }

    /// The viscous friction of joints that coupled motors connect.
    fn viscous(&self, joints: &[usize]) -> Result<Option<Block>, FeasibilityError> {
        if let [joint] = joints {
            let column = self.present(Fv, *joint);
            return column.map(|column| self.scalar(column)).transpose();
        }
        let n = joints.len();
        let mut terms = Vec::new();
        let mut diagonal = DMatrix::zeros(n, n);
        for (at, &joint) in joints.iter().enumerate() {
            let Some(column) = self.present(Fv, joint) else {
                let name = Parameter { kind: Fv, joint }.to_string();
                return Err(FeasibilityError::LeftOut { names: vec![name] });
            };
            diagonal[(at, at)] = self.size(column, &[])?;
            let mut unit = DMatrix::zeros(n, n);
            unit[(at, at)] = 1.0;
            terms.push((column, unit));
        }
        let mut beside = DMatrix::zeros(n, n);
        for &motor in joints {
            let Some(column) = self.present(FvMotor, motor) else { continue };
            let s = self.robot.transmission().direction(motor);
            let term =
                DMatrix::from_fn(
                    n,
                    n,
                    |i, j| {
                        if i == j { 0.0 } else { s[joints[i]] * s[joints[j]] }
                    },
                );
            if let Some(row) = self.rows.own(column) {
                beside += &term * self.rows.values[row];
            }
            terms.push((column, term));
        }
        // As far towards the estimate as it stays well inside.
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            beside[(i, j)] / (diagonal[(i, i)] * diagonal[(j, j)]).sqrt()
        });
        let least = scaled.symmetric_eigenvalues().min();
        let part =
            if least < LEAST_EIGENVALUE - 1.0 { (LEAST_EIGENVALUE - 1.0) / least } else { 1.0 };
        let column = terms[0].0;
        self.checked(Block::sum(&terms, &(diagonal + beside * part)), column).map(Some)
    }

    /// What has no positive prior has numbers that are none.
    fn checked(&self, block: Option<Block>, column: usize) -> Result<Block, FeasibilityError> {
        block.ok_or_else(|| FeasibilityError::NoValue { name: self.name(column) })
    }

    fn parameter(&self, column: usize) -> Parameter {
        self.robot.parameters().parameters()[column]
    }

    fn name(&self, column: usize) -> String {
        self.parameter(column).to_string()
    }
}
