//! What a motion may do.

use super::error::ExcitationError;
use super::limit_kind::LimitKind;
use super::series::{Course, State};
use super::shapes::{Nearest, Shapes, gap_share};
use crate::MAX_JOINTS;
use crate::dynamics::{Model, Workspace};
use crate::robot::{JointKind, Limits, Robot};

/// How much of a robot's limits a motion leaves free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Part of the range of positions that is left free at each end. 0.05.
    pub position: f64,
    /// Part of the limits of speed, acceleration and jerk that is used. 0.5.
    pub speed: f64,
    /// Part of the torque limits that is used. 0.8: the model has errors.
    pub torque: f64,
}

impl Default for Margins {
    fn default() -> Self {
        Self { position: 0.05, speed: 0.5, torque: 0.8 }
    }
}

/// One limit: of a joint, or of a motor that is geared to several, as seen at its joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    pub(super) kind: LimitKind,
    /// Counted from 0.
    pub(super) joint: usize,
    /// What is limited is this times the joints' values.
    pub(super) direction: [f64; MAX_JOINTS],
    pub(super) middle: f64,
    pub(super) half: f64,
}

impl Bound {
    /// From −1 to 1 within the limit.
    pub(super) fn share(&self, values: &[f64]) -> f64 {
        let value: f64 = self.direction.iter().zip(values).map(|(d, v)| d * v).sum();
        (value - self.middle) / self.half
    }
}

/// What a motion of an arm may do.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    pub(super) all: Vec<Bound>,
    /// Standard parameters that torques are computed with.
    pub(super) parameters: Option<Vec<f64>>,
    /// What is held apart, where shapes are stated.
    pub(super) shapes: Option<Shapes>,
}

/// How much of a limit a motion uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Used {
    /// Which limit.
    pub kind: LimitKind,
    /// The joint, or the motor of its number where that is geared to several, counted from 1.
    pub joint: usize,
    /// Whether it is the motor's.
    pub of_motor: bool,
    /// What may be reached at least \[SI\].
    pub lowest: f64,
    /// What may be reached at most.
    pub highest: f64,
    /// Largest distance from the middle of both along the motion, relative to half the way between: at most 1.
    pub share: f64,
}

impl Bounds {
    /// Of a robot, less the margins. `accelerations` take the place of those that its file states \[rad/s² or m/s²\],
    /// without a margin. Torques are limited where `parameters` (standard ones) are given. A motor that is geared to several
    /// joints has the limits of its own joint, as seen there.
    ///
    /// # Errors
    /// [`ExcitationError::NoAcceleration`], [`ExcitationError::OpenLimit`], [`ExcitationError::BadValue`], [`ExcitationError::Length`].
    pub fn new(
        robot: &Robot,
        margins: Margins,
        accelerations: Option<&[f64]>,
        parameters: Option<Vec<f64>>,
    ) -> Result<Self, ExcitationError> {
        let joints = robot.joints();
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
        if let Some(given) = accelerations {
            if given.len() != joints {
                let what = "accelerations";
                return Err(ExcitationError::Length { what, expected: joints, found: given.len() });
            }
            if let Some(&value) = given.iter().find(|a| !(a.is_finite() && **a > 0.0)) {
                let (what, expected) = ("an acceleration", "finite and positive");
                return Err(ExcitationError::BadValue { what, value, expected });
            }
        }
        let mut all = Vec::new();
        for (joint, limits) in robot.limits().enumerate() {
            let stated = limits.acceleration_max.map(|a| margins.speed * a);
            let acceleration = accelerations.map(|of| of[joint]).or(stated);
            if acceleration.is_none() && parameters.is_none() {
                return Err(ExcitationError::NoAcceleration { joint: joint + 1 });
            }
            let own = core::array::from_fn(|j| if j == joint { 1.0 } else { 0.0 });
            let Limits { position_min, position_max, .. } = *limits;
            all.push(Bound {
                kind: LimitKind::Position,
                joint,
                direction: own,
                middle: 0.5 * (position_min + position_max),
                half: (0.5 - margins.position) * (position_max - position_min),
            });
            let open = |what, key| ExcitationError::OpenLimit { joint: joint + 1, what, key };
            let prismatic = robot.chain()[joint].kind == JointKind::Prismatic;
            let [speed_key, torque_key] = match prismatic {
                true => ["velocity_max_m_s", "force_max_n"],
                false => ["velocity_max_rad_s", "torque_max_nm"],
            };
            let speed = limits.velocity_max.ok_or_else(|| open("speed", speed_key))?;
            let torque = match parameters {
                Some(_) => {
                    let most = limits.torque_max.ok_or_else(|| open("torque", torque_key))?;
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
            for direction in [Some(own), motor].into_iter().flatten() {
                for (kind, half) in symmetric {
                    let bound = |half| Bound { kind, joint, direction, middle: 0.0, half };
                    all.extend(half.map(bound));
                }
            }
            if let Some(half) = torque {
                let bound = |direction| Bound {
                    kind: LimitKind::Torque,
                    joint,
                    direction,
                    middle: 0.0,
                    half,
                };
                all.push(bound(own));
                let motor = motor_torque(robot, joint);
                if motor.iter().zip(own).any(|(motor, own)| (motor - own).abs() > 1e-9) {
                    all.push(bound(motor));
                }
            }
        }
        Ok(Self { all, parameters, shapes: None })
    }

    /// The same with shapes that are held apart.
    #[must_use]
    pub fn with_shapes(self, shapes: Option<Shapes>) -> Self {
        Self { shapes, ..self }
    }

    /// What is held apart; nothing where no shapes are stated.
    pub fn shapes(&self) -> Option<&Shapes> {
        self.shapes.as_ref()
    }

    /// The narrowest gap along a motion, at so many samples per second \[Hz\], where shapes are stated.
    pub fn nearest(&self, model: &Model, motion: &dyn Course, rate_hz: f64) -> Option<Nearest> {
        self.shapes.as_ref()?.nearest_along(model, motion, rate_hz)
    }

    /// The largest share of any limit or gap, with how much of each a motion uses.
    pub(super) fn share(
        &self,
        model: &Model,
        motion: &dyn Course,
        rate_hz: f64,
    ) -> (f64, Vec<Used>, Option<Nearest>) {
        let used = self.used(model, motion, rate_hz);
        let nearest = self.nearest(model, motion, rate_hz);
        let of_gaps = nearest.map_or(0.0, |of| gap_share(of.gap_m));
        (used.iter().map(|used| used.share).fold(of_gaps, f64::max), used, nearest)
    }

    /// How much of each limit a motion uses, at so many samples per second \[Hz\].
    pub fn used(&self, model: &Model, motion: &dyn Course, rate_hz: f64) -> Vec<Used> {
        let mut used: Vec<Used> = self.all.iter().map(Used::of).collect();
        let mut torques = Torques::new(model, self);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a motion has far fewer samples than 2^52"
        )]
        let samples = (motion.duration_s() * rate_hz).ceil().max(1.0) as usize;
        for i in 0..=samples {
            let state = motion.state(motion.duration_s() * i as f64 / samples as f64);
            let torque = torques.of(&state);
            for (used, bound) in used.iter_mut().zip(&self.all) {
                let share = bound.share(bound.kind.of(&state, torque)).abs();
                used.share = used.share.max(share);
            }
        }
        used
    }

    /// The limit of a joint itself.
    pub(super) fn own(&self, kind: LimitKind, joint: usize) -> Option<&Bound> {
        self.all.iter().find(|of| of.kind == kind && of.joint == joint)
    }

    /// Where a joint may be.
    pub(super) fn range(&self, joint: usize) -> [f64; 2] {
        let own = self.own(LimitKind::Position, joint);
        own.map_or([0.0; 2], |of| [of.middle - of.half, of.middle + of.half])
    }

    /// Whether torques are limited.
    pub fn limits_torques(&self) -> bool {
        self.parameters.is_some()
    }
}

impl LimitKind {
    fn of<'a>(self, state: &'a State, torque: &'a [f64]) -> &'a [f64] {
        match self {
            Self::Position => &state.position,
            Self::Speed => &state.velocity,
            Self::Acceleration => &state.acceleration,
            Self::Jerk => &state.jerk,
            Self::Torque => torque,
        }
    }
}

impl Used {
    fn of(bound: &Bound) -> Self {
        let Bound { kind, joint, direction, middle, half } = *bound;
        Self {
            kind,
            joint: joint + 1,
            of_motor: direction.iter().filter(|d| **d != 0.0).count() > 1,
            lowest: middle - half,
            highest: middle + half,
            share: 0.0,
        }
    }
}

/// Torques along a motion; none where none are limited.
struct Torques<'a> {
    model: &'a Model,
    parameters: Option<&'a [f64]>,
    workspace: Workspace<f64>,
    torque: [f64; MAX_JOINTS],
}

impl<'a> Torques<'a> {
    fn new(model: &'a Model, bounds: &'a Bounds) -> Self {
        let parameters = bounds.parameters.as_deref();
        Self { model, parameters, workspace: Workspace::new(), torque: [0.0; MAX_JOINTS] }
    }

    fn of(&mut self, state: &State) -> &[f64] {
        let n = self.model.joints();
        if let Some(parameters) = self.parameters {
            let [q, dq, ddq] = [&state.position, &state.velocity, &state.acceleration];
            self.model.inverse_dynamics(
                &mut self.workspace,
                parameters,
                &q[..n],
                &dq[..n],
                &ddq[..n],
                &mut self.torque[..n],
            );
        }
        &self.torque[..n]
    }
}

/// The torque of a motor as seen at its own joint, r_jj (R⁻ᵀ τ)_j.
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
