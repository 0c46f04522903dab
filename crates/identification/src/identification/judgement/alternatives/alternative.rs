//! Alternative readings of the signals and of the arm.

use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::{JointIndex, MotorIndex, Robot, Transmission};
use nalgebra::DMatrix;

use super::chosen::Chosen;
use super::lean::{Lean, cosine};
use super::refit::{Refit, Shared};
use crate::identification::problem::{Experiment, change_motor_positions, change_motor_torques};

/// Signal of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Its torque.
    Torque,
    /// Its position.
    Position,
    /// Both.
    Both,
}

impl Signal {
    /// Returns true if this signal is, or includes, another one.
    fn includes(self, other: Self) -> bool {
        self == other || self == Self::Both
    }
}

/// Cause of a late signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lag {
    /// A first-order low-pass with this time constant.
    LowPass,
    /// A delay.
    Delay,
}

/// Another reading of the signals, or of the arm, than the configured one.
#[derive(Clone, Debug, PartialEq)]
pub enum Alternative {
    /// A signal of a motor has the opposite sign.
    OppositeSign {
        /// The motor.
        motor: MotorIndex,
        /// The signal.
        signal: Signal,
    },
    /// The signals of two motors are swapped.
    Swapped {
        /// The motors.
        motors: [MotorIndex; 2],
        /// The signal.
        signal: Signal,
    },
    /// A signal is late.
    Late {
        /// The motor; `None` for all motors.
        motor: Option<MotorIndex>,
        /// The signal.
        signal: Signal,
        /// The cause.
        lag: Lag,
        /// Time constant or delay \[s\].
        time_s: Chosen,
    },
    /// The position of a motor has another scale.
    PositionScale {
        /// The motor.
        motor: MotorIndex,
        /// Factor by which the position has to be multiplied \[1\].
        factor: Chosen,
    },
    /// The torque of a motor has another scale.
    TorqueScale {
        /// The motor.
        motor: MotorIndex,
        /// Factor by which the torque has to be multiplied \[1\].
        factor: Chosen,
    },
    /// A motor turns in another way with another joint than configured.
    Coupling {
        /// The motor.
        motor: MotorIndex,
        /// The joint that it is coupled to.
        joint: JointIndex,
        /// Entry of the transmission \[motor turns per joint turn\]; `factor` is its multiple.
        entry: f64,
        /// Factor that the data choose, above 0 \[1\]; `None` for the entry itself.
        factor: Option<Chosen>,
    },
    /// The inertia of a joint's drive is missing in the model.
    DriveInertia {
        /// The joint.
        joint: JointIndex,
    },
    /// The torques do not contain gravity, because the controller removed it.
    NoGravity,
    /// Gravity acts along another axis of the base.
    Gravity {
        /// The gravity \[m/s²\].
        gravity_m_s2: [f64; 3],
    },
    /// Gravity is turned by an angle that the data choose: the base leans.
    Leaning(Lean),
}

impl Alternative {
    /// Returns the motors whose signals change; empty for all of them, and for gravity.
    pub fn motors(&self) -> Vec<MotorIndex> {
        match self {
            Self::OppositeSign { motor, .. }
            | Self::PositionScale { motor, .. }
            | Self::TorqueScale { motor, .. } => vec![*motor],
            Self::Swapped { motors, .. } => motors.to_vec(),
            Self::Late { motor, .. } => motor.iter().copied().collect(),
            Self::Coupling { motor, .. } => vec![*motor],
            Self::DriveInertia { joint } => vec![MotorIndex::new(joint.position())],
            Self::NoGravity | Self::Gravity { .. } | Self::Leaning(_) => Vec::new(),
        }
    }

    /// Returns true for readings that data often cannot distinguish.
    pub(super) fn is_related(&self, other: &Self) -> bool {
        let inverts_coupled = |one: &Self, other: &Self| {
            let (Self::Coupling { motor, .. }, Self::OppositeSign { motor: of_other, .. }) =
                (one, other)
            else {
                return false;
            };
            motor == of_other
        };
        self.is_same_kind(other) || inverts_coupled(self, other) || inverts_coupled(other, self)
    }

    /// Returns true for readings of one kind, of which the better represents both.
    fn is_same_kind(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::OppositeSign { motor, .. }, Self::OppositeSign { motor: of_other, .. })
            | (Self::PositionScale { motor, .. }, Self::PositionScale { motor: of_other, .. })
            | (Self::TorqueScale { motor, .. }, Self::TorqueScale { motor: of_other, .. }) => {
                motor == of_other
            }
            (Self::Swapped { motors, .. }, Self::Swapped { motors: of_other, .. }) => {
                motors == of_other
            }
            (
                Self::Late { motor, signal, .. },
                Self::Late { motor: of_other, signal: other, .. },
            ) => {
                let overlap = motor == of_other || motor.is_none() || of_other.is_none();
                overlap && signal == other
            }
            (
                Self::Coupling { motor, joint, .. },
                Self::Coupling { motor: of_other, joint: other, .. },
            ) => motor == of_other && joint == other,
            // Gravity along the axes of all joints acts like none.
            _ => self.has_other_gravity() && other.has_other_gravity(),
        }
    }

    /// Returns true if gravity differs from the configured one.
    fn has_other_gravity(&self) -> bool {
        self.gravity_m_s2().is_some()
    }

    /// Returns true for related readings of the same motors. Opposite directions of gravity fit
    /// nearly alike at a few rows, where the other first moments explain what it explains.
    pub(super) fn is_variant(&self, other: &Self) -> bool {
        let is_opposite = match (self.gravity_m_s2(), other.gravity_m_s2()) {
            (Some(one), Some(other)) => cosine(one, other) < 0.0,
            _ => false,
        };
        self.is_same_kind(other) && self.motors() == other.motors() && !is_opposite
    }

    /// Returns true if the friction of a drive may have the other sign with this reading.
    pub(super) fn may_turn_friction(&self) -> bool {
        matches!(self, Self::OppositeSign { .. } | Self::Swapped { .. })
    }

    /// Returns true if motion and counted samples are as they are configured. A delay leaves
    /// samples out.
    fn keeps_motion(&self) -> bool {
        match self {
            Self::NoGravity | Self::Gravity { .. } | Self::Leaning(_) => true,
            Self::OppositeSign { signal, .. }
            | Self::Swapped { signal, .. }
            | Self::Late { signal, lag: Lag::LowPass, .. } => *signal == Signal::Torque,
            Self::TorqueScale { .. } => true,
            Self::DriveInertia { .. } => true,
            Self::Late { lag: Lag::Delay, .. }
            | Self::PositionScale { .. }
            | Self::Coupling { .. } => false,
        }
    }

    /// Returns what its solution has in common with the configured one.
    pub(super) fn shared<'s, 'a>(&self, configured: &'s Refit<'a>) -> Shared<'s, 'a> {
        match (self.keeps_motion(), self.has_other_model()) {
            (true, false) => Shared::Matrix(configured),
            (true, true) => Shared::Motion(configured),
            (false, _) => Shared::Nothing,
        }
    }

    /// Returns gravity in the base \[m/s²\]; `None` as it is configured.
    pub(super) fn gravity_m_s2(&self) -> Option<[f64; 3]> {
        match self {
            Self::NoGravity => Some([0.0; 3]),
            Self::Gravity { gravity_m_s2 } => Some(*gravity_m_s2),
            Self::Leaning(lean) => Some(lean.gravity_m_s2()),
            _ => None,
        }
    }

    /// Returns another arm than the configured one. `None` if only signals or gravity differ, or
    /// if no transmission has this coupling.
    pub(super) fn arm(&self, configured: &Robot) -> Option<Robot> {
        match self {
            Self::Coupling { motor, joint, .. } => {
                let entry = self.coupling().map_or(0.0, |entry| entry.value);
                let transmission = configured.transmission();
                let other = transmission.with_entry(motor.position(), joint.position(), entry);
                Some(configured.clone().with_transmission(other.ok()?))
            }
            Self::DriveInertia { joint } => Some(configured.clone().with_drive_inertia(*joint)),
            _ => None,
        }
    }

    /// Returns true if the model has other base parameters than the configured one.
    pub(super) fn has_other_model(&self) -> bool {
        matches!(
            self,
            Self::Coupling { .. }
                | Self::DriveInertia { .. }
                | Self::NoGravity
                | Self::Gravity { .. }
                | Self::Leaning(_)
        )
    }

    /// Returns the number that the data choose, if there is one.
    pub(super) fn constant(&self) -> Option<Chosen> {
        match self {
            Self::Late { time_s, .. } => Some(*time_s),
            Self::PositionScale { factor, .. } | Self::TorqueScale { factor, .. } => Some(*factor),
            Self::Coupling { factor, .. } => *factor,
            Self::Leaning(lean) => Some(lean.angle_rad),
            _ => None,
        }
    }

    /// Returns gravity along an axis of the base in place of a direction that the data cannot tell
    /// from it.
    pub(super) fn simplified(self) -> Self {
        let along = if let Self::Leaning(lean) = &self { lean.near_axis() } else { None };
        along.map_or(self, |gravity_m_s2| Self::Gravity { gravity_m_s2 })
    }

    /// Returns the count of numbers that the data choose.
    pub(super) fn chosen_numbers(&self) -> usize {
        match self {
            // A direction has two.
            Self::Leaning(_) => 2,
            _ => usize::from(self.constant().is_some()),
        }
    }

    /// Returns the entry of the transmission, with its standard deviation. `None` without a
    /// coupling.
    pub(in super::super) fn coupling(&self) -> Option<Chosen> {
        let Self::Coupling { entry, factor, .. } = self else { return None };
        let factor = factor.unwrap_or(Chosen { value: 1.0, standard_deviation: 0.0 });
        Some(Chosen {
            value: entry * factor.value,
            standard_deviation: (entry * factor.standard_deviation).abs(),
        })
    }

    /// Returns the number of configured values that would be wrong.
    pub(super) fn wrong_values(&self) -> usize {
        match self {
            Self::OppositeSign { signal: Signal::Both, .. } => 2,
            _ => 1,
        }
    }

    /// Returns how far a number is from one that changes nothing.
    pub(super) fn departure(&self, value: f64) -> f64 {
        match self {
            Self::Late { .. } => value,
            _ => value.ln().abs(),
        }
    }

    /// Returns the same reading with another number.
    pub(super) fn with_constant(&self, value: f64) -> Self {
        self.with_chosen(Chosen { value, standard_deviation: 0.0 })
    }

    /// Returns the same reading with another number, and its standard deviation.
    pub(super) fn with_chosen(&self, chosen: Chosen) -> Self {
        let mut changed = self.clone();
        match &mut changed {
            Self::Late { time_s: own, .. }
            | Self::PositionScale { factor: own, .. }
            | Self::TorqueScale { factor: own, .. } => *own = chosen,
            Self::Coupling { factor: Some(own), .. } => *own = chosen,
            Self::Leaning(lean) => lean.angle_rad = chosen,
            _ => {}
        }
        changed
    }

    /// Corrects the positions of the motors, or what transforms like them (samples × motors), as
    /// far as no other sample takes part.
    pub(super) fn correct_positions(&self, motors: &mut DMatrix<f64>, configured: &Transmission) {
        match self {
            Self::PositionScale { motor, factor } => {
                motors.column_mut(motor.position()).scale_mut(factor.value);
            }
            // Positions that the configured transmission turns to those of the other one:
            // R R'⁻¹ = 1 − δ e_m wᵀ / (1 + δ w_m), where w is the row of the joint in R⁻¹.
            Self::Coupling { motor, joint, .. } => {
                let (added, row) = (self.added_coupling(configured), joint_row(configured, *joint));
                let motor = motor.position();
                let share = added / (1.0 + added * row[motor]);
                for mut of_sample in motors.row_iter_mut() {
                    let joint: f64 = of_sample.iter().zip(row).map(|(own, of)| own * of).sum();
                    of_sample[motor] -= share * joint;
                }
            }
            _ => {}
        }
        self.correct(Signal::Position, motors);
    }

    /// Returns the difference of the coupling from the configured one.
    fn added_coupling(&self, configured: &Transmission) -> f64 {
        match self {
            Self::Coupling { motor, joint, .. } => {
                let entry = self.coupling().map_or(0.0, |entry| entry.value);
                entry - configured.row(motor.position())[joint.position()]
            }
            _ => 0.0,
        }
    }

    /// Corrects the torques of the motors (samples × motors), as far as no other sample takes part.
    pub(super) fn correct_torques(&self, motors: &mut DMatrix<f64>, configured: &Transmission) {
        match self {
            Self::TorqueScale { motor, factor } => {
                motors.column_mut(motor.position()).scale_mut(factor.value);
            }
            // R⁻ᵀ R'ᵀ = 1 + δ w e_mᵀ.
            Self::Coupling { motor, joint, .. } => {
                let (added, row) = (self.added_coupling(configured), joint_row(configured, *joint));
                for mut of_sample in motors.row_iter_mut() {
                    let torque = added * of_sample[motor.position()];
                    for (own, of) in of_sample.iter_mut().zip(row) {
                        *own += torque * of;
                    }
                }
            }
            _ => {}
        }
        self.correct(Signal::Torque, motors);
    }

    fn correct(&self, of: Signal, motors: &mut DMatrix<f64>) {
        match self {
            Self::OppositeSign { motor, signal } if signal.includes(of) => {
                motors.column_mut(motor.position()).neg_mut();
            }
            Self::Swapped { motors: [one, other], signal } if signal.includes(of) => {
                motors.swap_columns(one.position(), other.position());
            }
            _ => {}
        }
    }

    /// Returns the reading with the same positions that leaves the torques as they are. `None` if
    /// it keeps the positions: a lag of positions alone is compared as one of the torques.
    pub(super) fn of_positions(&self) -> Option<Self> {
        let mut of_positions = self.clone();
        match &mut of_positions {
            Self::OppositeSign { signal, .. } | Self::Swapped { signal, .. } => {
                if *signal == Signal::Torque {
                    return None;
                }
                *signal = Signal::Position;
            }
            Self::PositionScale { .. } => {}
            // Another arm has another model.
            Self::Coupling { .. }
            | Self::DriveInertia { .. }
            | Self::Late { .. }
            | Self::TorqueScale { .. }
            | Self::NoGravity
            | Self::Gravity { .. }
            | Self::Leaning(_) => return None,
        }
        Some(of_positions)
    }

    /// Orders figures of the joints by the torque signals as they are configured. A swap of torques
    /// only moves a residual to another joint.
    pub(super) fn by_configured_torque<T>(&self, mut of_joints: Vec<T>) -> Vec<T> {
        if let Self::Swapped { motors: [one, other], signal: Signal::Torque | Signal::Both } = self
        {
            of_joints.swap(one.position(), other.position());
        }
        of_joints
    }

    /// Returns the weights of the joints for the corrected torques.
    pub(super) fn weights(&self, configured: &[f64]) -> Vec<f64> {
        let mut weights = self.by_configured_torque(configured.to_vec());
        if let Self::TorqueScale { motor, factor } = self {
            weights[motor.position()] /= factor.value.powi(2);
        }
        weights
    }

    /// Returns the motors whose signal `of` is late, out of `count`.
    pub(super) fn late_motors(&self, of: Signal, count: usize) -> Vec<usize> {
        match self {
            Self::Late { motor, signal, .. } if signal.includes(of) => {
                motor.map_or_else(|| (0..count).collect(), |motor| vec![motor.position()])
            }
            _ => Vec::new(),
        }
    }

    /// Returns the experiment with these signals corrected.
    pub(super) fn corrected(&self, logged: &Experiment, transmission: &Transmission) -> Experiment {
        let mut corrected = logged.clone();
        let count = logged.joints();
        let rate_hz = logged.sample_rate_hz();
        let undo = |motors: &mut DMatrix<f64>, of: Signal| {
            let Self::Late { lag, time_s, .. } = self else { return };
            for motor in self.late_motors(of, count) {
                match lag {
                    Lag::LowPass => logged.undo_low_pass(motors.column_mut(motor), time_s.value),
                    Lag::Delay => {
                        logged.undo_delay(motors.column_mut(motor), time_s.value * rate_hz);
                    }
                }
            }
        };
        corrected.change_signals(
            |positions| {
                change_motor_positions(positions, transmission, |motors| {
                    self.correct_positions(motors, transmission);
                    undo(motors, Signal::Position);
                });
            },
            |torques| {
                change_motor_torques(torques, transmission, |motors| {
                    self.correct_torques(motors, transmission);
                    undo(motors, Signal::Torque);
                });
            },
        );
        if let Self::Late { lag: Lag::Delay, time_s, .. } = self {
            corrected.leave_out_delayed(time_s.value * rate_hz);
        }
        corrected
    }
}

/// Returns the row of a joint in R⁻¹: its position per unit of each motor.
fn joint_row(transmission: &Transmission, joint: JointIndex) -> [f64; MAX_JOINTS] {
    let joints = transmission.row(0).len();
    core::array::from_fn(|motor| {
        let (mut of_motors, mut of_joints) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        if motor < joints {
            of_motors[motor] = 1.0;
        }
        transmission.joint_position(&of_motors[..joints], &mut of_joints[..joints]);
        of_joints[joint]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions and torques of three motors, corrected.
    fn corrected(of: &Alternative, logged: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
        let rows = [vec![1.0, 0.0, 0.0], vec![0.0, 1.0, 0.0], vec![0.0, 0.0, 1.0]];
        let coupling = Transmission::new(3, &rows).unwrap();
        let (mut positions, mut torques) = (logged.clone(), logged.clone());
        of.correct_positions(&mut positions, &coupling);
        of.correct_torques(&mut torques, &coupling);
        [positions, torques]
    }

    #[test]
    fn another_scale_changes_the_signals_of_its_motor_alone() {
        let motor = MotorIndex::new(1);
        let logged = DMatrix::from_fn(2, 3, |k, n| 1.0 + (3 * k + n) as f64);
        let factor = Chosen { value: 0.5, standard_deviation: 0.0 };
        let mut halved = logged.clone();
        halved.column_mut(1).scale_mut(0.5);
        let scaled = Alternative::PositionScale { motor, factor };
        assert_eq!(corrected(&scaled, &logged), [halved.clone(), logged.clone()]);
        let scaled = Alternative::TorqueScale { motor, factor };
        assert_eq!(corrected(&scaled, &logged), [logged, halved]);
    }

    #[test]
    fn a_swap_of_torques_takes_the_figures_of_its_joints_along() {
        let motors = [MotorIndex::new(0), MotorIndex::new(2)];
        for (signal, expected) in
            [(Signal::Torque, [3, 2, 1]), (Signal::Both, [3, 2, 1]), (Signal::Position, [1, 2, 3])]
        {
            let swapped = Alternative::Swapped { motors, signal };
            assert_eq!(swapped.by_configured_torque(vec![1, 2, 3]), expected);
        }
    }
}
