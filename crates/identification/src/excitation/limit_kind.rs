//! Kinds of limits.

use core::fmt;

/// Limited quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LimitKind {
    /// Position.
    Position,
    /// Speed.
    Speed,
    /// Acceleration.
    Acceleration,
    /// Jerk.
    Jerk,
    /// Torque or force.
    Torque,
}

impl LimitKind {
    /// All kinds, in the order of derivatives.
    pub const ALL: [Self; 5] =
        [Self::Position, Self::Speed, Self::Acceleration, Self::Jerk, Self::Torque];
}

impl fmt::Display for LimitKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Position => "position",
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::Torque => "torque",
        })
    }
}
