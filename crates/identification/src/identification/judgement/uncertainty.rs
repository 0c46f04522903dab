//! Uncertainty of a result, including the model and the configured values.
//!
//! The least-squares value ignores the nuisance parameters η. They are estimated together with the
//! parameters, with a prior for each. This gives their posterior mean μ and covariance P. A unit of
//! η shifts the value by K, so that the uncertainty u of the value is
//!
//! ```text
//! u² = noise + K (μ μᵀ + P) Kᵀ
//! ```
//!
//! The noise is computed from the spectrum of the residuals, or from the disagreement of the folds
//! if that is larger. If another reading of the signals fits decisively better, the change of the
//! value is added.
//!
//! The prior of a configured value has heavy tails, so that μ and P of a value that the data
//! contradict come from the data.
//!
//! The reported value stays that of the method. An estimate together with the nuisance parameters
//! would be more uncertain, and biased by the part of the torque that they absorb.

use nalgebra::{DMatrix, DVector};

use super::checks::FittedModel;
use super::extrapolation::Extrapolation;
use super::model_uncertainty::ModelUncertainty;
use super::nuisance_parameters::{
    NuisanceColumns, NuisanceEstimate, NuisanceObservation, Observed,
};
use crate::identification::problem::{IdentificationError, Tolerances};
use crate::regression::{FurtherColumns as _, JointSolution};

/// Smallest residual of a joint, as a share of its torque, for a rigid model with the usual
/// friction laws. The residual is not smaller even with very little noise.
const NOISE_FLOOR: f64 = 0.01;

/// Effect of the nuisance parameters on a result.
pub(super) struct Uncertainty {
    /// Combined standard uncertainty of each parameter.
    pub(super) combined_deviations: DVector<f64>,
    /// Estimates of the nuisance parameters, largest torques first.
    pub(super) nuisance_parameters: Vec<NuisanceEstimate>,
    pub(super) extrapolation: Extrapolation,
    /// Root mean square of the measured torque of each joint \[N·m or N\].
    pub(super) rms_torque: Vec<f64>,
    pub(super) model: Option<ModelUncertainty>,
}

/// Additional information on a result, which the checked equation does not contain.
#[derive(Clone, Copy)]
pub(super) struct Supplements<'a> {
    /// Change of each parameter by an alternative reading that fits decisively better.
    pub(super) alternative: Option<&'a DVector<f64>>,
    /// Standard deviation of each parameter from the disagreement of the folds.
    pub(super) fold_deviations: Option<&'a DVector<f64>>,
    /// Difference of the checked parameters from those of the result; `None` if they are the same.
    pub(super) other: Option<&'a DVector<f64>>,
}

impl Uncertainty {
    /// Creates the uncertainty of a fitted model. `bias` is the possible error of each parameter
    /// due to the position filter.
    pub(super) fn new(
        fitted: &FittedModel<'_>,
        bias: Option<&DVector<f64>>,
        further: Supplements<'_>,
    ) -> Result<Self, IdentificationError> {
        let FittedModel { context, motion, observations, analysis, parameters, .. } = *fitted;
        let auxiliary = fitted.auxiliary_columns;
        let Supplements { alternative, fold_deviations, other } = further;
        let columns = nuisance_columns(fitted);
        // Rows that the M-estimate removed from the equation contain no information on the nuisance
        // parameters either.
        let rates = fitted.torque_rates.clone();
        let along = NuisanceObservation::new(&columns, motion, auxiliary, observations, rates)?
            .with_zero_rows(analysis.rows_without_equation());
        let products = analysis.products(&along);
        let solved = |floors: &[f64]| {
            let solution = analysis.with_prior(&along, &products, floors);
            solution.map_err(IdentificationError::Regression)
        };
        let floors: Vec<f64> = columns.torque().iter().map(|torque| NOISE_FLOOR * torque).collect();
        let mut solution = solved(&floors)?;
        let (own, all) = (parameters.len(), solution.covariance.ncols());
        let sensitivity = &products.sensitivity;
        let residuals = observations.residuals(parameters);
        let of_motion = floors_of_motion(fitted, columns.torque(), &residuals)?;
        drop(residuals);
        let by_alternative = |k: usize| alternative.map_or(0.0, |change| change[k].powi(2));
        let has_prior = columns.has_prior();
        let combined_by = |solution: &JointSolution| {
            let tailed = solution.with_heavy_tails(&has_prior);
            let after = tailed.covariance.view((own, own), (all - own, all - own));
            let mean_shift = sensitivity * &tailed.nuisance_parameters;
            let spread: DMatrix<f64> = sensitivity * after;
            DVector::from_fn(own, |k, _| {
                let posterior = spread.row(k).dot(&sensitivity.row(k));
                let bias = bias.map_or(0.0, |bias| bias[k]);
                let difference = fold_deviations.map_or(0.0, |of| of[k].powi(2));
                let noise = solution.noise[(k, k)].max(difference);
                (noise + mean_shift[k].powi(2) + posterior + bias * bias + by_alternative(k))
                    .max(0.0)
                    .sqrt()
            })
        };
        let mut combined = combined_by(&solution);
        // Configured values are judged without these noise floors, because a wrong configured value
        // could be the cause of the large residual.
        if let Some(of_motion) = of_motion.filter(|of| *of != floors) {
            combined = combined.sup(&combined_by(&solved(&of_motion)?));
        }
        let rows = observations.rows_per_joint();
        let freed = solution.without_contradicted(&has_prior, Tolerances::CONTRADICTION_DEVIATIONS);
        let nuisance_parameters =
            columns.estimates(&products.column_products, rows, &solution, &freed);
        let remaining = observations.residuals(&(parameters + &solution.parameter_change))
            - along.weighted_sum(&solution.nuisance_parameters);
        if let Some(other) = other {
            solution.parameter_change += other;
        }
        // Predictions are compared with filtered records. The residual of unfiltered rows is much
        // larger.
        let model = (!context.decimation.is_none()).then(|| {
            let noise = observations.rms_per_joint(&remaining);
            ModelUncertainty::new(&columns, noise, &solution, sensitivity)
        });
        let extrapolation = Extrapolation::new(context, motion, &columns, parameters, &solution)?;
        let torque = columns.torque().to_vec();
        Ok(Self {
            combined_deviations: combined,
            nuisance_parameters,
            extrapolation,
            rms_torque: torque,
            model,
        })
    }
}

/// Returns the nuisance parameters of a fitted model.
fn nuisance_columns<'a>(fitted: &FittedModel<'a>) -> NuisanceColumns<'a> {
    let FittedModel { context, motion, observations, parameters, .. } = *fitted;
    let observed = Observed::new(context, motion, fitted.auxiliary_columns, observations);
    let columns = NuisanceColumns::new(context, parameters, observed);
    match fitted.has_substitute_controller() {
        true => columns.with_configured_gains(),
        false => columns,
    }
}

/// Returns the noise floor of each joint's rows \[N·m or N\] if the positions of motors may be
/// wrong. `torque` and `residuals` are those of all joints. A motor that is geared to two joints
/// takes part in the motion of both. So the residual of one joint may be due to an error of the
/// motion. The other joint then has this error too, but its parameters may hide it. Returns `None`
/// without such a motor.
fn floors_of_motion(
    fitted: &FittedModel<'_>,
    torque: &[f64],
    residuals: &DVector<f64>,
) -> Result<Option<Vec<f64>>, IdentificationError> {
    let (joints, transmission) = (torque.len(), fitted.context.robot.transmission());
    let turns = |motor: usize, joint: usize| transmission.direction(motor)[joint] != 0.0;
    let coupled: Vec<usize> = (0..joints).filter(|&motor| transmission.is_coupled(motor)).collect();
    if coupled.is_empty() {
        return Ok(None);
    }
    let residual_rms = fitted.left_but_for_lag(residuals)?;
    let share = |joint: usize| {
        let geared = |other: &usize| {
            coupled.iter().any(|&motor| turns(motor, joint) && turns(motor, *other))
        };
        let shares = (0..joints).filter(geared).map(|other| residual_rms[other] / torque[other]);
        // The share of a joint without torque is not finite and is ignored.
        shares.filter(|share| share.is_finite()).fold(NOISE_FLOOR, f64::max)
    };
    Ok(Some((0..joints).map(|joint| share(joint) * torque[joint]).collect()))
}
