//! Messages of the alternatives.

use core::fmt;

use super::alternative::{Alternative, Lag, Signal};
use super::chosen::Chosen;
use super::lean::Lean;
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
                "with the position of motor {motor} multiplied by {}: check its gear ratio and \
                 its counts per revolution",
                Number(*factor)
            ),
            Self::TorqueScale { motor, factor } => write!(
                f,
                "with the torque of motor {motor} multiplied by {}: check its torque constant, \
                 its gear ratio and the unit",
                Number(*factor)
            ),
            Self::Coupling { motor, joint, entry, .. } => {
                f.write_str("with a coupling of ")?;
                match self.coupling().filter(|of| of.standard_deviation > 0.0) {
                    Some(chosen) => Number(chosen).fmt(f)?,
                    None => entry.fmt(f)?,
                }
                write!(
                    f,
                    " turns of motor {motor} for one of joint {joint}: check its row in the \
                     transmission"
                )
            }
            Self::DriveInertia { joint } => write!(
                f,
                "with a parameter for the inertia of the drive of joint {joint}: check \
                 `drive_inertia`"
            ),
            Self::NoGravity => f.write_str(
                "without gravity: check whether the controller removes it from the torques \
                 (`excludes`), and how the arm is mounted",
            ),
            Self::Gravity { gravity_m_s2: [x, y, z] } => write!(
                f,
                "with gravity along [{x:.2}, {y:.2}, {z:.2}] m/s² in the base: check whether the \
                 arm is on the floor, a wall or the ceiling"
            ),
            Self::Leaning(lean) => leaning(f, lean),
        }
    }
}

fn leaning(f: &mut fmt::Formatter<'_>, lean: &Lean) -> fmt::Result {
    let [x, y, z] = lean.gravity_m_s2();
    let Chosen { value, standard_deviation } = lean.angle_rad;
    let angle_deg = Number(Chosen {
        value: value.to_degrees(),
        standard_deviation: standard_deviation.to_degrees(),
    });
    write!(
        f,
        "with gravity turned by {angle_deg}°, to [{x:.2}, {y:.2}, {z:.2}] m/s² in the base: check \
         how the arm is mounted; a spring or hose that turns joint 1 looks alike"
    )
}

/// Number with its standard deviation, to the digits that this justifies.
struct Number(Chosen);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(Chosen { value, standard_deviation }) = *self;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 6")]
        let decimals = (1.0 - standard_deviation.log10().floor()).clamp(0.0, 6.0) as usize;
        write!(f, "{value:.decimals$} ± {standard_deviation:.decimals$}")
    }
}

fn late(
    f: &mut fmt::Formatter<'_>,
    motor: Option<MotorIndex>,
    signal: Signal,
    lag: Lag,
    time_s: Chosen,
) -> fmt::Result {
    let in_ms = |time_s: f64| 1e3 * time_s;
    let time_ms = Number(Chosen {
        value: in_ms(time_s.value),
        standard_deviation: in_ms(time_s.standard_deviation),
    });
    match lag {
        Lag::LowPass => write!(f, "without a low-pass of {time_ms} ms ")?,
        Lag::Delay => write!(f, "without a delay of {time_ms} ms ")?,
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
