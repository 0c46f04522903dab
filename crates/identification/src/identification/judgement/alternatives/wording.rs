//! Messages of the alternatives.

use core::fmt;

use super::alternative::{Alternative, Lag, Signal};
use didim_dynamics::robot::MotorIndex;

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Torque => "torque",
            Self::Position => "position",
            Self::Both => "torque and position",
        })
    }
}

impl fmt::Display for Alternative {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the data fit decisively better ")?;
        match self {
            Self::OppositeSign { motor, signal } => {
                write!(f, "with the {signal} of motor {motor} inverted: check its sign")
            }
            Self::Swapped { motors: [one, other], signal: Signal::Both } => {
                write!(
                    f,
                    "with the drives of motors {one} and {other} swapped: check which is which"
                )
            }
            Self::Swapped { motors: [one, other], signal } => write!(
                f,
                "with the {signal}s of motors {one} and {other} swapped: check which is which"
            ),
            Self::Late { motor, signal, lag, time_s } => late(f, *motor, *signal, *lag, *time_s),
            Self::PositionScale { motor, factor } => write!(
                f,
                "with the position of motor {motor} multiplied by {factor:.3}: check its gear \
                 ratio and its counts per revolution"
            ),
            Self::Gravity { gravity_m_s2: [x, y, z] } => write!(
                f,
                "with gravity along [{x:.2}, {y:.2}, {z:.2}] m/s² in the base: check whether the \
                 arm is on the floor, a wall or the ceiling"
            ),
        }
    }
}

fn late(
    f: &mut fmt::Formatter<'_>,
    motor: Option<MotorIndex>,
    signal: Signal,
    lag: Lag,
    time_s: f64,
) -> fmt::Result {
    let time_ms = 1e3 * time_s;
    match lag {
        Lag::LowPass => write!(f, "without a low-pass of about {time_ms:.0} ms ")?,
        Lag::Delay => write!(f, "without a delay of about {time_ms:.0} ms ")?,
    }
    match (motor, signal) {
        (Some(motor), _) => write!(f, "of the {signal} of motor {motor}")?,
        (None, Signal::Both) => f.write_str("of all torques and positions")?,
        (None, _) => write!(f, "of all {signal}s")?,
    }
    f.write_str(match lag {
        Lag::LowPass => ": check the filters of drive and logger",
        Lag::Delay => ": check when each signal is valid",
    })
}
