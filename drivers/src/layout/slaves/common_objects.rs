//! Encodings of objects of the drive profile, for files that do not contain the encodings.

use super::super::eds::Object;
use super::super::field::Encoding;

/// Returns the encoding of an object of CiA 402, or `None` for other objects. For those, the vendor
/// decides if the highest bit is a sign. The objects of the axes of one slave are 800h apart.
pub(in crate::layout) fn encoding_of(object: Object) -> Option<Encoding> {
    if !(0x6000..0xA000).contains(&object.index) || object.sub_index != 0 {
        return None;
    }
    match 0x6000 | object.index & 0x07FF {
        // Status and control word, rated current and torque.
        0x6040 | 0x6041 | 0x6075 | 0x6076 => Some(Encoding::Unsigned),
        // Positions: demand, actual in increments and in user units, target, following error,
        // demand in increments.
        0x6062..=0x6064 | 0x607A | 0x60F4 | 0x60FC => Some(Encoding::Signed),
        // Velocities: demand, actual; torque: target, demand, actual; current.
        0x606B | 0x606C | 0x6071 | 0x6074 | 0x6077 | 0x6078 => Some(Encoding::Signed),
        _ => None,
    }
}
