//! Comparison of alternative readings of the signals and of the arm.
//!
//! Each alternative corrects the signals, or replaces the model, and is fitted like the configured
//! reading. Alternatives compete with each other by the logarithm of their likelihood ratio against
//! the configured reading, with Schwarz's penalty for numbers that the data choose (*Ann. Statist.*
//! 6, 1978) and one for the number of alternatives m (generalised likelihood ratio: Willsky and
//! Jones, *IEEE TAC* 21, 1976):
//!
//! ```text
//! ΔL = Σ_j N_j ln(e_j / e'_j) − (k/2) ln Σ_j N_j − ln m
//! ```
//!
//! e are the relative errors of the joints, N the independent rows by the autocorrelation of the
//! residuals of the alternative: those of a grossly wrong reading would hide it.

mod alternative;
mod bank;
mod chosen;
mod gravity_columns;
mod lean;
mod normal_equations;
mod refit;
mod screen;
mod wording;

pub use alternative::{Alternative, Lag, Signal};
pub use chosen::Chosen;
pub use lean::Lean;

use nalgebra::DVector;

use self::bank::{Group, bank, lag_times};
use self::refit::{Inspected, JointResidual, Refit, Shared, Solved, context_of};
use self::screen::{RESOLUTION_OF_DIRECTION, Screen};
use super::significance::Significance;
use crate::identification::problem::{Context, Experiment};
use crate::regression::{ResidualAnalysis, RowFilter};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, MotorIndex, Robot};

/// Smallest ΔL of an alternative that is named, and smallest distance from the next one that is
/// unrelated \[nat\]: odds of 22,000 to 1. Residuals are coloured, and models never exact.
const DECISIVE: f64 = 10.0;

/// Largest share of the residual power of one joint that a named alternative leaves.
const LEAVES: f64 = 0.5;

/// Smallest reduction of that joint's residual, as a share of its torque. Smaller errors matter to
/// no use. Healthy recordings of real arms reach 2 %.
const MATTERS: f64 = 0.02;

/// The same two limits for the screening, whose rows are few and not filtered.
const MAY_LEAVE: f64 = 0.7;
const MAY_MATTER: f64 = 0.012;

/// Largest number of alternatives that are fitted after the screening.
const FINALISTS: usize = 6;

/// Largest number of wrong readings that are found at once.
const MOST_AT_ONCE: usize = 3;

/// Steps of the golden-section search for the number of an alternative. They narrow an interval to
/// 1 % of its length.
const REFINING_STEPS: usize = 10;

/// Change of the logarithm of a number at which its likelihood is compared. The likelihood is a
/// parabola over such a change, and differs by more than rounding.
const STEP: f64 = 0.05;

/// Largest number of such steps from the number of the screening to the most likely one.
const MOST_STEPS: usize = 20;

/// Size and significance of an alternative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Largest reduction of the residual of a joint, as a share of its torque.
    pub explained: f64,
    /// Odds against the configured reading. `None` if they are not a number.
    pub significance: Option<Significance>,
}

/// Alternatives that fit decisively better.
#[derive(Default)]
pub(super) struct FoundAlternatives {
    /// The most decisive first. Each is found with the ones before it applied.
    pub(super) alternatives: Vec<(Alternative, Evidence)>,
    /// Change of the parameters with all of them, and with one that is not named because it matters
    /// too little, or because another one explains nearly as much. `None` if the model is another
    /// one.
    pub(super) parameter_change: Option<DVector<f64>>,
}

impl FoundAlternatives {
    /// Compares the alternatives on the first samples of an experiment. Most of the residual of
    /// rows that are not filtered is noise, so nothing is found there.
    pub(super) fn find(context: &Context<'_>) -> Self {
        if context.decimation.is_none() {
            return Self::default();
        }
        let inspected = Inspected::new(context);
        // A reading that cannot be fitted has no residual to explain.
        let own = inspected.context(context);
        let Some(configured) = own.and_then(|own| Refit::new(own, Shared::Nothing)) else {
            return Self::default();
        };
        let mut found = Self::default();
        explain(&configured, &inspected.samples, &mut found);
        if let Some(last) = &mut found.parameter_change {
            *last -= configured.solved.parameters();
        }
        found
    }
}

/// Returns the signal of a joint whose inversion leaves the smaller residual. `None` if neither can
/// be fitted.
pub(super) fn better_sign(context: &Context<'_>, joint: JointIndex) -> Option<Signal> {
    let inspected = Inspected::new(context);
    let context = &inspected.context(context)?;
    let motor = MotorIndex::new(joint.position());
    let inverted = |signal| Alternative::OppositeSign { motor, signal };
    let residual = |signal| {
        let alternative = inverted(signal);
        let reading = Reading::new(&alternative, context, &inspected.samples);
        let refit = reading.refit(context, Shared::Nothing)?;
        Some((relative_squares(&refit).iter().sum::<f64>(), signal))
    };
    let residuals = [Signal::Torque, Signal::Position].into_iter().filter_map(residual);
    residuals.min_by(|(one, _), (other, _)| one.total_cmp(other)).map(|(_, signal)| signal)
}

/// Returns the coupling of two neighbouring joints that is not configured and describes the data:
/// the motor of the outer joint turns with the inner one as far as with its own, either way.
pub(super) fn missing_coupling(
    context: &Context<'_>,
    neighbours: [JointIndex; 2],
) -> Option<Alternative> {
    let [joint, outer] = [neighbours.iter().min()?, neighbours.iter().max()?].map(|of| *of);
    let row = context.robot.transmission().row(outer.position());
    let own = row[outer.position()];
    let is_missing = row[joint.position()] == 0.0;
    let places = [(MotorIndex::new(outer.position()), joint)];
    is_missing.then(|| explaining_coupling(context, places, |_| [own, -own])).flatten()
}

/// Returns a configured coupling of a joint that describes the data with the other sign, or is
/// none.
pub(super) fn other_coupling(context: &Context<'_>, joint: JointIndex) -> Option<Alternative> {
    let (transmission, joints) = (context.robot.transmission(), context.robot.joints());
    let places = (0..joints).flat_map(|motor| (0..joints).map(move |of| (motor, of)));
    let places = places.filter(|(motor, of)| {
        let is_of_joint = [*motor, *of].contains(&joint.position());
        motor != of && is_of_joint && transmission.row(*motor)[*of] != 0.0
    });
    let places = places.map(|(motor, of)| (MotorIndex::new(motor), JointIndex::new(of)));
    explaining_coupling(context, places, |configured| [-configured, 0.0])
}

/// Returns the best of several couplings. `entries` has those that are tried at a place, by the
/// configured one. `None` if both joints of each place keep more than half of their residual power.
fn explaining_coupling(
    context: &Context<'_>,
    places: impl IntoIterator<Item = (MotorIndex, JointIndex)>,
    entries: impl Fn(f64) -> [f64; 2],
) -> Option<Alternative> {
    if context.decimation.is_none() {
        return None;
    }
    let inspected = Inspected::new(context);
    let configured = Refit::new(inspected.context(context)?, Shared::Nothing)?;
    let (context, before) = (&configured.context, relative_squares(&configured));
    let explaining = |alternative: Alternative| {
        let Alternative::Coupling { motor, joint, .. } = alternative else { return None };
        let reading = Reading::new(&alternative, context, &inspected.samples);
        let after = relative_squares(&reading.refit(context, Shared::Nothing)?);
        let explains = |of: usize| after[of] <= LEAVES * before[of];
        let gain: f64 = gains([&before, &after]).sum();
        let is_better = gain > 0.0 && (explains(joint.position()) || explains(motor.position()));
        is_better.then_some((gain, alternative))
    };
    let alternatives = places.into_iter().flat_map(|(motor, joint)| {
        let configured = context.robot.transmission().row(motor.position())[joint.position()];
        entries(configured).map(|entry| Alternative::Coupling { motor, joint, entry, factor: None })
    });
    let best =
        alternatives.filter_map(explaining).max_by(|(one, _), (other, _)| one.total_cmp(other));
    best.map(|(_, alternative)| alternative)
}

/// Signals and model of an alternative.
struct Reading {
    signals: Experiment,
    model: Model,
    /// The arm; `None` as it is configured.
    robot: Option<Robot>,
    /// Base parameters of the model; `None` as they are configured.
    base: Option<BaseParameters>,
}

impl Reading {
    fn new(alternative: &Alternative, context: &Context<'_>, logged: &Experiment) -> Self {
        let signals = alternative.corrected(logged, context.robot.transmission());
        let robot = alternative.arm(context.robot);
        let mut model = robot.as_ref().map_or_else(|| context.model.clone(), Model::new);
        if let Some(gravity_m_s2) = alternative.gravity_m_s2() {
            model = model.with_gravity(gravity_m_s2);
        }
        let compute = || BaseParameters::compute(&model).ok();
        let base = alternative.has_other_model().then(compute).flatten();
        Self { signals, model, robot, base }
    }

    /// Returns the number of base parameters that the model has more than the configured one.
    fn new_parameters(&self, configured: &BaseParameters) -> usize {
        let count = |base: &BaseParameters| base.columns().len();
        self.base.as_ref().map_or(0, |base| count(base).saturating_sub(count(configured)))
    }

    /// Solves with these signals.
    fn refit<'r>(&'r self, context: &Context<'r>, shared: Shared<'_, '_>) -> Option<Refit<'r>> {
        let robot = self.robot.as_ref().unwrap_or(context.robot);
        let base = self.base.as_ref().unwrap_or(context.base);
        let own = context_of((robot, base), &self.signals, context.options, &self.model)?;
        Refit::new(own, shared)
    }
}

/// Adds the best alternative, and those that are found with it applied.
fn explain(refit: &Refit<'_>, logged: &Experiment, found: &mut FoundAlternatives) {
    let is_first = found.alternatives.is_empty();
    let is_comparable = is_first || found.parameter_change.is_some();
    let (alternative, evidence) = match best(refit, logged) {
        None => return,
        Some(Best::Unnamed(parameters)) => {
            found.parameter_change = parameters.filter(|_| is_comparable);
            return;
        }
        Some(Best::Named(alternative, evidence)) => (alternative, evidence),
    };
    let reading = Reading::new(&alternative, &refit.context, logged);
    let (is_same_model, shared) = (!alternative.has_other_model(), alternative.shared(refit));
    found.alternatives.push((alternative, evidence));
    let Some(better) = reading.refit(&refit.context, shared) else {
        found.parameter_change = None;
        return;
    };
    let parameters = || better.solved.parameters().clone();
    found.parameter_change = (is_same_model && is_comparable).then(parameters);
    if found.alternatives.len() < MOST_AT_ONCE {
        explain(&better, &reading.signals, found);
    }
}

/// Alternative with its evidence.
struct Candidate {
    alternative: Alternative,
    /// Squared relative residual of each joint, before and after.
    squares: [Vec<f64>; 2],
    /// Σ_j N_j ln(e_j / e'_j).
    likelihood_gain: f64,
    evidence: f64,
    /// Joints whose residual the alternative explains.
    explained: Vec<usize>,
    /// Independent rows of each joint.
    rows: Vec<f64>,
    /// `None` if it cannot be fitted.
    solved: Option<Solved>,
}

impl Candidate {
    /// Returns true unless the reading turns the friction of a drive negative.
    fn is_possible(&self, configured: &Refit<'_>, filter: &RowFilter) -> bool {
        if !self.alternative.may_turn_friction() {
            return true;
        }
        let motors = self.alternative.motors();
        let of = |solved: &Solved| solved.negative_friction(&configured.context, filter, &motors);
        let own = self.solved.as_ref().map(of).unwrap_or_default();
        if own.is_empty() {
            return true;
        }
        let before = of(&configured.solved);
        own.iter().all(|parameter| before.contains(parameter))
    }

    /// Returns the largest reduction of a joint's relative residual.
    fn largest_reduction(&self) -> f64 {
        let [before, after] = &self.squares;
        let reductions =
            before.iter().zip(after).map(|(before, after)| before.sqrt() - after.sqrt());
        reductions.fold(0.0, f64::max)
    }

    /// Returns the evidence of the rows of some joints. Two alternatives that explain different
    /// joints may both be true.
    fn evidence_of(&self, joints: &[usize]) -> f64 {
        let [before, after] = &self.squares;
        let gains: Vec<f64> = gains([before, after]).collect();
        let of_joints: f64 = joints.iter().map(|joint| gains[*joint] * self.rows[*joint]).sum();
        self.evidence - self.likelihood_gain + of_joints
    }

    /// Returns the likelihood gain with another number; NaN if it cannot be fitted. `before` has
    /// the squared relative residuals of the configured reading.
    fn likelihood_at(
        &self,
        value: f64,
        before: &[f64],
        refit: &Refit<'_>,
        logged: &Experiment,
    ) -> f64 {
        let other = self.alternative.with_constant(value);
        let reading = Reading::new(&other, &refit.context, logged);
        let after = reading.refit(&refit.context, other.shared(refit));
        let after = after.map(|of| relative_squares(&of));
        after.map_or(f64::NAN, |after| likelihood_gain([before, &after], &self.rows))
    }

    /// Returns the alternative with the most likely number, and its standard deviation: by a
    /// parabola through the likelihood at three numbers. `None` if no number is the most likely.
    fn estimated(&self, refit: &Refit<'_>, logged: &Experiment) -> Option<Alternative> {
        let Some(Chosen { mut value, .. }) = self.alternative.constant() else {
            return Some(self.alternative.clone());
        };
        let before = relative_squares(refit);
        let near = |value: f64, steps: f64| {
            self.likelihood_at(value * (steps * STEP).exp(), &before, refit, logged)
        };
        let mut gains = [near(value, -1.0), self.likelihood_gain, near(value, 1.0)];
        // The screening finds the number to a few steps.
        for _ in 0..MOST_STEPS {
            let [lower, own, higher] = gains;
            if higher > own {
                value *= STEP.exp();
                gains = [own, higher, near(value, 1.0)];
            } else if lower > own {
                value *= (-STEP).exp();
                gains = [near(value, -1.0), lower, own];
            } else {
                break;
            }
        }
        Self::most_likely(value, gains).map(|chosen| self.alternative.with_chosen(chosen))
    }

    /// Returns the number at the maximum of a parabola through the likelihoods at a number and a
    /// step of its logarithm to either side, with its standard deviation: σ² = −1 / (ln L)″.
    /// `None` if the one in the middle is not the most likely.
    fn most_likely(value: f64, [lower, own, higher]: [f64; 3]) -> Option<Chosen> {
        let curvature = (2.0 * own - lower - higher) / (STEP * STEP);
        let shift = (higher - lower) / (2.0 * STEP * curvature);
        let chosen = Chosen {
            value: value * shift.clamp(-STEP, STEP).exp(),
            standard_deviation: value / curvature.sqrt(),
        };
        let is_maximum = own >= lower && own >= higher && chosen.standard_deviation.is_finite();
        is_maximum.then_some(chosen)
    }
}

/// Alternative that fits decisively better than the configured reading.
enum Best {
    /// It matters, and fits decisively better than every unrelated alternative.
    Named(Alternative, Evidence),
    /// It matters too little, or another one explains nearly as much. Its parameters, if it can be
    /// fitted.
    Unnamed(Option<DVector<f64>>),
}

/// Returns the best alternative, if it fits decisively better than the configured reading.
fn best(refit: &Refit<'_>, logged: &Experiment) -> Option<Best> {
    let torques = DivisorTorques::new(refit);
    let may_matter = |(joint, residual): (usize, &Option<JointResidual>)| {
        residual.is_some_and(|of| of.relative_error * torques.share(joint, of.torque) >= MATTERS)
    };
    if !refit.joints.iter().enumerate().any(may_matter) {
        return None;
    }
    let mut screen = Screen::new(refit)?;
    let groups = bank(&refit.context, &screen.ranges());
    let count = groups.iter().map(|of| of.constants.len().max(1)).sum::<usize>();
    let mut finalists = finalists(&mut screen, &groups, &torques)?;
    finalists.extend(low_pass_of_all_signals(refit, &screen, &torques));
    let fitted: Vec<Fitted> =
        finalists.into_iter().map(|of| of.fit(refit, logged, &torques)).collect();
    // A lag is a matter of degree. The others are there or not.
    let is_late = |of: &Alternative| matches!(of, Alternative::Late { .. });
    let rows = refit.context.samples.len() as f64;
    let has_cause = |of: &&Fitted| !of.explained.is_empty() || is_late(&of.alternative);
    let mut causes = fitted.iter().filter(has_cause);
    if !causes.any(|of| of.largest_likelihood_gain(rows) > DECISIVE) {
        return None;
    }
    let filter = refit.context.row_filter();
    let solution = refit.solved.with_covariance()?;
    let analysis = refit.solved.analysis(&solution, &filter);
    let judged = fitted.into_iter().filter_map(|of| of.judge(&analysis, count));
    let mut candidates: Vec<Candidate> = judged.collect();
    candidates.sort_by(|one, other| other.evidence.total_cmp(&one.evidence));
    if let Some(named) = named(&candidates, refit, &filter)
        && let Some(alternative) = named.estimated(refit, logged)
    {
        let significance = Significance::of_evidence(named.evidence, count);
        let evidence = Evidence { explained: named.largest_reduction(), significance };
        return Some(Best::Named(alternative.simplified(), evidence));
    }
    let first = candidates.first().filter(|of| of.evidence > DECISIVE)?;
    let parameters = || first.solved.as_ref().map(|of| of.parameters().clone());
    is_late(&first.alternative).then(|| Best::Unnamed(parameters()))
}

/// Returns the alternative that matters and fits decisively better than the configured reading and
/// than every unrelated alternative. `candidates` have the one with the most evidence first.
fn named<'c>(
    candidates: &'c [Candidate],
    refit: &Refit<'_>,
    filter: &RowFilter,
) -> Option<&'c Candidate> {
    let explains = |of: &&Candidate| !of.explained.is_empty() && of.evidence > DECISIVE;
    let mut decisive = candidates.iter().filter(explains);
    let first = decisive.find(|of| of.is_possible(refit, filter))?;
    let mut others = candidates.iter().filter(|of| !of.alternative.is_related(&first.alternative));
    let nearest = first.evidence - DECISIVE;
    let is_rivalled = others
        .any(|of| of.evidence_of(&first.explained) > nearest && of.is_possible(refit, filter));
    // The reading with the fewest wrong values stands for those that the data cannot distinguish.
    let is_equal =
        |of: &&Candidate| of.alternative.is_related(&first.alternative) && of.evidence > nearest;
    let equal = candidates.iter().filter(explains).filter(is_equal);
    let simplest = equal.min_by_key(|of| of.alternative.wrong_values()).unwrap_or(first);
    let is_simpler = simplest.alternative.wrong_values() < first.alternative.wrong_values();
    (!is_rivalled).then_some(if is_simpler { simplest } else { first })
}

/// Returns the best low-pass of all signals, as a finalist of its own: it needs rows that are
/// filtered, and a residual at every joint. Time constants shorter than the time between rows
/// change too little.
fn low_pass_of_all_signals(
    refit: &Refit<'_>,
    screen: &Screen<'_, '_>,
    torques: &DivisorTorques,
) -> Option<Finalist> {
    let mut residuals = refit.joints.iter().flatten();
    if residuals.any(|residual| residual.relative_error < MATTERS) {
        return None;
    }
    let motion = screen.filtered_motion(&refit.motion)?;
    let low_pass = |value| {
        let time_s = Chosen { value, standard_deviation: 0.0 };
        let (motor, signal, lag) = (None, Signal::Both, Lag::LowPass);
        Alternative::Late { motor, signal, lag, time_s }
    };
    let before = screen.without_low_pass(&low_pass(0.0), &motion)?;
    let screened = |time_s| {
        let alternative = low_pass(time_s);
        let squares = [before.clone(), screen.without_low_pass(&alternative, &motion)?];
        Some(Finalist { alternative, is_inside: true, squares })
    };
    let lags = lag_times(&refit.context).into_iter();
    let longer = lags.filter(|lag| lag * refit.context.rows_hz() >= 1.0);
    let gain = |of: &Finalist| sum_of_gains(&of.squares);
    let best =
        longer.filter_map(screened).max_by(|one, other| gain(one).total_cmp(&gain(other)))?;
    let [before, after] = &best.squares;
    let may_explain = !torques.explained([before, after], MAY_LEAVE, MAY_MATTER).is_empty();
    (gain(&best) > 0.0 && may_explain).then_some(best)
}

/// Alternative that passed the screening.
struct Finalist {
    alternative: Alternative,
    is_inside: bool,
    /// Squared relative residual of each joint at the picked rows, before and after.
    squares: [Vec<f64>; 2],
}

/// Returns the best alternatives of the screening, variants of one once.
fn finalists(
    screen: &mut Screen<'_, '_>,
    groups: &[Group],
    torques: &DivisorTorques,
) -> Option<Vec<Finalist>> {
    let before = screen.configured()?;
    let mut screened: Vec<Finalist> = Vec::new();
    for Group { alternative, constants } in groups {
        let mut score = |constant: f64| -> Option<(f64, Vec<f64>)> {
            let after = screen.with(&alternative.with_constant(constant))?;
            let after = alternative.by_configured_torque(after);
            Some((gains([&before, &after]).sum(), after))
        };
        let tried = match constants.is_empty() {
            true => vec![0.0],
            false => constants.clone(),
        };
        let scores: Vec<Option<(f64, Vec<f64>)>> = tried.iter().map(|of| score(*of)).collect();
        let value = |k: usize| scores[k].as_ref().map_or(f64::NEG_INFINITY, |of| of.0);
        let highest = (0..tried.len()).map(value).fold(f64::NEG_INFINITY, f64::max);
        // Numbers that the picked rows cannot tell apart: the one that changes least is best.
        let is_highest = |k: &usize| value(*k) >= highest - screen::RESOLUTION;
        let departure = |k: &usize| alternative.departure(tried[*k]);
        let best = (0..tried.len())
            .filter(is_highest)
            .min_by(|a, b| departure(a).total_cmp(&departure(b)))?;
        let Some((gain, after)) = &scores[best] else { continue };
        let is_better = *gain > 0.0;
        if !is_better || torques.explained([&before, after], MAY_LEAVE, MAY_MATTER).is_empty() {
            continue;
        }
        let (mut constant, mut after) = (tried[best], after.clone());
        let is_inside = constants.is_empty() || (best > 0 && best + 1 < constants.len());
        if let [low, _, high] = constants.get(best.wrapping_sub(1)..=best + 1).unwrap_or(&[]) {
            constant = refined([*low, *high], |of| score(of).map_or(f64::NEG_INFINITY, |of| of.0));
            after = score(constant).map_or(after, |of| of.1);
        }
        let alternative = alternative.with_constant(constant);
        screened.push(Finalist { alternative, is_inside, squares: [before.clone(), after] });
    }
    let gain = |of: &Finalist| sum_of_gains(&of.squares);
    screened.extend(leaning(screen, &screened, &before, torques));
    screened.sort_by(|one, other| gain(other).total_cmp(&gain(one)));
    let mut finalists: Vec<Finalist> = Vec::new();
    for candidate in screened {
        let is_variant = |of: &Finalist| of.alternative.is_variant(&candidate.alternative);
        if !finalists.iter().any(is_variant) {
            finalists.push(candidate);
        }
    }
    finalists.truncate(FINALISTS);
    Some(finalists)
}

/// Returns the direction of gravity that fits best, if the picked rows can tell it from the best of
/// `screened`.
fn leaning(
    screen: &Screen<'_, '_>,
    screened: &[Finalist],
    before: &[f64],
    torques: &DivisorTorques,
) -> Option<Finalist> {
    let of_gravity = screened.iter().filter(|of| of.alternative.gravity_m_s2().is_some());
    let gain = |of: &Finalist| sum_of_gains(&of.squares);
    let best = of_gravity.max_by(|one, other| gain(one).total_cmp(&gain(other)));
    let start = best.and_then(|of| of.alternative.gravity_m_s2());
    let is_turned = |of: &[f64; 3]| of.iter().any(|along| *along != 0.0);
    let (lean, after) = screen.lean(start.filter(is_turned))?;
    let squares = [before.to_vec(), after];
    let is_better = sum_of_gains(&squares) > best.map_or(0.0, gain) + RESOLUTION_OF_DIRECTION;
    let [before, after] = &squares;
    let may_explain = !torques.explained([before, after], MAY_LEAVE, MAY_MATTER).is_empty();
    let alternative = Alternative::Leaning(lean);
    (is_better && may_explain).then_some(Finalist { alternative, is_inside: true, squares })
}

/// Returns the place of the maximum in an interval, by golden-section search of the logarithm.
fn refined([low, high]: [f64; 2], mut score: impl FnMut(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let mut scored = |place: f64| (place, score(place.exp()));
    let (mut low, mut high) = (low.ln(), high.ln());
    let mut first = scored(high - SHARE * (high - low));
    let mut second = scored(low + SHARE * (high - low));
    for _ in 0..REFINING_STEPS {
        if first.1 > second.1 {
            high = second.0;
            second = first;
            first = scored(high - SHARE * (high - low));
        } else {
            low = first.0;
            first = second;
            second = scored(low + SHARE * (high - low));
        }
    }
    (0.5 * (low + high)).exp()
}

impl Finalist {
    /// Fits the alternative like the configured reading.
    fn fit(self, refit: &Refit<'_>, logged: &Experiment, torques: &DivisorTorques) -> Fitted {
        let Self { mut alternative, is_inside, mut squares, .. } = self;
        let reading = Reading::new(&alternative, &refit.context, logged);
        // Listed parameters may not be identifiable with another gravity.
        let mut better = reading.refit(&refit.context, alternative.shared(refit));
        if let Alternative::Leaning(lean) = &mut alternative
            && let Some((direction, closer)) = better.as_ref().and_then(|of| of.closer(*lean))
        {
            (*lean, better) = (direction, Some(closer));
        }
        if let Some(better) = &better {
            let after = alternative.by_configured_torque(relative_squares(better));
            squares = [relative_squares(refit), after];
        }
        let [before, after] = &squares;
        let explained = match is_inside {
            true => torques.explained([before, after], LEAVES, MATTERS),
            false => Vec::new(),
        };
        let new_parameters = reading.new_parameters(refit.context.base);
        let solved = better.map(|of| of.solved);
        Fitted { alternative, squares, explained, new_parameters, solved }
    }
}

/// Alternative that was fitted.
struct Fitted {
    alternative: Alternative,
    /// Squared relative residual of each joint, before and after.
    squares: [Vec<f64>; 2],
    /// Joints whose residual the alternative explains. None if its number is at the end of a range.
    explained: Vec<usize>,
    /// Number of parameters that its model has more than the configured one.
    new_parameters: usize,
    /// `None` if it cannot be fitted.
    solved: Option<Solved>,
}

impl Fitted {
    /// Returns the likelihood gain if each of so many rows of a joint were independent.
    fn largest_likelihood_gain(&self, rows: f64) -> f64 {
        let [before, after] = &self.squares;
        gains([before, after]).map(|gain| gain.max(0.0) * rows).sum()
    }

    /// Compares the alternative with the configured reading.
    fn judge(self, configured: &ResidualAnalysis<'_>, count: usize) -> Option<Candidate> {
        let rows = match &self.solved {
            Some(of) => self.alternative.by_configured_torque(of.effective_rows(configured)),
            None => configured.spectrum().effective_rows_per_joint(),
        };
        let [before, after] = &self.squares;
        let likelihood_gain = likelihood_gain([before, after], &rows);
        let all_rows: f64 = rows.iter().sum();
        let Self { alternative, explained, squares, solved, .. } = self;
        let numbers = alternative.chosen_numbers() + self.new_parameters;
        let choice = 0.5 * numbers as f64 * all_rows.ln();
        let evidence = likelihood_gain - choice - (count as f64).ln();
        let candidate =
            Candidate { alternative, squares, likelihood_gain, evidence, explained, rows, solved };
        evidence.is_finite().then_some(candidate)
    }
}

/// Returns ln(e / e') of each joint from the squared errors.
fn gains([before, after]: [&[f64]; 2]) -> impl Iterator<Item = f64> {
    before.iter().zip(after).map(|(before, after)| match *before > 0.0 && *after > 0.0 {
        true => 0.5 * (before / after).ln(),
        false => 0.0,
    })
}

/// Returns Σ_j ln(e_j / e'_j) from the squared errors before and after.
fn sum_of_gains([before, after]: &[Vec<f64>; 2]) -> f64 {
    gains([before, after]).sum()
}

/// Returns Σ_j N_j ln(e_j / e'_j), for the independent rows N of each joint.
fn likelihood_gain(squares: [&[f64]; 2], rows: &[f64]) -> f64 {
    gains(squares).zip(rows).map(|(gain, rows)| gain * rows).sum()
}

fn relative_squares(refit: &Refit<'_>) -> Vec<f64> {
    refit.joints.iter().map(|of| of.map_or(0.0, |of| of.relative_error.powi(2))).collect()
}

/// Torques of the joints, and those by which their errors are divided.
struct DivisorTorques {
    /// Torque of each joint, and its divisor \[N·m or N\].
    joints: Vec<[f64; 2]>,
}

impl DivisorTorques {
    fn new(refit: &Refit<'_>) -> Self {
        let chain = refit.context.robot.chain();
        let floor = refit.context.options.limits.torque_floor;
        let torque = |joint: usize| refit.joints[joint].map_or(0.0, |of| of.torque);
        let joints = (0..chain.len()).map(|joint| {
            let of_kind = (0..chain.len()).filter(|of| chain[*of].kind == chain[joint].kind);
            let largest = of_kind.map(torque).fold(0.0, f64::max);
            [torque(joint), torque(joint).max(floor * largest)]
        });
        Self { joints: joints.collect() }
    }

    /// Returns a torque of a joint as a share of its divisor.
    fn share(&self, joint: usize, torque: f64) -> f64 {
        let [_, divisor] = self.joints[joint];
        if divisor > 0.0 { torque / divisor } else { 0.0 }
    }

    /// Returns the joints that keep at most a share `leaves` of their residual power, and whose
    /// residual falls by at least a share `matters` of their torque.
    fn explained(&self, [before, after]: [&[f64]; 2], leaves: f64, matters: f64) -> Vec<usize> {
        let falls = |joint: &usize| {
            let (before, after) = (before[*joint], after[*joint]);
            let share = self.share(*joint, self.joints[*joint][0]);
            after <= leaves * before && (before.sqrt() - after.sqrt()) * share >= matters
        };
        (0..before.len()).filter(falls).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gaussian likelihood of the logarithm of a number has a known maximum and deviation.
    #[test]
    fn the_most_likely_number_has_the_deviation_of_its_likelihood() {
        for (deviation, distance) in [(0.002, 0.3), (0.02, -0.4), (0.3, 0.0)] {
            let (near, shift) = (1.7, distance * STEP);
            let likelihood = |of: f64| 100.0 - 0.5 * ((of - shift) / deviation).powi(2);
            let chosen = Candidate::most_likely(near, [-STEP, 0.0, STEP].map(likelihood)).unwrap();
            assert!((chosen.value / near - shift.exp()).abs() < 1e-9, "{chosen:?}");
            let relative = chosen.standard_deviation / near;
            assert!((relative / deviation - 1.0).abs() < 1e-9, "{chosen:?} for {deviation}");
        }
        for gains in [[1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [0.0; 3], [f64::NAN, 0.0, -1.0]] {
            assert!(Candidate::most_likely(1.7, gains).is_none(), "{gains:?}");
        }
    }

    #[test]
    fn the_search_finds_a_maximum_anywhere_in_its_interval() {
        for share in [0.05, 0.3, 0.6, 0.95] {
            let place = 0.1 * 20.0_f64.powf(share);
            let found = refined([0.1, 2.0], |of| -(of / place).ln().powi(2));
            assert!((found / place).ln().abs() < 0.05, "{found} instead of {place}");
        }
    }
}
