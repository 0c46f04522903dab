//! Values of a stored result: numbers and units. JSON has no number for NaN and infinity, which are
//! written as null and read as NaN.

use serde::{Deserialize, Deserializer};

/// Unit of a stored value. A result that is read has the same words as a new one.
pub(crate) type Unit = &'static str;

/// Every unit of a result.
const UNITS: [Unit; 16] = [
    "1",
    "kg·m²",
    "kg·m",
    "kg",
    "N·m",
    "N",
    "N·m·s/rad",
    "N·s/m",
    "N·m·s²/rad²",
    "N·s²/m²",
    "N·m·s³/rad³",
    "N·s³/m³",
    "deg",
    "m",
    "s",
    BELOW_ZERO,
];

/// Unit of the distance of a mass matrix from positive definite.
pub(crate) const BELOW_ZERO: Unit = "standard deviations below zero";

/// Reads a unit; one that this version does not know is empty.
pub(crate) fn unit<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Unit, D::Error> {
    let text = String::deserialize(deserializer)?;
    Ok(UNITS.into_iter().find(|unit| *unit == text).unwrap_or_default())
}

/// Returns the value of a number that earlier versions did not store.
pub(crate) fn not_stored() -> f64 {
    f64::NAN
}

/// Reads a number; null is NaN.
pub(crate) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Reads a list of numbers; null is NaN.
pub(crate) fn numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(from_nullable(Vec::<Option<f64>>::deserialize(deserializer)?))
}

/// Reads an optional list of numbers; null in the list is NaN.
pub(crate) fn optional_numbers<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Vec<f64>>, D::Error> {
    Ok(Option::<Vec<Option<f64>>>::deserialize(deserializer)?.map(from_nullable))
}

fn from_nullable(values: Vec<Option<f64>>) -> Vec<f64> {
    values.into_iter().map(|value| value.unwrap_or(f64::NAN)).collect()
}
