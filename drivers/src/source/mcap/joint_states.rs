//! Joint states in addition to the frames. Viewers can plot them without knowing the bus.
//!
//! The messages have the type `sensor_msgs/msg/JointState` and the format of rosbag2 (ROS 2 CDR,
//! little-endian). The file contains the schema.

use super::message::ENCAPSULATION;

pub(super) const TOPIC: &str = "/joint_states";
pub(super) const SCHEMA_NAME: &str = "sensor_msgs/msg/JointState";

/// Schema of the messages and of the types that it uses, in the format of ROS 2 message
/// definitions.
pub(super) const SCHEMA: &str = "\
std_msgs/Header header
string[] name
float64[] position # rad, m
float64[] velocity # empty: it is not measured
float64[] effort   # N m, N
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// One state of the joints. `position` and `effort` have one entry for each joint name.
#[derive(Clone, Copy, Debug)]
pub struct JointState<'a> {
    /// Time of the state on the clock of the frames \[ns\].
    pub stamp_ns: u64,
    /// Number of the bus cycle.
    pub sequence: u64,
    /// Joint positions \[rad, m\].
    pub position: &'a [f64],
    /// Torques and forces on the load side \[N·m, N\].
    pub effort: &'a [f64],
}

/// Appends the message of a state. Its time stamp is `log_time` \[ns since 1970\].
pub(super) fn encode(names: &[String], log_time: u64, state: &JointState<'_>, out: &mut Vec<u8>) {
    out.extend_from_slice(&ENCAPSULATION);
    let seconds = i32::try_from(log_time / 1_000_000_000).unwrap_or(i32::MAX);
    out.extend_from_slice(&seconds.to_le_bytes());
    let nanoseconds = u32::try_from(log_time % 1_000_000_000).unwrap_or(0);
    out.extend_from_slice(&nanoseconds.to_le_bytes());
    push_text("", out);
    push_length(names.len(), out);
    for name in names {
        push_text(name, out);
    }
    for values in [state.position, &[], state.effort] {
        push_length(values.len(), out);
        if !values.is_empty() {
            push_padding(8, out);
        }
        for value in values {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
}

/// Returns the largest size of a message for these joints \[bytes\].
pub(super) fn most_bytes(names: &[String]) -> u64 {
    let named: usize = names.iter().map(|name| 4 + name.len() + 4).sum();
    (64 + named + 16 * names.len()) as u64
}

fn push_length(length: usize, out: &mut Vec<u8>) {
    push_padding(4, out);
    out.extend_from_slice(&u32::try_from(length).unwrap_or(0).to_le_bytes());
}

/// Appends a text with a terminating zero. The length of the text includes this zero.
fn push_text(text: &str, out: &mut Vec<u8>) {
    push_length(text.len() + 1, out);
    out.extend_from_slice(text.as_bytes());
    out.push(0);
}

/// Appends padding up to a multiple of `to` bytes. Positions count from the end of the
/// encapsulation.
fn push_padding(to: usize, out: &mut Vec<u8>) {
    let place = out.len() - ENCAPSULATION.len();
    out.resize(place.next_multiple_of(to) + ENCAPSULATION.len(), 0);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Layout of a recorded message in the fixture, without its frame.
    #[test]
    fn values_stand_where_ros_2_has_them() {
        let names = ["j1".to_owned(), "joint_2".to_owned()];
        let state = JointState {
            stamp_ns: 0,
            sequence: 0,
            position: &[1.0, -2.0],
            effort: &[0.5, f64::NAN],
        };
        let mut out = Vec::new();
        encode(&names, 1_700_000_000_123_456_789, &state, &mut out);
        let mut expected = b"\x00\x01\x00\x00\x00\xf1\x53\x65\x15\xcd\x5b\x07".to_vec();
        expected.extend(b"\x01\x00\x00\x00\x00\x00\x00\x00");
        expected.extend(b"\x02\x00\x00\x00\x03\x00\x00\x00j1\x00\x00\x08\x00\x00\x00joint_2\x00");
        expected.extend(b"\x02\x00\x00\x00\x00\x00\x00\x00");
        expected.extend([1.0_f64, -2.0].map(f64::to_le_bytes).concat());
        expected.extend(b"\x00\x00\x00\x00\x02\x00\x00\x00");
        expected.extend([0.5, f64::NAN].map(f64::to_le_bytes).concat());
        assert_eq!(out, expected);
        assert!(out.len() as u64 <= most_bytes(&names));
    }
}
