//! Input of all methods.

use std::ops::Range;

use didim_formats::Measurement;

use super::trial::Framework;
use didim::cell::Cell;

/// Experiment for all methods.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonInput<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// The measurement.
    pub measurement: &'a Measurement,
    /// Range of the samples that count. The other samples are margin for the edges of the filters.
    pub counted_samples: &'a Range<usize>,
    /// Names and values of the true parameters of a simulated arm.
    pub truth: Option<&'a [(String, f64)]>,
}

impl ComparisonInput<'_> {
    /// Returns the cell with its options set for one framework.
    pub(super) fn cell_in(&self, framework: Framework) -> Cell {
        let mut cell = self.cell.clone();
        cell.options.simulation.decimated = framework == Framework::Decimated;
        cell
    }
}
