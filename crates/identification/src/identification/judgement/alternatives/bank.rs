//! List of the alternatives that are compared.

use didim_dynamics::robot::{JointIndex, MotorIndex, Robot};

use super::alternative::{Alternative, Lag, Signal};
use super::chosen::Chosen;
use super::lean::cosine;
use crate::identification::problem::Context;

/// Smallest range of a motor whose signals can be tested \[rad or m\]. The signals of a motor at
/// rest fit with any sign.
const MIN_RANGE: f64 = 0.01;

/// Longest lag of a signal \[s\]. A lag of a quarter of a second is longer than any that a drive or
/// a logger was reported to have.
const LONGEST_LAG_S: f64 = 0.25;

/// Shortest lag that is tried, as a share of the time between rows. It is the end of the range, so
/// that lags from twice this one on are named.
const SHORTEST_LAG: f64 = 0.125;

/// Ratio of successive lags. The best one is refined afterwards.
const LAG_STEP: f64 = 2.0;

/// Factors of positions that are tried: the usual mistake is a factor of 2. Gear ratios and counts
/// that are wrong by more also violate the limits of the joints.
const SCALES: [f64; 8] = [0.35, 0.5, 0.75, 0.9, 1.1, 1.3, 2.0, 2.8];

/// Factors of torques that are tried: a few tenths off, and wrong units up to a thousand.
const TORQUE_SCALES: [f64; 14] = [
    1.0 / 1024.0,
    1.0 / 256.0,
    1.0 / 64.0,
    1.0 / 16.0,
    0.25,
    0.5,
    0.7,
    1.4,
    2.0,
    4.0,
    16.0,
    64.0,
    256.0,
    1024.0,
];

/// Alternatives with the same meaning, and the numbers that are tried.
pub(super) struct Group {
    pub(super) alternative: Alternative,
    /// Numbers in ascending order; empty without one.
    pub(super) constants: Vec<f64>,
}

impl Group {
    fn new(alternative: Alternative, constants: &[f64]) -> Self {
        Self { alternative, constants: constants.to_vec() }
    }
}

/// Returns the alternatives for an arm. `ranges` are those of the motors \[rad or m\].
pub(super) fn bank(context: &Context<'_>, ranges: &[f64]) -> Vec<Group> {
    let is_tested = |motor: &usize| ranges[*motor] > MIN_RANGE && context.has_motor_torque(*motor);
    let motors: Vec<MotorIndex> =
        (0..ranges.len()).filter(is_tested).map(MotorIndex::new).collect();
    let mut groups = Vec::new();
    let signals = [Signal::Torque, Signal::Position, Signal::Both];
    // Alternatives with the same positions follow each other.
    for (k, motor) in motors.iter().enumerate() {
        for signal in signals {
            groups.push(Group::new(Alternative::OppositeSign { motor: *motor, signal }, &[]));
        }
        for other in &motors[..k] {
            for signal in signals {
                groups.push(Group::new(
                    Alternative::Swapped { motors: [*other, *motor], signal },
                    &[],
                ));
            }
        }
    }
    let lags = lag_times(context);
    for signal in [Signal::Torque, Signal::Position] {
        for motor in core::iter::once(None).chain(motors.iter().copied().map(Some)) {
            for lag in [Lag::LowPass, Lag::Delay] {
                groups.push(Group::new(
                    Alternative::Late { motor, signal, lag, time_s: Chosen::default() },
                    &lags,
                ));
            }
        }
    }
    for motor in &motors {
        let (motor, factor) = (*motor, Chosen::default());
        groups.push(Group::new(Alternative::PositionScale { motor, factor }, &SCALES));
        groups.push(Group::new(Alternative::TorqueScale { motor, factor }, &TORQUE_SCALES));
    }
    groups.extend(couplings(context.robot, &motors));
    let without_inertia =
        motors.iter().filter(|motor| !context.robot.chain()[motor.position()].drive_inertia);
    groups.extend(without_inertia.map(|motor| {
        let joint = JointIndex::new(motor.position());
        Group::new(Alternative::DriveInertia { joint }, &[])
    }));
    groups.push(Group::new(Alternative::NoGravity, &[]));
    for gravity_m_s2 in other_directions(context.robot.gravity_m_s2()) {
        groups.push(Group::new(Alternative::Gravity { gravity_m_s2 }, &[]));
    }
    groups
}

/// Returns other values of the configured couplings: of the other sign, another size, or none.
/// Couplings that are not configured are left out, because friction of a wrist looks like one.
fn couplings(robot: &Robot, motors: &[MotorIndex]) -> Vec<Group> {
    let mut groups = Vec::new();
    for motor in motors {
        let row = robot.transmission().row(motor.position());
        for (joint, &configured) in (0..row.len()).map(JointIndex::new).zip(row) {
            if configured == 0.0 || joint.position() == motor.position() {
                continue;
            }
            let coupling =
                |entry, factor| Alternative::Coupling { motor: *motor, joint, entry, factor };
            groups.extend([-configured, 0.0].map(|entry| Group::new(coupling(entry, None), &[])));
            groups.push(Group::new(coupling(configured, Some(Chosen::default())), &SCALES));
        }
    }
    groups
}

/// Returns the lags that are tried \[s\].
pub(super) fn lag_times(context: &Context<'_>) -> Vec<f64> {
    lag_times_from(SHORTEST_LAG / context.rows_hz())
}

fn lag_times_from(shortest_s: f64) -> Vec<f64> {
    let longer = |before: &f64| Some(before * LAG_STEP);
    let shorter = core::iter::successors(Some(shortest_s), longer);
    shorter.take_while(|of| *of < LONGEST_LAG_S).chain([LONGEST_LAG_S]).collect()
}

/// Returns gravity of the same size along every axis of the base, in both senses, except the
/// configured direction.
fn other_directions(configured: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let size = configured.iter().map(|own| own * own).sum::<f64>().sqrt();
    let all = (0..3).flat_map(move |axis| [along(axis, size), along(axis, -size)]);
    // A nearly equal direction is no other direction.
    all.filter(move |other| cosine(configured, *other) < 0.9)
}

/// Returns a vector along an axis.
fn along(axis: usize, size: f64) -> [f64; 3] {
    core::array::from_fn(|k| if k == axis { size } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lag_times_are_dense_and_reach_the_longest() {
        let lags = lag_times_from(0.001);
        assert_eq!((lags[0], lags[lags.len() - 1]), (0.001, LONGEST_LAG_S));
        let is_dense = |pair: &[f64]| pair[1] > pair[0] && pair[1] <= LAG_STEP * pair[0];
        assert!(lags.windows(2).all(is_dense), "{lags:?}");
    }
}
