//! Limits of a motion.

use super::error::ExcitationError;
use super::limit_kind::LimitKind;
use super::series::{Course, State};
use super::shapes::{Nearest, Shapes, gap_share};
use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::numeric::{Lanes, Scalar, WIDTH};
use didim_dynamics::robot::{JointIndex, JointKind, Limits, Robot};

/// Margins of a motion to a robot's limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Share of the position range that stays unused at each end; the default is 0.05.
    pub position: f64,
    /// Used share of the limits of speed, acceleration and jerk; the default is 0.5.
    pub speed: f64,
    /// Used share of the torque limits; the default is 0.8, because the model has errors.
    pub torque: f64,
}

impl Default for Margins {
    fn default() -> Self {
        Self { position: 0.05, speed: 0.5, torque: 0.8 }
    }
}

/// Limit of a joint, or of a motor that is geared to several joints, referred to the motor's joint.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bound {
    pub(super) kind: LimitKind,
    /// Joint, counted from 0.
    pub(super) joint: usize,
    /// Joints whose weighted sum is limited, each with its factor.
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) middle: f64,
    pub(super) half_range: f64,
}

impl Bound {
    /// Returns the used share of the limit, from −1 to 1 if the limit is kept.
    pub(super) fn share_of_limit(&self, values: &[f64]) -> f64 {
        let value: f64 = self.terms.iter().map(|(joint, factor)| factor * values[*joint]).sum();
        (value - self.middle) / self.half_range
    }
}

/// Returns the joints with a factor.
fn terms_of(factors: &[f64; MAX_JOINTS]) -> Vec<(usize, f64)> {
    let factors = factors.iter().copied().enumerate();
    factors.filter(|(_, factor)| *factor != 0.0).collect()
}

/// Limits of a motion of an arm.
#[derive(Clone, Debug)]
pub struct Bounds {
    pub(super) limits: Vec<Bound>,
    /// Standard parameters for computing the torques.
    pub(super) parameters: Option<Vec<f64>>,
    /// Shapes that must not collide, if configured.
    pub(super) shapes: Option<Shapes>,
}

/// Share of a limit that a motion uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsedLimit {
    /// Kind of the limit.
    pub kind: LimitKind,
    /// Joint, or the motor with this number if it is geared to several joints.
    pub joint: JointIndex,
    /// True if the limit is that of the motor.
    pub of_motor: bool,
    /// Lower limit \[SI\].
    pub lower_limit: f64,
    /// Upper limit.
    pub upper_limit: f64,
    /// Largest distance from the middle of both limits along the motion, relative to half the
    /// distance between them: at most 1.
    pub used_share: f64,
}

impl Bounds {
    /// Creates the bounds of a robot, reduced by the margins. `accelerations` replace those of the
    /// robot file \[rad/s² or m/s²\], without a margin. Torques are limited if `parameters`
    /// (standard parameters) are given. A motor that is geared to several joints has the limits of
    /// its own joint, referred to this joint.
    ///
    /// # Errors
    /// [`ExcitationError::NoAcceleration`], [`ExcitationError::OpenLimit`],
    /// [`ExcitationError::BadValue`], [`ExcitationError::Length`].
    pub fn new(
        robot: &Robot,
        margins: Margins,
        accelerations: Option<&[f64]>,
        parameters: Option<Vec<f64>>,
    ) -> Result<Self, ExcitationError> {
        let joints = robot.joints();
        check_arguments(margins, accelerations, joints)?;
        let mut bounds = Vec::new();
        for (joint, limits) in robot.limits().enumerate() {
            let configured = limits.acceleration_max.map(|a| margins.speed * a);
            let acceleration = accelerations.map(|of| of[joint]).or(configured);
            if acceleration.is_none() && parameters.is_none() {
                return Err(ExcitationError::NoAcceleration { joint: JointIndex::new(joint) });
            }
            let selector = core::array::from_fn(|j| if j == joint { 1.0 } else { 0.0 });
            let Limits { position_min, position_max, .. } = *limits;
            bounds.push(Bound {
                kind: LimitKind::Position,
                joint,
                terms: terms_of(&selector),
                middle: 0.5 * (position_min + position_max),
                half_range: (0.5 - margins.position) * (position_max - position_min),
            });
            let open_limit =
                |what, key| ExcitationError::OpenLimit { joint: JointIndex::new(joint), what, key };
            let prismatic = robot.chain()[joint].kind == JointKind::Prismatic;
            let [speed_key, torque_key] = match prismatic {
                true => ["velocity_max_m_s", "force_max_n"],
                false => ["velocity_max_rad_s", "torque_max_nm"],
            };
            let speed = limits.velocity_max.ok_or_else(|| open_limit("speed", speed_key))?;
            let torque = match parameters {
                Some(_) => {
                    let most = limits.torque_max.ok_or_else(|| open_limit("torque", torque_key))?;
                    Some(margins.torque * most)
                }
                None => None,
            };
            let symmetric = [
                (LimitKind::Speed, Some(margins.speed * speed)),
                (LimitKind::Acceleration, acceleration),
                (LimitKind::Jerk, limits.jerk_max.map(|jerk| margins.speed * jerk)),
            ];
            let transmission = robot.transmission();
            let motor = transmission.is_coupled(joint).then(|| transmission.direction(joint));
            for direction in [Some(selector), motor].into_iter().flatten() {
                for (kind, half) in symmetric {
                    bounds.extend(half.map(|half_range| Bound {
                        kind,
                        joint,
                        terms: terms_of(&direction),
                        middle: 0.0,
                        half_range,
                    }));
                }
            }
            if let Some(half) = torque {
                let bound = |direction: [f64; MAX_JOINTS]| Bound {
                    kind: LimitKind::Torque,
                    joint,
                    terms: terms_of(&direction),
                    middle: 0.0,
                    half_range: half,
                };
                bounds.push(bound(selector));
                let motor = motor_torque(robot, joint);
                if motor.iter().zip(selector).any(|(motor, own)| (motor - own).abs() > 1e-9) {
                    bounds.push(bound(motor));
                }
            }
        }
        Ok(Self { limits: bounds, parameters, shapes: None })
    }

    /// Returns the bounds with shapes that must not collide.
    #[must_use]
    pub fn with_shapes(self, shapes: Option<Shapes>) -> Self {
        Self { shapes, ..self }
    }

    /// Returns the shapes that must not collide; `None` if no shapes are configured.
    pub fn separated_shapes(&self) -> Option<&Shapes> {
        self.shapes.as_ref()
    }

    /// Returns the narrowest gap along a motion, at this number of samples per second \[Hz\], if
    /// shapes are configured.
    pub fn narrowest_gap(
        &self,
        model: &Model,
        motion: &dyn Course,
        rate_hz: f64,
    ) -> Option<Nearest> {
        self.shapes.as_ref()?.nearest_along(model, motion, rate_hz)
    }

    /// Returns the largest used share of any limit or gap along a motion, and the used share of
    /// each limit.
    pub(super) fn shares_along(
        &self,
        model: &Model,
        motion: &dyn Course,
        rate_hz: f64,
    ) -> (f64, Vec<UsedLimit>, Option<Nearest>) {
        let used = self.used_limits(model, motion, rate_hz);
        let nearest = self.narrowest_gap(model, motion, rate_hz);
        let of_gaps = nearest.map_or(0.0, |of| gap_share(of.gap_m));
        (used.iter().map(|used| used.used_share).fold(of_gaps, f64::max), used, nearest)
    }

    /// Returns the share of each limit that a motion uses, at this number of samples per second
    /// \[Hz\].
    pub fn used_limits(&self, model: &Model, motion: &dyn Course, rate_hz: f64) -> Vec<UsedLimit> {
        let mut used: Vec<UsedLimit> = self.limits.iter().map(UsedLimit::from_bound).collect();
        let mut torques = Torques::new(model, self);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a motion has far fewer samples than 2^52"
        )]
        let samples = (motion.duration_s() * rate_hz).ceil().max(1.0) as usize;
        let state = |i: usize| motion.state(motion.duration_s() * i as f64 / samples as f64);
        for first in (0..=samples).step_by(WIDTH) {
            let states: [State; WIDTH] = core::array::from_fn(|l| state((first + l).min(samples)));
            let torques = torques.values_of(&states);
            for (used, bound) in used.iter_mut().zip(&self.limits) {
                for (state, torque) in states.iter().zip(&torques) {
                    let share = bound.share_of_limit(bound.kind.values_of(state, torque)).abs();
                    used.used_share = used.used_share.max(share);
                }
            }
        }
        used
    }

    /// Returns the limit of the joint itself.
    pub(super) fn joint_bound(&self, kind: LimitKind, joint: usize) -> Option<&Bound> {
        self.limits.iter().find(|of| of.kind == kind && of.joint == joint)
    }

    /// Returns the permitted positions of a joint.
    pub(super) fn range(&self, joint: usize) -> [f64; 2] {
        let bound = self.joint_bound(LimitKind::Position, joint);
        bound.map_or([0.0; 2], |of| [of.middle - of.half_range, of.middle + of.half_range])
    }

    /// Returns true if torques are limited.
    pub fn limits_torques(&self) -> bool {
        self.parameters.is_some()
    }
}

/// Checks that margins and accelerations are in range.
fn check_arguments(
    margins: Margins,
    accelerations: Option<&[f64]>,
    joints: usize,
) -> Result<(), ExcitationError> {
    for (what, value, most) in [
        ("the position margin", margins.position, 0.45),
        ("the share of the speed", margins.speed, 1.0),
        ("the share of the torque", margins.torque, 1.0),
    ] {
        if !(value > 0.0 && value <= most) {
            return Err(ExcitationError::BadValue {
                what,
                value,
                expected: "above 0 and at most 1 (a position margin at most 0.45)",
            });
        }
    }
    if let Some(accelerations_given) = accelerations {
        if accelerations_given.len() != joints {
            let quantity = "accelerations";
            return Err(ExcitationError::Length {
                what: quantity,
                expected: joints,
                found: accelerations_given.len(),
            });
        }
        if let Some(&value) = accelerations_given.iter().find(|a| !(a.is_finite() && **a > 0.0)) {
            let (what, expected) = ("an acceleration", "finite and positive");
            return Err(ExcitationError::BadValue { what, value, expected });
        }
    }
    Ok(())
}

impl LimitKind {
    fn values_of<'a>(self, state: &'a State, torque: &'a [f64]) -> &'a [f64] {
        match self {
            Self::Position => &state.position,
            Self::Speed => &state.velocity,
            Self::Acceleration => &state.acceleration,
            Self::Jerk => &state.jerk,
            Self::Torque => torque,
        }
    }
}

impl UsedLimit {
    fn from_bound(bound: &Bound) -> Self {
        let &Bound { kind, joint, middle, half_range: half, .. } = bound;
        Self {
            kind,
            joint: JointIndex::new(joint),
            of_motor: bound.terms.len() > 1,
            lower_limit: middle - half,
            upper_limit: middle + half,
            used_share: 0.0,
        }
    }
}

/// Torques along a motion; `None` if torques are not limited.
struct Torques<'a> {
    model: &'a Model,
    parameters: Option<Vec<Group>>,
    workspace: Workspace<Group>,
}

impl<'a> Torques<'a> {
    fn new(model: &'a Model, bounds: &'a Bounds) -> Self {
        let lanes = |of: &Vec<f64>| of.iter().map(|value| Lanes::constant(*value)).collect();
        let parameters = bounds.parameters.as_ref().map(lanes);
        Self { model, parameters, workspace: Workspace::new() }
    }

    /// Returns the torques of each state; 0 beyond the number of joints.
    fn values_of(&mut self, states: &[State; WIDTH]) -> [[f64; MAX_JOINTS]; WIDTH] {
        let (n, mut torque) = (self.model.joints(), [Lanes::zero(); MAX_JOINTS]);
        if let Some(parameters) = &self.parameters {
            let group = |of: fn(&State) -> &[f64; MAX_JOINTS]| -> [Group; MAX_JOINTS] {
                core::array::from_fn(|joint| Lanes::from_fn(|l| of(&states[l])[joint]))
            };
            let (q, dq) = (group(|of| &of.position), group(|of| &of.velocity));
            let ddq = group(|of| &of.acceleration);
            let torque = &mut torque[..n];
            let workspace = &mut self.workspace;
            self.model.inverse_dynamics(
                workspace,
                parameters,
                &q[..n],
                &dq[..n],
                &ddq[..n],
                torque,
            );
        }
        core::array::from_fn(|l| torque.map(|of| of.0[l]))
    }
}

/// Returns the factors for the torque of a motor referred to its own joint, r_jj (R⁻ᵀ τ)_j.
fn motor_torque(robot: &Robot, motor: usize) -> [f64; MAX_JOINTS] {
    let (n, transmission) = (robot.joints(), robot.transmission());
    let ratio = transmission.row(motor)[motor];
    let mut direction = [0.0; MAX_JOINTS];
    for joint in 0..n {
        let (mut unit, mut of_motors) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        unit[joint] = 1.0;
        transmission.motor_torque(&unit[..n], &mut of_motors[..n]);
        direction[joint] = ratio * of_motors[motor];
    }
    direction
}
