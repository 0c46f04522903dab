//! What controls an arm whose commands state their law: taken from the record.
//!
//! τ = kp (p_d − p) + kd (v_d − v) + τ_ff, where p_d is the reference. The methods that simulate the loop have gains that stay,
//! speeds that are those of the reference or zero, and no torque that is added: a record that has another law is refused.

use std::ops::Range;

use didim_core::control::{
    ControlLaw, ControlTiming, FeedForward, JointController, SimulatedController,
};
use didim_core::robot::Transmission;
use didim_formats::Measurement;

use crate::window::{DriveReadings, JointReading};

/// Below it a target is zero \[rad/s, N·m\]: zero is no count of a signal of 12 bits over ±45 rad/s or ±54 N·m, whose step is
/// half of it.
const ZERO: f64 = 0.05;
/// A speed target is that of the reference where its extremes are, within [`ZERO`] and this share.
const SPEED: f64 = 0.05;
/// Half of the time over which the reference is differentiated \[s\]: over less a count of it shows.
const REACH_S: f64 = 0.01;
/// The loop is computed so often at least \[Hz\]: motors do so at tens of kilohertz.
const LOOP_HZ: f64 = 5000.0;

/// Why a record does not tell what controls the arm.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LawError {
    /// A sample without the law or the reference.
    #[error(
        "{lacking} of the {samples} samples lack the law or the target of the command of joint {joint}; identify a part of the \
         record that has both, state [controller], or use idim-ls"
    )]
    Missing {
        /// The joint, from 1.
        joint: usize,
        /// Samples without it.
        lacking: u64,
        /// Samples that count.
        samples: u64,
    },
    /// The gains change along the record.
    #[error(
        "the {what} that the commands of joint {joint} state goes from {least} to {most} {unit} along the record, and the methods \
         that simulate have one law; identify a part with one of them, or use idim-ls"
    )]
    Changes {
        /// The joint, from 1.
        joint: usize,
        /// Which gain.
        what: &'static str,
        /// The least of it.
        least: f64,
        /// The most.
        most: f64,
        /// The unit of both.
        unit: String,
    },
    /// The commands state no stiffness: nothing holds the joint to the reference.
    #[error(
        "the commands of joint {joint} state no stiffness, so that nothing holds it to its reference; use idim-ls"
    )]
    NoStiffness {
        /// The joint, from 1.
        joint: usize,
    },
    /// The speeds asked for are neither zero nor those of the reference.
    #[error(
        "the speeds that the commands of joint {joint} ask for, {least} to {most} rad/s, are neither zero nor those of their \
         positions; state [controller], or use idim-ls"
    )]
    Speed {
        /// The joint, from 1.
        joint: usize,
        /// The least of them \[rad/s\].
        least: f64,
        /// The most \[rad/s\].
        most: f64,
    },
    /// The commands add torques.
    #[error(
        "the commands of joint {joint} add torques of {least} to {most} N·m to their law, which the methods that simulate do not \
         know; record without them, or use idim-ls"
    )]
    Torque {
        /// The joint, from 1.
        joint: usize,
        /// The least of them \[N·m\].
        least: f64,
        /// The most \[N·m\].
        most: f64,
    },
    /// A motor is no joint.
    #[error(
        "the law of the commands is that of motor {motor}, which the transmission makes no joint of the same angle; state \
         [controller], whose gains are those of joints"
    )]
    Geared {
        /// The motor, from 1.
        motor: usize,
    },
    /// Recordings with different laws.
    #[error(
        "the commands of the recordings state different laws; identify each alone, or use idim-ls"
    )]
    Different,
}

/// What controls the arm by the commands of records, each with the samples that count and what was told along them.
///
/// # Errors
/// [`LawError`].
pub fn commanded_controller<'a>(
    records: impl IntoIterator<Item = (&'a Measurement, &'a Range<usize>, &'a DriveReadings)>,
    transmission: &Transmission,
) -> Result<SimulatedController, LawError> {
    let mut laws =
        records.into_iter().map(|(of, counted, told)| law(of, counted, told, transmission));
    let first = laws.next().unwrap_or(Err(LawError::Different))?;
    laws.try_for_each(|law| if law? == first { Ok(()) } else { Err(LawError::Different) })?;
    Ok(first)
}

fn law(
    measurement: &Measurement,
    counted: &Range<usize>,
    told: &DriveReadings,
    transmission: &Transmission,
) -> Result<SimulatedController, LawError> {
    let signals = &measurement.signals;
    let samples = counted.len() as u64;
    // Where one axis has no command, no sample has a reference: whose it is comes first.
    for joint in 1..=measurement.axes() {
        for all in [&told.stiffness, &told.damping, &told.speed_target, &told.torque_target] {
            reading(all, joint, samples)?;
        }
    }
    let joints = (0..measurement.axes()).map(|axis| {
        let joint = axis + 1;
        let of = |all| reading(all, joint, samples);
        let constant = |all, what| {
            let JointReading { minimum, maximum, unit, .. } = of(all)?;
            if minimum >= maximum {
                return Ok(*minimum);
            }
            let (least, most, unit) = (*minimum, *maximum, unit.clone());
            Err(LawError::Changes { joint, what, least, most, unit })
        };
        let row = transmission.row(axis);
        let own = |(k, ratio): (usize, &f64)| {
            let of_joint = if k == axis { 1.0 } else { 0.0 };
            (ratio.abs() - of_joint).abs() < f64::EPSILON
        };
        if !row.iter().enumerate().all(own) {
            return Err(LawError::Geared { motor: joint });
        }
        let stiffness = constant(&told.stiffness, "stiffness")?;
        let damping = constant(&told.damping, "damping")?;
        if stiffness <= 0.0 {
            return Err(LawError::NoStiffness { joint });
        }
        let &JointReading { minimum: least, maximum: most, .. } = of(&told.torque_target)?;
        if least.abs().max(most.abs()) > ZERO {
            return Err(LawError::Torque { joint, least, most });
        }
        let &JointReading { minimum: least, maximum: most, .. } = of(&told.speed_target)?;
        let reference = signals.reference_rad.as_ref().and_then(|all| all.get(axis));
        let reference = reference.ok_or(LawError::Missing { joint, lacking: samples, samples })?;
        let rests = least.abs().max(most.abs()) <= ZERO;
        let [slowest, fastest] = speeds(reference, counted, signals.sample_rate_hz);
        let within = ZERO + SPEED * slowest.abs().max(fastest.abs());
        if !rests && ((least - slowest).abs() > within || (most - fastest).abs() > within) {
            return Err(LawError::Speed { joint, least, most });
        }
        // A speed of zero is asked for: kd (0 − v) is kd (v_d − v) less kd v_d.
        let against = if rests { -damping } else { 0.0 };
        Ok(JointController {
            law: ControlLaw::Pd { kp_per_rad: stiffness, kd_s_per_rad: damping, k_tau_nm: 1.0 },
            feed_forward: FeedForward { acceleration_kg_m2: 0.0, velocity_nm_s_per_rad: against },
            torque_limit_nm: None,
        })
    });
    let rate_hz = signals.sample_rate_hz;
    let timing = ControlTiming::Continuous {
        sample_period_s: (rate_hz * (LOOP_HZ / rate_hz).ceil()).recip(),
    };
    let joints = joints.collect::<Result<_, _>>()?;
    Ok(SimulatedController::Cabinet { timing, joints, rescale_to_inertia_kg_m2: None })
}

/// What was told of a joint, in each sample.
fn reading(all: &[JointReading], joint: usize, samples: u64) -> Result<&JointReading, LawError> {
    let found = all.iter().find(|one| one.joint == joint);
    match samples.saturating_sub(found.map_or(0, |one| one.readings)) {
        lacking @ 1.. => Err(LawError::Missing { joint, lacking, samples }),
        0 => found.ok_or(LawError::Missing { joint, lacking: 0, samples }),
    }
}

/// The least and the largest speed of a reference along the samples that count \[rad/s\].
fn speeds(reference: &[f64], counted: &Range<usize>, rate_hz: f64) -> [f64; 2] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few samples")]
    let reach = (REACH_S * rate_hz).ceil() as usize;
    let along = reference.get(counted.clone()).unwrap_or_default();
    #[expect(clippy::cast_precision_loss, reason = "a few samples")]
    let over_s = 2.0 * reach as f64 / rate_hz;
    let speeds = along.windows(2 * reach + 1).map(|of| (of[2 * reach] - of[0]) / over_s);
    speeds.fold([0.0; 2], |[least, most]: [f64; 2], speed| [least.min(speed), most.max(speed)])
}
