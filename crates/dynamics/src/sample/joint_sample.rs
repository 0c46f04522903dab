//! One synchronous sample of every drive of the arm.

/// The largest number of joints an arm can have; memory is sized by it.
pub const MAX_JOINTS: usize = 16;

/// The number of joints up to which scratch memory has half the size. Nearly all arms have no more,
/// and clearing and copying what they do not have would cost them time.
pub(crate) const FEW_JOINTS: usize = 8;

/// Data of all drives for one bus cycle, in SI units on the motor side.
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
    /// Motor angle command of the controller \[rad\]; meaningful when `has_reference`.
    pub motor_reference_rad: [f64; MAX_JOINTS],
    /// True if every joint of this sample has a reference.
    pub has_reference: bool,
    /// Further readings that the drives reported in this cycle.
    pub readings: Readings,
}

impl JointSample {
    /// Creates a sample of zeros at the given cycle and instant.
    pub fn zero(sequence: u64, stamp_ns: u64) -> Self {
        Self {
            sequence,
            stamp_ns,
            motor_position_rad: [0.0; MAX_JOINTS],
            motor_torque_nm: [0.0; MAX_JOINTS],
            motor_reference_rad: [0.0; MAX_JOINTS],
            has_reference: false,
            readings: Readings::default(),
        }
    }
}

/// Additional reading of a drive, sent in each cycle or less often.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reading {
    /// Temperature of the motor \[°C\], in steps of 0.1 °C.
    Temperature,
    /// Supply or DC link voltage \[V\], in steps of 0.1 V.
    SupplyVoltage,
    /// The mode of the drive, a number without a unit, such as 6061h of CiA 402.
    Mode,
    /// The stiffness that a command asks for \[N·m/rad\], in steps of 1/64.
    Stiffness,
    /// The damping that a command asks for \[N·m·s/rad\], in steps of 1/6400.
    Damping,
    /// The speed that a command asks for \[rad/s\], in steps of 1/500.
    SpeedTarget,
    /// The torque that a command adds \[N·m\], in steps of 1/250.
    TorqueTarget,
}

impl Reading {
    /// Every reading.
    pub const ALL: [Self; 7] = [
        Self::Temperature,
        Self::SupplyVoltage,
        Self::Mode,
        Self::Stiffness,
        Self::Damping,
        Self::SpeedTarget,
        Self::TorqueTarget,
    ];

    /// Returns its unit; empty for a mode.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Temperature => "degC",
            Self::SupplyVoltage => "V",
            Self::Mode => "",
            Self::Stiffness => "N·m/rad",
            Self::Damping => "N·m·s/rad",
            Self::SpeedTarget => "rad/s",
            Self::TorqueTarget => "N·m",
        }
    }

    /// Returns the number of steps in one unit.
    pub const fn steps_per_unit(self) -> f64 {
        match self {
            Self::Temperature | Self::SupplyVoltage => 10.0,
            Self::Mode => 1.0,
            Self::Stiffness => 64.0,
            Self::Damping => 6400.0,
            Self::SpeedTarget => 500.0,
            Self::TorqueTarget => 250.0,
        }
    }
}

/// The additional readings in the frames of one bus cycle. Most cycles have none.
///
/// They have the resolution of the drives and no more, because every sample of a window stores
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    /// Value of each [`Reading`] and joint, in steps; 0 if there is none.
    pub steps: [[i16; MAX_JOINTS]; Reading::ALL.len()],
    /// For each [`Reading`], one bit for each joint that has one.
    pub joints: [u16; Reading::ALL.len()],
}

impl Readings {
    /// Takes a value in its unit, rounded to a step. Impossible values are ignored: NaN, or more
    /// than 32767 steps (±3276.7 °C or V).
    pub fn set(&mut self, reading: Reading, joint: usize, value: f64) {
        let steps = (value * reading.steps_per_unit()).round();
        let place = self.steps[reading as usize].get_mut(joint);
        let (Some(place), true) = (place, steps.abs() <= f64::from(i16::MAX)) else { return };
        #[expect(clippy::cast_possible_truncation, reason = "rounded, and within the range")]
        let steps = steps as i16;
        *place = steps;
        self.joints[reading as usize] |= 1 << joint;
    }

    /// Returns a value in steps, if there is one.
    pub fn get(&self, reading: Reading, joint: usize) -> Option<i16> {
        let steps = self.steps[reading as usize].get(joint)?;
        (self.joints[reading as usize] & (1 << joint) != 0).then_some(*steps)
    }

    /// Replaces the values that `later` contains.
    pub fn update(&mut self, later: &Self) {
        for reading in Reading::ALL {
            let (own, joints) = (&mut self.steps[reading as usize], later.joints[reading as usize]);
            for (joint, (own, later)) in
                own.iter_mut().zip(later.steps[reading as usize]).enumerate()
            {
                if joints & (1 << joint) != 0 {
                    *own = later;
                }
            }
            self.joints[reading as usize] |= joints;
        }
    }

    /// Returns true if the mode of a joint has changed.
    pub fn changes_mode(&self, before: &Self) -> bool {
        let mode = |of: &Self, joint| of.get(Reading::Mode, joint);
        (0..MAX_JOINTS).any(|joint| {
            mode(self, joint).zip(mode(before, joint)).is_some_and(|(now, then)| now != then)
        })
    }

    /// Returns true if there is no reading.
    pub fn is_empty(&self) -> bool {
        self.joints == [0; Reading::ALL.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_is_kept_to_a_step_and_what_no_drive_says_is_not() {
        let mut readings = Readings::default();
        readings.set(Reading::Temperature, 2, 41.26);
        readings.set(Reading::SupplyVoltage, MAX_JOINTS - 1, 3276.7);
        readings.set(Reading::Mode, 0, -1.0);
        assert_eq!(readings.get(Reading::Temperature, 2), Some(413));
        assert_eq!(readings.get(Reading::SupplyVoltage, MAX_JOINTS - 1), Some(32767));
        assert_eq!(readings.get(Reading::Mode, 0), Some(-1));
        assert_eq!(readings.get(Reading::Temperature, 1), None);
        let before = readings;
        for value in [f64::NAN, f64::INFINITY, 3276.8, -3300.0] {
            readings.set(Reading::Temperature, 2, value);
        }
        readings.set(Reading::Temperature, MAX_JOINTS, 20.0);
        assert_eq!(readings, before);
        assert_eq!(readings.get(Reading::Temperature, MAX_JOINTS), None);
    }

    #[test]
    fn later_readings_replace_those_before_and_a_mode_shows_a_change() {
        let [mut latched, mut later] = [Readings::default(); 2];
        latched.set(Reading::Mode, 0, 8.0);
        latched.set(Reading::Temperature, 0, 30.0);
        later.set(Reading::Mode, 1, 10.0);
        assert!(!later.changes_mode(&latched), "of another joint");
        latched.update(&later);
        assert_eq!(latched.get(Reading::Mode, 0), Some(8));
        assert_eq!(latched.get(Reading::Mode, 1), Some(10));
        assert_eq!(latched.get(Reading::Temperature, 0), Some(300));
        later.set(Reading::Mode, 0, 10.0);
        assert!(later.changes_mode(&latched));
        latched.update(&later);
        assert!(!later.changes_mode(&latched));
        assert!(!latched.is_empty() && Readings::default().is_empty());
    }
}
