//! Nuisance parameters of an arm, and the prior size of each.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BaseAxis, NuisanceParameter};
use crate::identification::observation::{AuxiliaryObservation, Motion};
use crate::identification::problem::Context;
use crate::regression::Observations;
use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::{
    Angle, Joint, JointIndex, JointKind, MotorIndex, ParameterKind, Robot, SignModel,
};

/// Speeds at which the additional friction laws bend, as shares of the highest speed of the record.
const BEND_SPEEDS: [f64; 3] = [0.003, 0.02, 0.1];

/// Prior deviation of friction at each bend, as a share of Coulomb friction.
const BEND_SHARE: f64 = 0.5;

/// Alternative presliding distances of friction hysteresis, as multiples of the configured one.
pub(super) const PRESLIDING_FACTORS: [f64; 2] = [0.5, 2.0];

/// Prior relative deviation of viscous friction at the highest speed.
const CURVATURE_SHARE: f64 = 0.2;

/// Prior size of a neighbour's effect on a joint, as a share of the effect of the joint's own
/// motion.
const COUPLING_SHARE: f64 = 0.5;

/// Prior Coulomb friction of a joint whose model has none, as a share of the joint's torque.
const UNMODELLED_FRICTION: f64 = 0.1;

/// Prior torque that depends on a joint's position, as a share of the joint's torque.
const POSITION_TORQUE_SHARE: f64 = 0.01;

/// Prior size of each unselected parameter, as a share of a joint's torque.
const LEFT_OUT_SHARE: f64 = 0.02;

/// Smallest share of an unselected parameter that is not ignored, relative to the largest share.
const MIN_SPEED_SHARE: f64 = 1e-6;

/// Largest ratio of two highest speeds that have friction laws of the same shape.
const SPEED_RATIO_TOLERANCE: f64 = 1.5;

/// Step of the finite differences over geometry \[rad and m\]. Their relative error is of the same
/// order.
pub(super) const GEOMETRY_STEP: f64 = 1e-6;

/// One column: the torque of a nuisance parameter over the motion.
pub(super) struct Column {
    pub(super) nuisance: NuisanceParameter,
    /// Prior standard deviation, in the unit of the column's coefficient.
    pub(super) deviation: f64,
    pub(super) effect: NuisanceEffect,
}

/// Origin of a column's torque. Joints are counted from 0.
pub(super) enum NuisanceEffect {
    /// tanh(u/w) minus the model's own sign function, with u the speed along a direction.
    Bend { direction: usize, bend: usize },
    /// |u| u divided by the highest speed.
    Curvature { direction: usize },
    /// Change of a joint's hysteresis state z with another presliding distance than the configured
    /// one. `number` counts the pairs of a joint with hysteresis and one of [`PRESLIDING_FACTORS`],
    /// joint by joint.
    PreslidingDistance { joint: usize, number: usize },
    /// Torque on joint `row` due to the motion of joint `of`.
    Neighbour { row: usize, of: usize, by: CouplingKind },
    /// The predicted torque of one joint, or of all.
    Gain(Option<usize>),
    /// Time derivative of a joint's predicted torque.
    Delay(usize),
    /// Change of the predicted torques with a joint's position, divided by the step.
    Zero(usize),
    /// Change of the predicted torques with the scale of a joint's position, divided by the step.
    Scale(usize),
    /// Position of a joint, scaled from −1 to 1 over the joint's limits.
    OverRange(usize),
    /// Change of the predicted torques with another geometry, divided by the step.
    Geometry(Box<Model>),
    /// Known torque on a joint. With `over_range` it is multiplied by the joint's position, scaled
    /// from −1 to 1 over the joint's limits.
    KnownTorque { joint: usize, over_range: bool },
    /// Column of an unselected base parameter, by its number among the unselected ones.
    LeftOut(usize),
}

/// Quantity of a neighbour's motion that acts on a joint.
#[derive(Clone, Copy)]
pub(super) enum CouplingKind {
    Speed,
    Sign,
    Acceleration,
}

/// Direction of a joint's own motion or of a coupled motor's motion.
pub(super) struct Direction {
    /// Share of each joint's speed in the speed along the direction; also the share of the
    /// direction's friction that acts on each joint.
    pub(super) joint_shares: Vec<f64>,
    /// Highest speed along the direction during the motion.
    pub(super) highest_speed: f64,
    /// Sign function of the model.
    pub(super) sign: SignModel,
    nuisance: NuisanceParameter,
    coulomb: f64,
    viscous: f64,
}

impl Direction {
    /// Returns the inverse of the width w of a bend.
    pub(super) fn scale(&self, bend: usize) -> f64 {
        1.0 / (BEND_SPEEDS[bend] * self.highest_speed)
    }
}

/// Properties of a record that determine the list of nuisance parameters and their prior sizes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(in super::super) struct Observed {
    /// Root mean square of the measured torque of each joint \[N·m or N\].
    pub(super) torque_nm: Vec<f64>,
    /// Highest speed along each direction \[rad/s or m/s\].
    highest_speed: Vec<f64>,
    /// Largest share of a joint's torque that a unit of each unselected parameter contributes.
    left_out_shares: Vec<f64>,
}

impl Observed {
    pub(in super::super) fn new(
        context: &Context<'_>,
        motion: &Motion,
        auxiliary: &AuxiliaryObservation,
        observations: &Observations,
    ) -> Self {
        let torque_nm = observations.rms_per_joint(&observations.measured_values());
        let count = observations.rows_per_joint() as f64;
        let left_out_shares = (0..auxiliary.left_out.ncols())
            .map(|column: usize| {
                torque_nm
                    .iter()
                    .enumerate()
                    .map(|(joint, torque): (usize, &f64)| {
                        let own_column =
                            auxiliary.left_out.column_of(joint, column).unwrap_or_default();
                        let square: f64 = own_column.iter().map(|value| value * value).sum();
                        (square / count).sqrt() / torque
                    })
                    .fold(0.0, f64::max)
            })
            .collect();
        let highest = |(_, shares): (MovingPart, Vec<f64>)| {
            highest_speed(motion, context.experiment.counted_samples(), &shares)
        };
        let highest_speed = speed_shares(context.robot).map(highest).collect();
        Self { torque_nm, highest_speed, left_out_shares }
    }

    /// Returns true if another record has the same nuisance parameters. The shapes of friction
    /// depend on the highest speeds.
    pub(in super::super) fn is_like(&self, other: &Self) -> bool {
        let alike =
            |(one, other): (&f64, &f64)| one.max(*other) <= SPEED_RATIO_TOLERANCE * one.min(*other);
        let acts = |of: &Self| -> Vec<bool> {
            let least = of.least_share();
            of.left_out_shares.iter().map(|share| *share > least).collect()
        };
        self.highest_speed.len() == other.highest_speed.len()
            && self.highest_speed.iter().zip(&other.highest_speed).all(alike)
            && acts(self) == acts(other)
    }

    /// Returns the smallest share of an unselected parameter that is considered. The size of a
    /// parameter without effect along this motion would be unlimited.
    fn least_share(&self) -> f64 {
        MIN_SPEED_SHARE * self.left_out_shares.iter().copied().fold(0.0, f64::max)
    }

    /// Returns true if the record belongs to this robot and these parameters.
    pub(in super::super) fn belongs_to(&self, context: &Context<'_>) -> bool {
        let (robot, base) = (context.robot, context.base.columns().len());
        self.torque_nm.len() == robot.joints()
            && self.highest_speed.len() == speed_shares(robot).count()
            && self.left_out_shares.len() == base - context.selection.columns().len()
    }
}

/// Prior sizes of each joint's own effects, from the estimate or, if there is none, from nominal
/// values.
pub(super) struct PriorSizes<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) parameters: &'a DVector<f64>,
    pub(super) observed: &'a Observed,
}

impl PriorSizes<'_> {
    fn parameter_value(&self, kind: ParameterKind, joint: usize) -> Option<f64> {
        let column = self.context.robot.parameters().column(kind, JointIndex::new(joint))?;
        let index = self.context.selection.columns().iter().position(|own| *own == column)?;
        Some(self.parameters[index].abs())
    }

    /// Returns the Coulomb friction of a joint at the start of motion \[N·m or N\].
    fn coulomb_friction(&self, joint: usize) -> f64 {
        let coulomb = self.parameter_value(ParameterKind::Fc, joint);
        let coulomb = coulomb.unwrap_or(UNMODELLED_FRICTION * self.observed.torque_nm[joint]);
        let by_load = self.parameter_value(ParameterKind::FcLoad, joint).unwrap_or_default();
        let by_load = by_load * self.observed.torque_nm[joint];
        let others =
            [ParameterKind::Fs, ParameterKind::Fh].map(|kind| self.parameter_value(kind, joint));
        coulomb + by_load + others.into_iter().flatten().sum::<f64>()
    }

    /// Returns the viscous friction of a joint at its highest speed, divided by that speed
    /// \[N·m·s/rad or N·s/m\]. It is the sum over all viscous friction laws of the joint.
    fn viscous_friction(&self, joint: usize) -> f64 {
        use ParameterKind::{Fv, FvAsymmetric, FvCubic, FvQuadratic};

        let highest = self.observed.highest_speed[joint];
        let at_highest = [Fv, FvAsymmetric, FvQuadratic, FvCubic].into_iter().zip([0, 0, 1, 2]);
        let viscous = at_highest.map(|(kind, power)| {
            self.parameter_value(kind, joint).unwrap_or_default() * highest.powi(power)
        });
        viscous.sum()
    }

    /// Returns the directions along which the arm moves.
    pub(super) fn motion_directions(&self) -> Vec<Direction> {
        let speeds = speed_shares(self.context.robot).zip(&self.observed.highest_speed);
        let moving = speeds.filter(|(_, highest)| **highest > 0.0);
        moving
            .map(|((of, shares), highest): ((MovingPart, Vec<f64>), &f64)| {
                let (nuisance, coulomb, viscous) = match of {
                    MovingPart::Motor(motor) => {
                        let value = |kind| self.parameter_value(kind, motor).unwrap_or_default();
                        let friction = [ParameterKind::FcMotor, ParameterKind::FvMotor].map(value);
                        (
                            NuisanceParameter::MotorFriction(MotorIndex::new(motor)),
                            friction[0],
                            friction[1],
                        )
                    }
                    MovingPart::Joint(joint) => {
                        let nuisance = NuisanceParameter::JointFriction(JointIndex::new(joint));
                        (nuisance, self.coulomb_friction(joint), self.viscous_friction(joint))
                    }
                };
                let (MovingPart::Joint(index) | MovingPart::Motor(index)) = of;
                let sign = self.context.robot.sign_model(index);
                Direction {
                    joint_shares: shares,
                    highest_speed: *highest,
                    sign,
                    nuisance,
                    coulomb,
                    viscous,
                }
            })
            .collect()
    }

    /// Returns true if a parameter of a motor that is geared to both joints describes this
    /// coupling.
    fn is_modelled(&self, by: CouplingKind, joints: [usize; 2]) -> bool {
        let kind = match by {
            CouplingKind::Speed => ParameterKind::FvMotor,
            CouplingKind::Sign => ParameterKind::FcMotor,
            CouplingKind::Acceleration => ParameterKind::Ia,
        };
        let transmission = self.context.robot.transmission();
        let is_geared =
            |motor: usize| joints.iter().all(|joint| transmission.direction(motor)[*joint] != 0.0);
        (0..self.context.robot.joints())
            .any(|motor| is_geared(motor) && self.parameter_value(kind, motor).is_some())
    }

    /// Returns the columns of the couplings of neighbouring joints.
    fn coupling_columns(&self) -> Vec<Column> {
        let joints = self.context.robot.joints();
        let mut columns = Vec::new();
        for row in 0..joints {
            for of in [row.checked_sub(1), Some(row + 1).filter(|next| *next < joints)] {
                let Some(of) = of else { continue };
                let [joint, neighbour] = [row, of].map(JointIndex::new);
                let nuisance = NuisanceParameter::Coupling { joint, neighbour };
                let value = |kind| self.parameter_value(kind, row).unwrap_or_default();
                let sizes = [
                    (CouplingKind::Speed, self.viscous_friction(row)),
                    (CouplingKind::Sign, value(ParameterKind::Fc)),
                    (CouplingKind::Acceleration, value(ParameterKind::Ia)),
                ];
                let sizes = sizes.into_iter().filter(|(by, _)| !self.is_modelled(*by, [row, of]));
                for (by, size) in sizes {
                    columns.push(Column {
                        nuisance,
                        deviation: COUPLING_SHARE * size,
                        effect: NuisanceEffect::Neighbour { row, of, by },
                    });
                }
            }
        }
        columns
    }

    /// Returns the columns of each joint's position scale, and of a torque that depends on its
    /// position.
    fn position_columns(&self) -> Vec<Column> {
        let tolerance = self.context.options.tolerances.position_scale;
        let mut columns = Vec::new();
        for (joint, limits) in self.context.robot.limits().enumerate() {
            let index = JointIndex::new(joint);
            columns.push(Column {
                nuisance: NuisanceParameter::PositionScale(index),
                deviation: tolerance,
                effect: NuisanceEffect::Scale(joint),
            });
            if (limits.position_max - limits.position_min).is_finite() {
                columns.push(Column {
                    nuisance: NuisanceParameter::PositionTorque(index),
                    deviation: POSITION_TORQUE_SHARE * self.observed.torque_nm[joint],
                    effect: NuisanceEffect::OverRange(joint),
                });
            }
        }
        columns
    }

    /// Returns all columns.
    pub(super) fn columns(&self, directions: &[Direction]) -> Vec<Column> {
        let context = self.context;
        let (joints, tolerances) = (context.robot.joints(), &context.options.tolerances);
        let mut columns = Vec::new();
        let mut add = |nuisance, deviation: f64, effect| {
            columns.push(Column { nuisance, deviation, effect });
        };
        for (index, direction) in directions.iter().enumerate() {
            for bend in 0..BEND_SPEEDS.len() {
                let acts = NuisanceEffect::Bend { direction: index, bend };
                add(direction.nuisance, BEND_SHARE * direction.coulomb, acts);
            }
            let acts = NuisanceEffect::Curvature { direction: index };
            add(direction.nuisance, CURVATURE_SHARE * direction.viscous, acts);
        }
        for (number, (joint, _)) in context.model.hysteresis().enumerate() {
            let hysteresis = self.parameter_value(ParameterKind::Fh, joint);
            let size = BEND_SHARE * hysteresis.unwrap_or_default();
            for factor_index in 0..PRESLIDING_FACTORS.len() {
                let number = PRESLIDING_FACTORS.len() * number + factor_index;
                let acts = NuisanceEffect::PreslidingDistance { joint, number };
                add(NuisanceParameter::JointFriction(JointIndex::new(joint)), size, acts);
            }
        }
        for Column { nuisance, deviation, effect } in self.coupling_columns() {
            add(nuisance, deviation, effect);
        }
        add(NuisanceParameter::CommonGain, tolerances.torque_gain, NuisanceEffect::Gain(None));
        for joint in 0..joints {
            let index = JointIndex::new(joint);
            let (gain, delay) = (NuisanceEffect::Gain(Some(joint)), NuisanceEffect::Delay(joint));
            add(NuisanceParameter::TorqueGain(index), tolerances.torque_gain, gain);
            add(NuisanceParameter::TorqueDelay(index), tolerances.torque_delay_s, delay);
            if context.robot.known_torques()[joint].is_some() {
                for over_range in [false, true] {
                    let acts = NuisanceEffect::KnownTorque { joint, over_range };
                    add(NuisanceParameter::KnownTorque(index), tolerances.known_torque, acts);
                }
            }
            let link = context.model.chain()[joint];
            let turns = link.kind == JointKind::Revolute;
            let zero = if turns { tolerances.zero_deg.to_radians() } else { tolerances.length_m };
            add(NuisanceParameter::Zero(index), zero, NuisanceEffect::Zero(joint));
            let geometry = |other| {
                NuisanceEffect::Geometry(Box::new(context.model.clone().with_joint(joint, other)))
            };
            let twist = geometry(Joint { alpha: rotate_angle(link.alpha, GEOMETRY_STEP), ..link });
            add(NuisanceParameter::Twist(index), tolerances.twist_deg.to_radians(), twist);
            let distance = geometry(Joint { d_m: link.d_m + GEOMETRY_STEP, ..link });
            add(NuisanceParameter::Distance(index), tolerances.length_m, distance);
            // The offset along a prismatic joint is the zero position of the joint.
            if turns {
                let offset = geometry(Joint { r_m: link.r_m + GEOMETRY_STEP, ..link });
                add(NuisanceParameter::Offset(index), tolerances.length_m, offset);
            }
        }
        let left_out = &self.observed.left_out_shares;
        let least = self.observed.least_share();
        for (index, share) in left_out.iter().enumerate().filter(|(_, share)| **share > least) {
            add(
                NuisanceParameter::LeftOutParameters,
                LEFT_OUT_SHARE / share,
                NuisanceEffect::LeftOut(index),
            );
        }
        // Last, because results of earlier versions do not have them, or only the mounting.
        for (axis, leaning) in mountings(&context.model) {
            let acts = NuisanceEffect::Geometry(Box::new(leaning));
            add(NuisanceParameter::Mounting(axis), tolerances.mounting_deg.to_radians(), acts);
        }
        columns.extend(self.position_columns());
        columns
    }
}

/// Returns the model with gravity turned by [`GEOMETRY_STEP`] about each axis of the base, but for
/// the axis that is nearest to gravity.
fn mountings(model: &Model) -> impl Iterator<Item = (BaseAxis, Model)> {
    let gravity_m_s2 = model.gravity_m_s2();
    let along = |axis: &BaseAxis| gravity_m_s2[*axis as usize].abs();
    let nearest = BaseAxis::ALL.into_iter().max_by(|a, b| along(a).total_cmp(&along(b)));
    let acts = gravity_m_s2.iter().any(|of| *of != 0.0);
    let axes = BaseAxis::ALL.into_iter().filter(move |axis| acts && Some(*axis) != nearest);
    axes.map(move |axis| (axis, model.clone().with_gravity(axis.turn(gravity_m_s2, GEOMETRY_STEP))))
}

fn rotate_angle(angle: Angle, by: f64) -> Angle {
    let (sin, cos) = by.sin_cos();
    Angle { cos: angle.cos * cos - angle.sin * sin, sin: angle.sin * cos + angle.cos * sin }
}

/// Moving part whose speed defines a direction, counted from 0.
#[derive(Clone, Copy)]
enum MovingPart {
    Joint(usize),
    Motor(usize),
}

/// Returns the directions along which friction may act: every joint, and every motor that is geared
/// to several joints. Each has the share of each joint's speed.
fn speed_shares(robot: &Robot) -> impl Iterator<Item = (MovingPart, Vec<f64>)> + '_ {
    let (joints, transmission) = (robot.joints(), robot.transmission());
    let coupled = (0..joints).filter(|&motor| transmission.is_coupled(motor));
    let of_motor =
        move |motor| (MovingPart::Motor(motor), transmission.direction(motor)[..joints].to_vec());
    (0..joints)
        .map(move |joint| {
            let shares = (0..joints).map(|j| if j == joint { 1.0 } else { 0.0 }).collect();
            (MovingPart::Joint(joint), shares)
        })
        .chain(coupled.map(of_motor))
}

/// Returns the highest speed along a direction.
fn highest_speed(motion: &Motion, counted: impl Iterator<Item = usize>, shares: &[f64]) -> f64 {
    let speed = |k: usize| -> f64 {
        let joints = shares.iter().enumerate().filter(|(_, share)| **share != 0.0);
        joints.map(|(joint, share)| motion.velocity(k, joint) * share).sum()
    };
    counted.map(|k| speed(k).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use didim_dynamics::robot::Robot;

    /// The axes perpendicular to gravity, and no other.
    #[test]
    fn a_base_leans_about_two_axes() {
        let robot =
            Robot::from_toml(include_str!("../../../../../../config/robots/tx40.toml")).unwrap();
        for (nearest, others) in [(0, [1, 2]), (1, [0, 2]), (2, [0, 1])] {
            let mut gravity_m_s2 = [0.3, 0.2, 0.1];
            gravity_m_s2[nearest] = -9.8;
            let model = Model::new(&robot).with_gravity(gravity_m_s2);
            let axes: Vec<usize> = mountings(&model).map(|(axis, _)| axis as usize).collect();
            assert_eq!(axes, others);
            for (_, leaning) in mountings(&model) {
                let length = |of: [f64; 3]| of.iter().map(|of| of * of).sum::<f64>().sqrt();
                let change: [f64; 3] =
                    core::array::from_fn(|k| leaning.gravity_m_s2()[k] - gravity_m_s2[k]);
                let angle_rad = length(change) / length(gravity_m_s2);
                assert!((angle_rad / GEOMETRY_STEP - 1.0).abs() < 1e-2, "{angle_rad}");
            }
        }
        assert_eq!(mountings(&Model::new(&robot).with_gravity([0.0; 3])).count(), 0);
    }
}
