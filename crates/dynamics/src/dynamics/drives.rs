//! Contributions of motors to the links: inertia, friction and offset, across couplings.
//!
//! All of it follows from R. Relative to its own joint, motor m moves by s · q with s = row m of R
//! / R_mm. So its inertia ia_m adds s sᵀ ia_m to the mass matrix. Its viscous friction adds s sᵀ
//! fv_m q̇ and its Coulomb friction s fc_m sign(s · q̇) to the torques. Terms that cannot be
//! distinguished from another joint's own term are regrouped into it. Diagonal entries (i, i) of s
//! sᵀ are regrouped into fv_i, and into ia_i if motor i is not coupled itself.

use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::robot::ParameterKind::{Fc, FcMotor, Fv, FvMotor, Ia, Off};
use crate::robot::{FrictionLaw, JointIndex, Robot, SignModel};

/// τ\[row\] += factor · φ\[column\] · x\[input\].
#[derive(Clone, Copy, Debug)]
struct LinearTerm {
    column: usize,
    row: usize,
    input: usize,
    factor: f64,
}

/// τ += s φ\[column\] sign(s · q̇), with the non-zero entries of s: (joint, entry).
#[derive(Clone, Debug)]
struct CoulombTerm {
    column: usize,
    direction: Vec<(usize, f64)>,
}

/// Terms with the same law for the sign. Their signs are computed together.
#[derive(Clone, Debug)]
struct SharedSignTerms {
    sign: SignModel,
    coulomb_terms: Vec<CoulombTerm>,
}

impl SharedSignTerms {
    fn sign_chunks(&self) -> impl Iterator<Item = (SignModel, &[CoulombTerm])> {
        self.coulomb_terms.chunks(MAX_SIGNS).map(|terms| (self.sign, terms))
    }
}

/// τ\[joint\] += φ\[column\] · law(q̇\[joint\]).
#[derive(Clone, Copy, Debug)]
struct LawTerm {
    column: usize,
    joint: usize,
    law: FrictionLaw,
    sign: SignModel,
}

/// Largest number of signs that are computed together.
const MAX_SIGNS: usize = 8;

/// Terms of all drives, each with the column of its parameter.
#[derive(Clone, Debug)]
pub(super) struct DriveTerms {
    /// Inertia terms of each row.
    inertia: Vec<Vec<LinearTerm>>,
    viscous: Vec<LinearTerm>,
    coulomb: Vec<SharedSignTerms>,
    laws: Vec<LawTerm>,
    /// Terms that grow with the load.
    loads: Vec<LawTerm>,
    /// Terms with hysteresis at reversals.
    hysteresis: Vec<LawTerm>,
    /// Column and row of each offset.
    offset: Vec<(usize, usize)>,
}

impl DriveTerms {
    pub(super) fn new(robot: &Robot) -> Self {
        let (n, table) = (robot.joints(), robot.parameters());
        let transmission = robot.transmission();
        let mut drives = Self {
            inertia: vec![Vec::new(); n],
            viscous: Vec::new(),
            coulomb: Vec::new(),
            laws: Vec::new(),
            loads: Vec::new(),
            hysteresis: Vec::new(),
            offset: Vec::new(),
        };
        for j in 0..n {
            let direction = transmission.direction(j);
            let sign = robot.sign_model(j);
            let joint = JointIndex::new(j);
            if let Some(column) = table.column(Ia, joint) {
                let is_uncoupled = |i: usize| {
                    i == j
                        || transmission.is_coupled(i)
                        || table.column(Ia, JointIndex::new(i)).is_none()
                };
                for term in outer_product(n, &direction, column, is_uncoupled) {
                    drives.inertia[term.row].push(term);
                }
            }
            if let Some(column) = table.column(Fv, joint) {
                drives.viscous.push(LinearTerm { column, row: j, input: j, factor: 1.0 });
            }
            if let Some(column) = table.column(FvMotor, joint) {
                drives.viscous.extend(outer_product(n, &direction, column, |_| false));
            }
            if let Some(column) = table.column(Fc, joint) {
                drives.add_coulomb(sign, CoulombTerm { column, direction: vec![(j, 1.0)] });
            }
            if let Some(column) = table.column(FcMotor, joint) {
                let entries = direction.into_iter().enumerate().filter(|(_, s)| *s != 0.0);
                let direction = entries.collect();
                drives.add_coulomb(sign, CoulombTerm { column, direction });
            }
            for &law in &robot.own_friction()[j].laws {
                if let Some(column) = table.column(law.kind(), joint) {
                    let terms = match law {
                        FrictionLaw::Load => &mut drives.loads,
                        FrictionLaw::Hysteresis { .. } => &mut drives.hysteresis,
                        _ => &mut drives.laws,
                    };
                    terms.push(LawTerm { column, joint: j, law, sign });
                }
            }
            if let Some(column) = table.column(Off, joint) {
                drives.offset.push((column, j));
            }
        }
        drives
    }

    fn add_coulomb(&mut self, sign: SignModel, term: CoulombTerm) {
        match self.coulomb.iter_mut().find(|alike| alike.sign == sign) {
            Some(alike) => alike.coulomb_terms.push(term),
            None => self.coulomb.push(SharedSignTerms { sign, coulomb_terms: vec![term] }),
        }
    }

    pub(super) fn set_sign_model(&mut self, sign_model: SignModel) {
        for alike in &mut self.coulomb {
            alike.sign = sign_model;
        }
        let laws = self.laws.iter_mut().chain(&mut self.loads);
        for term in laws.chain(&mut self.hysteresis) {
            term.sign = sign_model;
        }
    }

    /// Sets another speed for Stribeck friction in every joint \[rad/s or m/s\].
    pub(super) fn set_stribeck_speed(&mut self, speed_rad_s: f64) {
        for term in &mut self.laws {
            if let FrictionLaw::Stribeck { speed_rad_s: own } = &mut term.law {
                *own = speed_rad_s;
            }
        }
    }

    /// Calls `add(row, column, coefficient)` for every product φ\[column\] · coefficient in
    /// τ\[row\] that the drives' inertia causes.
    #[inline(always)]
    pub(super) fn for_each_inertia<T: Scalar>(
        &self,
        ddq: &[T],
        mut add: impl FnMut(usize, usize, T),
    ) {
        for &LinearTerm { column, row, input, factor } in self.inertia.iter().flatten() {
            add(row, column, T::constant(factor) * ddq[input]);
        }
    }

    /// Does the same for friction and offsets. `hysteresis` gives the state of friction with
    /// hysteresis at reversals.
    #[inline(always)]
    pub(super) fn for_each_friction<T: Scalar>(
        &self,
        dq: &[T],
        hysteresis: Option<&[T; MAX_JOINTS]>,
        mut add: impl FnMut(usize, usize, T),
    ) {
        for &LinearTerm { column, row, input, factor } in &self.viscous {
            add(row, column, T::constant(factor) * dq[input]);
        }
        for (sign_model, terms) in self.coulomb.iter().flat_map(SharedSignTerms::sign_chunks) {
            let mut signs = [T::zero(); MAX_SIGNS];
            let signs = &mut signs[..terms.len()];
            for (speed, term) in signs.iter_mut().zip(terms) {
                for &(joint, s) in &term.direction {
                    *speed += T::constant(s) * dq[joint];
                }
            }
            sign_model.replace_speeds(signs);
            for (CoulombTerm { column, direction }, &mut sign) in terms.iter().zip(signs) {
                for &(joint, s) in direction {
                    add(joint, *column, T::constant(s) * sign);
                }
            }
        }
        for &LawTerm { column, joint, law, sign } in &self.laws {
            add(joint, column, law.value(dq[joint], sign));
        }
        for &LawTerm { column, joint, law, sign } in &self.hysteresis {
            let share = match hysteresis {
                Some(shares) => shares[joint],
                None => law.value(dq[joint], sign),
            };
            add(joint, column, share);
        }
        for &(column, row) in &self.offset {
            add(row, column, T::constant(1.0));
        }
    }

    /// Returns true if any friction grows with the load.
    pub(super) fn feel_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Does the same for friction that grows with these loads.
    #[inline(always)]
    pub(super) fn for_each_load_friction<T: Scalar>(
        &self,
        dq: &[T],
        loads: &[T; MAX_JOINTS],
        mut add: impl FnMut(usize, usize, T),
    ) {
        for &LawTerm { column, joint, law, sign } in &self.loads {
            let load = loads[joint];
            add(joint, column, load * load.sign() * law.value(dq[joint], sign));
        }
    }

    /// Calls `add(joint, by load, by speed)` with the derivatives of friction by each joint's load
    /// and by its speed. The latter add to those of
    /// [`for_each_friction_partial`](Self::for_each_friction_partial).
    pub(super) fn for_each_load_partial(
        &self,
        parameters: &[f64],
        dq: &[f64],
        loads: &[f64; MAX_JOINTS],
        mut add: impl FnMut(usize, f64, f64),
    ) {
        for &LawTerm { column, joint, law, sign } in &self.loads {
            let (load, share) = (loads[joint], parameters[column]);
            let by_load = share * Scalar::sign(load) * law.value(dq[joint], sign);
            add(joint, by_load, share * load.abs() * law.slope(dq[joint], sign));
        }
    }

    /// Calls `at(row, column)` for the entries to which inertia, friction and offsets contribute.
    #[inline(always)]
    pub(super) fn for_each_entry(&self, mut at: impl FnMut(usize, usize)) {
        for term in self.inertia.iter().flatten().chain(&self.viscous) {
            at(term.row, term.column);
        }
        for CoulombTerm { column, direction } in self.coulomb.iter().flat_map(|a| &a.coulomb_terms)
        {
            for &(joint, _) in direction {
                at(joint, *column);
            }
        }
        for term in self.laws.iter().chain(&self.loads).chain(&self.hysteresis) {
            at(term.joint, term.column);
        }
        for &(column, row) in &self.offset {
            at(row, column);
        }
    }

    /// Calls `add(row, joint, value)` for every entry of ∂τ/∂q̇ due to friction without a history.
    #[inline(always)]
    pub(super) fn for_each_friction_partial(
        &self,
        parameters: &[f64],
        dq: &[f64],
        mut add: impl FnMut(usize, usize, f64),
    ) {
        for &LinearTerm { column, row, input, factor } in &self.viscous {
            add(row, input, factor * parameters[column]);
        }
        for (sign_model, terms) in self.coulomb.iter().flat_map(SharedSignTerms::sign_chunks) {
            let mut signs = [0.0; MAX_SIGNS];
            let signs = &mut signs[..terms.len()];
            for (speed, term) in signs.iter_mut().zip(terms) {
                *speed = term.direction.iter().map(|&(joint, s)| s * dq[joint]).sum();
            }
            sign_model.replace_speeds(signs);
            for (CoulombTerm { column, direction }, sign) in terms.iter().zip(signs) {
                // The derivative of fc s sign(s · q̇) is fc s sign'(s · q̇) sᵀ.
                let slope = parameters[*column] * sign_model.slope(*sign);
                for &(row, s) in direction {
                    for &(joint, by) in direction {
                        add(row, joint, slope * s * by);
                    }
                }
            }
        }
        for &LawTerm { column, joint, law, sign } in &self.laws {
            add(joint, joint, parameters[column] * law.slope(dq[joint], sign));
        }
    }

    /// Does the same for friction with hysteresis at reversals, for joints past their presliding
    /// distance.
    pub(super) fn for_each_sliding_partial(
        &self,
        parameters: &[f64],
        dq: &[f64],
        mut add: impl FnMut(usize, f64),
    ) {
        for &LawTerm { column, joint, law, sign } in &self.hysteresis {
            add(joint, parameters[column] * law.slope(dq[joint], sign));
        }
    }

    /// Returns joint and column of the coefficient of all friction with hysteresis at reversals.
    pub(super) fn hysteresis(&self) -> impl Iterator<Item = (usize, usize)> {
        self.hysteresis.iter().map(|term| (term.joint, term.column))
    }

    /// Returns the terms of the parameters that have a new column in `places`, with the new
    /// columns.
    pub(super) fn with_columns(&self, places: &[Option<usize>]) -> Self {
        let terms = |terms: &[LinearTerm]| {
            let selected = terms
                .iter()
                .filter_map(|term| Some(LinearTerm { column: places[term.column]?, ..*term }));
            selected.collect()
        };
        let laws = |terms: &[LawTerm]| {
            let selected = terms
                .iter()
                .filter_map(|term| Some(LawTerm { column: places[term.column]?, ..*term }));
            selected.collect()
        };
        let offset = self.offset.iter().filter_map(|&(column, row)| Some((places[column]?, row)));
        Self {
            inertia: self.inertia.iter().map(|row| terms(row)).collect(),
            viscous: terms(&self.viscous),
            coulomb: self
                .coulomb
                .iter()
                .map(|alike: &SharedSignTerms| {
                    let selected = alike.coulomb_terms.iter().filter_map(|term| {
                        let direction = term.direction.clone();
                        Some(CoulombTerm { column: places[term.column]?, direction })
                    });
                    SharedSignTerms { sign: alike.sign, coulomb_terms: selected.collect() }
                })
                .collect(),
            laws: laws(&self.laws),
            loads: laws(&self.loads),
            hysteresis: laws(&self.hysteresis),
            offset: offset.collect(),
        }
    }

    /// Calls `add(row, column of the matrix, value)` for every entry of the drives' mass matrix.
    #[inline(always)]
    pub(super) fn for_each_mass<T: Scalar>(
        &self,
        parameters: &[T],
        mut add: impl FnMut(usize, usize, T),
    ) {
        for &LinearTerm { column, row, input, factor } in self.inertia.iter().flatten() {
            add(row, input, T::constant(factor) * parameters[column]);
        }
    }

    /// Calls `add(column of the matrix, value)` for the entries in one row.
    #[inline(always)]
    pub(super) fn for_each_mass_in_row<T: Scalar>(
        &self,
        row: usize,
        parameters: &[T],
        mut add: impl FnMut(usize, T),
    ) {
        for &LinearTerm { column, input, factor, .. } in &self.inertia[row] {
            add(input, T::constant(factor) * parameters[column]);
        }
    }
}

/// Returns the non-zero entries of s sᵀ: all off-diagonal ones, and those diagonal entries for
/// which `fixed(joint)` is true.
fn outer_product(
    joints: usize,
    s: &[f64; MAX_JOINTS],
    column: usize,
    fixed: impl Fn(usize) -> bool,
) -> Vec<LinearTerm> {
    let pairs = (0..joints).flat_map(|row| (0..joints).map(move |input| (row, input)));
    pairs
        .filter(|&(row, input)| row != input || fixed(row))
        .map(|(row, input)| LinearTerm { column, row, input, factor: s[row] * s[input] })
        .filter(|term| term.factor != 0.0)
        .collect()
}
