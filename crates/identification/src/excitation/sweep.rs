//! Constant-speed sweeps for friction: one joint at a time, there and back, all others at rest.

use super::bounds::{Bounds, UsedLimit};
use super::design::CHECK_HZ;
use super::error::ExcitationError;
use super::limit_kind::LimitKind;
use super::limits::DesignLimits;
use super::search::Search;
use super::series::{Course, FourierSeries, JointSeries, State};
use super::shapes::Nearest;
use super::task::Task;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::JointIndex;
use didim_dynamics::trajectory::Reference;

/// Shortest time for accelerating to a constant speed \[s\]. A limit may require more time.
const BLEND_S: f64 = 0.2;
const BLEND_GROWTH: f64 = 1.3;
const BLEND_TRIALS: usize = 16;
/// Number of positions of a joint's range that are tried to both sides, and the largest share of a
/// limit at rest there. The remainder is for moving.
const START_POSITIONS: usize = 100;

/// Movement of a joint from one position to another at a constant speed, which it reaches and
/// leaves smoothly.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stroke {
    start_s: f64,
    joint: usize,
    start_position: f64,
    /// Speed with the sign of the direction \[rad/s or m/s\].
    speed: f64,
    blend_s: f64,
    held_s: f64,
}

/// Movement of a joint there and back at a constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepPass {
    /// The joint.
    pub joint: JointIndex,
    /// Speed \[rad/s or m/s\].
    pub speed: f64,
    /// Both ends of the movement \[rad or m\].
    pub end_positions: [f64; 2],
}

/// Joints that move there and back at constant speeds, one after the other. All begin and end at
/// their rest positions.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    duration_s: f64,
    posture: Vec<f64>,
    strokes: Vec<Stroke>,
    /// Passes of the sweep, the slowest of each joint first.
    pub passes: Vec<SweepPass>,
}

/// Sweep within the limits.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepDesign {
    /// The motion.
    pub sweep: Sweep,
    /// Used share of each limit, checked at 5000 samples per second.
    pub used: Vec<UsedLimit>,
    /// Narrowest gap between shapes along the sweep; `None` if no shapes are configured.
    pub narrowest_gap: Option<Nearest>,
}

/// Designs a sweep of these joints (counted from 0) within the limits of a task. Each joint gets an
/// equal part of the task's duration. Fast passes use the whole range that the limits permit while
/// the other joints are in the rest posture. Slow passes go as far as the time permits.
///
/// # Errors
/// [`ExcitationError::NoSweep`], and the errors of a rest posture.
pub fn sweep(task: &Task, joints: &[usize]) -> Result<SweepDesign, ExcitationError> {
    let posture = Search::new(task).rest_posture()?;
    let part_s = task.duration_s / joints.len().max(1) as f64;
    let spans: Vec<[f64; 2]> =
        joints.iter().map(|joint| rest_range(task, &posture, *joint)).collect();
    let mut longer = 1.0;
    for _ in 0..BLEND_TRIALS {
        let mut sweep =
            Sweep { duration_s: 0.0, posture: posture.clone(), strokes: vec![], passes: vec![] };
        for (&joint, &presliding) in joints.iter().zip(&spans) {
            if sweep.add(&task.bounds, joint, presliding, part_s, longer)
                < DesignLimits::DEFAULT.min_sweep_speeds
            {
                return Err(ExcitationError::NoSweep {
                    joint: JointIndex::new(joint),
                    seconds: part_s,
                });
            }
        }
        let (share, used, nearest) = task.bounds.shares_along(&task.model, &sweep, CHECK_HZ);
        if share <= 1.0 {
            return Ok(SweepDesign { sweep, used, narrowest_gap: nearest });
        }
        longer *= BLEND_GROWTH;
    }
    let joint = JointIndex::new(joints.first().copied().unwrap_or_default());
    Err(ExcitationError::NoSweep { joint, seconds: part_s })
}

/// Returns the furthest positions of a joint on both sides of a posture where the arm can rest.
fn rest_range(task: &Task, posture: &[f64], joint: usize) -> [f64; 2] {
    let share = |place: f64| {
        let joints = posture
            .iter()
            .enumerate()
            .map(|(k, at): (usize, &f64)| {
                let mean = if k == joint { place } else { *at };
                JointSeries { mean, sine: vec![], cosine: vec![] }
            })
            .collect();
        task.bounds.shares_along(&task.model, &FourierSeries { duration_s: 1.0, joints }, 1.0).0
    };
    let span = posture[joint];
    let most = DesignLimits::DEFAULT.max_rest_share.max(share(span));
    task.bounds.range(joint).map(|end| {
        let place = |step: usize| {
            span + (end - span) * DesignLimits::DEFAULT.max_rest_share * step as f64
                / START_POSITIONS as f64
        };
        // The position range already includes a margin.
        (1..=START_POSITIONS)
            .map(place)
            .take_while(|place| share(*place) <= most)
            .last()
            .unwrap_or(span)
    })
}

impl Sweep {
    /// Adds the passes of a joint, and returns the number of passes that fit into time and range.
    fn add(
        &mut self,
        bounds: &Bounds,
        joint: usize,
        [low, high]: [f64; 2],
        part_s: f64,
        longer: f64,
    ) -> usize {
        let limit = |kind| {
            bounds
                .joint_bound(kind, joint)
                .map_or(f64::INFINITY, |of| DesignLimits::DEFAULT.joint_limit_share * of.half_range)
        };
        let [top, acceleration, jerk] =
            [LimitKind::Speed, LimitKind::Acceleration, LimitKind::Jerk].map(limit);
        let blend = |speed: f64| {
            let least = (1.5 * speed / acceleration).max((6.0 * speed / jerk).sqrt());
            longer * least.max(BLEND_S)
        };
        let mut left_s = part_s;
        let mut passes = Vec::new();
        // The fastest pass is added first; the slow ones get the remaining time.
        for k in 0..DesignLimits::DEFAULT.sweep_speeds {
            let speed = top
                * DesignLimits::DEFAULT
                    .lowest_speed_share
                    .powf(k as f64 / (DesignLimits::DEFAULT.sweep_speeds - 1) as f64);
            let own_s = left_s / (DesignLimits::DEFAULT.sweep_speeds - k) as f64;
            let part = ((own_s - 3.0 * blend(speed)) * speed / (2.0 * (high - low))).min(1.0);
            // The time at constant speed has to be at least the time of acceleration.
            if part * (high - low) < 2.0 * speed * blend(speed) {
                continue;
            }
            left_s -= 2.0 * part * (high - low) / speed + 3.0 * blend(speed);
            let target = |end: f64| self.posture[joint] + part * (end - self.posture[joint]);
            passes.push(SweepPass {
                joint: JointIndex::new(joint),
                speed,
                end_positions: [target(low), target(high)],
            });
        }
        let count = passes.len();
        for pass in passes.into_iter().rev() {
            let ([low, high], rest) = (pass.end_positions, self.posture[joint]);
            for [from, to] in [[rest, low], [low, high], [high, rest]] {
                self.push(joint, from, to, pass.speed, blend(pass.speed));
            }
            self.passes.push(pass);
        }
        count
    }

    /// Appends a stroke; its speed is reduced if the distance is too short.
    fn push(&mut self, joint: usize, from: f64, to: f64, speed: f64, blend_s: f64) {
        let presliding = (to - from).abs();
        if presliding == 0.0 {
            return;
        }
        let speed = speed.min(presliding / blend_s);
        let held_s = presliding / speed - blend_s;
        let start_s = self.duration_s;
        self.strokes.push(Stroke {
            start_s,
            joint,
            start_position: from,
            speed: speed.copysign(to - from),
            blend_s,
            held_s,
        });
        self.duration_s += held_s + 2.0 * blend_s;
    }

    /// Returns the joint that moves at a given time, and its position with three derivatives.
    pub(super) fn moving_joint(&self, time_s: f64) -> Option<(usize, [f64; 4])> {
        let begun = self.strokes.partition_point(|of| of.start_s <= time_s);
        let stroke = self.strokes.get(begun.checked_sub(1)?)?;
        (time_s < self.duration_s).then(|| (stroke.joint, stroke.evaluate(time_s - stroke.start_s)))
    }
}

impl Stroke {
    /// Returns position and derivatives at a time after the start of the stroke. The speed rises
    /// and falls by 3 s² − 2 s³.
    fn evaluate(&self, time_s: f64) -> [f64; 4] {
        let Self { start_position: from, speed, blend_s: b, held_s, .. } = *self;
        let blended = |s: f64| {
            let presliding = speed * b * s * s * s * (1.0 - 0.5 * s);
            [
                presliding,
                speed * s * s * (3.0 - 2.0 * s),
                speed / b * 6.0 * s * (1.0 - s),
                speed / (b * b) * (6.0 - 12.0 * s),
            ]
        };
        if time_s < b {
            let [route, rest @ ..] = blended(time_s / b);
            let [v, a, j] = rest;
            [from + route, v, a, j]
        } else if time_s < b + held_s {
            [from + speed * (time_s - 0.5 * b), speed, 0.0, 0.0]
        } else {
            let [distance, v, a, j] = blended(((held_s + 2.0 * b - time_s) / b).clamp(0.0, 1.0));
            [from + speed * (held_s + b) - distance, v, -a, j]
        }
    }
}

impl Course for Sweep {
    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn state(&self, time_s: f64) -> State {
        let mut state = State::default();
        state.position[..self.posture.len()].copy_from_slice(&self.posture);
        if let Some((joint, [q, dq, ddq, jerk])) = self.moving_joint(time_s) {
            state.position[joint] = q;
            state.velocity[joint] = dq;
            state.acceleration[joint] = ddq;
            state.jerk[joint] = jerk;
        }
        state
    }
}

impl Reference for Sweep {
    fn joints(&self) -> usize {
        self.posture.len().min(MAX_JOINTS)
    }

    fn evaluate(
        &self,
        time_s: f64,
        position: &mut [f64],
        velocity: &mut [f64],
        acceleration: &mut [f64],
    ) {
        self.state(time_s).copy_to(self.joints(), position, velocity, acceleration);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_is_smooth_and_arrives() {
        let mut sweep =
            Sweep { duration_s: 0.0, posture: vec![0.1, 0.3], strokes: vec![], passes: vec![] };
        sweep.push(1, 0.3, -1.2, 0.8, 0.25);
        sweep.push(1, -1.2, -1.1, 0.8, 0.25);
        sweep.push(1, -1.1, 0.3, 0.8, 0.25);
        let h = 1e-5;
        let mut fastest: f64 = 0.0;
        for k in 1..4000 {
            let time_s = sweep.duration_s * f64::from(k) / 4000.0;
            let [before, at, after] = [-h, 0.0, h].map(|h| sweep.state(time_s + h));
            let slope = (after.position[1] - before.position[1]) / (2.0 * h);
            assert!((slope - at.velocity[1]).abs() < 1e-6, "{time_s}");
            let slope = (after.velocity[1] - before.velocity[1]) / (2.0 * h);
            assert!((slope - at.acceleration[1]).abs() < 1e-3, "{time_s}");
            assert!((at.position[0] - 0.1).hypot(at.velocity[0]) < 1e-15);
            fastest = fastest.max(at.velocity[1].abs());
        }
        assert!((fastest - 0.8).abs() < 1e-12);
        let end = sweep.state(sweep.duration_s);
        assert!((end.position[1] - 0.3).hypot(end.velocity[1]) < 1e-12);
        let nearly = sweep.state(sweep.duration_s - 1e-9);
        assert!((nearly.position[1] - 0.3).abs() < 1e-9 && nearly.velocity[1].abs() < 1e-9);
    }
}
