//! When the torques act, what the position filter and the noise of the positions do, and whether
//! the described controller made the recorded torques.

mod columns;
mod controller;

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::bias::PositionBias;
use super::estimate::TorqueDelay;
use super::reasons::{ControllerUnchecked, Note};
use super::verdict::UNEXPLAINED;
use crate::identification::observation::{AuxiliaryObservation, FilteredPositions, Motion};
use crate::identification::problem::{Context, IdentificationError, Method, PositionFilter};
use crate::regression::{Observations, ResidualAnalysis};
use didim_dynamics::control::SimulatedController;

/// The position filter is held against one with so many times its cut-off, where the sample rate
/// allows, and one in between.
const WIDER: f64 = 4.0;

/// With less room above its cut-off, smoothing and noise cannot be distinguished there.
const NARROWEST_COMPARISON: f64 = 1.5;

/// Those that are tried then where the model leaves much, as shares of its cut-off. They smooth
/// more than the power law has it, which would make much of next to nothing.
const NARROWER: [f64; 2] = [0.5, 0.25];

/// A cut-off beyond this share of the Nyquist frequency filters nothing.
const WIDEST_CUTOFF: f64 = 0.8;

/// Periods of the cut-off after which a position filter has forgotten a glitch to 1e-4: the slowest
/// pole of order 4 is damped by 0.38.
const RINGING_PERIODS: f64 = 4.0;

/// Where the noise of the measured positions may do harm.
pub(crate) enum PositionError {
    /// The method does not ask.
    NotInspected,
    /// It is not known: the loop could not be simulated with it.
    Unknown,
    /// In the regressor, behind the position filter, which may do harm itself.
    InTheRegressor,
    /// In the loop that was recorded, and not in the one that was simulated: torques under half the
    /// noise and all of it, samples × joints \[N·m\].
    InTheLoop([DMatrix<f64>; 2]),
}

/// The model that was fitted, and what it is checked with.
pub(super) struct FittedModel<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) method: Method,
    /// The motion that the observation matrix was built on.
    pub(super) motion: &'a Motion,
    /// What there is of it beside the observation matrix.
    pub(super) auxiliary_columns: &'a AuxiliaryObservation,
    pub(super) position_error: &'a PositionError,
    /// Samples that outliers reach.
    pub(super) outliers: &'a [Range<usize>],
    pub(super) observations: &'a Observations,
    pub(super) analysis: &'a ResidualAnalysis<'a>,
    /// θ.
    pub(super) parameters: &'a DVector<f64>,
    /// Their corrected standard deviations.
    pub(super) deviations: &'a DVector<f64>,
    /// Their torques' time derivatives, filtered and decimated \[N·m/s or N/s\].
    pub(super) torque_rates: &'a DVector<f64>,
}

/// What they found.
pub(super) struct Checks {
    /// How far position filter and position noise have moved each parameter.
    pub(super) bias: Option<DVector<f64>>,
    /// The largest of it.
    pub(super) position_bias: Option<PositionBias>,
    /// Of each joint; none where the motion does not tell it.
    pub(super) torque_delay_per_joint: Vec<Option<TorqueDelay>>,
    /// Differences of the described controller's commands from the recorded ones, if they are known.
    pub(super) controller_error_per_joint: Option<Vec<Difference>>,
    /// What has not been checked, and why.
    pub(super) notes: Vec<Note>,
}

/// Part of a difference that the motion explains.
#[derive(Clone, Copy)]
pub(super) struct Difference {
    /// Its size, relative to the torque.
    pub(super) size: f64,
    /// Probability that noise alone explains at least as much.
    pub(super) probability: f64,
}

/// Differences of the described controller from the recorded torques.
enum ControllerError {
    /// One for each joint.
    PerJoint(Vec<Difference>),
    /// It cannot be told.
    Unknown(ControllerUnchecked),
    /// Nothing says what controls the arm.
    NotDescribed,
}

impl FittedModel<'_> {
    /// All in turn.
    pub(super) fn check(&self) -> Result<Checks, IdentificationError> {
        let mut notes = Vec::new();
        let (position_bias, bias) = self.position_check()?.unzip();
        if bias.is_none() {
            notes.push(self.position_unchecked());
        }
        // One column per joint, for its delay in s. What is logged at t and acts δ later than stated
        // is, at the instant where it was thought to act, `τ(t + δ) ≈ τ(t) + δ dτ/dt`. Filtered
        // torques are differentiated, which is as good as the reverse but for what filters make of
        // the ends of a record, where nothing is known of either.
        let delays = self.analysis.extend(self.torque_rates);
        let delays = delays.map_err(IdentificationError::Regression)?;
        if delays.is_none() {
            notes.push(Note::DelayUnchecked);
        }
        let mut torque_delay_per_joint = vec![None; self.context.robot.joints()];
        for (k, &joint) in delays.iter().flat_map(|d| d.columns.iter().enumerate()) {
            torque_delay_per_joint[joint] = delays.as_ref().map(|found| TorqueDelay {
                delay_s: found.coefficients[k],
                standard_deviation_s: found.covariance[(k, k)].sqrt(),
            });
        }
        let controller_error_per_joint = match self.controller_error()? {
            ControllerError::PerJoint(errors) => Some(errors),
            ControllerError::Unknown(why) => {
                // Others do not depend on it.
                if self.method.simulates() {
                    notes.push(Note::ControllerUnchecked { why });
                }
                None
            }
            ControllerError::NotDescribed => None,
        };
        Ok(Checks {
            bias,
            position_bias,
            torque_delay_per_joint,
            controller_error_per_joint,
            notes,
        })
    }

    /// Returns true if the simulated loop has a substitute controller.
    pub(super) fn has_substitute_controller(&self) -> bool {
        let controller = &self.context.options.controller;
        self.method.simulates() && !matches!(controller, Some(SimulatedController::Cabinet { .. }))
    }

    /// The parameter that a bias moves furthest in its standard deviations, and by how many.
    fn furthest(&self, bias: &DVector<f64>) -> (usize, f64) {
        let relative = bias.component_div(self.deviations);
        let index = if relative.is_empty() { 0 } else { relative.iamax() };
        (index, relative[index])
    }

    /// Which joints leave so much of their torque, in root mean squares, that something else than a
    /// small error is the matter.
    pub(super) fn unexplained(&self, left: &[f64]) -> Vec<bool> {
        let torque = self.observations.rms_per_joint(&self.observations.measured_values());
        left.iter().zip(&torque).map(|(left, torque)| *left > UNEXPLAINED * torque).collect()
    }

    /// What of the noise of the positions was not looked at.
    fn position_unchecked(&self) -> Note {
        match self.position_error {
            PositionError::InTheRegressor => {
                let cutoff_hz = self.context.options.position_filter.cutoff_hz;
                Note::PositionFilterUnchecked { cutoff_hz }
            }
            PositionError::NotInspected => Note::PositionNoiseIgnored,
            PositionError::Unknown | PositionError::InTheLoop(_) => Note::PositionNoiseNotSimulated,
        }
    }

    /// The torques that the model makes of the parameters.
    fn predicted(&self) -> DVector<f64> {
        self.observations.predicted(self.parameters)
    }

    /// What the noise of the positions does.
    fn position_check(&self) -> Result<Option<(PositionBias, DVector<f64>)>, IdentificationError> {
        match self.position_error {
            PositionError::Unknown | PositionError::NotInspected => Ok(None),
            PositionError::InTheRegressor => self.position_filter_check(),
            // y(a) = y(0) + a l + a² e: twice y(1) − 2 y(1/2) + y(0) is e, the part that is even in
            // the noise and biases the estimate.
            PositionError::InTheLoop([half, all]) => {
                let even =
                    (self.context.rows_of(&(all - half * 2.0), "torque")? + self.predicted()) * 2.0;
                let shift = -self.analysis.estimate_shift(&even);
                let (index, deviations) = self.furthest(&shift);
                let parameter = self.context.selection.names()[index].clone();
                Ok(Some((PositionBias { parameter, deviations, by_filter: false }, shift)))
            }
        }
    }

    /// What position filter and position noise do to the estimate, from what another cut-off f
    /// would change: smoothing has an effect of f⁻², as far as it bends what changes suddenly, and
    /// the noise of the velocity one of f³, as its power.
    ///
    /// ```text
    /// θ(f) = θ₀ + s + n        with another cut-off        θ(r f) = θ₀ + r⁻² s + r³ n
    /// ```
    ///
    /// Two other filters give s and n, and −(s + n) is how far the parameter is from θ₀.
    fn position_filter_check(
        &self,
    ) -> Result<Option<(PositionBias, DVector<f64>)>, IdentificationError> {
        let (experiment, filter) = (self.context.experiment, self.context.options.position_filter);
        let nyquist_hz = 0.5 * experiment.sample_rate_hz();
        let widest = (WIDEST_CUTOFF * nyquist_hz / filter.cutoff_hz).min(WIDER);
        let left = || {
            let of = self.observations;
            of.rms_per_joint(&of.residuals(self.parameters))
        };
        let ratios = match widest < NARROWEST_COMPARISON {
            true if !self.unexplained(&left()).contains(&true) => return Ok(None),
            true => NARROWER,
            false => [widest.sqrt(), widest],
        };
        // How far the filter rings around a glitch [samples].
        let reach =
            RINGING_PERIODS * experiment.sample_rate_hz() / (filter.cutoff_hz * ratios[1].min(1.0));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "above 0, and casts saturate"
        )]
        let reach = reach.ceil() as usize;
        // θ(r f) − θ(f): if the motion behind the other filter is the true one, y = X' θ + ε, the
        // estimate is off by Zᵀ (X' − X) θ, and would move back by as much.
        let mut positions = FilteredPositions::with_zeros(experiment);
        let mut shift_with = |ratio: f64| -> Result<DVector<f64>, IdentificationError> {
            let other = PositionFilter { cutoff_hz: ratio * filter.cutoff_hz, ..filter };
            positions.filter(experiment, &other)?;
            positions.track_hysteresis(self.context.robot);
            Ok(self.analysis.estimate_shift(&self.torque_difference(&positions, reach)?))
        };
        let [shift_1, shift_2] = [shift_with(ratios[0])?, shift_with(ratios[1])?];
        let [[s1, n1], [s2, n2]] = ratios.map(effects);
        let determinant = s1 * n2 - s2 * n1;
        let smoothing = (&shift_1 * n2 - &shift_2 * n1) / determinant;
        let noise = (&shift_2 * s1 - &shift_1 * s2) / determinant;
        let shift = -(&smoothing + &noise);
        let (index, deviations) = self.furthest(&shift);
        let parameter = self.context.selection.names()[index].clone();
        let by_filter = smoothing[index].abs() >= noise[index].abs();
        Ok(Some((PositionBias { parameter, deviations, by_filter }, shift)))
    }
}

/// What smoothing and noise change when the cut-off is multiplied by a ratio, per unit of each.
fn effects(ratio: f64) -> [f64; 2] {
    [ratio.powi(-2) - 1.0, ratio.powi(3) - 1.0]
}
