//! Transforms of tall columns, one class of frequencies at a time.

use nalgebra::{DMatrix, DVector};

use super::fourier::PARALLEL_SIGNALS;
use super::observation_matrix::ObservationMatrix;
use super::products::{matrix_product, symmetric_product};
use super::row_filter::RowFilter;

/// Number of frequencies at a time.
const FREQUENCIES_AT_ONCE: usize = 512;

/// Transforms of columns whose rows are those of several joints. They are computed on demand,
/// because all of them would take several times the memory of the columns.
#[derive(Clone, Debug)]
pub(super) struct Spectra<'a> {
    filter: &'a RowFilter,
    joints: Vec<JointSignals<'a>>,
    /// Blocks of the only class, if there is no other.
    only_blocks: Option<Vec<FrequencyBlock>>,
}

/// Transforms at some frequencies.
#[derive(Clone, Debug)]
pub(super) struct FrequencyBlock {
    pub(super) frequencies: Vec<usize>,
    /// Real parts for each joint, and below them the imaginary parts.
    pub(super) of_joints: Vec<DMatrix<f64>>,
}

/// Columns in the rows of one joint.
#[derive(Clone, Debug)]
struct JointSignals<'a> {
    signals: Vec<&'a [f64]>,
    /// Combinations of the signals that form the columns (signals × columns), if the columns are
    /// not the signals themselves.
    combination: Option<DMatrix<f64>>,
}

impl<'a> Spectra<'a> {
    /// Creates the spectra of X times a factor on the right (b × c), with the rows of each joint
    /// divided by its level.
    pub(super) fn of_product(
        filter: &'a RowFilter,
        matrix: &'a ObservationMatrix,
        factor: &DMatrix<f64>,
        levels: &[f64],
    ) -> Self {
        Self::new(
            filter,
            levels
                .iter()
                .enumerate()
                .map(|(joint, level): (usize, &f64)| {
                    let combined = factor.select_rows(&matrix.columns_of(joint)) / *level;
                    let signals = matrix.of_joint(joint).map(|(_, values)| values).collect();
                    JointSignals { signals, combination: Some(combined) }
                })
                .collect(),
        )
    }

    /// Creates the spectra of columns (r × c).
    pub(super) fn of_columns(
        filter: &'a RowFilter,
        columns: &'a DMatrix<f64>,
        joints: usize,
    ) -> Self {
        let rows = columns.nrows() / joints;
        Self::new(
            filter,
            (0..joints)
                .map(|joint: usize| {
                    let columns_of_all = columns.as_slice().chunks_exact(columns.nrows());
                    let signals = columns_of_all
                        .map(|column| &column[joint * rows..(joint + 1) * rows])
                        .collect();
                    JointSignals { signals, combination: None }
                })
                .collect(),
        )
    }

    /// Creates the spectra of signals of one joint.
    pub(super) fn of_signals(filter: &'a RowFilter, signals: Vec<&'a [f64]>) -> Self {
        Self::new(filter, vec![JointSignals { signals, combination: None }])
    }

    fn new(filter: &'a RowFilter, joints: Vec<JointSignals<'a>>) -> Self {
        let mut spectra = Self { filter, joints, only_blocks: None };
        if filter.fourier.frequency_classes() == 1 {
            let mut blocks = Vec::new();
            spectra.for_each_block_of(0, |block| blocks.push(block));
            spectra.only_blocks = Some(blocks);
        }
        spectra
    }

    /// Calls `visit` with one block of frequencies after the other.
    pub(super) fn for_each_block(&self, mut visit: impl FnMut(&FrequencyBlock)) {
        match &self.only_blocks {
            Some(fixed) => fixed.iter().for_each(visit),
            None => {
                for class in 0..self.filter.fourier.frequency_classes() {
                    self.for_each_block_of(class, |block| visit(&block));
                }
            }
        }
    }

    fn for_each_block_of(&self, class: usize, mut visit: impl FnMut(FrequencyBlock)) {
        let frequencies: Vec<usize> = self.filter.fourier.frequencies_of(class).collect();
        let transforms: Vec<_> = self.joints.iter().map(|of| self.transforms(class, of)).collect();
        for first in (0..frequencies.len()).step_by(FREQUENCIES_AT_ONCE) {
            let some = first..frequencies.len().min(first + FREQUENCIES_AT_ONCE);
            visit(FrequencyBlock {
                of_joints: self
                    .joints
                    .iter()
                    .zip(&transforms)
                    .map(|(joint, transforms): (&JointSignals<'_>, &Vec<f64>)| {
                        let parts = transforms.chunks_exact(frequencies.len());
                        let values = parts.flat_map(|part| &part[some.clone()]).copied();
                        let values =
                            DMatrix::from_iterator(2 * some.len(), joint.signals.len(), values);
                        match &joint.combination {
                            Some(combined) => matrix_product(&values, combined),
                            None => values,
                        }
                    })
                    .collect(),
                frequencies: frequencies[some.clone()].to_vec(),
            });
        }
    }

    /// Returns the transforms of a joint's signals one after the other: the real parts at all
    /// frequencies of a class, then the imaginary parts.
    fn transforms(&self, class: usize, of: &JointSignals<'_>) -> Vec<f64> {
        let frequencies = self.filter.fourier.frequencies_of(class).count();
        let mut values = vec![0.0; 2 * frequencies * of.signals.len()];
        let transformed = values.chunks_mut(2 * frequencies * PARALLEL_SIGNALS);
        for (signals, to) in of.signals.chunks(PARALLEL_SIGNALS).zip(transformed) {
            let transforms = self.filter.fourier.of_class(class, signals);
            for (signal, to) in to.chunks_exact_mut(2 * frequencies).enumerate() {
                let (re, im) = to.split_at_mut(frequencies);
                for ((re, im), value) in re.iter_mut().zip(im).zip(&transforms) {
                    (*re, *im) = (value.re.0[signal], value.im.0[signal]);
                }
            }
        }
        values
    }

    /// Returns `AᵀA` of the columns A of one joint at the informative frequencies. It is that of
    /// the rows that the filter passes (Parseval).
    pub(super) fn passed_gram(&self) -> DMatrix<f64> {
        let (filter, length) = (self.filter, self.filter.fourier.length() as f64);
        let count = self.joints.iter().map(|joint| joint.signals.len()).sum();
        let mut gram = DMatrix::zeros(count, count);
        self.for_each_block(|FrequencyBlock { frequencies, of_joints }| {
            let inside = |k: &usize| *k < filter.passband_frequencies;
            let weights: Vec<f64> = (frequencies.iter())
                .filter(|k| inside(k))
                .map(|k| (filter.multiplicity(*k) / length).sqrt())
                .collect();
            let mut passed = DMatrix::zeros(2 * weights.len(), count);
            let targets = passed.as_mut_slice().chunks_exact_mut(weights.len().max(1));
            let parts =
                of_joints.iter().flat_map(|of| of.as_slice().chunks_exact(frequencies.len()));
            for (to, part) in targets.zip(parts) {
                let part = frequencies.iter().zip(part).filter(|(k, _)| inside(k));
                for (to, ((_, value), weight)) in to.iter_mut().zip(part.zip(&weights)) {
                    *to = value * weight;
                }
            }
            gram += symmetric_product(&passed, &passed);
        });
        gram
    }

    /// Adds for each joint the share that a projection on these orthonormal columns takes out of
    /// white noise at each informative frequency.
    pub(super) fn add_leverage(&self, rows: usize, leverage: &mut [Vec<f64>]) {
        self.for_each_block(|FrequencyBlock { frequencies, of_joints }| {
            for (leverage, values) in leverage.iter_mut().zip(of_joints) {
                for column in values.as_slice().chunks_exact(2 * frequencies.len()) {
                    let (re, im) = column.split_at(frequencies.len());
                    for ((frequency, re), im) in frequencies.iter().zip(re).zip(im) {
                        if let Some(leverage) = leverage.get_mut(*frequency) {
                            *leverage += (re * re + im * im) / rows as f64;
                        }
                    }
                }
            }
        });
    }
}

/// Orthonormal columns Q (r × b) as `Ω^{-1/2} X R⁻¹`, never formed.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrthonormalBasis<'a> {
    pub(super) matrix: &'a ObservationMatrix,
    pub(super) noise_levels: &'a [f64],
    pub(super) r_inverse: &'a DMatrix<f64>,
}

impl OrthonormalBasis<'_> {
    /// Returns Qᵀ times weighted rows (r).
    pub(super) fn transposed_times(&self, rows: &[f64]) -> DVector<f64> {
        let per_joint = self.matrix.rows_per_joint();
        let mut sums = DVector::zeros(self.matrix.ncols());
        for (joint, level) in self.noise_levels.iter().enumerate() {
            let joint_rows = &rows[joint * per_joint..(joint + 1) * per_joint];
            self.matrix.add_transposed_times(joint, 1.0 / level, joint_rows, &mut sums);
        }
        self.r_inverse.tr_mul(&sums)
    }

    /// Subtracts from weighted rows (r) their projection on Q.
    pub(super) fn take_out_of(&self, rows: &mut [f64]) {
        let parameters = self.r_inverse * self.transposed_times(rows);
        let per_joint = self.matrix.rows_per_joint();
        for (joint, level) in self.noise_levels.iter().enumerate() {
            let target = &mut rows[joint * per_joint..(joint + 1) * per_joint];
            self.matrix.add_joint_times(joint, -1.0 / level, &parameters, target);
        }
    }
}
