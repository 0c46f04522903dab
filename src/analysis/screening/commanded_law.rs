//! Controller of an arm whose commands state their control law, taken from the record.
//!
//! τ = kp (p_d − p) + kd (v_d − v) + τ_ff, where p_d is the reference. Methods that simulate the
//! loop need constant gains, speed targets equal to the reference speed or zero, and no added
//! torque. A record with another law is refused.

use std::ops::Range;

use didim_dynamics::control::{
    ControlLaw, ControlTiming, FeedForward, JointController, SimulatedController,
};
use didim_dynamics::robot::{JointIndex, MotorIndex, Transmission};
use didim_formats::Measurement;

use crate::cell::CommandCheck;
use crate::window::{DriveReadings, JointReading};

/// Error when a record does not show the controller of the arm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LawError {
    /// A sample has no control law or no reference.
    #[error(
        "{without_law} of the {samples} samples have no control law or no target of joint {joint} \
         in the command. Identify a part of the record that has both, set [controller], or use \
         idim-ls"
    )]
    Missing {
        /// The joint.
        joint: JointIndex,
        /// Number of samples without a law or a reference.
        without_law: u64,
        /// Number of counted samples.
        samples: u64,
    },
    /// The gains change along the record.
    #[error(
        "the {what} in the commands of joint {joint} goes from {least} to {most} {unit} along the \
        record, and methods with simulation need one constant law. Identify a part with constant \
        values, or use idim-ls"
    )]
    Changes {
        /// The joint.
        joint: JointIndex,
        /// Name of the gain.
        what: &'static str,
        /// Smallest value.
        least: f64,
        /// Largest value.
        most: f64,
        /// Unit of both values.
        unit: String,
    },
    /// The commands state no stiffness, so nothing holds the joint to the reference.
    #[error(
        "the commands of joint {joint} state no stiffness, so that nothing holds it to its \
        reference; use idim-ls"
    )]
    NoStiffness {
        /// The joint.
        joint: JointIndex,
    },
    /// The commanded speeds are neither zero nor equal to the reference speed.
    #[error(
        "the speeds that the commands of joint {joint} ask for, {least} to {most} rad/s, are \
         neither zero nor those of their positions; state [controller], or use idim-ls"
    )]
    Speed {
        /// The joint.
        joint: JointIndex,
        /// Smallest commanded speed \[rad/s\].
        least: f64,
        /// Largest commanded speed \[rad/s\].
        most: f64,
    },
    /// The commands add torques to the law.
    #[error(
        "the commands of joint {joint} add torques of {least} to {most} N·m to their law, which \
         the methods that simulate do not know; record without them, or use idim-ls"
    )]
    Torque {
        /// The joint.
        joint: JointIndex,
        /// Smallest added torque \[N·m\].
        least: f64,
        /// Largest added torque \[N·m\].
        most: f64,
    },
    /// The angle of the motor is not the angle of one joint.
    #[error(
        "the law of the commands is that of motor {motor}, which the transmission makes no joint \
         of the same angle; state [controller], whose gains are those of joints"
    )]
    Geared {
        /// The motor.
        motor: MotorIndex,
    },
    /// The recordings contain different laws.
    #[error(
        "the commands of the recordings state different laws; identify each alone, or use idim-ls"
    )]
    Different,
}

/// Derives the controller of the arm from the commands of records. Each record has its counted
/// samples and its drive readings.
///
/// # Errors
/// [`LawError`].
pub fn commanded_controller<'a>(
    records: impl IntoIterator<Item = (&'a Measurement, &'a Range<usize>, &'a DriveReadings)>,
    transmission: &Transmission,
    check: CommandCheck,
) -> Result<SimulatedController, LawError> {
    let mut laws = records
        .into_iter()
        .map(|(of, counted, readings)| read_law(of, counted, readings, transmission, check));
    let first = laws.next().unwrap_or(Err(LawError::Different))?;
    laws.try_for_each(|law| if law? == first { Ok(()) } else { Err(LawError::Different) })?;
    Ok(first)
}

fn read_law(
    measurement: &Measurement,
    counted: &Range<usize>,
    readings: &DriveReadings,
    transmission: &Transmission,
    check: CommandCheck,
) -> Result<SimulatedController, LawError> {
    let signals = &measurement.signals;
    let samples = counted.len() as u64;
    // If one axis has no command, no sample has a reference. This check comes first, so the error
    // names that axis.
    for joint in (0..measurement.axes()).map(JointIndex::new) {
        for all in [
            &readings.stiffness,
            &readings.damping,
            &readings.speed_target,
            &readings.torque_target,
        ] {
            joint_reading(all, joint, samples)?;
        }
    }
    let joints = (0..measurement.axes()).map(|axis| {
        let joint = JointIndex::new(axis);
        let constant_of = |all| joint_reading(all, joint, samples);
        let constant = |all, what| {
            let JointReading { minimum, maximum, unit, .. } = constant_of(all)?;
            if minimum >= maximum {
                return Ok(*minimum);
            }
            let (least, most, unit) = (*minimum, *maximum, unit.clone());
            Err(LawError::Changes { joint, what, least, most, unit })
        };
        let row = transmission.row(axis);
        if !row.iter().enumerate().all(|(k, ratio): (usize, &f64)| {
            let of_joint = if k == axis { 1.0 } else { 0.0 };
            (ratio.abs() - of_joint).abs() < f64::EPSILON
        }) {
            return Err(LawError::Geared { motor: MotorIndex::new(axis) });
        }
        let stiffness = constant(&readings.stiffness, "stiffness")?;
        let damping = constant(&readings.damping, "damping")?;
        if stiffness <= 0.0 {
            return Err(LawError::NoStiffness { joint });
        }
        let &JointReading { minimum: least, maximum: most, .. } =
            constant_of(&readings.torque_target)?;
        if least.abs().max(most.abs()) > check.zero_tolerance {
            return Err(LawError::Torque { joint, least, most });
        }
        let &JointReading { minimum: least, maximum: most, .. } =
            constant_of(&readings.speed_target)?;
        let reference = signals.reference_rad.as_ref().and_then(|all| all.get(axis));
        let reference =
            reference.ok_or(LawError::Missing { joint, without_law: samples, samples })?;
        let rests = least.abs().max(most.abs()) <= check.zero_tolerance;
        let [slowest, fastest] =
            reference_speeds(reference, counted, signals.sample_rate_hz, check.reach_s);
        let within = check.zero_tolerance + check.speed_share * slowest.abs().max(fastest.abs());
        if !rests && ((least - slowest).abs() > within || (most - fastest).abs() > within) {
            return Err(LawError::Speed { joint, least, most });
        }
        // The commanded speed is zero: kd (0 − v) equals kd (v_d − v) minus kd v_d.
        let against = if rests { -damping } else { 0.0 };
        Ok(JointController {
            law: ControlLaw::Pd { kp_per_rad: stiffness, kd_s_per_rad: damping, k_tau_nm: 1.0 },
            feed_forward: FeedForward { acceleration_kg_m2: 0.0, velocity_nm_s_per_rad: against },
            torque_limit_nm: None,
        })
    });
    let rate_hz = signals.sample_rate_hz;
    let timing = ControlTiming::Continuous {
        sample_period_s: (rate_hz * (check.loop_hz / rate_hz).ceil()).recip(),
    };
    let joints = joints.collect::<Result<_, _>>()?;
    Ok(SimulatedController::Cabinet { timing, joints, rescale_to_inertia_kg_m2: None })
}

/// Returns the readings of a joint, which need one value per sample.
fn joint_reading(
    all: &[JointReading],
    joint: JointIndex,
    samples: u64,
) -> Result<&JointReading, LawError> {
    let joint_reading = all.iter().find(|one| one.joint == joint);
    match samples.saturating_sub(joint_reading.map_or(0, |one| one.readings)) {
        missing_names @ 1.. => {
            Err(LawError::Missing { joint, without_law: missing_names, samples })
        }
        0 => joint_reading.ok_or(LawError::Missing { joint, without_law: 0, samples }),
    }
}

/// Returns the smallest and the largest speed of a reference over the counted samples \[rad/s\].
fn reference_speeds(
    reference: &[f64],
    counted: &Range<usize>,
    rate_hz: f64,
    reach_s: f64,
) -> [f64; 2] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few samples")]
    let reach = (reach_s * rate_hz).ceil() as usize;
    let along = reference.get(counted.clone()).unwrap_or_default();
    #[expect(clippy::cast_precision_loss, reason = "a few samples")]
    let over_s = 2.0 * reach as f64 / rate_hz;
    let speeds = along.windows(2 * reach + 1).map(|of| (of[2 * reach] - of[0]) / over_s);
    speeds.fold([0.0; 2], |[least, most]: [f64; 2], speed| [least.min(speed), most.max(speed)])
}
