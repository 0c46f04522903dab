//! Reference of a recording's control loop.

use core::ops::Range;

use nalgebra::DMatrix;

use crate::identification::problem::{Context, IdentificationError};
use didim_dynamics::trajectory::SampledReference;

/// Returns the references of the recording with these samples; the first sample is at time 0. They
/// are interpolated like in the drive and have this delay \[s\]. `references` are those of the
/// experiment.
///
/// # Errors
/// [`IdentificationError::Reference`].
pub(crate) fn find_reference(
    context: &Context<'_>,
    references: &DMatrix<f64>,
    samples: &Range<usize>,
    delay_s: f64,
) -> Result<SampledReference, IdentificationError> {
    let rows = references.rows_range(samples.clone()).into_owned();
    let reference = SampledReference::new(context.experiment.sample_rate_hz(), &rows);
    let reference = reference.map_err(IdentificationError::Reference)?;
    let interpolation = context.options.simulation.reference;
    Ok(reference.with_interpolation(interpolation).with_delay_s(delay_s))
}
