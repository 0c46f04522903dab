//! The measured motion, filtered and differentiated (paper, section 3.1.1).

use nalgebra::DMatrix;

use super::filtered_positions::FilteredPositions;
use crate::identification::given::{Experiment, IdentificationError, PositionFilter};
use crate::signal::central_difference;

/// Joint positions, velocities and accelerations on one grid, each samples × joints \[rad, rad/s,
/// rad/s²; m for a prismatic joint\].
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// q.
    pub position: DMatrix<f64>,
    /// q̇.
    pub velocity: DMatrix<f64>,
    /// q̈.
    pub acceleration: DMatrix<f64>,
}

/// The motion of an experiment: positions filtered without phase over the whole record, then
/// central differences twice.
///
/// # Errors
/// [`IdentificationError::PositionFilter`] and [`IdentificationError::Signal`].
pub fn filtered_motion(
    experiment: &Experiment,
    filter: &PositionFilter,
) -> Result<Motion, IdentificationError> {
    let mut positions = FilteredPositions::of(experiment);
    positions.filter(experiment, filter)?;
    motion_along(experiment, positions.joint_after_joint(experiment.joints()))
}

/// The motion along these positions of an experiment's samples, samples × joints.
///
/// # Errors
/// [`IdentificationError::Signal`].
pub(crate) fn motion_along(
    experiment: &Experiment,
    position: DMatrix<f64>,
) -> Result<Motion, IdentificationError> {
    let velocity = derivatives(experiment, &position, "position")?;
    let acceleration = derivatives(experiment, &velocity, "position")?;
    Ok(Motion { position, velocity, acceleration })
}

/// The [`central_difference`] of every joint's signal, each recording's by itself.
fn derivatives(
    experiment: &Experiment,
    signals: &DMatrix<f64>,
    signal: &'static str,
) -> Result<DMatrix<f64>, IdentificationError> {
    let rate_hz = experiment.sample_rate_hz();
    let mut derivatives = DMatrix::zeros(signals.nrows(), signals.ncols());
    for (joint, (from, mut to)) in
        signals.column_iter().zip(derivatives.column_iter_mut()).enumerate()
    {
        for of in experiment.recordings() {
            let (from, to) = (from.as_slice(), to.as_mut_slice());
            central_difference(&from[of.samples.clone()], rate_hz, &mut to[of.samples.clone()])
                .map_err(|cause| IdentificationError::Signal {
                    signal,
                    joint: joint + 1,
                    cause: cause.later_by(of.samples.start),
                })?;
        }
    }
    Ok(derivatives)
}
