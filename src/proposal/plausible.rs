//! What units and signs are likely, by the arm's limits, its nominal masses and the work of its drives.

use didim_core::dynamics::{Model, Workspace};
use didim_core::robot::{JointKind, Robot};
use didim_formats::RATE_TOLERANCE;

use super::value::{
    Guess, Standing, WHICH_POSITION, WHICH_SIGN, WHICH_TORQUE, list, parsed, quoted, texts,
};
use crate::cell::OPEN;
use crate::text::significant;

/// A position may be out of its limits by so many times: they are round numbers.
const WITHIN: f64 = 1.02;
/// So much motion of a joint would be none in the smaller unit \[rad or m\].
const MOVED: f64 = 0.3;
/// Rows that are looked at.
const LOOKED_AT: usize = 2000;
/// The share of a torque's square that gravity explains where it can be told.
const EXPLAINED: f64 = 0.5;
/// Speeds and accelerations are differences over so many rows to either side.
const REACH: usize = 10;
/// The nominal masses are right by so many times, with payload: on the whole, and at each joint.
const FACTORS: [f64; 2] = [2.0, 3.0];
/// The share of the power that a drive loses in an arm with friction.
const LOST: f64 = 0.1;
/// The part of its span by which a joint is back where it was.
const BACK: f64 = 0.1;

/// Rows of a second of any robot's log: three powers of ten, so that one unit of time fits.
pub(super) const RATES_HZ: core::ops::Range<f64> = 20.0..20_000.0;

/// A rate that is a round number, as far as a table's times are held to it, is meant to be one.
pub(super) fn rounded(rate_hz: f64) -> f64 {
    let whole = rate_hz.round();
    if (rate_hz / whole - 1.0).abs() < RATE_TOLERANCE { whole } else { rate_hz }
}

/// When a torque acts.
pub(super) fn torque_valid(is_command: bool) -> Guess {
    if is_command {
        return Guess::open(
            "how long a commanded torque acts: { held = { hold_us = …, delay_us = … } }, as a rule the cycle of the controller",
        );
    }
    let why = "each torque is of the instant of its sample; { held = { hold_us = …, delay_us = … } } where it is a command";
    Guess::assumed(quoted("instant"), why)
}

/// Signals of the joints' side in units that nobody stated, against the arm.
pub(super) struct Look<'a> {
    pub(super) robot: &'a Robot,
    /// By joint.
    pub(super) position: Vec<Vec<f64>>,
    pub(super) torque: Vec<Vec<f64>>,
}

/// How gravity of the nominal masses explains the torque of a joint: the torque of one, in their unit.
type Gravity = Vec<Option<f64>>;

impl Look<'_> {
    fn kinds(&self) -> impl Iterator<Item = JointKind> {
        self.robot.chain().iter().map(|joint| joint.kind)
    }

    /// In units of so many rad, and so many m.
    fn within_limits(&self, rad: f64, metres: f64) -> Vec<bool> {
        let joints = self.robot.chain().iter().zip(&self.position);
        let within = joints.map(|(joint, position)| {
            let unit = if joint.kind == JointKind::Revolute { rad } else { metres };
            let largest = joint.limits.position_min.abs().max(joint.limits.position_max.abs());
            position.iter().all(|value| (value * unit).abs() <= WITHIN * largest)
        });
        within.collect()
    }

    /// How many joints move by more than a quantity of the unit as it stands.
    fn moving(&self) -> usize {
        self.position.iter().filter(|values| span(values) > MOVED).count()
    }

    /// rad or deg, m or mm, by the limits of the joints.
    pub(super) fn position_unit(&self) -> Guess {
        if self.kinds().any(|kind| kind == JointKind::Prismatic) {
            return Guess::open(WHICH_POSITION);
        }
        let si = self.within_limits(1.0, 1.0);
        let scaled = self.within_limits(1f64.to_radians(), 1e-3);
        let all = |within: &[bool]| within.iter().all(|is| *is);
        let beyond = si.iter().filter(|is| !**is).count();
        if all(&si) && 2 * self.moving() > self.position.len() {
            let why = "all positions are within the joints' limits, and would be next to no motion in degrees";
            return Guess::assumed(self.units(["rad", "m"]), why);
        }
        if all(&scaled) && 2 * beyond > self.position.len() {
            let why = "most joints would be beyond their limits in radians, and none is in degrees";
            return Guess::assumed(self.units(["deg", "mm"]), why);
        }
        Guess::open(WHICH_POSITION)
    }

    /// One for all axes, or one for each.
    fn units(&self, [turn, length]: [&str; 2]) -> String {
        let of = |kind| quoted(if kind == JointKind::Revolute { turn } else { length });
        let units: Vec<String> = self.kinds().map(of).collect();
        one_or_each(&units)
    }

    /// How much torque of the signal is one of the nominal arm's, by joint, where gravity explains the signal.
    fn gravity(&self) -> Gravity {
        let joints = self.robot.joints();
        let Some(nominal) = self.robot.nominal() else { return vec![None; joints] };
        let model = Model::new(self.robot);
        let mut workspace = Workspace::new();
        let rows = self.position.first().map_or(0, Vec::len);
        let looked_at: Vec<usize> =
            (REACH..rows.saturating_sub(REACH)).step_by((rows / LOOKED_AT).max(1)).collect();
        let mut columns = vec![Vec::with_capacity(looked_at.len()); joints];
        for row in &looked_at {
            let q: Vec<f64> = self.position.iter().map(|values| values[*row]).collect();
            let mut gravity = vec![0.0; joints];
            model.bias(&mut workspace, nominal.standard(), &q, &vec![0.0; joints], &mut gravity);
            columns.iter_mut().zip(gravity).for_each(|(column, torque)| column.push(torque));
        }
        let of = |(joint, gravity): (usize, &Vec<f64>)| {
            explained(&self.position[joint], &self.torque[joint], &looked_at, gravity)
        };
        columns.iter().enumerate().map(of).collect()
    }

    /// The same with positions in rad or m, where this is their unit, as TOML.
    pub(super) fn in_si(&self, unit: &str) -> Option<Self> {
        let units: Vec<String> = match parsed(unit)? {
            toml::Value::String(unit) => vec![unit; self.position.len()],
            toml::Value::Array(units) => texts(&units),
            _ => return None,
        };
        if units.len() != self.position.len() {
            return None;
        }
        let scaled = self.position.iter().zip(&units).map(|(position, unit)| {
            let scale = match unit.as_str() {
                "rad" | "m" => 1.0,
                "deg" => 1f64.to_radians(),
                "mm" => 1e-3,
                _ => return None,
            };
            Some(position.iter().map(|value| value * scale).collect())
        });
        let position: Vec<Vec<f64>> = scaled.collect::<Option<_>>()?;
        Some(Self { robot: self.robot, position, torque: self.torque.clone() })
    }

    /// Unit and sign of the torques.
    pub(super) fn torque(&self, named: Option<(&str, f64)>) -> [Guess; 2] {
        let gravity = self.gravity();
        let told: Vec<f64> = gravity.iter().flatten().copied().collect();
        let factors: Vec<String> = gravity
            .iter()
            .zip(1..)
            .filter_map(|(factor, joint)| Some((factor.as_ref()?, joint)))
            .map(|(factor, joint)| format!("{} of it in joint {joint}", significant(*factor, 3)))
            .collect();
        let why = format!("gravity of the nominal masses shows, {}", factors.join(", "));
        let unit = match named {
            Some((unit, scale)) if told.is_empty() || are_near(&told, scale) => {
                Guess::found(quoted(unit), "the columns' names")
            }
            Some((unit, _)) => {
                Guess::open(&format!("the unit: the columns' names say {unit}, and {why}"))
            }
            None if are_near(&told, 1.0) => Guess::assumed(self.units(["Nm", "N"]), &why),
            None if are_near(&told, 1e3)
                && self.kinds().all(|kind| kind == JointKind::Revolute) =>
            {
                Guess::assumed(quoted("mNm"), &why)
            }
            None => Guess::open(WHICH_TORQUE),
        };
        // What is far from every unit says nothing of the sign: the nominal masses are not the arm's.
        let gravity = if is_a_unit(&told) { gravity } else { vec![None; gravity.len()] };
        [unit, self.sign(&gravity, &why)]
    }

    /// By gravity; where that does not show, by what friction takes; where neither, as of the other joints.
    fn sign(&self, gravity: &Gravity, why: &str) -> Guess {
        let sign = |of: f64| if of < 0.0 { "-1" } else { "1" };
        let told: Vec<&str> = gravity.iter().flatten().map(|factor| sign(*factor)).collect();
        let back = self.back();
        let lost = |joint| self.lost(back?, joint);
        let Some(first) = told.first() else {
            return match lost(None) {
                Some(share) => Guess::assumed(
                    sign(share).to_owned(),
                    &format!(
                        "so {:.0} % of the drives' power is lost to friction",
                        100.0 * share.abs()
                    ),
                ),
                None => Guess::open(WHICH_SIGN),
            };
        };
        let alike = told.iter().all(|sign| sign == first);
        let each: Vec<Option<&str>> = (gravity.iter().enumerate())
            .map(|(joint, factor)| factor.or_else(|| lost(Some(joint))).map(sign))
            .collect();
        if told.len() == gravity.len() && alike {
            return Guess::found((*first).to_owned(), why);
        }
        if each.iter().flatten().all(|sign| sign == first) {
            return Guess::assumed(
                (*first).to_owned(),
                &format!("{why}; the others are taken alike"),
            );
        }
        let value: Vec<String> =
            each.iter().map(|sign| sign.map_or_else(|| quoted(OPEN), str::to_owned)).collect();
        let standing = match each.iter().all(Option::is_some) {
            true => Standing::Assumed,
            false => Standing::Missing,
        };
        Guess { value: list(&value), standing, why: format!("{why}. {WHICH_SIGN}") }
    }

    /// The last row of the second half in which the arm is nearly where it began.
    fn back(&self) -> Option<usize> {
        let rows = self.position.first().map_or(0, Vec::len);
        let near: Vec<f64> = self.position.iter().map(|values| BACK * span(values)).collect();
        let is_back = |row: &usize| {
            let joints = self.position.iter().zip(&near);
            joints.into_iter().all(|(values, near)| (values[*row] - values[0]).abs() <= *near)
        };
        (rows / 2..rows).rev().find(is_back)
    }

    /// The share of its power that does not come back to a joint, or to all, up to a row in which the arm is where it began;
    /// nothing where that is little.
    fn lost(&self, back: usize, joint: Option<usize>) -> Option<f64> {
        let (mut work, mut all) = (0.0, 0.0);
        let of = |(index, _): &(usize, _)| joint.is_none_or(|joint| joint == *index);
        for (_, (position, torque)) in self.position.iter().zip(&self.torque).enumerate().filter(of)
        {
            for row in 1..=back {
                let step =
                    0.5 * (torque[row] + torque[row - 1]) * (position[row] - position[row - 1]);
                work += step;
                all += step.abs();
            }
        }
        let share = work / all;
        (share.abs() > LOST).then_some(share)
    }

    /// Whether gravity of the nominal masses explains the torques in N·m or mN·m of the joints' side.
    pub(super) fn is_of_joints(&self) -> bool {
        let told: Vec<f64> = self.gravity().into_iter().flatten().collect();
        told.len() > 1 && is_a_unit(&told)
    }

    /// Whether the positions are within the joints' limits in a unit that they can have.
    pub(super) fn may_be_of_joints(&self) -> bool {
        let units = [(1.0, 1.0), (1f64.to_radians(), 1e-3)];
        units.iter().any(|(rad, metres)| self.within_limits(*rad, *metres).iter().all(|is| *is))
    }
}

/// The torque of the signal to one of gravity, beside friction, offset and the joint's own acceleration, where gravity
/// explains much of what these leave.
fn explained(
    position: &[f64],
    torque: &[f64],
    looked_at: &[usize],
    gravity: &[f64],
) -> Option<f64> {
    let column =
        |of: &dyn Fn(usize) -> f64| -> Vec<f64> { looked_at.iter().map(|row| of(*row)).collect() };
    let step = |row: usize| position[row + REACH] - position[row - REACH];
    let bend = |row: usize| position[row + REACH] - 2.0 * position[row] + position[row - REACH];
    let others =
        [column(&|_| 1.0), column(&|row| step(row).signum()), column(&step), column(&bend)];
    let torque = column(&|row| torque[row]);
    let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    // Gram and Schmidt, twice each: what is left of gravity and of the torque.
    let mut directions: Vec<Vec<f64>> = Vec::new();
    let without = |values: &[f64], directions: &[Vec<f64>]| {
        let mut left = values.to_vec();
        for direction in directions.iter().chain(directions) {
            let along: f64 = left.iter().zip(direction).map(|(a, b)| a * b).sum();
            left.iter_mut().zip(direction).for_each(|(left, of)| *left -= along * of);
        }
        left
    };
    for other in &others {
        let mut left = without(other, &directions);
        let size = square(&left).sqrt();
        // A joint that never turns round has no sign of its own beside the offset.
        if size > 1e-9 * square(other).sqrt() {
            left.iter_mut().for_each(|value| *value /= size);
            directions.push(left);
        }
    }
    let [gravity, torque] = [gravity, &torque].map(|values| without(values, &directions));
    let both: f64 = gravity.iter().zip(&torque).map(|(gravity, torque)| gravity * torque).sum();
    let share = both * both / (square(&gravity) * square(&torque));
    (share > EXPLAINED).then(|| both / square(&gravity))
}

fn span(values: &[f64]) -> f64 {
    let (low, high) =
        values.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    high - low
}

/// Whether torques are N·m or mN·m of the nominal masses.
fn is_a_unit(told: &[f64]) -> bool {
    are_near(told, 1.0) || are_near(told, 1e3)
}

/// Whether torques in a unit are those of the nominal masses, by how many times they are in each joint that tells.
fn are_near(told: &[f64], unit: f64) -> bool {
    let logarithms = told.iter().map(|factor| (factor.abs() / unit).ln());
    #[expect(clippy::cast_precision_loss, reason = "joints")]
    let mean = logarithms.clone().sum::<f64>() / told.len() as f64;
    let [whole, each] = FACTORS.map(f64::ln);
    !told.is_empty() && mean.abs() < whole && logarithms.clone().all(|of| of.abs() < each)
}

/// One for all where they are the same.
fn one_or_each(values: &[String]) -> String {
    match values.first() {
        Some(first) if values.iter().all(|value| value == first) => first.clone(),
        _ => list(values),
    }
}
