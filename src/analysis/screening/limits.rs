//! Check of a measurement against the robot's limits before any fit. Large excesses indicate a
//! wrong unit or column.

use core::fmt;
use core::ops::Range;

use didim_dynamics::robot::{Joint, JointIndex, JointKind, Limits, Robot};
use didim_formats::{Measurement, Side};
use didim_identification::identification::KeptParameters;

use crate::cell::Cell;
use crate::cell::LimitCheck;
use crate::text::significant_digits;

/// Quantity beyond a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitedQuantity {
    /// The position of the joint.
    Position,
    /// Its speed.
    Speed,
    /// Its torque or force.
    Torque,
}

/// Likely cause of the excess.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// A few isolated samples.
    Glitch,
    /// Positions that jump by a turn.
    Wrap {
        /// Time of the jump \[s after the first sample\].
        time_s: f64,
    },
    /// Positions that are whole turns off in all samples.
    Turns {
        /// Number of turns.
        turns: f64,
    },
    /// Degrees or millimetres instead of radians or metres.
    PositionUnit,
    /// Torque in mN·m, as a current, or on the other side of the gear, instead of N·m on the joint
    /// side.
    TorqueUnit,
    /// Wrong torque gain, or a configured limit that differs from the drive's.
    Gain,
    /// Wrong axis, sign or zero, or a configured limit that differs from the robot's.
    Axis,
}

/// The sample with the largest excess over a limit.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitExcess {
    /// The joint.
    pub joint: JointIndex,
    /// Number of the joint, with its name if it has one.
    pub joint_label: String,
    /// The limited quantity.
    pub quantity: LimitedQuantity,
    /// Time of the sample \[s after the first sample\].
    pub time_s: f64,
    /// Its value \[SI\].
    pub value: f64,
    /// The limit \[SI\].
    pub limit: f64,
    /// Ratio of the value to the limit. For a position: 1 plus the excess divided by the larger of
    /// the two limits.
    pub limit_ratio: f64,
    /// Number of samples beyond the limit.
    pub samples: usize,
    /// Likely cause.
    pub cause: Cause,
    kind: JointKind,
}

/// A measurement that cannot be a motion of this robot. Correct the columns or the limits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the data do not fit the robot: {}; correct unit, sign, zero or axis in the cell, or the \
    limits in the robot file", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct BeyondLimits(pub Vec<LimitExcess>);

impl fmt::Display for LimitExcess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            joint: _,
            joint_label: joint,
            quantity: limited,
            time_s,
            value,
            limit,
            limit_ratio: times,
            samples,
            cause,
            kind,
        } = self;
        let revolute = *kind == JointKind::Revolute;
        let (what, unit) = match limited {
            LimitedQuantity::Position => ("position", if revolute { "rad" } else { "m" }),
            LimitedQuantity::Speed => ("speed", if revolute { "rad/s" } else { "m/s" }),
            LimitedQuantity::Torque => ("torque", kind.torque_unit()),
        };
        // A position excess has no ratio, because one of its limits may be 0.
        let beyond = match limited {
            LimitedQuantity::Position => "beyond".to_owned(),
            _ => format!("{} times", significant_digits(*times, 3)),
        };
        write!(
            f,
            "the {what} of joint {joint} is {} {unit} after {time_s:.3} s, {beyond} its limit of \
            {} {unit} in {samples} samples ({})",
            significant_digits(*value, 3),
            significant_digits(*limit, 3),
            match cause {
                Cause::Glitch => "a glitch?".to_owned(),
                Cause::Wrap { time_s } =>
                    format!("it jumps by a turn after {time_s:.3} s: set `wraps` in the cell"),
                Cause::Turns { turns } => format!(
                    "all of them are within the limits after {turns} turn{} ({} rad) less: set \
                    `zero` of the positions in the cell",
                    if turns.abs() > 1.0 { "s" } else { "" },
                    significant_digits(turns * core::f64::consts::TAU, 6)
                ),
                Cause::PositionUnit if revolute => "degrees in place of radians?".to_owned(),
                Cause::PositionUnit => "millimetres in place of metres?".to_owned(),
                Cause::TorqueUnit => "mN·m, a current, or the other side of the gear?".to_owned(),
                Cause::Gain => "the gain, or the limit?".to_owned(),
                Cause::Axis => "another axis, sign or zero?".to_owned(),
            }
        )
    }
}

/// Remedy for [`open_limits`].
pub const LIMITS_REMEDY: &str =
    "state velocity_max_* and torque_max_nm or force_max_n where they are known";

/// Describes the limits that a robot's file leaves open. `None` if all are set.
pub fn open_limits(robot: &Robot) -> Option<String> {
    let joints_of = |what: &str, is_open: &dyn Fn(&Limits) -> bool| {
        let joints = robot.limits().enumerate().filter(|(_, limits)| is_open(limits));
        let label = |(joint, _): (usize, _)| robot.joint_label(JointIndex::new(joint));
        let joints: Vec<String> = joints.map(label).collect();
        (!joints.is_empty()).then(|| format!("{what} of joint {}", joints.join(", ")))
    };
    let open_limits_listed = [
        joints_of("speed", &|limits| limits.velocity_max.is_none()),
        joints_of("torque", &|limits| limits.torque_max.is_none()),
    ];
    let names: Vec<String> = open_limits_listed.into_iter().flatten().collect();
    (!names.is_empty()).then(|| {
        format!(
            "the robot file lacks limits, so recordings are not checked against them: {}",
            names.join(", ")
        )
    })
}

/// Remedy for [`unlisted_laws`].
pub const FRICTION_LAWS_REMEDY: &str =
    "add them to `identification.parameters`, or take the laws out of the robot file";

/// Lists the friction-law parameters of the robot that the cell neither identifies nor fixes, as
/// text.
pub fn unlisted_laws(cell: &Cell) -> Option<String> {
    // Laws that the data choose are listed automatically.
    let listed = cell.options.parameters.as_ref().filter(|_| !cell.chooses_friction)?;
    let is_fixed = |name: &String| match &cell.options.keep_nominal {
        None => false,
        Some(KeptParameters::All) => {
            let value = cell.robot.nominal().and_then(|nominal| nominal.value(name));
            value.is_some_and(|value| value != 0.0)
        }
        Some(KeptParameters::Named(names)) => names.contains(name),
    };
    let table = cell.robot.parameters();
    let parameters = table.parameters().iter().zip(table.names());
    let of_laws = parameters.filter(|(own, _)| own.kind.is_friction_law()).map(|(_, name)| name);
    let unlisted = of_laws.filter(|name| {
        cell.base.names().contains(name) && !listed.contains(name) && !is_fixed(name)
    });
    let unlisted: Vec<&str> = unlisted.map(String::as_str).collect();
    (!unlisted.is_empty()).then(|| {
        format!(
            "the robot file has friction laws whose parameters are not identified and count as \
                0: {}",
            unlisted.join(", ")
        )
    })
}

/// Returns the counted samples' values that are beyond the robot's limits and need a note, largest
/// excess first.
///
/// # Errors
/// [`BeyondLimits`], if a value exceeds [`LimitCheck::refusal_multiple`] times its limit.
pub fn check_limits(
    measurement: &Measurement,
    counted: &Range<usize>,
    robot: &Robot,
    check: LimitCheck,
) -> Result<Vec<LimitExcess>, BeyondLimits> {
    let signals = &measurement.signals;
    let fits =
        signals.position_rad.len() == robot.joints() && signals.torque_nm.len() == robot.joints();
    if !fits {
        // The conversion to an experiment reports this error.
        return Ok(Vec::new());
    }
    let joints = JointSamples::new(measurement, counted, robot, check);
    let mut beyond: Vec<LimitExcess> = (0..robot.joints())
        .flat_map(|joint| {
            let limited =
                [LimitedQuantity::Position, LimitedQuantity::Speed, LimitedQuantity::Torque];
            limited.map(|limited| joints.find_excess(joint, limited, robot))
        })
        .flatten()
        .collect();
    beyond.sort_by(|a, b| b.limit_ratio.total_cmp(&a.limit_ratio));
    if beyond.first().is_some_and(|worst| worst.limit_ratio > check.refusal_multiple) {
        beyond.retain(|one| one.limit_ratio > check.refusal_multiple);
        beyond.truncate(3);
        return Err(BeyondLimits(beyond));
    }
    Ok(beyond)
}

/// The counted samples on the joint side.
struct JointSamples {
    limit_check: LimitCheck,
    first_sample: usize,
    period_s: f64,
    /// By joint.
    position: Vec<Vec<f64>>,
    torque: Vec<Vec<f64>>,
}

impl JointSamples {
    fn new(
        measurement: &Measurement,
        counted: &Range<usize>,
        robot: &Robot,
        check: LimitCheck,
    ) -> Self {
        let signals = &measurement.signals;
        let side = |columns: &[Vec<f64>], turn: &dyn Fn(&[f64], &mut [f64])| -> Vec<Vec<f64>> {
            let mut transposed = vec![Vec::with_capacity(counted.len()); columns.len()];
            let (mut from, mut to) = (vec![0.0; columns.len()], vec![0.0; columns.len()]);
            for k in counted.clone() {
                for (value, column) in from.iter_mut().zip(columns) {
                    *value = column.get(k).copied().unwrap_or_default();
                }
                match measurement.side {
                    Side::Joint => to.copy_from_slice(&from),
                    Side::Motor => turn(&from, &mut to),
                }
                transposed.iter_mut().zip(&to).for_each(|(column, value)| column.push(*value));
            }
            transposed
        };
        let transmission = robot.transmission();
        Self {
            limit_check: check,
            first_sample: counted.start,
            period_s: 1.0 / signals.sample_rate_hz,
            position: side(&signals.position_rad, &|from, to| {
                transmission.joint_position(from, to)
            }),
            torque: side(&signals.torque_nm, &|from, to| transmission.joint_torque(from, to)),
        }
    }

    fn time_s(&self, sample: usize) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
        let samples = (self.first_sample + sample) as f64;
        samples * self.period_s
    }

    fn find_excess(
        &self,
        joint: usize,
        limited: LimitedQuantity,
        robot: &Robot,
    ) -> Option<LimitExcess> {
        if limited == LimitedQuantity::Torque
            && !robot.recorded_torque().has_joint(JointIndex::new(joint))
        {
            return None;
        }
        let joint_of_chain = robot.chain()[joint];
        let limits = joint_of_chain.limits;
        let position = &self.position[joint];
        // A limit that the file leaves open is not checked: see [`open_limits`].
        let most = match limited {
            LimitedQuantity::Torque => limits.torque_max?,
            LimitedQuantity::Speed => limits.velocity_max?,
            LimitedQuantity::Position => limits.position_max,
        };
        let note_multiple = self.limit_check.note_multiple;
        let found = match limited {
            LimitedQuantity::Torque => {
                largest_excess(&self.torque[joint], note_multiple, |torque| torque.abs() / most)
            }
            LimitedQuantity::Speed => {
                largest_excess(&self.speed(joint), note_multiple, |speed| speed.abs() / most)
            }
            LimitedQuantity::Position => {
                let size = limits.position_min.abs().max(most.abs());
                largest_excess(position, note_multiple, |position| {
                    let out = (position - most).max(limits.position_min - position);
                    1.0 + out.max(0.0) / size
                })
            }
        };
        let Excess { sample, value, times, samples } = found?;
        let limit = match limited {
            LimitedQuantity::Position if value <= most => limits.position_min,
            _ => most,
        };
        let cause = match limited {
            _ if samples <= self.limit_check.glitch_samples => Cause::Glitch,
            LimitedQuantity::Torque if times > self.limit_check.other_unit => Cause::TorqueUnit,
            LimitedQuantity::Torque => Cause::Gain,
            _ => match self.wrap_time(joint, joint_of_chain.kind) {
                Some(time_s) => Cause::Wrap { time_s },
                None if limited == LimitedQuantity::Position
                    && let Some(turns) = whole_turns(position, &joint_of_chain) =>
                {
                    Cause::Turns { turns }
                }
                None if times > self.limit_check.other_unit => Cause::PositionUnit,
                None => Cause::Axis,
            },
        };
        let (joint, time_s, kind) =
            (JointIndex::new(joint), self.time_s(sample), joint_of_chain.kind);
        Some(LimitExcess {
            joint_label: robot.joint_label(joint),
            joint,
            quantity: limited,
            time_s,
            value,
            limit,
            limit_ratio: times,
            samples,
            cause,
            kind,
        })
    }

    /// Returns the speed from position differences over a few samples to either side.
    fn speed(&self, joint: usize) -> Vec<f64> {
        let position = &self.position[joint];
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few samples"
        )]
        let half = ((self.limit_check.half_step_s / self.period_s).round() as usize).max(1);
        let last = position.len().saturating_sub(1);
        let speed_at = |k: usize| {
            let (before, after) = (k.saturating_sub(half), (k + half).min(last));
            #[expect(clippy::cast_precision_loss, reason = "a few samples")]
            let time_s = (after - before).max(1) as f64 * self.period_s;
            (position[after] - position[before]) / time_s
        };
        (0..position.len()).map(speed_at).collect()
    }

    /// Returns the time at which a position first jumps by nearly a turn between two samples.
    fn wrap_time(&self, joint: usize, kind: JointKind) -> Option<f64> {
        let turn = core::f64::consts::TAU;
        let is_turn = |pair: &[f64]| ((pair[1] - pair[0]).abs() / turn - 1.0).abs() < 0.05;
        let jump = self.position[joint].windows(2).position(is_turn)?;
        (kind == JointKind::Revolute).then(|| self.time_s(jump + 1))
    }
}

/// The largest of values that are beyond a limit, and the number of them.
struct Excess {
    sample: usize,
    value: f64,
    /// Ratio to the limit.
    times: f64,
    samples: usize,
}

/// Returns the largest value, by its ratio to the limit, and how many ratios are above
/// `note_multiple`; `None` if none is.
fn largest_excess(
    values: &[f64],
    note_multiple: f64,
    ratio: impl Fn(f64) -> f64,
) -> Option<Excess> {
    let mut largest: Option<Excess> = None;
    for (sample, &value) in values.iter().enumerate() {
        let times = ratio(value);
        if times > note_multiple {
            let samples = largest.as_ref().map_or(0, |before| before.samples) + 1;
            largest = match largest {
                Some(before) if before.times > times => Some(Excess { samples, ..before }),
                _ => Some(Excess { sample, value, times, samples }),
            };
        }
    }
    largest
}

/// Returns the number of whole turns by which a revolute joint's positions are off, if they are
/// within its limits without them.
fn whole_turns(position: &[f64], joint: &Joint) -> Option<f64> {
    let turn = core::f64::consts::TAU;
    let Limits { position_min, position_max, .. } = joint.limits;
    let sum: f64 = position.iter().sum();
    #[expect(clippy::cast_precision_loss, reason = "samples are far fewer than 2^52")]
    let mean = sum / position.len() as f64;
    let turns = ((mean - 0.5 * (position_min + position_max)) / turn).round();
    let fits = |value: &f64| (position_min..=position_max).contains(&(value - turns * turn));
    let is_off = joint.kind == JointKind::Revolute && turns != 0.0;
    (is_off && position.iter().all(fits)).then_some(turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_turn_is_no_plural() {
        let text = |turns: f64| {
            LimitExcess {
                joint: JointIndex::new(0),
                joint_label: "1".to_owned(),
                quantity: LimitedQuantity::Position,
                time_s: 1.0,
                value: 7.0,
                limit: 3.0,
                limit_ratio: 2.3,
                samples: 5,
                cause: Cause::Turns { turns },
                kind: JointKind::Revolute,
            }
            .to_string()
        };
        assert!(text(1.0).contains("after 1 turn (6.28319 rad) less"), "{}", text(1.0));
        assert!(text(-1.0).contains("after -1 turn ("), "{}", text(-1.0));
        assert!(text(2.0).contains("after 2 turns ("), "{}", text(2.0));
    }
}
