//! Fields that several log formats have in common.

use super::LineFault;
use crate::frame::MAX_PAYLOAD;
use crate::source::InterfaceName;

pub(super) const NS_PER_S: u64 = 1_000_000_000;

/// Parses a decimal number in units of `unit_ns` nanoseconds. The calculation uses integers and is
/// exact; digits below a nanosecond are dropped.
pub(super) fn stamp_ns(field: &[u8], unit_ns: u64) -> Result<u64, LineFault> {
    let dot = field.iter().position(|byte| *byte == b'.').unwrap_or(field.len());
    let (integer, fraction) = (&field[..dot], field.get(dot + 1..).unwrap_or_default());
    if integer.is_empty() || (dot < field.len() && fraction.is_empty()) {
        return Err(LineFault::Time);
    }
    let mut ns: u64 = 0;
    for digit in integer {
        let digit =
            digit.is_ascii_digit().then(|| u64::from(digit - b'0')).ok_or(LineFault::Time)?;
        ns =
            ns.checked_mul(10).and_then(|ns| ns.checked_add(digit)).ok_or(LineFault::StampRange)?;
    }
    ns = ns.checked_mul(unit_ns).ok_or(LineFault::StampRange)?;
    let mut worth = unit_ns;
    for digit in fraction {
        if !digit.is_ascii_digit() || worth < 10 {
            return Err(LineFault::Time);
        }
        worth /= 10;
        ns = ns.checked_add(worth * u64::from(digit - b'0')).ok_or(LineFault::StampRange)?;
    }
    Ok(ns)
}

/// Parses a number in a base. Every character has to be a digit.
pub(super) fn parse_digits(digits: &[u8], base: u32) -> Option<u64> {
    (!digits.is_empty()).then_some(())?;
    digits.iter().try_fold(0u64, |value, byte| {
        let digit = char::from(*byte).to_digit(base)?;
        value.checked_mul(base.into())?.checked_add(digit.into())
    })
}

/// Returns the interface name of a channel from its number, such as `can1`.
pub(super) fn channel_name(number: &[u8]) -> Option<InterfaceName> {
    let digits = (1..=3).contains(&number.len()) && number.iter().all(u8::is_ascii_digit);
    digits.then(|| InterfaceName::from_bytes(&[b"can", number].concat())).flatten()
}

/// Parses data bytes. Each byte is one field of the line.
pub(super) fn bytes<'a>(
    fields: impl Iterator<Item = &'a [u8]>,
    length: u64,
    base: u32,
) -> Result<([u8; MAX_PAYLOAD], usize), LineFault> {
    let length = usize::try_from(length).ok().filter(|length| *length <= MAX_PAYLOAD);
    let length = length.ok_or(LineFault::Length)?;
    let mut payload = [0; MAX_PAYLOAD];
    let mut count = 0;
    for (place, field) in payload.iter_mut().zip(fields.take(length)) {
        let byte = parse_digits(field, base).and_then(|byte| u8::try_from(byte).ok());
        *place = byte.ok_or(LineFault::Bytes)?;
        count += 1;
    }
    if count == length { Ok((payload, length)) } else { Err(LineFault::Bytes) }
}
