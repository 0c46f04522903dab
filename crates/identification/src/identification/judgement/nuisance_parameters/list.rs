//! Nuisance parameters of an arm, and the prior size of each.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::NuisanceParameter;
use crate::identification::observation::{AuxiliaryObservation, Motion};
use crate::identification::problem::Context;
use crate::regression::Observations;
use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::{
    Angle, Joint, JointIndex, JointKind, MotorIndex, ParameterKind, Robot, SignModel,
};

/// Speeds at which the tried friction laws bend, as shares of the highest speed of the window.
const BEND_SPEEDS: [f64; 3] = [0.003, 0.02, 0.1];

/// A friction law may differ by this share of Coulomb friction at each bend.
const BEND_SHARE: f64 = 0.5;

/// Ways over which friction that lags may turn, as shares of the stated one.
pub(super) const PRESLIDING_FACTORS: [f64; 2] = [0.5, 2.0];

/// Viscous friction at the highest speed may be larger or smaller by this share.
const CURVATURE_SHARE: f64 = 0.2;

/// A neighbour may act on a joint with this share of what the joint's own motion does.
const COUPLING_SHARE: f64 = 0.5;

/// A joint without Coulomb friction in its model may have this share of its torque.
const UNMODELLED_FRICTION: f64 = 0.1;

/// Each parameter that is left out may be worth this share of a joint's torque.
const LEFT_OUT_SHARE: f64 = 0.02;

/// Columns with a smaller share of the largest one are ignored.
const MIN_SPEED_SHARE: f64 = 1e-6;

/// Highest speeds within this factor have friction of the same shapes.
const SPEED_RATIO_TOLERANCE: f64 = 1.5;

/// Step of the differences over geometry \[rad and m\]: their error is of this order, relative.
pub(super) const GEOMETRY_STEP: f64 = 1e-6;

/// One column: a torque over the motion.
pub(super) struct Column {
    pub(super) nuisance: NuisanceParameter,
    /// Its standard deviation beforehand, in the unit of the column's coefficient.
    pub(super) deviation: f64,
    pub(super) effect: NuisanceEffect,
}

/// Origin of a column's torque. Joints are counted from 0.
pub(super) enum NuisanceEffect {
    /// tanh(u/w) less the model's own sign function, with u the speed along a direction.
    Bend { direction: usize, bend: usize },
    /// |u| u over the highest speed.
    Curvature { direction: usize },
    /// Change of a joint's hysteresis state z with another presliding distance than the stated one.
    /// `number` counts the pairs of a joint with hysteresis and one of [`PRESLIDING_FACTORS`],
    /// joint by joint.
    PreslidingDistance { joint: usize, number: usize },
    /// On `row`, as a neighbour moves.
    Neighbour { row: usize, of: usize, by: CouplingKind },
    /// The predicted torque of one joint, or of all.
    Gain(Option<usize>),
    /// The rate of a joint's predicted torque.
    Delay(usize),
    /// Change of the predicted torques by a step of a joint's position.
    Zero(usize),
    /// Change of the predicted torques by another geometry, divided by its step.
    Geometry(Box<Model>),
    /// The known torque on a joint, or that times the position within the joint's limits, from −1
    /// to 1.
    KnownTorque { joint: usize, over_range: bool },
    /// The column of a base parameter that is not selected, by its number among these.
    LeftOut(usize),
}

/// The acting quantity of a neighbour's motion.
#[derive(Clone, Copy)]
pub(super) enum CouplingKind {
    Speed,
    Sign,
    Acceleration,
}

/// A joint's or a coupled motor's own motion.
pub(super) struct Direction {
    /// Share of each joint's speed in it, and share of its friction that acts on each joint.
    pub(super) joint_shares: Vec<f64>,
    /// The highest speed along the motion.
    pub(super) highest_speed: f64,
    /// The model's own law for the sign.
    pub(super) sign: SignModel,
    nuisance: NuisanceParameter,
    coulomb: f64,
    viscous: f64,
}

impl Direction {
    /// Inverse of the width w of a bend.
    pub(super) fn scale(&self, bend: usize) -> f64 {
        1.0 / (BEND_SPEEDS[bend] * self.highest_speed)
    }
}

/// Properties of a record that decide which nuisance parameters there are and how large they may
/// be.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in super::super) struct Observed {
    /// Root mean square of the measured torque of each joint \[N·m or N\].
    pub(super) torque_nm: Vec<f64>,
    /// The highest speed along each direction \[rad/s or m/s\].
    highest_speed: Vec<f64>,
    /// The largest share of a joint's torque that a unit of each parameter makes that is left out.
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

    /// True if the nuisance parameters of another record are the same: the shapes of friction
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

    /// One that does nothing along this motion may be anything: nobody could say how large.
    fn least_share(&self) -> f64 {
        MIN_SPEED_SHARE * self.left_out_shares.iter().copied().fold(0.0, f64::max)
    }

    /// Returns true if it belongs to this robot and these parameters.
    pub(in super::super) fn belongs_to(&self, context: &Context<'_>) -> bool {
        let (robot, base) = (context.robot, context.base.columns().len());
        self.torque_nm.len() == robot.joints()
            && self.highest_speed.len() == speed_shares(robot).count()
            && self.left_out_shares.len() == base - context.selection.columns().len()
    }
}

/// Size of each joint's own effects, from the estimate or, if there is none, from nominal sizes.
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

    /// Returns the Coulomb friction of a joint as it begins to move \[N·m or N\].
    fn coulomb_friction(&self, joint: usize) -> f64 {
        let coulomb = self.parameter_value(ParameterKind::Fc, joint);
        let coulomb = coulomb.unwrap_or(UNMODELLED_FRICTION * self.observed.torque_nm[joint]);
        let by_load = self.parameter_value(ParameterKind::FcLoad, joint).unwrap_or_default();
        let by_load = by_load * self.observed.torque_nm[joint];
        let others =
            [ParameterKind::Fs, ParameterKind::Fh].map(|kind| self.parameter_value(kind, joint));
        coulomb + by_load + others.into_iter().flatten().sum::<f64>()
    }

    /// Viscous friction of a joint at its highest speed, over that speed \[N·m·s/rad or N·s/m\]:
    /// however it is shared out among the laws that the joint has.
    fn viscous_friction(&self, joint: usize) -> f64 {
        use ParameterKind::{Fv, FvAsymmetric, FvCubic, FvQuadratic};

        let highest = self.observed.highest_speed[joint];
        let at_highest = [Fv, FvAsymmetric, FvQuadratic, FvCubic].into_iter().zip([0, 0, 1, 2]);
        let viscous = at_highest.map(|(kind, power)| {
            self.parameter_value(kind, joint).unwrap_or_default() * highest.powi(power)
        });
        viscous.sum()
    }

    /// Those along which the arm moves.
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

    /// Every column.
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
                for (by, size) in sizes {
                    add(nuisance, COUPLING_SHARE * size, NuisanceEffect::Neighbour { row, of, by });
                }
            }
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
            // That of a prismatic joint is its zero.
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
        columns
    }
}

fn rotate_angle(angle: Angle, by: f64) -> Angle {
    let (sin, cos) = by.sin_cos();
    Angle { cos: angle.cos * cos - angle.sin * sin, sin: angle.sin * cos + angle.cos * sin }
}

/// The moving part along a direction, counted from 0.
#[derive(Clone, Copy)]
enum MovingPart {
    Joint(usize),
    Motor(usize),
}

/// Directions along which friction may act: of every joint, and of every motor that is geared to
/// several; with how much each joint's speed adds to it.
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

/// The highest speed along a direction.
fn highest_speed(motion: &Motion, counted: impl Iterator<Item = usize>, shares: &[f64]) -> f64 {
    let speed = |k: usize| -> f64 {
        let joints = shares.iter().enumerate().filter(|(_, share)| **share != 0.0);
        joints.map(|(joint, share)| motion.velocity(k, joint) * share).sum()
    };
    counted.map(|k| speed(k).abs()).fold(0.0, f64::max)
}
