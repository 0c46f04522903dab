//! Whether the described controller is the one that was recorded.
//!
//! A controller makes its command of the reference and the measured position, and all three are
//! recorded: what the described law makes of them has to be the command.

use core::ops::Range;

use nalgebra::DMatrix;

use super::alignment::same_period;
use super::simulator::Simulator;
use crate::MAX_JOINTS;
use crate::control::{ControllerConfig, SampledController, Setpoint, SimulatedController};
use crate::identification::given::{Context, IdentificationError};
use crate::trajectory::Reference;

/// Of every joint, `‖F(τ_law − τ)‖ / ‖F τ‖` over the rows: the error of the described law on the
/// recorded signals, filtered and decimated. None where it is not known: gains that are not the
/// cabinet's, a controller that computes between the samples or is not sampled, a torque that is no
/// command, no reference. Samples that outliers reach do not count.
pub(super) fn controller_error(
    context: &Context<'_>,
    simulator: &Simulator<'_>,
    outliers: &[Range<usize>],
) -> Result<Option<Vec<f64>>, IdentificationError> {
    let (experiment, reference) = (context.experiment, simulator.reference());
    let SimulatedController::Cabinet { timing, joints, rescale_to_inertia_kg_m2: None } =
        simulator.controller()
    else {
        return Ok(None);
    };
    let held = experiment.torque_timing().hold_s > 0.0;
    let each_sample = same_period(experiment.sample_rate_hz(), timing.sample_period_s());
    if !held || !each_sample || experiment.reference_rad().is_none() {
        return Ok(None);
    }
    let config = ControllerConfig { timing: *timing, joints: joints.clone() };
    let Ok(mut controller) = SampledController::new(&config) else { return Ok(None) };

    let (samples, n) = experiment.position_rad().shape();
    let mut error = DMatrix::zeros(samples, n);
    let [mut position, mut velocity, mut acceleration, mut measured, mut torque] =
        [[0.0; MAX_JOINTS]; 5];
    for k in 0..samples {
        let time_s = k as f64 / experiment.sample_rate_hz();
        reference.at(time_s, &mut position[..n], &mut velocity[..n], &mut acceleration[..n]);
        for (to, from) in measured.iter_mut().zip(experiment.position_rad().row(k).iter()) {
            *to = *from;
        }
        let setpoint = Setpoint {
            position: &position[..n],
            velocity: &velocity[..n],
            acceleration: &acceleration[..n],
        };
        controller.update(setpoint, &measured[..n], &mut torque[..n]);
        for (joint, (torque, logged)) in
            torque.iter().zip(experiment.torque_nm().row(k).iter()).enumerate()
        {
            error[(k, joint)] = torque - logged;
        }
    }
    let mut recorded = experiment.torque_nm().clone();
    for range in outliers {
        error.rows_range_mut(range.clone()).fill(0.0);
        recorded.rows_range_mut(range.clone()).fill(0.0);
    }
    let decimate = |signals: &DMatrix<f64>| {
        let rows = context.decimation.decimate_columns(signals, experiment.counted());
        rows.map_err(IdentificationError::RegressorFilter)
    };
    let (error, logged) = (decimate(&error)?, decimate(&recorded)?);
    let ratio = |joint: usize| error.column(joint).norm() / logged.column(joint).norm();
    Ok(Some((0..n).map(ratio).collect()))
}
