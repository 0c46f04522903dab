//! The uncertainty of a result that includes the model and what was stated.
//!
//! The least-squares value does not know of the freedoms η. They are solved for together with the
//! parameters, with what is known of each beforehand, which gives their mean μ and covariance P after the
//! data. A unit of η moves the value by K, so that its uncertainty is
//!
//! ```text
//! u² = noise + K (μ μᵀ + P) Kᵀ
//! ```
//!
//! The noise is that of the residuals' spectrum, or what pieces of the motion disagree by, where that is more. How far a low-pass
//! would move the value that explains much of what the model leaves is added to it.
//!
//! Where the data contradict what was stated of a freedom, its μ and P are of the data alone.
//!
//! The value stays that of the method: with the freedoms it would be more uncertain, and wrong by
//! what they take from it.

use nalgebra::{DMatrix, DVector};

use super::checks::FittedModel;
use super::elsewhere::Elsewhere;
use super::freedoms::{Along, Columns, FreedomEstimate, Observed};
use super::model_uncertainty::ModelUncertainty;
use super::reasons::Note;
use crate::identification::given::{IdentificationError, Tolerances};
use crate::regression::{FurtherColumns as _, JointSolution};

/// A rigid model with named friction leaves this share of a joint's torque, however quiet the data are.
const NOISE_FLOOR: f64 = 0.01;

/// What the freedoms make of a result.
pub(super) struct Uncertainty {
    /// Combined standard uncertainty of each parameter.
    pub(super) combined: DVector<f64>,
    /// What the data say of the freedoms, the largest torques first.
    pub(super) freedoms: Vec<FreedomEstimate>,
    pub(super) elsewhere: Elsewhere,
    /// Root mean square of the measured torque of each joint \[N·m or N\].
    pub(super) torque: Vec<f64>,
    pub(super) model: Option<ModelUncertainty>,
    /// What a person has to know with it.
    pub(super) notes: Vec<Note>,
}

/// What is known of a result beside the equation that is checked.
#[derive(Clone, Copy)]
pub(super) struct Beside<'a> {
    /// Of so many rows that say the same, one counts.
    pub(super) copies: f64,
    /// The standard deviation of each parameter by how much pieces of the motion disagree.
    pub(super) disagreement: Option<&'a DVector<f64>>,
    /// How far the checked parameters are from the result's, where they are not the same.
    pub(super) other: Option<&'a DVector<f64>>,
}

impl Uncertainty {
    /// `bias` is how far each parameter may be off by what the position filter does.
    pub(super) fn new(
        fitted: &FittedModel<'_>,
        bias: Option<&DVector<f64>>,
        further: Beside<'_>,
    ) -> Result<Self, IdentificationError> {
        let FittedModel { context, motion, beside, observations, analysis, parameters, .. } =
            *fitted;
        let Beside { copies, disagreement, other } = further;
        let observed = Observed::new(context, motion, beside, observations);
        let columns = Columns::new(context, parameters, observed);
        // Rows that an M-estimate left out of the equation say nothing of the freedoms either.
        let along = Along::new(&columns, motion, beside, observations)?
            .without(analysis.rows_without_equation());
        let products = analysis.products(&along);
        let solved = |floors: &[f64]| {
            let solution = analysis.with_prior(&along, &products, floors, copies);
            solution.map_err(IdentificationError::Regression)
        };
        let floors: Vec<f64> = columns.torque().iter().map(|torque| NOISE_FLOOR * torque).collect();
        let mut solution = solved(&floors)?;
        let (own, all) = (parameters.len(), solution.covariance.ncols());
        let moved = &products.moved;
        let residuals = observations.residuals(parameters);
        let left = observations.rms_per_joint(&residuals);
        let low_passed = fitted.low_passed(&residuals, &left);
        let of_motion = floors_of_motion(fitted, columns.torque(), &residuals)?;
        drop(residuals);
        let by_low_passes = |k: usize| low_passed.iter().map(|of| of.moved[k].powi(2)).sum::<f64>();
        let combined_by = |solution: &JointSolution| {
            // A statement that the data contradict says nothing of how far the value is off.
            let unstated =
                solution.without_contradicted(&columns.stated(), Tolerances::CONTRADICTED);
            let after = unstated.covariance.view((own, own), (all - own, all - own));
            let told = moved * &unstated.freedoms;
            let spread: DMatrix<f64> = moved * after;
            DVector::from_fn(own, |k, _| {
                let open = spread.row(k).dot(&moved.row(k));
                let bias = bias.map_or(0.0, |bias| bias[k]);
                let apart = disagreement.map_or(0.0, |of| of[k].powi(2));
                let noise = solution.noise[(k, k)].max(apart);
                (noise + told[k].powi(2) + open + bias * bias + by_low_passes(k)).max(0.0).sqrt()
            })
        };
        let mut combined = combined_by(&solution);
        // What is stated is judged without such a doubt, which could be the cause of what contradicts it.
        if let Some(of_motion) = of_motion.filter(|of| *of != floors) {
            combined = combined.sup(&combined_by(&solved(&of_motion)?));
        }
        let rows = observations.rows_per_joint();
        let freedoms = columns.estimates(&products.squares, rows, &solution);
        let remaining = observations.residuals(&(parameters + &solution.change))
            - along.times(&solution.freedoms);
        if let Some(other) = other {
            solution.change += other;
        }
        // A record is predicted behind the filter, and what is left of rows without it is much more.
        let model = (!context.decimation.is_none()).then(|| {
            let noise = observations.rms_per_joint(&remaining);
            ModelUncertainty::new(&columns, noise, &solution, moved)
        });
        let elsewhere = Elsewhere::new(context, motion, &columns, parameters, &solution)?;
        let torque = columns.torque().to_vec();
        let notes = low_passed.into_iter().map(|of| of.note).collect();
        Ok(Self { combined, freedoms, elsewhere, torque, model, notes })
    }
}

/// The least noise of each joint's rows \[N·m or N\], with these torques and residuals of all, where the positions of motors are in doubt. One that
/// is geared to two joints takes part in the motion of both: what is left at the one may be an error of the motion, and then
/// it is at the other as well, whose parameters may hide it. None where no motor is.
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
    let left = fitted.left_but_for_lag(residuals)?;
    let share = |joint: usize| {
        let geared = |other: &usize| {
            coupled.iter().any(|&motor| turns(motor, joint) && turns(motor, *other))
        };
        let shares = (0..joints).filter(geared).map(|other| left[other] / torque[other]);
        // Of a joint without torque there is none.
        shares.filter(|share| share.is_finite()).fold(NOISE_FLOOR, f64::max)
    };
    Ok(Some((0..joints).map(|joint| share(joint) * torque[joint]).collect()))
}
