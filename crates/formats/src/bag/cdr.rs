//! Messages of ROS 2 in CDR (XCDR1): a header of four bytes with the byte order, then the fields,
//! each aligned to its size from there on.

/// A message that ends too early, or declares more data than it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MalformedMessage;

/// `sensor_msgs/msg/JointState` without the velocities.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct JointState {
    pub(super) stamp_ns: u64,
    pub(super) name: Vec<String>,
    pub(super) position: Vec<f64>,
    pub(super) effort: Vec<f64>,
}

struct CdrReader<'a> {
    bytes: &'a [u8],
    offset: usize,
    is_little_endian: bool,
}

impl<'a> CdrReader<'a> {
    fn new(message: &'a [u8]) -> Result<Self, MalformedMessage> {
        let (header, bytes) = message.split_at_checked(4).ok_or(MalformedMessage)?;
        match header[..2] {
            [0, 0] => Ok(Self { bytes, offset: 0, is_little_endian: false }),
            [0, 1] => Ok(Self { bytes, offset: 0, is_little_endian: true }),
            _ => Err(MalformedMessage),
        }
    }

    fn take_bytes<const N: usize>(&mut self) -> Result<[u8; N], MalformedMessage> {
        let begin = self.offset.next_multiple_of(N);
        let taken = self.bytes.get(begin..).and_then(|rest| rest.first_chunk::<N>()).copied();
        let mut taken = taken.ok_or(MalformedMessage)?;
        self.offset = begin + N;
        if !self.is_little_endian {
            taken.reverse();
        }
        Ok(taken)
    }

    fn take_u32(&mut self) -> Result<u32, MalformedMessage> {
        Ok(u32::from_le_bytes(self.take_bytes()?))
    }

    /// Reads a number of entries. Each entry takes at least `least` bytes, which bounds the count.
    fn take_count(&mut self, least: usize) -> Result<usize, MalformedMessage> {
        let count = self.take_u32()? as usize;
        let fits =
            count.checked_mul(least).is_some_and(|bytes| bytes <= self.bytes.len() - self.offset);
        if fits { Ok(count) } else { Err(MalformedMessage) }
    }

    fn take_text(&mut self) -> Result<String, MalformedMessage> {
        let length = self.take_count(1)?;
        let text = &self.bytes[self.offset..self.offset + length];
        self.offset += length;
        // The length of a text includes its terminating zero.
        let text = text.strip_suffix(&[0]).unwrap_or(text);
        Ok(String::from_utf8_lossy(text).into_owned())
    }

    fn take_numbers(&mut self) -> Result<Vec<f64>, MalformedMessage> {
        let count = self.take_count(8)?;
        (0..count).map(|_| Ok(f64::from_le_bytes(self.take_bytes()?))).collect()
    }
}

/// `std_msgs/msg/String`.
pub(super) fn text(message: &[u8]) -> Result<String, MalformedMessage> {
    CdrReader::new(message)?.take_text()
}

impl JointState {
    pub(super) fn read(message: &[u8]) -> Result<Self, MalformedMessage> {
        let mut reader = CdrReader::new(message)?;
        let (seconds, nanoseconds) = (reader.take_u32()?, reader.take_u32()?);
        reader.take_text()?;
        let names = reader.take_count(4)?;
        let name = (0..names).map(|_| reader.take_text()).collect::<Result<_, _>>()?;
        let position = reader.take_numbers()?;
        reader.take_numbers()?;
        let effort = reader.take_numbers()?;
        let stamp_ns = u64::from(seconds) * 1_000_000_000 + u64::from(nanoseconds);
        Ok(Self { stamp_ns, name, position, effort })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints, as rclcpp writes them; no velocities.
    fn message(little: bool) -> Vec<u8> {
        let mut bytes = vec![0, u8::from(little), 0, 0];
        let word = |bytes: &mut Vec<u8>, value: u32| {
            while !bytes.len().is_multiple_of(4) {
                bytes.push(0);
            }
            bytes.extend(if little { value.to_le_bytes() } else { value.to_be_bytes() });
        };
        word(&mut bytes, 1_700_000_000);
        word(&mut bytes, 123_456_789);
        word(&mut bytes, 5);
        bytes.extend(*b"base\0");
        word(&mut bytes, 2);
        for text in ["j1", "joint_2"] {
            word(&mut bytes, u32::try_from(text.len()).unwrap() + 1);
            bytes.extend(text.bytes().chain([0]));
        }
        for numbers in [vec![1.0, -2.0], vec![], vec![0.5, 0.25]] {
            word(&mut bytes, u32::try_from(numbers.len()).unwrap());
            for number in numbers {
                while !(bytes.len() - 4).is_multiple_of(8) {
                    bytes.push(0);
                }
                let number: f64 = number;
                bytes.extend(if little { number.to_le_bytes() } else { number.to_be_bytes() });
            }
        }
        bytes
    }

    #[test]
    fn both_byte_orders_are_read_and_nothing_beyond_the_end() {
        let expected = JointState {
            stamp_ns: 1_700_000_000_123_456_789,
            name: vec!["j1".into(), "joint_2".into()],
            position: vec![1.0, -2.0],
            effort: vec![0.5, 0.25],
        };
        for little in [true, false] {
            let message = message(little);
            assert_eq!(JointState::read(&message), Ok(expected.clone()));
            // Padding behind is no matter.
            assert_eq!(
                JointState::read(&[message.as_slice(), &[0; 4]].concat()),
                Ok(expected.clone())
            );
            for length in 0..message.len() {
                assert_eq!(JointState::read(&message[..length]), Err(MalformedMessage), "{length}");
            }
            // Any byte is read or refused.
            for at in 0..message.len() {
                let mut other = message.clone();
                other[at] = 0xFF;
                let _ = JointState::read(&other);
            }
        }
        assert_eq!(JointState::read(&[0, 6, 0, 0, 1, 2, 3, 4]), Err(MalformedMessage));
    }
}
