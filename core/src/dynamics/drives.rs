//! What motors add to the links: their inertia, friction, and offset, across couplings.
//!
//! All of it follows from R. Seen at its own joint, motor m moves by s · q with
//! s = row m of R / R_mm, so its inertia ia_m adds s sᵀ ia_m to the mass matrix, its viscous
//! friction s sᵀ fv_m q̇ and its Coulomb friction s fc_m sign(s · q̇) to the torques. What cannot be
//! distinguished from another joint's own term is regrouped into that: diagonal entries (i, i) of s sᵀ into
//! fv_i, and into ia_i where motor i is not coupled itself.

use crate::MAX_JOINTS;
use crate::numeric::Scalar;
use crate::robot::ParameterKind::{Fc, FcMotor, Fv, FvMotor, Ia, Off};
use crate::robot::{FrictionLaw, Robot, SignModel};

/// τ\[row\] += factor · φ\[column\] · x\[input\].
#[derive(Clone, Copy, Debug)]
struct Term {
    column: usize,
    row: usize,
    input: usize,
    factor: f64,
}

/// τ += s φ\[column\] sign(s · q̇), s by its entries that are not 0: (joint, entry).
#[derive(Clone, Debug)]
struct CoulombTerm {
    column: usize,
    direction: Vec<(usize, f64)>,
}

/// Terms with the same law for the sign, whose signs are computed together.
#[derive(Clone, Debug)]
struct Alike {
    sign: SignModel,
    terms: Vec<CoulombTerm>,
}

impl Alike {
    fn chunks(&self) -> impl Iterator<Item = (SignModel, &[CoulombTerm])> {
        self.terms.chunks(TOGETHER).map(|terms| (self.sign, terms))
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

/// At most so many signs are computed together.
const TOGETHER: usize = MAX_JOINTS;

/// The terms of all drives, each with the column of its parameter.
#[derive(Clone, Debug)]
pub(super) struct Drives {
    /// By row.
    inertia: Vec<Vec<Term>>,
    viscous: Vec<Term>,
    coulomb: Vec<Alike>,
    laws: Vec<LawTerm>,
    /// Those that grow with the load.
    loads: Vec<LawTerm>,
    /// Those that lag at reversals.
    hysteresis: Vec<LawTerm>,
    /// Column and row.
    offset: Vec<(usize, usize)>,
}

impl Drives {
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
            if let Some(column) = table.column(Ia, j) {
                let kept = |i: usize| {
                    i == j || transmission.is_coupled(i) || table.column(Ia, i).is_none()
                };
                for term in outer(n, &direction, column, kept) {
                    drives.inertia[term.row].push(term);
                }
            }
            if let Some(column) = table.column(Fv, j) {
                drives.viscous.push(Term { column, row: j, input: j, factor: 1.0 });
            }
            if let Some(column) = table.column(FvMotor, j) {
                drives.viscous.extend(outer(n, &direction, column, |_| false));
            }
            if let Some(column) = table.column(Fc, j) {
                drives.add_coulomb(sign, CoulombTerm { column, direction: vec![(j, 1.0)] });
            }
            if let Some(column) = table.column(FcMotor, j) {
                let entries = direction.into_iter().enumerate().filter(|(_, s)| *s != 0.0);
                let direction = entries.collect();
                drives.add_coulomb(sign, CoulombTerm { column, direction });
            }
            for &law in &robot.own_friction()[j].laws {
                if let Some(column) = table.column(law.kind(), j) {
                    let terms = match law {
                        FrictionLaw::Load => &mut drives.loads,
                        FrictionLaw::Hysteresis { .. } => &mut drives.hysteresis,
                        _ => &mut drives.laws,
                    };
                    terms.push(LawTerm { column, joint: j, law, sign });
                }
            }
            if let Some(column) = table.column(Off, j) {
                drives.offset.push((column, j));
            }
        }
        drives
    }

    fn add_coulomb(&mut self, sign: SignModel, term: CoulombTerm) {
        match self.coulomb.iter_mut().find(|alike| alike.sign == sign) {
            Some(alike) => alike.terms.push(term),
            None => self.coulomb.push(Alike { sign, terms: vec![term] }),
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

    /// Another speed for Stribeck friction in every joint \[rad/s or m/s\].
    pub(super) fn set_stribeck_speed(&mut self, speed_rad_s: f64) {
        for term in &mut self.laws {
            if let FrictionLaw::Stribeck { speed_rad_s: own } = &mut term.law {
                *own = speed_rad_s;
            }
        }
    }

    /// Calls `add(row, column, coefficient)` for every product φ\[column\] · coefficient in τ\[row\]
    /// that the drives' inertia causes.
    #[inline(always)]
    pub(super) fn for_each_inertia<T: Scalar>(
        &self,
        ddq: &[T],
        mut add: impl FnMut(usize, usize, T),
    ) {
        for &Term { column, row, input, factor } in self.inertia.iter().flatten() {
            add(row, column, T::constant(factor) * ddq[input]);
        }
    }

    /// The same for friction and offsets; what lags at reversals stands at `hysteresis`.
    #[inline(always)]
    pub(super) fn for_each_friction<T: Scalar>(
        &self,
        dq: &[T],
        hysteresis: Option<&[T; MAX_JOINTS]>,
        mut add: impl FnMut(usize, usize, T),
    ) {
        for &Term { column, row, input, factor } in &self.viscous {
            add(row, column, T::constant(factor) * dq[input]);
        }
        for (sign_model, terms) in self.coulomb.iter().flat_map(Alike::chunks) {
            let mut signs = [T::zero(); TOGETHER];
            let signs = &mut signs[..terms.len()];
            for (speed, term) in signs.iter_mut().zip(terms) {
                for &(joint, s) in &term.direction {
                    *speed += T::constant(s) * dq[joint];
                }
            }
            sign_model.replace(signs);
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

    /// Whether any friction grows with the load.
    pub(super) fn feel_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// The same for friction that grows with these loads.
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

    /// Calls `add(joint, by load, by speed)` with how friction grows with each joint's load and, beyond what
    /// [`for_each_friction_partial`](Self::for_each_friction_partial) has, with its speed.
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

    /// Calls `at(row, column)` for the entries that inertia, friction and offsets add to.
    #[inline(always)]
    pub(super) fn for_each_entry(&self, mut at: impl FnMut(usize, usize)) {
        for term in self.inertia.iter().flatten().chain(&self.viscous) {
            at(term.row, term.column);
        }
        for CoulombTerm { column, direction } in self.coulomb.iter().flat_map(|a| &a.terms) {
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

    /// Calls `add(row, joint, value)` for every entry of ∂τ/∂q̇ that friction causes, but for what has a history.
    #[inline(always)]
    pub(super) fn for_each_friction_partial(
        &self,
        parameters: &[f64],
        dq: &[f64],
        mut add: impl FnMut(usize, usize, f64),
    ) {
        for &Term { column, row, input, factor } in &self.viscous {
            add(row, input, factor * parameters[column]);
        }
        for (sign_model, terms) in self.coulomb.iter().flat_map(Alike::chunks) {
            let mut signs = [0.0; TOGETHER];
            let signs = &mut signs[..terms.len()];
            for (speed, term) in signs.iter_mut().zip(terms) {
                *speed = term.direction.iter().map(|&(joint, s)| s * dq[joint]).sum();
            }
            sign_model.replace(signs);
            for (CoulombTerm { column, direction }, sign) in terms.iter().zip(signs) {
                // fc s sign(s · q̇) has the derivative fc s sign'(s · q̇) sᵀ.
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

    /// The same of friction that lags at reversals, for joints that have gone on for long.
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

    /// Joint and column of the coefficient of all friction that lags at reversals.
    pub(super) fn hysteresis(&self) -> impl Iterator<Item = (usize, usize)> {
        self.hysteresis.iter().map(|term| (term.joint, term.column))
    }

    /// The drives of the parameters with a place, by their places in place of their columns.
    pub(super) fn selecting(&self, places: &[Option<usize>]) -> Self {
        let terms = |terms: &[Term]| {
            let kept = terms
                .iter()
                .filter_map(|term| Some(Term { column: places[term.column]?, ..*term }));
            kept.collect()
        };
        let alike = |alike: &Alike| {
            let kept = alike.terms.iter().filter_map(|term| {
                let direction = term.direction.clone();
                Some(CoulombTerm { column: places[term.column]?, direction })
            });
            Alike { sign: alike.sign, terms: kept.collect() }
        };
        let laws = |terms: &[LawTerm]| {
            let kept = terms
                .iter()
                .filter_map(|term| Some(LawTerm { column: places[term.column]?, ..*term }));
            kept.collect()
        };
        let offset = self.offset.iter().filter_map(|&(column, row)| Some((places[column]?, row)));
        Self {
            inertia: self.inertia.iter().map(|row| terms(row)).collect(),
            viscous: terms(&self.viscous),
            coulomb: self.coulomb.iter().map(alike).collect(),
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
        for &Term { column, row, input, factor } in self.inertia.iter().flatten() {
            add(row, input, T::constant(factor) * parameters[column]);
        }
    }

    /// Calls `add(column of the matrix, value)` for those in one row.
    #[inline(always)]
    pub(super) fn for_each_mass_in_row<T: Scalar>(
        &self,
        row: usize,
        parameters: &[T],
        mut add: impl FnMut(usize, T),
    ) {
        for &Term { column, input, factor, .. } in &self.inertia[row] {
            add(input, T::constant(factor) * parameters[column]);
        }
    }
}

/// The entries of s sᵀ that are not 0: all beside the diagonal, and those on it that are `kept`.
fn outer(
    joints: usize,
    s: &[f64; MAX_JOINTS],
    column: usize,
    kept: impl Fn(usize) -> bool,
) -> Vec<Term> {
    let pairs = (0..joints).flat_map(|row| (0..joints).map(move |input| (row, input)));
    pairs
        .filter(|&(row, input)| row != input || kept(row))
        .map(|(row, input)| Term { column, row, input, factor: s[row] * s[input] })
        .filter(|term| term.factor != 0.0)
        .collect()
}
