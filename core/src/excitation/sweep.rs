//! Friction sweeps: one joint at a time, there and back at constant speeds, all others at rest.

use super::bounds::{Bounds, Used};
use super::design::CHECK_HZ;
use super::error::ExcitationError;
use super::limit_kind::LimitKind;
use super::search::Search;
use super::series::{Course, FourierSeries, JointSeries, State};
use super::shapes::Nearest;
use super::task::Task;
use crate::MAX_JOINTS;
use crate::trajectory::Reference;

/// Speeds of a joint, one factor apart, and the lowest relative to the highest: about a fiftieth of the limit where half of it
/// may be used.
const SPEEDS: usize = 6;
const LOWEST: f64 = 0.04;
/// A joint with fewer speeds tells no law from another.
const FEWEST: usize = 3;
/// What is used of the limits of a joint itself, for rounding.
const NEARLY: f64 = 0.999;
/// A speed is reached within this time at least \[s\], and longer where a limit asks for it.
const BLEND_S: f64 = 0.2;
const LONGER: f64 = 1.3;
const TRIALS: usize = 16;
/// Places of a joint's range that are tried to both sides, and the largest share of a limit at rest there: what is left is for moving.
const PLACES: usize = 100;
const AT_REST: f64 = 0.95;

/// A joint that goes from one place to another at a speed that it reaches and leaves smoothly.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stroke {
    start_s: f64,
    joint: usize,
    from: f64,
    /// With the sign of the direction.
    speed: f64,
    blend_s: f64,
    held_s: f64,
}

/// A speed of a joint, and how far it goes there and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass {
    /// Counted from 0.
    pub joint: usize,
    /// \[rad/s or m/s\].
    pub speed: f64,
    /// The two ends of its way \[rad or m\].
    pub between: [f64; 2],
}

/// Joints that go there and back at constant speeds, one after the other; all begin and end where they rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    duration_s: f64,
    posture: Vec<f64>,
    strokes: Vec<Stroke>,
    /// What it consists of, the slowest of each joint first.
    pub passes: Vec<Pass>,
}

/// A sweep within the limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// The motion.
    pub sweep: Sweep,
    /// How much of each limit it uses, checked at 5000 samples per second.
    pub used: Vec<Used>,
    /// The narrowest gap between shapes along it; nothing where no shapes are stated.
    pub nearest: Option<Nearest>,
}

/// Sweeps these joints (counted from 0) within the limits of a task, each in an equal part of its duration: fast passes go through
/// all that the limits leave about the posture where the others rest, slow ones as far as there is time.
///
/// # Errors
/// [`ExcitationError::NoSweep`], and those of a posture to rest in.
pub fn sweep(task: &Task, joints: &[usize]) -> Result<Swept, ExcitationError> {
    let posture = Search::new(task).rest()?;
    let part_s = task.duration_s / joints.len().max(1) as f64;
    let ways: Vec<[f64; 2]> = joints.iter().map(|joint| way(task, &posture, *joint)).collect();
    let mut longer = 1.0;
    for _ in 0..TRIALS {
        let mut sweep =
            Sweep { duration_s: 0.0, posture: posture.clone(), strokes: vec![], passes: vec![] };
        for (&joint, &way) in joints.iter().zip(&ways) {
            if sweep.add(&task.bounds, joint, way, part_s, longer) < FEWEST {
                return Err(ExcitationError::NoSweep { joint: joint + 1, seconds: part_s });
            }
        }
        let (share, used, nearest) = task.bounds.share(&task.model, &sweep, CHECK_HZ);
        if share <= 1.0 {
            return Ok(Swept { sweep, used, nearest });
        }
        longer *= LONGER;
    }
    let joint = joints.first().map_or(0, |joint| joint + 1);
    Err(ExcitationError::NoSweep { joint, seconds: part_s })
}

/// How far a joint may go to both sides of a posture, at rest.
fn way(task: &Task, posture: &[f64], joint: usize) -> [f64; 2] {
    let share = |place: f64| {
        let still = |(k, at): (usize, &f64)| {
            let mean = if k == joint { place } else { *at };
            JointSeries { mean, sine: vec![], cosine: vec![] }
        };
        let joints = posture.iter().enumerate().map(still).collect();
        task.bounds.share(&task.model, &FourierSeries { duration_s: 1.0, joints }, 1.0).0
    };
    let from = posture[joint];
    let most = AT_REST.max(share(from));
    task.bounds.range(joint).map(|end| {
        let place = |step: usize| from + (end - from) * AT_REST * step as f64 / PLACES as f64;
        // The range itself is no limit that is left free twice.
        (1..=PLACES).map(place).take_while(|place| share(*place) <= most).last().unwrap_or(from)
    })
}

impl Sweep {
    /// Adds the passes of a joint, and says how many there is time and room for.
    fn add(
        &mut self,
        bounds: &Bounds,
        joint: usize,
        [low, high]: [f64; 2],
        part_s: f64,
        longer: f64,
    ) -> usize {
        let limit = |kind| bounds.own(kind, joint).map_or(f64::INFINITY, |of| NEARLY * of.half);
        let [top, acceleration, jerk] =
            [LimitKind::Speed, LimitKind::Acceleration, LimitKind::Jerk].map(limit);
        let blend = |speed: f64| {
            let least = (1.5 * speed / acceleration).max((6.0 * speed / jerk).sqrt());
            longer * least.max(BLEND_S)
        };
        let mut left_s = part_s;
        let mut passes = Vec::new();
        // The fastest first: the slow ones have what it leaves.
        for k in 0..SPEEDS {
            let speed = top * LOWEST.powf(k as f64 / (SPEEDS - 1) as f64);
            let own_s = left_s / (SPEEDS - k) as f64;
            let part = ((own_s - 3.0 * blend(speed)) * speed / (2.0 * (high - low))).min(1.0);
            // As long at the speed as it takes to reach it.
            if part * (high - low) < 2.0 * speed * blend(speed) {
                continue;
            }
            left_s -= 2.0 * part * (high - low) / speed + 3.0 * blend(speed);
            let at = |end: f64| self.posture[joint] + part * (end - self.posture[joint]);
            passes.push(Pass { joint, speed, between: [at(low), at(high)] });
        }
        let count = passes.len();
        for pass in passes.into_iter().rev() {
            let ([low, high], rest) = (pass.between, self.posture[joint]);
            for [from, to] in [[rest, low], [low, high], [high, rest]] {
                self.push(joint, from, to, pass.speed, blend(pass.speed));
            }
            self.passes.push(pass);
        }
        count
    }

    /// Goes on with a stroke, more slowly where the way is too short for the speed.
    fn push(&mut self, joint: usize, from: f64, to: f64, speed: f64, blend_s: f64) {
        let way = (to - from).abs();
        if way == 0.0 {
            return;
        }
        let speed = speed.min(way / blend_s);
        let held_s = way / speed - blend_s;
        let start_s = self.duration_s;
        self.strokes.push(Stroke {
            start_s,
            joint,
            from,
            speed: speed.copysign(to - from),
            blend_s,
            held_s,
        });
        self.duration_s += held_s + 2.0 * blend_s;
    }

    /// The joint that moves at a time, and its position with its derivatives.
    pub(super) fn moving(&self, time_s: f64) -> Option<(usize, [f64; 4])> {
        let begun = self.strokes.partition_point(|of| of.start_s <= time_s);
        let own = self.strokes.get(begun.checked_sub(1)?)?;
        (time_s < self.duration_s).then(|| (own.joint, own.at(time_s - own.start_s)))
    }
}

impl Stroke {
    /// Position and its derivatives so long after its start: the speed rises and falls by 3 s² − 2 s³.
    fn at(&self, time_s: f64) -> [f64; 4] {
        let Self { from, speed, blend_s: b, held_s, .. } = *self;
        let blended = |s: f64| {
            let way = speed * b * s * s * s * (1.0 - 0.5 * s);
            [
                way,
                speed * s * s * (3.0 - 2.0 * s),
                speed / b * 6.0 * s * (1.0 - s),
                speed / (b * b) * (6.0 - 12.0 * s),
            ]
        };
        if time_s < b {
            let [way, rest @ ..] = blended(time_s / b);
            let [v, a, j] = rest;
            [from + way, v, a, j]
        } else if time_s < b + held_s {
            [from + speed * (time_s - 0.5 * b), speed, 0.0, 0.0]
        } else {
            let [way, v, a, j] = blended(((held_s + 2.0 * b - time_s) / b).clamp(0.0, 1.0));
            [from + speed * (held_s + b) - way, v, -a, j]
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
        if let Some((joint, [q, dq, ddq, jerk])) = self.moving(time_s) {
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

    fn at(
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
