//! Selection of the frames of an identifier that carry a multiplexed signal.

use super::field::Field;

/// A value of a multiplexer: it says which signals a frame carries.
#[derive(Clone, Debug, PartialEq)]
pub struct Selector {
    /// Bits of the multiplexer.
    pub field: Field,
    /// Its value.
    pub value: u64,
}

impl Selector {
    /// Returns true if a payload has the value.
    pub fn is_in(&self, payload: &[u8]) -> bool {
        self.field.bits(payload) == self.value
    }
}
