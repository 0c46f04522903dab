//! Checks of values from a file; each error names the value.

use super::error::SetupError;

pub(super) fn check_length(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), SetupError> {
    if expected == found { Ok(()) } else { Err(SetupError::Length { what, expected, found }) }
}

pub(super) fn check_positive(what: &'static str, value: f64) -> Result<(), SetupError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(SetupError::BadValue { what, value, expected: "finite and positive" })
    }
}

pub(super) fn check_not_negative(what: &'static str, value: f64) -> Result<(), SetupError> {
    if value.is_finite() && value >= 0.0 {
        Ok(())
    } else {
        Err(SetupError::BadValue { what, value, expected: "finite and not negative" })
    }
}
