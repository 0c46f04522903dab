//! Whether the model is the arm's: what would change if it were free to be otherwise.
//!
//! Residuals of a few per cent are usual on an arm, and their colour alone does not tell harmless
//! noise from a model that is wrong. So each error that has a name gets columns of its own: if the
//! data want them, and the parameters would move by more than their standard deviations allow, the
//! standard deviations are not the uncertainty.

mod columns;
mod workspace;

use core::fmt;
use core::ops::Range;

use nalgebra::{DMatrix, DVector};
use serde::{Serialize, Serializer};

use crate::dynamics::Model;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::options::PositionFilter;
use crate::identification::given::selection::Selection;
use crate::identification::observation::filtered_positions::FilteredPositions;
use crate::identification::observation::matrix::BesideObservation;
use crate::identification::observation::prefilter::Motion;
use crate::regression::{Extension, Observations, ResidualAnalysis};
use crate::robot::Robot;
use crate::signal::ParallelDecimation;
use columns::Columns;
pub(crate) use workspace::indefinite_posture;

/// The position filter is held against one with so many times its cut-off, where the sample rate
/// allows, and one in between.
const WIDER: f64 = 4.0;

/// With less room above its cut-off, smoothing and noise cannot be told apart.
const NARROWEST_COMPARISON: f64 = 1.5;

/// A cut-off beyond this share of the Nyquist frequency filters nothing.
const WIDEST_CUTOFF: f64 = 0.8;

/// Periods of the cut-off after which a position filter has forgotten a glitch to 1e-4: the slowest pole
/// of order 4 is damped by 0.38.
const RINGING_PERIODS: f64 = 4.0;

/// Something that the model takes for known and that may be otherwise. Joints and motors are
/// numbered from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// The shape of friction over speed at a joint.
    JointFriction(usize),
    /// The same at a motor that is geared to several joints.
    MotorFriction(usize),
    /// When the torques act, each joint's on its own.
    TorqueDelay,
    /// The torque gain of one joint against the others. A factor common to all is no freedom: it
    /// is in every parameter.
    TorqueGain(usize),
    /// The base parameters that are taken as 0.
    LeftOutParameters,
    /// What the position filter takes out of the motion.
    PositionFilter,
    /// What the noise of the positions adds to it.
    PositionNoise,
}

impl fmt::Display for Freedom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointFriction(joint) => write!(f, "friction law of joint {joint}"),
            Self::MotorFriction(motor) => write!(f, "friction law of motor {motor}"),
            Self::TorqueDelay => f.write_str("delay of the torques"),
            Self::TorqueGain(joint) => write!(f, "torque gain of joint {joint}"),
            Self::LeftOutParameters => f.write_str("parameters left out"),
            Self::PositionFilter => f.write_str("position filter"),
            Self::PositionNoise => f.write_str("noise of the positions"),
        }
    }
}

impl Serialize for Freedom {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What one freedom would change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelCheck {
    /// What the model would be free to have.
    pub freedom: Freedom,
    /// The probability that a right model makes as much of this freedom by chance; none where
    /// nothing is estimated.
    pub probability: Option<f64>,
    /// The parameter that would move furthest in its standard deviations, of those that would move
    /// by more than the freedom's own uncertainty if there are any.
    pub parameter: String,
    /// How far, in its corrected standard deviations, as the model has them now.
    pub shift_deviations: f64,
    /// How uncertain that is, in the same unit: one standard deviation; none where nothing is
    /// estimated.
    pub shift_uncertainty: Option<f64>,
}

/// A shift counts when it is so many times its own uncertainty.
pub(crate) const CERTAIN: f64 = 3.0;

/// When the torque of a joint acts, over what its timing says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TorqueDelay {
    /// Later than stated by this \[s\]; earlier where negative.
    pub delay_s: f64,
    /// Its corrected standard deviation \[s\].
    pub standard_deviation_s: f64,
}

/// Where the noise of the measured positions may do harm.
pub(crate) enum PositionError {
    /// The method does not ask.
    NotLookedAt,
    /// It is not known: the loop could not be simulated with it.
    Unknown,
    /// In the regressor, behind this filter, which may do harm itself.
    InTheRegressor(PositionFilter),
    /// In the loop that was recorded, and not in the one that was simulated: torques under half the
    /// noise and all of it, samples × joints \[N·m\].
    InTheLoop([DMatrix<f64>; 2]),
}

/// What the checks need.
pub(crate) struct Subject<'a> {
    pub(crate) robot: &'a Robot,
    pub(crate) model: &'a Model,
    pub(crate) selection: &'a Selection,
    pub(crate) experiment: &'a Experiment,
    pub(crate) decimation: &'a ParallelDecimation,
    /// The motion that the observation matrix was built on.
    pub(crate) motion: &'a Motion,
    /// What there is of it beside the observation matrix.
    pub(crate) beside: &'a BesideObservation,
    pub(crate) position_error: &'a PositionError,
    /// Samples that outliers spoil.
    pub(crate) spoiled: &'a [Range<usize>],
    pub(crate) observations: &'a Observations,
    pub(crate) analysis: &'a ResidualAnalysis<'a>,
    /// Standard parameters of the estimate.
    pub(crate) standard: &'a [f64],
    /// Corrected standard deviations of the selected parameters.
    pub(crate) deviations: &'a DVector<f64>,
}

/// What they found.
pub(crate) struct Checks {
    pub(crate) model_checks: Vec<ModelCheck>,
    /// Of each joint; none where the motion does not tell it.
    pub(crate) torque_delay_per_joint: Vec<Option<TorqueDelay>>,
    /// What has not been checked, and why.
    pub(crate) notes: Vec<String>,
}

impl Subject<'_> {
    /// Every freedom in turn.
    pub(crate) fn check(&self) -> Result<Checks, IdentificationError> {
        let columns = Columns { subject: self };
        let joints = self.robot.joints();
        let transmission = self.robot.transmission();
        // What explains much comes first: a filter or a delay also bends every friction law.
        let mut model_checks = Vec::new();
        let mut notes = Vec::new();
        match self.position_check(&columns)? {
            Some(check) => model_checks.push(check),
            None => notes.push(self.position_unchecked()),
        }
        let mut add = |freedom, columns: Option<&DMatrix<f64>>| {
            let extension = match columns {
                Some(columns) => self.analysis.extended(columns),
                None => Ok(None),
            };
            let extension = extension.map_err(IdentificationError::Regression)?;
            model_checks.extend(extension.iter().map(|extension| self.shifted(freedom, extension)));
            Ok::<_, IdentificationError>(extension)
        };
        let delays = add(Freedom::TorqueDelay, Some(&self.delays()))?;
        add(Freedom::LeftOutParameters, Some(&self.beside.left_out))?;
        let coupled: Vec<usize> =
            (0..joints).filter(|&motor| transmission.is_coupled(motor)).collect();
        let of_joints = (0..joints).map(|joint| unit(joint, joints));
        let of_motors =
            coupled.iter().map(|&motor| transmission.direction(motor)[..joints].to_vec());
        let freedoms = (0..joints).map(|joint| Freedom::JointFriction(joint + 1));
        let freedoms =
            freedoms.chain(coupled.iter().map(|motor| Freedom::MotorFriction(motor + 1)));
        let directions: Vec<Vec<f64>> = of_joints.chain(of_motors).collect();
        for (freedom, friction) in freedoms.zip(columns.friction(&directions)?) {
            add(freedom, friction.as_ref())?;
        }
        let predicted = self.predicted();
        for joint in 0..joints {
            add(Freedom::TorqueGain(joint + 1), Some(&self.gain(&predicted, joint)))?;
        }
        if delays.is_none() {
            notes.push(
                "the delay of the torques could not be checked, nor all else: too few rows are left \
                 over, or nothing moves"
                    .to_owned(),
            );
        }

        let mut torque_delay_per_joint = vec![None; joints];
        for (k, &joint) in delays.iter().flat_map(|d| d.columns.iter().enumerate()) {
            torque_delay_per_joint[joint] = delays.as_ref().map(|found| TorqueDelay {
                delay_s: found.coefficients[k],
                standard_deviation_s: found.covariance[(k, k)].sqrt(),
            });
        }
        Ok(Checks { model_checks, torque_delay_per_joint, notes })
    }

    fn shifted(&self, freedom: Freedom, extension: &Extension) -> ModelCheck {
        let uncertainty = Some(&extension.shift_deviation);
        self.check_of(freedom, Some(extension.probability), &extension.shift, uncertainty)
    }

    fn check_of(
        &self,
        freedom: Freedom,
        probability: Option<f64>,
        shift: &DVector<f64>,
        uncertainty: Option<&DVector<f64>>,
    ) -> ModelCheck {
        let relative = shift.component_div(self.deviations);
        let certain = |k: usize| uncertainty.is_none_or(|u| shift[k].abs() > CERTAIN * u[k]);
        let furthest = (0..relative.len()).max_by(|&a, &b| {
            let order = certain(a).cmp(&certain(b));
            order.then(relative[a].abs().total_cmp(&relative[b].abs()))
        });
        let furthest = furthest.unwrap_or_default();
        ModelCheck {
            freedom,
            probability,
            parameter: self.selection.names()[furthest].clone(),
            shift_deviations: relative[furthest],
            shift_uncertainty: uncertainty.map(|u| u[furthest] / self.deviations[furthest]),
        }
    }

    /// Why the noise of the positions was not looked at.
    fn position_unchecked(&self) -> String {
        match self.position_error {
            PositionError::InTheRegressor(filter) => format!(
                "what the position filter does at {} Hz could not be checked, so near to half the \
                 sample rate",
                filter.cutoff_hz
            ),
            PositionError::NotLookedAt => {
                "this method does not check what the noise of the positions does".to_owned()
            }
            PositionError::Unknown | PositionError::InTheLoop(_) => {
                "what the noise of the positions does to the loop could not be simulated".to_owned()
            }
        }
    }

    /// The predicted torque of one joint in its own rows: a gain that is wrong by a factor 1 + g
    /// adds g times this.
    fn gain(&self, predicted: &DVector<f64>, joint: usize) -> DMatrix<f64> {
        let range = self.observations.joint_rows(joint);
        DMatrix::from_fn(predicted.len(), 1, |row, _| {
            if range.contains(&row) { predicted[row] } else { 0.0 }
        })
    }

    /// X θ.
    fn predicted(&self) -> DVector<f64> {
        self.observations.matrix() * self.theta()
    }

    /// One column per joint, for its delay in s. What is logged at t and acts δ later than stated
    /// is, at the instant where it was thought to act, `τ(t + δ) ≈ τ(t) + δ dτ/dt`. Filtered torques
    /// are differentiated, which is as good as the reverse but for what filters make of the ends of a
    /// record, where nothing is known of either.
    fn delays(&self) -> DMatrix<f64> {
        let rates = &self.beside.rates * self.theta();
        DMatrix::from_fn(rates.len(), self.observations.joints(), |row, joint| {
            if self.observations.joint_rows(joint).contains(&row) { rates[row] } else { 0.0 }
        })
    }

    /// θ.
    fn theta(&self) -> DVector<f64> {
        let columns = self.selection.columns().iter();
        let theta = columns.map(|&column| self.standard[column]);
        DVector::from_iterator(self.selection.columns().len(), theta)
    }

    /// What the noise of the positions does.
    fn position_check(
        &self,
        columns: &Columns<'_>,
    ) -> Result<Option<ModelCheck>, IdentificationError> {
        match self.position_error {
            PositionError::Unknown | PositionError::NotLookedAt => Ok(None),
            PositionError::InTheRegressor(filter) => self.position_filter_check(columns, filter),
            // y(a) = y(0) + a l + a² e: twice y(1) − 2 y(1/2) + y(0) is e, the part that is even in
            // the noise and biases the estimate.
            PositionError::InTheLoop([half, all]) => {
                let even = (columns.rows_of(&(all - half * 2.0))? + self.predicted()) * 2.0;
                let shift = -self.analysis.moved_by(&even);
                Ok(Some(self.check_of(Freedom::PositionNoise, None, &shift, None)))
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
    /// Two wider filters give s and n, and −(s + n) is how far the parameter is from θ₀.
    fn position_filter_check(
        &self,
        columns: &Columns<'_>,
        filter: &PositionFilter,
    ) -> Result<Option<ModelCheck>, IdentificationError> {
        let nyquist_hz = 0.5 * self.experiment.sample_rate_hz();
        let widest = (WIDEST_CUTOFF * nyquist_hz / filter.cutoff_hz).min(WIDER);
        if widest < NARROWEST_COMPARISON {
            return Ok(None);
        }
        // How far the filter rings around a glitch [samples].
        let reach = RINGING_PERIODS * self.experiment.sample_rate_hz() / filter.cutoff_hz;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "above 0, and casts saturate"
        )]
        let reach = reach.ceil() as usize;
        // θ(r f) − θ(f): if the motion behind the other filter is the true one, y = X' θ + ε, the
        // estimate is off by Zᵀ (X' − X) θ, and would move back by as much.
        let mut positions = FilteredPositions::of(self.experiment);
        let mut move_with = |ratio: f64| -> Result<DVector<f64>, IdentificationError> {
            let other = PositionFilter { cutoff_hz: ratio * filter.cutoff_hz, ..*filter };
            positions.filter(self.experiment, &other)?;
            Ok(self.analysis.moved_by(&columns.torque_difference(&positions, reach)?))
        };
        let (near, far) = (widest.sqrt(), widest);
        let (moved_near, moved_far) = (move_with(near)?, move_with(far)?);
        let ([s1, n1], [s2, n2]) = (effects(near), effects(far));
        let determinant = s1 * n2 - s2 * n1;
        let smoothing = (&moved_near * n2 - &moved_far * n1) / determinant;
        let noise = (&moved_far * s1 - &moved_near * s2) / determinant;
        let back = self.check_of(Freedom::PositionFilter, None, &-(&smoothing + &noise), None);
        let parameter = self.selection.names().iter().position(|name| *name == back.parameter);
        let smoothed = parameter.is_none_or(|k| smoothing[k].abs() >= noise[k].abs());
        let freedom = if smoothed { Freedom::PositionFilter } else { Freedom::PositionNoise };
        Ok(Some(ModelCheck { freedom, ..back }))
    }
}

/// What smoothing and noise change when the cut-off is multiplied by a ratio, per unit of each.
fn effects(ratio: f64) -> [f64; 2] {
    [ratio.powi(-2) - 1.0, ratio.powi(3) - 1.0]
}

/// The direction of a joint's own speed.
fn unit(joint: usize, joints: usize) -> Vec<f64> {
    (0..joints).map(|j| if j == joint { 1.0 } else { 0.0 }).collect()
}
