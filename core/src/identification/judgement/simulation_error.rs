//! How far a simulated loop is from the measurements (paper, table 3).

use nalgebra::{DMatrix, DVector};

use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::observation::prefilter::Motion;
use crate::signal::ParallelDecimation;

/// Relative errors of a simulation over the rows of each joint, filtered and decimated as those of
/// the equation.
pub(crate) struct SimulationErrors {
    /// ‖q − q_s‖ / ‖q‖.
    pub(crate) position_per_joint: Vec<f64>,
    /// ‖τ − τ_s‖ / ‖τ‖, where measured and simulated torques can be compared.
    pub(crate) torque_per_joint: Option<Vec<f64>>,
}

impl SimulationErrors {
    /// Of a simulated motion, and of the rows of measured and simulated torques.
    pub(crate) fn new(
        experiment: &Experiment,
        decimation: &ParallelDecimation,
        motion: &Motion,
        torques: Option<(&DVector<f64>, &DVector<f64>)>,
    ) -> Result<Self, IdentificationError> {
        let joints = experiment.joints();
        let rows = |signals: &DMatrix<f64>| {
            let failed =
                |cause| IdentificationError::Signal { signal: "position", joint: 1, cause };
            let rows = decimation.decimate_columns(signals, experiment.counted());
            rows.map(|rows| experiment.fitted_joints(decimation, rows)).map_err(failed)
        };
        let (measured, simulated) = (rows(experiment.position_rad())?, rows(&motion.position)?);
        Ok(Self {
            position_per_joint: relative_errors(joints, &measured, &simulated),
            torque_per_joint: torques
                .map(|(measured, simulated)| relative_errors(joints, measured, simulated)),
        })
    }
}

/// ‖y − y_s‖ / ‖y‖ of every joint's rows.
fn relative_errors(joints: usize, measured: &DVector<f64>, simulated: &DVector<f64>) -> Vec<f64> {
    let rows = measured.len() / joints;
    let pairs = (0..joints).map(|joint| {
        let range = joint * rows..(joint + 1) * rows;
        (measured.rows_range(range.clone()), simulated.rows_range(range))
    });
    pairs.map(|(y, simulated)| (y - simulated).norm() / y.norm()).collect()
}
