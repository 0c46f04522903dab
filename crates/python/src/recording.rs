//! Recordings: signals in memory, or read from a file.

use std::path::PathBuf;
use std::sync::Arc;

use didim::analysis::{CountedPiece, count_samples, read_recording, recording_source};
use didim::cell::SignalSource;
use didim::report::html::InputFile;
use didim_formats::{Record, RecordingStart, Side, SignalArrays};
use numpy::{PyArray2, PyReadonlyArray1, ToPyArray as _};
use pyo3::prelude::*;

use crate::cell::Cell;
use crate::rows::{Rows, check_shape, columns, from_columns};
use crate::{errors, logging, work};

/// A recording on a uniform grid, in pieces without gaps.
#[pyclass(frozen, module = "didim._native")]
#[derive(Clone)]
pub(crate) struct Recording {
    pub(crate) record: Arc<Record>,
    /// The file, if there is one.
    pub(crate) file: Option<InputFile>,
    /// Format of the file.
    pub(crate) source: SignalSource,
}

impl Recording {
    /// Returns the pieces with the samples that count for a cell. Logs warnings.
    pub(crate) fn counted_pieces(
        &self,
        python: Python<'_>,
        cell: &didim::cell::Cell,
        from_to: [Option<f64>; 2],
    ) -> PyResult<Vec<CountedPiece>> {
        let (record, mut logged) = ((*self.record).clone(), Ok(()));
        let warn = |warning: String| {
            if logged.is_ok() {
                logged = logging::log(python, tracing::Level::WARN, &warning);
            }
        };
        let parts = count_samples(record, cell, from_to, warn).map_err(errors::data)?;
        logged?;
        if let Some(first) = parts.first()
            && first.piece.measurement.axes() != cell.robot.joints()
        {
            return Err(errors::data(format!(
                "the recording has {} joints, the robot {}; give one column per joint of the robot",
                first.piece.measurement.axes(),
                cell.robot.joints()
            )));
        }
        Ok(parts)
    }
}

#[pymethods]
impl Recording {
    /// Creates a recording from arrays in SI units.
    #[new]
    #[pyo3(signature = (time, position, torque, reference=None, motor_side=false))]
    fn new(
        time: PyReadonlyArray1<'_, f64>,
        position: Rows<'_>,
        torque: Rows<'_>,
        reference: Option<Rows<'_>>,
        motor_side: bool,
    ) -> PyResult<Self> {
        let time_s = time.as_array().to_vec();
        let joints = position.as_array().ncols();
        let shape = (Some(time_s.len()), joints);
        check_shape("position", &position, shape)?;
        check_shape("torque", &torque, shape)?;
        if let Some(reference) = &reference {
            check_shape("reference", reference, shape)?;
        }
        let arrays = SignalArrays {
            side: if motor_side { Side::Motor } else { Side::Joint },
            time_s,
            position: columns(&position),
            torque: columns(&torque),
            reference: reference.as_ref().map(columns).unwrap_or_default(),
        };
        let finite = |of: &[Vec<f64>]| of.iter().flatten().all(|value| value.is_finite());
        let named = [("position", &arrays.position), ("torque", &arrays.torque)];
        let named = named.into_iter().chain([("reference", &arrays.reference)]);
        if let Some((name, _)) = named.into_iter().find(|(_, of)| !finite(of)) {
            let problem = "has a value that is no finite number; leave these rows out";
            return Err(errors::data(format!("{name} {problem}")));
        }
        let record = Record::from_arrays(arrays).map_err(errors::data)?;
        Ok(Self { record: Arc::new(record), file: None, source: SignalSource::Arrays })
    }

    /// Sample rate \[Hz\].
    #[getter]
    fn sample_rate(&self) -> f64 {
        self.record.segments.first().map_or(f64::NAN, |of| of.measurement.signals.sample_rate_hz)
    }

    #[getter]
    fn joints(&self) -> usize {
        self.record.segments.first().map_or(0, |of| of.measurement.axes())
    }

    /// Instant of the first sample, as text of RFC 3339; `None` if unknown.
    #[getter]
    fn recorded(&self) -> Option<String> {
        self.record.recording_start.map(|start: RecordingStart| start.to_string())
    }

    /// Changes that were made for a uniform grid, and gaps.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.record.notes()
    }

    /// True if the signals were measured on the motor side.
    #[getter]
    fn motor_side(&self) -> bool {
        self.record.segments.first().is_some_and(|of| of.measurement.side == Side::Motor)
    }

    /// Start of each piece after the first sample \[s\], its positions, torques and, if there are
    /// any, commanded positions.
    fn signals<'py>(&self, python: Python<'py>) -> Vec<PieceArrays<'py>> {
        let arrays = |columns: &Vec<Vec<f64>>| from_columns(columns).to_pyarray(python);
        let segments = self.record.segments.iter();
        segments
            .map(|piece| {
                let signals = &piece.measurement.signals;
                let reference = signals.reference_rad.as_ref().map(arrays);
                let (position, torque) = (&signals.position_rad, &signals.torque_nm);
                (piece.begins_s, arrays(position), arrays(torque), reference)
            })
            .collect()
    }
}

/// Start \[s\], positions, torques and commanded positions of a piece.
type PieceArrays<'py> =
    (f64, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Option<Bound<'py, PyArray2<f64>>>);

/// Reads a recording in the formats of the command line, with the layout of a cell.
#[pyfunction]
#[pyo3(signature = (path, cell, sample_rate=None))]
pub(crate) fn read(
    python: Python<'_>,
    path: PathBuf,
    cell: &Cell,
    sample_rate: Option<f64>,
) -> PyResult<Recording> {
    let cell = Arc::clone(&cell.cell);
    let read = work::run(python, move || {
        let source = recording_source(&path, false, &cell);
        let record = read_recording(&path, false, &cell, (sample_rate, &[]));
        // A file that can be read has a hash; one that cannot has said why.
        record.map(|record| (record, InputFile::read(&path).ok(), source))
    })?;
    let (record, file, source) = read.map_err(errors::data)?;
    Ok(Recording { record: Arc::new(record), file, source })
}
