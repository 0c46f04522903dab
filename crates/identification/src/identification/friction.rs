//! Choice of the friction laws: those that predict held-out data best.
//!
//! Terms are added one at a time, as in forward selection. They are judged by the error on held-out
//! folds and by the uncertainty outside the recorded motion, never by the fit. Nonlinear shape
//! parameters (the width of the sign function, the Stribeck speed) are searched on a grid and
//! refined. All linear parameters are solved anew for each trial: separable least squares (Golub
//! and Pereyra 2003). Friction hysteresis is refined only if the robot file configures it. It is
//! not tried otherwise, because it made the predictions of real arms worse.

use super::identify::identify;
use super::judgement::{
    ChosenFriction, Estimate, FrictionChange, FrictionGain, FrictionScore, ParameterEstimate,
};
use super::observation::filtered_motion;
use super::problem::{Experiment, IdentificationError, Method, Options};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{
    FrictionLaw, JointFriction, JointIndex, Parameter, ParameterKind, Robot, SignModel,
};

/// Chooses the friction laws of a robot by IDIM-LS; `tried` is called after each identification.
///
/// # Errors
/// [`IdentificationError::NothingHeldOut`], and those of IDIM-LS with the robot's own laws.
pub fn choose_friction(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &Options,
    tried: impl FnMut(),
) -> Result<ChosenFriction, IdentificationError> {
    let motion = filtered_motion(robot, experiment, &options.position_filter)?;
    let highest = |joint: usize| {
        // Without a recorded torque, a joint shows no friction.
        if !robot.recorded_torque().has_joint(JointIndex::new(joint)) {
            return 0.0;
        }
        let speeds = experiment.counted_samples().map(|k| motion.velocity(k, joint).abs());
        speeds.fold(0.0, f64::max)
    };
    let highest: Vec<f64> = (0..experiment.joints()).map(highest).collect();
    let mut search = Search {
        robot,
        experiment,
        options,
        report_trial: tried,
        trial_count: 0,
        most_extrapolation: f64::INFINITY,
    };
    let first = search.try_configured(base)?;
    search.most_extrapolation =
        first.score.extrapolation + options.friction_search.extrapolation_tie;
    let (before, mut best, mut gains) = (first.score, first, Vec::new());
    let candidates = search.list_changes(&highest);
    for _ in 0..options.friction_search.max_rounds {
        if !search.run_round(&mut best, &candidates, &mut gains) {
            break;
        }
    }
    let unrefined = best.held_out_error_per_joint.clone();
    search.refine_shapes(&mut best, &gains);
    // Each change is reported with its final shape.
    for gain in &mut gains {
        gain.change = refined_change(gain.change, &best.friction[gain.joint]);
    }
    for (joint, (own, configured)) in best.friction.iter().zip(robot.own_friction()).enumerate() {
        if let Some(way_rad) = own
            .presliding_distance()
            .filter(|presliding| configured.presliding_distance() != Some(*presliding))
        {
            let held_out = [unrefined[joint], best.held_out_error_per_joint[joint]];
            let change = FrictionChange::Law(FrictionLaw::Hysteresis { way_rad });
            gains.push(FrictionGain { joint: JointIndex::new(joint), change, held_out });
        }
    }
    Ok(ChosenFriction {
        friction: best.friction,
        gains,
        before,
        after: best.score,
        trials: search.trial_count,
    })
}

/// Identification with certain friction laws, and its score.
struct Trial {
    friction: Vec<JointFriction>,
    score: FrictionScore,
    /// True if the result is usable for the required uses.
    applicable: bool,
    held_out_error_per_joint: Vec<f64>,
    /// Joints whose load, Stribeck or hysteresis friction parameter is implausible: negative, or a
    /// larger share of the load than a gear loses. Such a parameter stands for another law.
    disguises_other_law: Vec<bool>,
}

struct Search<'a, T> {
    robot: &'a Robot,
    experiment: &'a Experiment,
    options: &'a Options,
    report_trial: T,
    trial_count: usize,
    /// Largest accepted uncertainty of the torque outside the recorded motion.
    most_extrapolation: f64,
}

impl<T: FnMut()> Search<'_, T> {
    /// Tries the robot's own laws.
    fn try_configured(&mut self, base: &BaseParameters) -> Result<Trial, IdentificationError> {
        let estimate = self.identify(self.robot, base)?;
        let friction = self.robot.own_friction().to_vec();
        score_trial(friction, &estimate, self.options.friction_search.max_load_share)
            .ok_or(IdentificationError::NothingHeldOut)
    }

    /// Returns the changes to try, each with its law at every moving joint.
    fn list_changes(&self, highest: &[f64]) -> Vec<Vec<Option<FrictionChange>>> {
        let search = &self.options.friction_search;
        let at_each = |change: &dyn Fn(f64) -> FrictionChange| {
            let of_joint = |speed: &f64| (*speed > 0.0).then(|| change(*speed));
            highest.iter().map(of_joint).collect()
        };
        let laws = [FrictionLaw::Quadratic, FrictionLaw::Cubic, FrictionLaw::Asymmetric];
        let mut candidates: Vec<Vec<_>> =
            laws.into_iter().map(|law| at_each(&|_| FrictionChange::Law(law))).collect();
        if self.robot.friction().coulomb {
            candidates.push(self.load_friction_candidates(highest));
            candidates.extend(search.sign_widths.iter().map(|share| {
                at_each(&|speed| {
                    FrictionChange::Sign(SignModel::Tanh {
                        width_rad_s: round_speed(share * speed),
                    })
                })
            }));
            candidates.extend(search.stribeck_speeds.iter().map(|share| {
                at_each(&|speed| {
                    FrictionChange::Law(FrictionLaw::Stribeck {
                        speed_rad_s: round_speed(share * speed),
                    })
                })
            }));
        }
        candidates
    }

    /// Returns load-dependent friction for every moving joint where it is identifiable separately.
    /// It is not where gravity has no effect or a constant one.
    fn load_friction_candidates(&self, highest: &[f64]) -> Vec<Option<FrictionChange>> {
        let law = FrictionLaw::Load;
        let laws = self.robot.own_friction().iter().map(|own| own.with_law(law)).collect();
        let robot = self.robot.clone().with_friction(laws);
        let base = BaseParameters::compute(&Model::new(&robot));
        let shows = |joint| {
            let column = robot.parameters().column(law.kind(), joint);
            base.as_ref().is_ok_and(|base| column.is_some_and(|own| base.columns().contains(&own)))
        };
        let of_joint = |(joint, speed): (usize, &f64)| {
            (*speed > 0.0 && shows(JointIndex::new(joint))).then_some(FrictionChange::Law(law))
        };
        highest.iter().enumerate().map(of_joint).collect()
    }

    /// Tries every candidate at all joints at once and takes the best change of each joint. Keeps
    /// those changes, one after the other, that still reduce the error enough. Returns true if a
    /// change was made.
    fn run_round(
        &mut self,
        best: &mut Trial,
        candidates: &[Vec<Option<FrictionChange>>],
        gains: &mut Vec<FrictionGain>,
    ) -> bool {
        let mut wanted: Vec<Option<(f64, FrictionChange)>> = vec![None; best.friction.len()];
        for candidate in candidates {
            let Some(trial) = self.try_changes(best, candidate) else { continue };
            for (joint, change) in candidate.iter().enumerate() {
                if trial.friction[joint] == best.friction[joint] {
                    continue;
                }
                let gain = best.gain_over(&trial, joint);
                let Some(change) = change.filter(|_| gain >= self.options.friction_search.min_gain)
                else {
                    continue;
                };
                if wanted[joint].is_none_or(|(other, _)| gain > other) {
                    wanted[joint] = Some((gain, change));
                }
            }
        }
        let mut wanted: Vec<_> = (wanted.into_iter().enumerate())
            .filter_map(|(joint, wanted)| wanted.map(|(gain, change)| (gain, joint, change)))
            .collect();
        wanted.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut accepted = false;
        for (_, joint, change) in wanted {
            let mut alone = vec![None; best.friction.len()];
            alone[joint] = Some(change);
            let Some(trial) = self.try_changes(best, &alone) else { continue };
            if best.gain_over(&trial, joint) < self.options.friction_search.min_gain
                || !self.is_no_worse(&trial, best)
            {
                continue;
            }
            let held_out = [&*best, &trial].map(|of| of.held_out_error_per_joint[joint]);
            gains.push(FrictionGain { joint: JointIndex::new(joint), change, held_out });
            *best = trial;
            accepted = true;
        }
        accepted
    }

    /// Adjusts the nonlinear shape parameters of each joint to minimise its held-out error.
    fn refine_shapes(&mut self, best: &mut Trial, gains: &[FrictionGain]) {
        // The speeds of a joint that was not changed stay as they are.
        let changed = |joint: usize| gains.iter().any(|gain| gain.joint == JointIndex::new(joint));
        let chain = self.robot.chain();
        let search = self.options.friction_search.clone();
        for factor in search.refinements {
            let scaled = |v: f64| round_speed(factor * v);
            let mut step = |of: &dyn Fn(usize, &JointFriction) -> JointFriction| {
                let improved = |_: &usize| self.refine_by(of, best);
                (0..search.max_refinements).take_while(improved).for_each(drop);
            };
            step(&|joint, own| if changed(joint) { own.with_speeds(scaled) } else { own.clone() });
            // A configured presliding distance is only a rule of thumb, so it is refined at every
            // joint that has one.
            step(&|joint, own| {
                let limits = chain[joint].limits;
                let way_rad = own.presliding_distance().map(scaled);
                match way_rad
                    .filter(|presliding| *presliding < limits.position_max - limits.position_min)
                {
                    Some(way_rad) => own.with_law(FrictionLaw::Hysteresis { way_rad }),
                    None => own.clone(),
                }
            });
        }
    }

    /// Takes one step at the joints that it helps. Returns true if a change was made.
    fn refine_by(
        &mut self,
        step: &dyn Fn(usize, &JointFriction) -> JointFriction,
        best: &mut Trial,
    ) -> bool {
        let laws = best.friction.iter().enumerate().map(|(joint, own)| step(joint, own));
        let laws: Vec<_> = laws.collect();
        let Some(trial) = self.trial_of(best, laws.clone()) else { return false };
        let chosen = (best.friction.iter().zip(laws).enumerate())
            .map(
                |(joint, (own, scaled))| {
                    if best.gain_over(&trial, joint) > 0.0 { scaled } else { own.clone() }
                },
            )
            .collect();
        let chosen = self.trial_of(best, chosen).filter(|trial| self.is_no_worse(trial, best));
        let is_found = chosen.is_some();
        if let Some(trial) = chosen {
            *best = trial;
        }
        is_found
    }

    /// Tries a change at each joint that has one. Returns `None` if nothing changes or the changed
    /// model is not identifiable.
    fn try_changes(&mut self, best: &Trial, changes: &[Option<FrictionChange>]) -> Option<Trial> {
        let changed = (best.friction.iter().zip(changes)).map(|(own, change)| match change {
            Some(FrictionChange::Sign(sign)) => JointFriction { sign: *sign, ..own.clone() },
            Some(FrictionChange::Law(law)) => own.with_law(*law),
            None => own.clone(),
        });
        self.trial_of(best, changed.collect())
    }

    /// Returns true if a trial is at least as good as another: its held-out error is no larger, it
    /// is usable for the required uses if the other is, its uncertainty outside the recorded motion
    /// is not above that of the robot file's laws, and no friction parameter is implausible at a
    /// joint where that of the other is plausible.
    fn is_no_worse(&self, one: &Trial, other: &Trial) -> bool {
        one.score.held_out <= other.score.held_out
            && one.score.extrapolation <= self.most_extrapolation
            && one.applicable >= other.applicable
            && one
                .disguises_other_law
                .iter()
                .zip(&other.disguises_other_law)
                .all(|(one, other)| one <= other)
    }

    /// Tries these friction laws; returns `None` if they are those of `best`.
    fn trial_of(&mut self, best: &Trial, friction: Vec<JointFriction>) -> Option<Trial> {
        if friction == best.friction { None } else { self.try_friction(friction) }
    }

    fn try_friction(&mut self, friction: Vec<JointFriction>) -> Option<Trial> {
        let robot = self.robot.clone().with_friction(friction.clone());
        let base = BaseParameters::compute(&Model::new(&robot)).ok()?;
        let estimate = self.identify(&robot, &base).ok()?;
        score_trial(friction, &estimate, self.options.friction_search.max_load_share)
    }

    fn identify(
        &mut self,
        robot: &Robot,
        base: &BaseParameters,
    ) -> Result<Estimate, IdentificationError> {
        self.trial_count += 1;
        let options = self.options.clone().with_friction(robot);
        let identified = identify(Method::IdimLs, robot, base, self.experiment, &options);
        (self.report_trial)();
        Ok(identified?.estimate)
    }
}

fn score_trial(
    friction: Vec<JointFriction>,
    estimate: &Estimate,
    most_of_load: f64,
) -> Option<Trial> {
    let held_out = estimate.held_out.relative_error?;
    let score = FrictionScore { held_out, extrapolation: estimate.extrapolation.relative_error };
    let held_out_error_per_joint = estimate.held_out.relative_error_per_joint.clone();
    let possible = [
        (ParameterKind::Fs, f64::INFINITY),
        (ParameterKind::Fh, f64::INFINITY),
        (ParameterKind::FcLoad, most_of_load),
    ];
    let disguised = (0..friction.len())
        .map(|joint: usize| {
            possible.iter().any(|&(kind, most)| {
                let name = Parameter { kind, joint: JointIndex::new(joint) }.to_string();
                let is_implausible = |own: &ParameterEstimate| {
                    own.name == name && !(0.0..=most).contains(&own.value)
                };
                estimate.parameters.iter().any(is_implausible)
            })
        })
        .collect();
    let applicable = estimate.verdict.applicable;
    Some(Trial {
        friction,
        score,
        applicable,
        held_out_error_per_joint,
        disguises_other_law: disguised,
    })
}

impl Trial {
    /// Returns the share of a joint's held-out error that another trial removes; 0 if its friction
    /// stands for another law.
    fn gain_over(&self, other: &Self, joint: usize) -> f64 {
        if other.disguises_other_law[joint] {
            return 0.0;
        }
        1.0 - other.held_out_error_per_joint[joint] / self.held_out_error_per_joint[joint]
    }
}

/// Returns a change with the shape that the law has in a joint's final friction.
fn refined_change(change: FrictionChange, friction: &JointFriction) -> FrictionChange {
    let same_kind = |law: FrictionLaw| friction.laws.iter().find(|own| own.kind() == law.kind());
    match change {
        FrictionChange::Sign(_) => FrictionChange::Sign(friction.sign),
        FrictionChange::Law(law) => FrictionChange::Law(same_kind(law).copied().unwrap_or(law)),
    }
}

/// Rounds to three significant digits, because a shape is not known more precisely.
fn round_speed(speed: f64) -> f64 {
    let digits = 10_f64.powf(2.0 - speed.abs().log10().floor());
    (speed * digits).round() / digits
}
