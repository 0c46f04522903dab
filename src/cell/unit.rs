//! Units of recorded quantities, by name or by size, and values for all axes or for each.

use core::f64::consts::{PI, TAU};

use didim_dynamics::robot::JointKind;
use didim_formats::Side;
use schemars::JsonSchema;
use serde::Deserialize;

/// A unit by its name, or by its size.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a unit such as \"deg\", or { name = \"count\", si = 1.5e-4 }")]
pub enum Unit {
    /// One of the built-in units.
    Named(String),
    /// Another unit.
    Sized(SizedUnit),
}

/// `{ name = …, si = … }`
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a unit such as { name = \"count\", si = 1.5e-4 }")]
pub struct SizedUnit {
    /// The name of the unit, for people.
    pub name: String,
    /// The size of one unit in SI units \[rad, m, N·m or N\], above 0.
    pub si: f64,
}

/// One for all axes, or one for each.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "one for all axes, or a list of one for each")]
pub enum OneOrEach<T> {
    /// For all.
    One(T),
    /// For each.
    Each(Vec<T>),
}

impl<T: Clone> OneOrEach<T> {
    pub(super) fn of_each(&self, axes: usize) -> Option<Vec<T>> {
        match self {
            Self::One(one) => Some(vec![one.clone(); axes]),
            Self::Each(each) => (each.len() == axes).then(|| each.clone()),
        }
    }
}

/// Units of a quantity.
pub(crate) struct QuantityUnits {
    units: &'static [(&'static str, JointKind, f64)],
    /// True if the quantity may be given as a current.
    pub(super) allows_current: bool,
}

/// Units of currents, with their size in amperes.
pub(crate) const CURRENT_UNITS: [(&str, f64); 2] = [("A", 1.0), ("mA", 1e-3)];
pub(crate) const POSITION_UNITS: QuantityUnits = QuantityUnits {
    units: &[
        ("rad", JointKind::Revolute, 1.0),
        ("deg", JointKind::Revolute, PI / 180.0),
        ("rev", JointKind::Revolute, TAU),
        ("mrad", JointKind::Revolute, 1e-3),
        ("mdeg", JointKind::Revolute, PI / 180e3),
        ("m", JointKind::Prismatic, 1.0),
        ("mm", JointKind::Prismatic, 1e-3),
        ("um", JointKind::Prismatic, 1e-6),
    ],
    allows_current: false,
};
pub(crate) const TORQUE_UNITS: QuantityUnits = QuantityUnits {
    units: &[
        ("Nm", JointKind::Revolute, 1.0),
        ("mNm", JointKind::Revolute, 1e-3),
        ("Ncm", JointKind::Revolute, 1e-2),
        ("kNm", JointKind::Revolute, 1e3),
        ("N", JointKind::Prismatic, 1.0),
        ("kN", JointKind::Prismatic, 1e3),
    ],
    allows_current: true,
};
/// Returns the finite numbers of a key, one for each axis.
pub(super) fn numbers(
    configured: &OneOrEach<f64>,
    key: &str,
    axes: usize,
) -> Result<Vec<f64>, String> {
    let numbers = configured.of_each(axes).ok_or_else(|| wrong_count(key, axes))?;
    match numbers.iter().find(|number| !number.is_finite()) {
        Some(number) => Err(format!("has a `{key}` of {number}; use a finite number")),
        None => Ok(numbers),
    }
}

/// Returns the sign of each axis, 1 or -1; 1 if left out.
pub(super) fn axis_signs(
    configured: Option<&OneOrEach<f64>>,
    axes: usize,
) -> Result<Vec<f64>, String> {
    let signs = configured.map_or(Ok(vec![1.0; axes]), |signs| numbers(signs, "sign", axes))?;
    match signs.iter().find(|sign| !matches!(**sign, 1.0 | -1.0)) {
        Some(sign) => Err(format!("has a sign of {sign}; use 1 or -1, and `factor` for the size")),
        None => Ok(signs),
    }
}

/// Returns the factor of each axis, above 0; 1 if left out.
pub(super) fn axis_factors(
    configured: Option<&OneOrEach<f64>>,
    axes: usize,
) -> Result<Vec<f64>, String> {
    let factors = configured.map_or(Ok(vec![1.0; axes]), |own| numbers(own, "factor", axes))?;
    match factors.iter().find(|factor| **factor <= 0.0) {
        Some(factor) => {
            Err(format!("has a factor of {factor}; use one above 0, and `sign` for signs"))
        }
        None => Ok(factors),
    }
}

/// Returns the problem of a key with another number of entries than axes.
pub(super) fn wrong_count(key: &str, axes: usize) -> String {
    format!("`{key}` has another number of entries than the arm has axes, {axes}")
}
/// Configured unit, sign and factor of a quantity, and the torque per ampere of a current.
pub(super) struct TorqueUnit<'a> {
    pub(super) unit: &'a OneOrEach<Unit>,
    pub(super) sign: Option<&'a OneOrEach<f64>>,
    pub(super) per_ampere: Option<&'a OneOrEach<f64>>,
    pub(super) factor: Option<&'a OneOrEach<f64>>,
}

impl TorqueUnit<'_> {
    /// Returns the signed SI value of one unit, for each axis.
    pub(super) fn axis_scales(
        &self,
        units: &QuantityUnits,
        side: Side,
        kinds: &[JointKind],
    ) -> Result<Vec<f64>, String> {
        let axes = kinds.len();
        let each = |what: &str| wrong_count(what, axes);
        let unit = self.unit.of_each(axes).ok_or_else(|| each("unit"))?;
        let signs = axis_signs(self.sign, axes)?;
        if self.per_ampere.is_some() && !unit.iter().any(Unit::is_current) {
            return Err("has `per_ampere`, which belongs to the units \"A\" and \"mA\"".to_owned());
        }
        let of_each = |of: &OneOrEach<f64>| of.of_each(axes).ok_or_else(|| each("per_ampere"));
        let per_ampere = self.per_ampere.map(of_each).transpose()?;
        let factors = axis_factors(self.factor, axes)?;
        let mut scales = Vec::with_capacity(axes);
        for axis in 0..axes {
            // A motor is always revolute, whatever its joint's kind.
            let kind = if side == Side::Motor { JointKind::Revolute } else { kinds[axis] };
            let of_one = per_ampere.as_ref().map(|of| of[axis]);
            let scale = unit[axis].scale(units, kind, of_one, axis + 1)?;
            scales.push(scale * signs[axis] * factors[axis]);
        }
        Ok(scales)
    }
}

/// Returns the size of a unit of currents in amperes.
fn amperes(unit: &str) -> Option<f64> {
    CURRENT_UNITS.iter().find(|(name, _)| *name == unit).map(|(_, amperes)| *amperes)
}

impl Unit {
    /// Returns true for a unit of currents.
    pub(super) fn is_current(&self) -> bool {
        matches!(self, Self::Named(name) if amperes(name).is_some())
    }

    /// Returns the SI value of one unit, for an axis with a number from 1.
    fn scale(
        &self,
        units: &QuantityUnits,
        kind: JointKind,
        per_ampere: Option<f64>,
        axis: usize,
    ) -> Result<f64, String> {
        let is_positive = |number: &f64| number.is_finite() && *number > 0.0;
        let name = match self {
            Self::Named(name) => name,
            Self::Sized(SizedUnit { si, .. }) if is_positive(si) => return Ok(*si),
            Self::Sized(SizedUnit { name, si }) => {
                return Err(format!(
                    "has the unit \"{name}\" of the size {si}; use one above 0, and `sign` for \
                    signs"
                ));
            }
        };
        if let Some(amperes) = amperes(name).filter(|_| units.allows_current) {
            return per_ampere.filter(is_positive).map(|of_one| amperes * of_one).ok_or_else(|| {
                format!(
                    "has the unit \"{name}\"; give `per_ampere` with it, the torque or force of \
                    one ampere, above 0"
                )
            });
        }
        units.size(name, kind).ok_or_else(|| {
            let currents = CURRENT_UNITS.iter().filter(|_| units.allows_current);
            let names = units.of_kind(kind).map(|(name, _)| name);
            let names = names.chain(currents.map(|(name, _)| *name));
            let names: Vec<String> = names.map(|name| format!("\"{name}\"")).collect();
            format!(
                "has the unit \"{name}\" for axis {axis}; use {} or its size in SI units, as \
                {{ name = \"{name}\", si = … }}",
                names.join(" or ")
            )
        })
    }
}

impl QuantityUnits {
    /// Returns the units of joints of a kind, with their sizes in SI units.
    fn of_kind(&self, kind: JointKind) -> impl Iterator<Item = (&'static str, f64)> {
        let fitting = self.units.iter().filter(move |(_, of, _)| *of == kind);
        fitting.map(|(name, _, size)| (*name, *size))
    }

    /// Returns the size of a unit in SI units.
    pub(crate) fn size(&self, unit: &str, kind: JointKind) -> Option<f64> {
        self.of_kind(kind).find(|(name, _)| *name == unit).map(|(_, size)| size)
    }
}
