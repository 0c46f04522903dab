//! What the loop of a recording was told to follow.

use core::ops::Range;

use nalgebra::DMatrix;

use crate::identification::given::{Context, IdentificationError};
use crate::trajectory::SampledReference;

/// The references of the recording with these samples, the first at time 0, as the drive makes them
/// continuous and with this delay \[s\]; `references` are those of the experiment.
///
/// # Errors
/// [`IdentificationError::Reference`].
pub(crate) fn reference_of(
    context: &Context<'_>,
    references: &DMatrix<f64>,
    samples: &Range<usize>,
    delay_s: f64,
) -> Result<SampledReference, IdentificationError> {
    let own = references.rows_range(samples.clone()).into_owned();
    let reference = SampledReference::new(context.experiment.sample_rate_hz(), &own);
    let reference = reference.map_err(IdentificationError::Reference)?;
    let interpolation = context.options.simulation.reference;
    Ok(reference.with_interpolation(interpolation).with_delay_s(delay_s))
}
