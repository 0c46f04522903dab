//! Position of a signal in a payload, and the conversion of its bits to a number.

use crate::frame::MAX_PAYLOAD;

/// The widest integer that an `f64` holds exactly \[bits\].
pub const EXACT_BITS: u8 = 53;

/// Order of the bytes of a signal, with its notation in a DBC file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// Intel, `@1`: the start bit is the least significant one.
    LittleEndian,
    /// Motorola, `@0`: the start bit is the most significant one; bits count down inside a byte and
    /// up over bytes.
    BigEndian,
}

/// Meaning of the bits of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// An unsigned integer.
    Unsigned,
    /// An integer in two's complement.
    Signed,
    /// IEEE 754 binary32 (`SIG_VALTYPE_` 1).
    Float32,
    /// IEEE 754 binary64 (`SIG_VALTYPE_` 2).
    Float64,
}

/// A number that a field cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{value} does not fit: the signal holds {minimum} to {maximum}")]
pub struct DoesNotFit {
    /// The number that does not fit, in the unit of the DBC file.
    pub value: f64,
    /// Smallest value that fits, in the unit of the DBC file.
    pub minimum: f64,
    /// Largest value that fits, in the unit of the DBC file.
    pub maximum: f64,
}

/// Bits of one signal, prepared for reading: the bytes that hold them, the shift and the width.
///
/// `physical value = raw × factor + offset`, in the unit of the DBC file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    first_byte: u8,
    bytes: u8,
    shift: u8,
    width: u8,
    order: ByteOrder,
    encoding: Encoding,
    factor: f64,
    offset: f64,
}

impl Field {
    /// Creates the field of `width` bits at the DBC start bit `start`. Returns `None` if it is
    /// empty, wider than 64 bits or reaches beyond a payload of `length` bytes.
    pub fn new(
        start: u64,
        width: u64,
        order: ByteOrder,
        encoding: Encoding,
        (factor, offset): (f64, f64),
        length: usize,
    ) -> Option<Self> {
        if width == 0 || width > 64 || start >= 8 * MAX_PAYLOAD as u64 {
            return None;
        }
        // Count the bits in the order of their significance, upwards for Intel. For Motorola, bit 7
        // of byte 0 is the first. With this count a field is one run of bits in either order.
        let first = match order {
            ByteOrder::LittleEndian => start,
            ByteOrder::BigEndian => 8 * (start / 8) + (7 - start % 8),
        };
        let end = first + width;
        if end > 8 * length as u64 {
            return None;
        }
        let first_byte = first / 8;
        let bytes = end.div_ceil(8) - first_byte;
        let shift = match order {
            ByteOrder::LittleEndian => first % 8,
            ByteOrder::BigEndian => 8 * (first_byte + bytes) - end,
        };
        Some(Self {
            first_byte: u8::try_from(first_byte).ok()?,
            bytes: u8::try_from(bytes).ok()?,
            shift: u8::try_from(shift).ok()?,
            width: u8::try_from(width).ok()?,
            order,
            encoding,
            factor,
            offset,
        })
    }

    /// Returns the number of bits.
    pub fn width(&self) -> u8 {
        self.width
    }

    /// Returns the meaning of the bits.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Returns factor and offset of the DBC file.
    pub fn scale(&self) -> (f64, f64) {
        (self.factor, self.offset)
    }

    /// Returns the field with the same bits in another unit. One unit of the present field is
    /// `factor` of the new unit.
    #[must_use]
    pub(super) fn in_unit(self, factor: f64) -> Self {
        Self { factor: factor * self.factor, offset: factor * self.offset, ..self }
    }

    /// Returns the raw bits, in the low end of the result. Bytes beyond the payload are read as
    /// zero.
    pub fn bits(&self, payload: &[u8]) -> u64 {
        let mut word = 0u128;
        for k in 0..self.bytes {
            let byte = payload.get(usize::from(self.first_byte + k)).copied().unwrap_or(0);
            word |= u128::from(byte) << self.byte_shift(k);
        }
        low_64(word >> self.shift) & self.mask()
    }

    /// Writes the low bits of `bits` to the place of the field and keeps every other bit. Bytes
    /// beyond the payload are not written.
    pub fn write_bits(&self, payload: &mut [u8], bits: u64) {
        let word = u128::from(bits & self.mask()) << self.shift;
        let held_bits = u128::from(self.mask()) << self.shift;
        for k in 0..self.bytes {
            if let Some(byte) = payload.get_mut(usize::from(self.first_byte + k)) {
                let shift = self.byte_shift(k);
                *byte = *byte & !low_8(held_bits >> shift) | low_8(word >> shift);
            }
        }
    }

    /// Returns the physical value, in the unit of the DBC file. It is exact for integers of at most
    /// [`EXACT_BITS`] bits.
    pub fn value(&self, payload: &[u8]) -> f64 {
        self.value_of(self.bits(payload))
    }

    fn value_of(&self, bits: u64) -> f64 {
        let raw = match self.encoding {
            Encoding::Unsigned => bits as f64,
            Encoding::Signed => {
                let unused = 64 - self.width;
                ((bits << unused).cast_signed() >> unused) as f64
            }
            Encoding::Float32 => f64::from(f32::from_bits(low_32(bits))),
            Encoding::Float64 => f64::from_bits(bits),
        };
        raw * self.factor + self.offset
    }

    /// Returns the bits whose physical value is nearest to `value`.
    ///
    /// # Errors
    /// [`DoesNotFit`] if the value is not finite or outside of the range of the bits. The value is
    /// never saturated or wrapped.
    pub fn bits_for(&self, value: f64) -> Result<u64, DoesNotFit> {
        let raw = (value - self.offset) / self.factor;
        let (minimum, maximum) = self.raw_range();
        let raw = match self.encoding {
            Encoding::Unsigned | Encoding::Signed => raw.round(),
            Encoding::Float32 | Encoding::Float64 => raw,
        };
        if !(minimum..=maximum).contains(&raw) {
            let (a, b) = (minimum * self.factor + self.offset, maximum * self.factor + self.offset);
            return Err(DoesNotFit { value, minimum: a.min(b), maximum: a.max(b) });
        }
        #[allow(
            clippy::cast_possible_truncation,
            reason = "the range was checked; binary32 rounds"
        )]
        Ok(match self.encoding {
            Encoding::Unsigned => raw as u64,
            Encoding::Signed => (raw as i64).cast_unsigned() & self.mask(),
            Encoding::Float32 => u64::from((raw as f32).to_bits()),
            Encoding::Float64 => raw.to_bits(),
        })
    }

    /// Returns the value of one count of an integer, in the unit of the DBC file; 0 for a
    /// floating-point signal.
    pub fn step(&self) -> f64 {
        match self.encoding {
            Encoding::Unsigned | Encoding::Signed => self.factor.abs(),
            Encoding::Float32 | Encoding::Float64 => 0.0,
        }
    }

    /// Returns the number of values of an integer field, times the value of one count, in the unit
    /// of the DBC file: an integer wraps by this amount. Returns `None` for a floating-point
    /// signal.
    pub fn modulus(&self) -> Option<f64> {
        match self.encoding {
            Encoding::Unsigned | Encoding::Signed => {
                Some(f64::from(self.width).exp2() * self.factor.abs())
            }
            Encoding::Float32 | Encoding::Float64 => None,
        }
    }

    /// Returns the middle of an integer's range, in the unit of the DBC file; `None` for a
    /// floating-point signal.
    pub fn range_middle(&self) -> Option<f64> {
        match self.encoding {
            Encoding::Signed => Some(self.offset),
            Encoding::Unsigned => {
                Some(f64::from(self.width - 1).exp2() * self.factor + self.offset)
            }
            Encoding::Float32 | Encoding::Float64 => None,
        }
    }

    /// Returns true if two fields of one message share a bit.
    pub fn overlaps(&self, other: &Self) -> bool {
        let (mut a, mut b) = ([0u8; MAX_PAYLOAD], [0u8; MAX_PAYLOAD]);
        self.write_bits(&mut a, u64::MAX);
        other.write_bits(&mut b, u64::MAX);
        a.iter().zip(b).any(|(a, b)| a & b != 0)
    }

    fn raw_range(&self) -> (f64, f64) {
        let values = f64::from(self.width).exp2();
        match self.encoding {
            Encoding::Unsigned => (0.0, values - 1.0),
            Encoding::Signed => (-values / 2.0, values / 2.0 - 1.0),
            Encoding::Float32 => (f64::from(f32::MIN), f64::from(f32::MAX)),
            Encoding::Float64 => (f64::MIN, f64::MAX),
        }
    }

    /// Returns the number of bits by which byte `k` of the field is shifted in the raw number.
    fn byte_shift(&self, k: u8) -> u8 {
        match self.order {
            ByteOrder::LittleEndian => 8 * k,
            ByteOrder::BigEndian => 8 * (self.bytes - 1 - k),
        }
    }

    fn mask(&self) -> u64 {
        u64::MAX >> (64 - self.width)
    }
}

#[allow(clippy::cast_possible_truncation, reason = "the low bits are what is asked for")]
fn low_64(word: u128) -> u64 {
    word as u64
}

#[allow(clippy::cast_possible_truncation, reason = "the low bits are what is asked for")]
fn low_32(word: u64) -> u32 {
    word as u32
}

#[allow(clippy::cast_possible_truncation, reason = "the low bits are what is asked for")]
fn low_8(word: u128) -> u8 {
    word as u8
}
