//! What all methods are given.

use std::ops::Range;

use didim_formats::Measurement;

use super::trial::Framework;
use crate::cell::Cell;

/// The experiment that all methods are given.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonInput<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// What was measured.
    pub measurement: &'a Measurement,
    /// The samples that count; the others are margin for the edges of the filters.
    pub counted: &'a Range<usize>,
    /// The true parameters of a simulated arm.
    pub truth: Option<&'a [(String, f64)]>,
}

impl ComparisonInput<'_> {
    /// The cell with all methods in one framework.
    pub(super) fn cell_in(&self, framework: Framework) -> Cell {
        let mut cell = self.cell.clone();
        cell.options.simulation.decimated = framework == Framework::Decimated;
        cell
    }
}
