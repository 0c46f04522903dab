//! One synchronous sample of every drive of the arm.

/// The largest number of joints an arm can have; scratch memory is sized by it.
pub const MAX_JOINTS: usize = 8;

/// What all drives said about one bus cycle, in SI units on the motor side.
///
/// Entries beyond the arm's joints are zero. The sample belongs to the instant `stamp_ns` (the
/// SYNC); when each signal is valid relative to that instant is data of the layout, not of the
/// sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSample {
    /// Number of bus cycles since the first one: a cycle without a complete sample leaves a gap, so
    /// a gap in the sequence is a loss. Sample `k` lies `k` nominal periods after sample 0.
    pub sequence: u64,
    /// The instant of the SYNC \[ns\] on the monotonic clock (live) or the log's clock (replay).
    pub stamp_ns: u64,
    /// Measured motor angle \[rad\].
    pub motor_position_rad: [f64; MAX_JOINTS],
    /// Motor torque, commanded or measured as the layout says \[N·m\].
    pub motor_torque_nm: [f64; MAX_JOINTS],
    /// Motor angle the controller was told to reach \[rad\]; meaningful when `has_reference`.
    pub motor_reference_rad: [f64; MAX_JOINTS],
    /// Whether every joint of this sample carries a reference.
    pub has_reference: bool,
}

impl JointSample {
    /// A sample of zeros at the given cycle and instant.
    pub fn zero(sequence: u64, stamp_ns: u64) -> Self {
        Self {
            sequence,
            stamp_ns,
            motor_position_rad: [0.0; MAX_JOINTS],
            motor_torque_nm: [0.0; MAX_JOINTS],
            motor_reference_rad: [0.0; MAX_JOINTS],
            has_reference: false,
        }
    }
}
