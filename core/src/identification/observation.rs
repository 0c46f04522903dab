//! The observation matrix of equations 7 and 8.

use core::ops::Range;

use nalgebra::DMatrix;

use super::error::IdentificationError;
use super::prefilter::Motion;
use super::selection::Selection;
use crate::MAX_JOINTS;
use crate::dynamics::{Model, Workspace};
use crate::signal::ParallelDecimation;

/// Signals that are filtered side by side.
const LANES: usize = 4;

/// Memory for unfiltered columns \[bytes\]. The regressor is evaluated once more for every so many:
/// 28 parameters of six joints over 45,000 samples fit in one pass.
const BLOCK_BYTES: usize = 64 << 20;

/// The filtered, decimated observation matrix X of a motion: the rows of each joint together, one
/// column per selected parameter. Equation 6 filters each column as the torque is filtered.
///
/// Memory is bounded by 64 MiB or one group of columns, whichever is more, for any record.
///
/// # Errors
/// [`IdentificationError::RegressorFilter`] when the record is too short for the filter,
/// [`IdentificationError::Regressor`] when the regressor is not finite.
///
/// # Panics
/// When model, selection and motion are not of the same robot.
pub fn observation_matrix(
    model: &Model,
    selection: &Selection,
    motion: &Motion,
    decimation: &ParallelDecimation,
    counted: Range<usize>,
) -> Result<DMatrix<f64>, IdentificationError> {
    let (samples, joints) = motion.position.shape();
    let width = model.parameter_names().len();
    let kept: Vec<usize> = decimation.kept(counted).filter(|&k| k < samples).collect();
    let mut matrix = DMatrix::zeros(kept.len() * joints, selection.columns().len());

    // Every pair of parameter and joint is a signal, four of which make a group.
    let pairs: Vec<(usize, usize)> = (0..selection.columns().len())
        .flat_map(|parameter| (0..joints).map(move |joint| (parameter, joint)))
        .collect();
    let group_bytes = samples.max(1) * size_of::<[f64; LANES]>();
    let groups = (BLOCK_BYTES / group_bytes).clamp(1, pairs.len().div_ceil(LANES).max(1));
    let mut signals = vec![[0.0; LANES]; groups * samples];
    let mut workspace = Workspace::new();
    let mut regressor = vec![0.0; joints * width];

    for block in pairs.chunks(groups * LANES) {
        let places: Vec<Vec<usize>> = block
            .chunks(LANES)
            .map(|group| {
                group.iter().map(|&(p, joint)| joint * width + selection.columns()[p]).collect()
            })
            .collect();
        for k in 0..samples {
            let [q, dq, ddq] =
                [&motion.position, &motion.velocity, &motion.acceleration].map(|s| row(s, k));
            let state = (&q[..joints], &dq[..joints], &ddq[..joints]);
            model.regressor(&mut workspace, state.0, state.1, state.2, &mut regressor);
            for (group, places) in places.iter().enumerate() {
                let lanes = &mut signals[group * samples + k];
                for (lane, &place) in lanes.iter_mut().zip(places) {
                    *lane = regressor[place];
                }
            }
        }
        for (group, signals) in block.chunks(LANES).zip(signals.chunks_mut(samples.max(1))) {
            decimation.filter_lanes(signals).map_err(|cause| match cause {
                crate::signal::SignalError::NotFinite { index } => {
                    IdentificationError::Regressor { sample: index }
                }
                cause => IdentificationError::RegressorFilter(cause),
            })?;
            for (lane, &(parameter, joint)) in group.iter().enumerate() {
                let mut column = matrix.column_mut(parameter);
                let rows = column.as_mut_slice()[joint * kept.len()..].iter_mut();
                for (entry, &k) in rows.zip(&kept) {
                    *entry = signals[k][lane];
                }
            }
        }
    }
    Ok(matrix)
}

fn row(signals: &DMatrix<f64>, k: usize) -> [f64; MAX_JOINTS] {
    let mut values = [0.0; MAX_JOINTS];
    for (to, from) in values.iter_mut().zip(signals.row(k).iter()) {
        *to = *from;
    }
    values
}
