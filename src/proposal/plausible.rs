//! Detection of likely units and signs from the arm's limits, its nominal masses and the work of
//! its drives.

use core::f64::consts::TAU;

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{JointIndex, JointKind, Robot};
use didim_formats::{TimeLimits, unwrap_turns};

use super::limits::ProposalLimits;
use super::value::{
    Guess, POSITION_UNIT_QUESTION, TORQUE_SIGN_QUESTION, TORQUE_UNIT_QUESTION, ValueOrigin,
    list_text, parse_value, quote_text,
};
use crate::cell::{MISSING_VALUE, POSITION_UNITS, QuantityUnits, TORQUE_UNITS};
use crate::text::significant_digits;

/// Number of rows to inspect.
const INSPECTED_ROWS: usize = 2000;
/// Number of rows to either side for the differences that give speeds and accelerations.
const DIFFERENCE_ROWS: usize = 10;

/// Rounds a rate that is close to a whole number, within the tolerance for a table's times.
pub(super) fn round_rate(rate_hz: f64) -> f64 {
    let rounded = rate_hz.round();
    if (rate_hz / rounded - 1.0).abs() < TimeLimits::DEFAULT.same_rate { rounded } else { rate_hz }
}

/// Proposes the time at which a torque is valid.
pub(super) fn propose_torque_timing(is_command: bool) -> Guess {
    if is_command {
        return Guess::without_value(
            "how long a commanded torque acts: { held = { hold_us = …, delay_us = … } }, as a rule \
            the cycle of the controller",
        );
    }
    let why = "each torque is of the instant of its sample; { held = { hold_us = …, delay_us = … } \
        } where it is a command";
    Guess::assumed(quote_text("instant"), why)
}

/// Joint-side signals in unknown units, which are compared with the arm.
pub(super) struct SignalSurvey<'a> {
    pub(super) robot: &'a Robot,
    /// By joint.
    pub(super) position: Vec<Vec<f64>>,
    pub(super) torque: Vec<Vec<f64>>,
    /// True if angles wrapped at a turn, and were unwrapped.
    pub(super) has_turns: bool,
}

/// Signal torque per unit of gravity torque of the nominal masses, by joint. `None` if gravity does
/// not explain the signal.
type Gravity = Vec<Option<f64>>;

impl SignalSurvey<'_> {
    /// Returns the largest absolute value of the torque signals, in their own unit.
    pub(super) fn largest_torque(&self) -> f64 {
        let values = self.torque.iter().flatten().map(|value| value.abs());
        values.fold(0.0, f64::max)
    }

    fn kinds(&self) -> impl Iterator<Item = JointKind> {
        self.robot.chain().iter().map(|joint| joint.kind)
    }

    /// Checks each joint's positions against its limits, if one unit of the signal is `rad` radians
    /// or `metres` metres.
    fn within_limits(&self, rad: f64, metres: f64) -> Vec<bool> {
        let joints = self.robot.chain().iter().zip(&self.position);
        let within = joints.map(|(joint, position)| {
            let unit = if joint.kind == JointKind::Revolute { rad } else { metres };
            let largest = joint.limits.position_min.abs().max(joint.limits.position_max.abs());
            position
                .iter()
                .all(|value| (value * unit).abs() <= ProposalLimits::DEFAULT.limit_factor * largest)
        });
        within.collect()
    }

    /// Counts the joints whose motion exceeds the minimum in the signal's own unit.
    fn moving_count(&self) -> usize {
        self.position
            .iter()
            .filter(|values| value_span(values) > ProposalLimits::DEFAULT.min_motion)
            .count()
    }

    /// Returns true if positions jump by 360 and stay within: angles in degrees that wrap.
    fn has_full_degrees(&self) -> bool {
        let degrees = TAU.to_degrees();
        let turn_share = ProposalLimits::DEFAULT.turn_share;
        let mut values = self.position.iter().flatten();
        let mut steps = (self.position.iter())
            .flat_map(|values| values.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
        values.all(|value| value.abs() <= degrees)
            && steps.any(|step| (step / degrees - 1.0).abs() < turn_share)
    }

    /// Proposes rad or deg, or m or mm, from the limits of the joints.
    pub(super) fn position_unit(&self) -> Guess {
        if self.kinds().any(|kind| kind == JointKind::Prismatic) {
            return Guess::without_value(POSITION_UNIT_QUESTION);
        }
        if let Some(guess) = self.unit_by_limits_in_degrees() {
            return guess;
        }
        if self.has_full_degrees() {
            let why = "the positions jump by 360, and none is beyond";
            return Guess::assumed(self.units(["deg", "mm"]), why);
        }
        let si = self.within_limits(1.0, 1.0);
        let scaled = self.within_limits(1f64.to_radians(), 1e-3);
        let is_every = |within: &[bool]| within.iter().all(|is| *is);
        let beyond = si.iter().filter(|is| !**is).count();
        if is_every(&si) && 2 * self.moving_count() > self.position.len() {
            let why = "all positions are within the joints' limits, and would be next to no motion \
                in degrees";
            return Guess::assumed(self.units(["rad", "m"]), why);
        }
        if is_every(&scaled) && 2 * beyond > self.position.len() {
            let why = "most joints would be beyond their limits in radians, and none is in degrees";
            return Guess::assumed(self.units(["deg", "mm"]), why);
        }
        Guess::without_value(POSITION_UNIT_QUESTION)
    }

    /// Proposes the unit if the limits of most joints are beyond any joint's motion in radians, so
    /// that they are in degrees.
    fn unit_by_limits_in_degrees(&self) -> Option<Guess> {
        let [least, most] = ProposalLimits::DEFAULT.degree_limits_rad;
        let limits = self.robot.chain().iter().map(|joint| &joint.limits);
        let limits: Vec<f64> =
            limits.map(|limits| limits.position_min.abs().max(limits.position_max.abs())).collect();
        let beyond = limits.iter().filter(|limit| (least..most).contains(*limit)).count();
        if 2 * beyond <= limits.len() {
            return None;
        }
        let limit = limits.iter().copied().filter(|limit| *limit < most).fold(0.0, f64::max);
        let span = self.position.iter().map(|values| value_span(values)).fold(0.0, f64::max);
        let why = format!(
            "the limits of the joints, up to {limit:.0} rad, look like degrees: correct them to \
            radians in the URDF"
        );
        Some(match span > least {
            true => {
                let why = format!("{why}; the positions span {span:.0}, which are degrees too");
                Guess::assumed(self.units(["deg", "mm"]), &why)
            }
            false => Guess::without_value(&format!("{POSITION_UNIT_QUESTION}; {why}")),
        })
    }

    /// Returns one unit for all axes, or a list with one unit per axis.
    fn units(&self, [turn, length]: [&str; 2]) -> String {
        let quoted_units =
            |kind| quote_text(if kind == JointKind::Revolute { turn } else { length });
        let units: Vec<String> = self.kinds().map(quoted_units).collect();
        one_or_each(&units)
    }

    /// Returns the signal torque per unit of the nominal arm's torque, by joint, if gravity
    /// explains the signal.
    fn gravity(&self) -> Gravity {
        let joints = self.robot.joints();
        let Some(nominal) = self.robot.nominal() else { return vec![None; joints] };
        let model = Model::new(self.robot);
        let mut workspace = Workspace::new();
        let rows = self.position.first().map_or(0, Vec::len);
        let inspected: Vec<usize> = (DIFFERENCE_ROWS..rows.saturating_sub(DIFFERENCE_ROWS))
            .step_by((rows / INSPECTED_ROWS).max(1))
            .collect();
        let mut columns = vec![Vec::with_capacity(inspected.len()); joints];
        for row in &inspected {
            let q: Vec<f64> = self.position.iter().map(|values| values[*row]).collect();
            let mut gravity = vec![0.0; joints];
            model.bias(
                &mut workspace,
                nominal.standard_parameters(),
                &q,
                &vec![0.0; joints],
                &mut gravity,
            );
            columns.iter_mut().zip(gravity).for_each(|(column, torque)| column.push(torque));
        }
        let factor_of = |(joint, gravity): (usize, &Vec<f64>)| {
            gravity_ratio(&self.position[joint], &self.torque[joint], &inspected, gravity)
        };
        columns.iter().enumerate().map(factor_of).collect()
    }

    /// Returns the signals in SI units, with positions converted from a unit as TOML, and torques
    /// from one that has a size. Angles that jump by a turn are unwrapped.
    pub(super) fn in_si(&self, unit: &str, torque_unit: Option<&toml::Value>) -> Option<Self> {
        let sizes = self.unit_sizes(&parse_value(unit)?, &POSITION_UNITS)?;
        let sized_torque = torque_unit.filter(|unit| is_sized(unit));
        let torque_sizes = sized_torque.and_then(|unit| self.unit_sizes(unit, &TORQUE_UNITS));
        let mut position = scaled_columns(&self.position, &sizes);
        let angles = position.iter_mut().zip(self.kinds());
        let mut angles: Vec<&mut Vec<f64>> = angles
            .filter(|(_, kind)| *kind == JointKind::Revolute)
            .map(|(values, _)| values)
            .collect();
        let has_turns = angles.iter().any(|values| values.windows(2).any(is_turn));
        if has_turns {
            angles.iter_mut().for_each(|values| unwrap_turns(values));
        }
        let torque = torque_sizes.map(|sizes| scaled_columns(&self.torque, &sizes));
        let torque = torque.unwrap_or_else(|| self.torque.clone());
        Some(Self { robot: self.robot, position, torque, has_turns })
    }

    /// Returns the size of the unit of each joint, from one unit or a list.
    fn unit_sizes(&self, unit: &toml::Value, units: &QuantityUnits) -> Option<Vec<f64>> {
        let joints = self.position.len();
        let each = match unit {
            toml::Value::Array(units) => units.clone(),
            one => vec![one.clone(); joints],
        };
        let size = |(unit, kind): (&toml::Value, JointKind)| match unit {
            toml::Value::String(name) => units.size(name, kind),
            unit => {
                let size = unit.get("si")?;
                let integer = || i32::try_from(size.as_integer()?).ok().map(f64::from);
                size.as_float().or_else(integer)
            }
        };
        let sizes = each.iter().zip(self.kinds()).map(size);
        (each.len() == joints).then(|| sizes.collect())?
    }

    /// Proposes unit and sign of the torques.
    pub(super) fn torque(&self, named: Option<(&str, f64)>) -> [Guess; 2] {
        let gravity = self.gravity();
        let factors_found: Vec<f64> = gravity.iter().flatten().copied().collect();
        let factors: Vec<String> = gravity
            .iter()
            .enumerate()
            .filter_map(|(joint, factor)| Some((factor.as_ref()?, self.label(joint))))
            .map(|(factor, joint)| {
                format!("{} of it in joint {joint}", significant_digits(*factor, 3))
            })
            .collect();
        let why = format!("gravity of the nominal masses shows, {}", factors.join(", "));
        let unit = match named {
            Some((unit, scale)) if factors_found.is_empty() || are_near(&factors_found, scale) => {
                Guess::from_file(quote_text(unit), "the columns' names")
            }
            Some((unit, _)) => {
                Guess::without_value(&format!("the unit: the columns' names say {unit}, and {why}"))
            }
            None if are_near(&factors_found, 1.0) => Guess::assumed(self.units(["Nm", "N"]), &why),
            None if are_near(&factors_found, 1e3)
                && self.kinds().all(|kind| kind == JointKind::Revolute) =>
            {
                Guess::assumed(quote_text("mNm"), &why)
            }
            None => Guess::without_value(TORQUE_UNIT_QUESTION),
        };
        // If the ratio is far from every unit, the torque shows no sign, because the nominal masses
        // are not those of the arm.
        let gravity = if is_a_unit(&factors_found) { gravity } else { vec![None; gravity.len()] };
        [unit, self.sign(&gravity, &why)]
    }

    /// Returns number and name of a joint.
    fn label(&self, joint: usize) -> String {
        self.robot.joint_label(JointIndex::new(joint))
    }

    /// Proposes the sign from gravity, or else from the friction losses, joint by joint. If neither
    /// is conclusive for a joint, the sign is asked.
    fn sign(&self, gravity: &Gravity, why: &str) -> Guess {
        let sign = |of: f64| if of < 0.0 { "-1" } else { "1" };
        let signs: Vec<&str> = gravity.iter().flatten().map(|factor| sign(*factor)).collect();
        let back = self.return_row();
        let share_lost = |joint| self.lost_share(back?, joint);
        // A joint without gravity stores little energy, so the arm need not be back.
        let last_row = self.position.first().map_or(0, Vec::len).saturating_sub(1);
        let share_of_joint = |joint| self.lost_share(last_row, Some(joint));
        let Some(first) = signs.first() else {
            return match share_lost(None) {
                Some(share) => Guess::assumed(
                    sign(share).to_owned(),
                    &format!(
                        "so {:.0} % of the drives' power is lost to friction",
                        100.0 * share.abs()
                    ),
                ),
                None => Guess::without_value(TORQUE_SIGN_QUESTION),
            };
        };
        let alike = signs.iter().all(|sign| sign == first);
        let each: Vec<Option<&str>> = (gravity.iter().enumerate())
            .map(|(joint, factor)| factor.or_else(|| share_of_joint(joint)).map(sign))
            .collect();
        if signs.len() == gravity.len() && alike {
            return Guess::from_file((*first).to_owned(), why);
        }
        if each.iter().all(|sign| sign.as_ref() == Some(first)) {
            let why = format!("{why}; the other joints lose power to friction");
            return Guess::assumed((*first).to_owned(), &why);
        }
        let doubtful = (each.iter().enumerate()).filter(|(_, sign)| sign.is_none());
        let doubtful: Vec<String> = doubtful.map(|(joint, _)| self.label(joint)).collect();
        let why = match doubtful.is_empty() {
            true => why.to_owned(),
            false => format!("{why}; not known of joint {}", doubtful.join(", ")),
        };
        let value: Vec<String> = each
            .iter()
            .map(|sign| sign.map_or_else(|| quote_text(MISSING_VALUE), str::to_owned))
            .collect();
        let standing = match each.iter().all(Option::is_some) {
            true => ValueOrigin::Assumed,
            false => ValueOrigin::Missing,
        };
        Guess {
            value: list_text(&value),
            origin: standing,
            explanation: format!("{why}. {TORQUE_SIGN_QUESTION}"),
        }
    }

    /// Returns the last row in the second half of the log in which the arm is nearly back at its
    /// initial position.
    fn return_row(&self) -> Option<usize> {
        let rows = self.position.first().map_or(0, Vec::len);
        let near: Vec<f64> = self
            .position
            .iter()
            .map(|values| ProposalLimits::DEFAULT.return_tolerance * value_span(values))
            .collect();
        (rows / 2..rows).rev().find(|row: &usize| {
            let joints = self.position.iter().zip(&near);
            joints.into_iter().all(|(values, near)| (values[*row] - values[0]).abs() <= *near)
        })
    }

    /// Returns the share of power that one joint or all joints lose up to a row in which the arm is
    /// back at its initial position. `None` if the share is too small.
    fn lost_share(&self, back: usize, joint: Option<usize>) -> Option<f64> {
        let (mut work, mut all) = (0.0, 0.0);
        let is_selected = |(index, _): &(usize, _)| joint.is_none_or(|joint| joint == *index);
        for (_, (position, torque)) in
            self.position.iter().zip(&self.torque).enumerate().filter(is_selected)
        {
            for row in 1..=back {
                let step =
                    0.5 * (torque[row] + torque[row - 1]) * (position[row] - position[row - 1]);
                work += step;
                all += step.abs();
            }
        }
        let share = work / all;
        (share.abs() > ProposalLimits::DEFAULT.min_lost_share).then_some(share)
    }

    /// Returns true if gravity of the nominal masses explains the torques as N·m or mN·m on the
    /// joint side.
    pub(super) fn is_of_joints(&self) -> bool {
        let factors: Vec<f64> = self.gravity().into_iter().flatten().collect();
        factors.len() > 1 && is_a_unit(&factors)
    }

    /// Returns true if the positions are within the joints' limits in a possible unit.
    pub(super) fn may_be_of_joints(&self) -> bool {
        let units = [(1.0, 1.0), (1f64.to_radians(), 1e-3)];
        units.iter().any(|(rad, metres)| self.within_limits(*rad, *metres).iter().all(|is| *is))
    }
}

/// Fits the ratio of signal torque to gravity torque, together with friction, an offset and the
/// joint's own acceleration. `None` unless gravity explains a large share of the remaining torque.
fn gravity_ratio(
    position: &[f64],
    torque: &[f64],
    inspected: &[usize],
    gravity: &[f64],
) -> Option<f64> {
    let column =
        |of: &dyn Fn(usize) -> f64| -> Vec<f64> { inspected.iter().map(|row| of(*row)).collect() };
    let step = |row: usize| position[row + DIFFERENCE_ROWS] - position[row - DIFFERENCE_ROWS];
    let bend = |row: usize| {
        position[row + DIFFERENCE_ROWS] - 2.0 * position[row] + position[row - DIFFERENCE_ROWS]
    };
    let others =
        [column(&|_| 1.0), column(&|row| step(row).signum()), column(&step), column(&bend)];
    let torque = column(&|row| torque[row]);
    let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    // Gram-Schmidt with each step made twice. It gives the residuals of gravity and of the torque.
    let mut directions: Vec<Vec<f64>> = Vec::new();
    let without = |values: &[f64], directions: &[Vec<f64>]| {
        let mut remainder = values.to_vec();
        for direction in directions.iter().chain(directions) {
            let along: f64 = remainder.iter().zip(direction).map(|(a, b)| a * b).sum();
            remainder
                .iter_mut()
                .zip(direction)
                .for_each(|(remaining, of)| *remaining -= along * of);
        }
        remainder
    };
    for other in &others {
        let mut remainder = without(other, &directions);
        let size = square(&remainder).sqrt();
        // If a joint never reverses, its sign of motion cannot be distinguished from the offset.
        if size > 1e-9 * square(other).sqrt() {
            remainder.iter_mut().for_each(|value| *value /= size);
            directions.push(remainder);
        }
    }
    let [gravity, torque] = [gravity, &torque].map(|values| without(values, &directions));
    let both: f64 = gravity.iter().zip(&torque).map(|(gravity, torque)| gravity * torque).sum();
    let share = both * both / (square(&gravity) * square(&torque));
    (share > ProposalLimits::DEFAULT.min_explained_share).then(|| both / square(&gravity))
}

fn value_span(values: &[f64]) -> f64 {
    let (low, high) =
        values.iter().fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
    high - low
}

/// Returns true if the torques are N·m or mN·m of the nominal masses.
fn is_a_unit(reported: &[f64]) -> bool {
    are_near(reported, 1.0) || are_near(reported, 1e3)
}

/// Returns true if torques in this unit match those of the nominal masses. `reported` has the ratio
/// of the two for each joint that shows it.
fn are_near(reported: &[f64], unit: f64) -> bool {
    let logarithms = reported.iter().map(|factor| (factor.abs() / unit).ln());
    #[expect(clippy::cast_precision_loss, reason = "joints")]
    let mean = logarithms.clone().sum::<f64>() / reported.len() as f64;
    let [complete, each] = ProposalLimits::DEFAULT.mass_factors.map(f64::ln);
    !reported.is_empty() && mean.abs() < complete && logarithms.clone().all(|of| of.abs() < each)
}

/// Multiplies each column by its size.
fn scaled_columns(columns: &[Vec<f64>], sizes: &[f64]) -> Vec<Vec<f64>> {
    let scaled = columns.iter().zip(sizes);
    scaled.map(|(values, size)| values.iter().map(|value| value * size).collect()).collect()
}

/// Returns true if two consecutive angles differ by a turn.
fn is_turn(pair: &[f64]) -> bool {
    let turns = (pair[1] - pair[0]).abs() / TAU;
    (turns - 1.0).abs() < ProposalLimits::DEFAULT.turn_share
}

/// Returns true for a unit that is given by its size, for all joints or one of them.
fn is_sized(unit: &toml::Value) -> bool {
    match unit {
        toml::Value::Array(units) => units.iter().any(toml::Value::is_table),
        unit => unit.is_table(),
    }
}

/// Returns one value for all axes if the values are equal, or else a list with one value per axis.
fn one_or_each(values: &[String]) -> String {
    match values.first() {
        Some(first) if values.iter().all(|value| value == first) => first.clone(),
        _ => list_text(values),
    }
}
