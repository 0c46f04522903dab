//! The result of an identification.

use std::path::PathBuf;
use std::sync::Arc;

use didim::analysis::{
    ConsistentModel, CountedPiece, DataChoices, Format, NO_FRICTION, StoredModel,
    identify_recordings, measurement_pairs,
};
use didim::cell::SignalSource;
use didim::files::replace;
use didim::report::consistent_summary;
use didim::report::html::{InputFile, Origin, Report, SampleRange};
use didim_identification::identification::{
    Identification, IdentificationError, Method, Prediction,
};
use numpy::{PyArray1, PyArray2, ToPyArray as _};
use pyo3::prelude::*;
use tracing::Level;

use crate::cell::Cell;
use crate::logging::log;
use crate::recording::Recording;
use crate::rows::from_columns;
use crate::{errors, work};

/// An identified robot.
#[pyclass(frozen, module = "didim._native")]
pub(crate) struct Result {
    /// The cell, with the choices that the data made.
    cell: Arc<didim::cell::Cell>,
    identification: Arc<Identification>,
    /// File and range of each piece.
    origins: Vec<(Option<InputFile>, SampleRange)>,
}

/// Torques of a recording, and those that a result predicts, by the same filters.
type PredictedArrays<'py> =
    (String, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Times, and measured and fitted torques.
type FittedArrays<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl Result {
    /// The result as the JSON object that `didim identify --json` prints, without the data of its
    /// recordings.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(&self.identification.estimate).map_err(errors::identification)
    }

    /// Covariance of the parameters (statistical), in their order and units; `None` if the method
    /// gives none.
    fn covariance<'py>(&self, python: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let estimate = &self.identification.estimate;
        let matrix = estimate.covariance.as_ref()?.matrix(estimate.parameters.len())?;
        let columns: Vec<Vec<f64>> =
            matrix.column_iter().map(|column| column.iter().copied().collect()).collect();
        Some(from_columns(&columns).to_pyarray(python))
    }

    /// Time \[s\], measured and predicted torque of the rows that were fitted: rows × joints.
    fn fit<'py>(&self, python: Python<'py>) -> FittedArrays<'py> {
        let fit = &self.identification.fit;
        let [measured, predicted] =
            [&fit.measured, &fit.predicted].map(|columns| from_columns(columns).to_pyarray(python));
        (fit.time_s.to_pyarray(python), measured, predicted)
    }

    /// Predicts the torques of recordings. Returns the JSON object of `didim predict --json`
    /// without the notes, the times \[s\], and the measured and the predicted torques.
    #[pyo3(signature = (recordings, start=None, end=None))]
    fn predict<'py>(
        &self,
        python: Python<'py>,
        recordings: Vec<PyRef<'py, Recording>>,
        start: Option<f64>,
        end: Option<f64>,
    ) -> PyResult<PredictedArrays<'py>> {
        let parts = counted(python, &self.cell, &recordings, [start, end])?.0;
        let (cell, json) = (didim::cell::Cell::clone(&self.cell), self.json()?);
        let predicted = work::run(python, move || -> PyResult<Prediction> {
            let (model, cell) = StoredModel::parse(json.as_bytes(), "result".as_ref(), cell)
                .map_err(errors::identification)?;
            model.predict(&cell, &measurement_pairs(&parts)).map_err(errors::data)
        })??;
        let json = serde_json::to_string(&predicted).map_err(errors::identification)?;
        let [measured, of_model] = [&predicted.measured, &predicted.predicted]
            .map(|columns| from_columns(columns).to_pyarray(python));
        Ok((json, predicted.time_s.to_pyarray(python), measured, of_model))
    }

    /// Returns the model in a format of `didim export`, and the parts that the format cannot hold.
    /// Writes the model to a file if one is named. The notes of the command line go to the logger.
    #[pyo3(signature = (format, name="arm", path=None, total_mass=None))]
    fn export(
        &self,
        python: Python<'_>,
        format: &str,
        name: &str,
        path: Option<PathBuf>,
        total_mass: Option<f64>,
    ) -> PyResult<(String, Vec<String>)> {
        let is_named = |of: &Format| of.name() == format;
        let format = Format::ALL.into_iter().find(is_named).ok_or_else(|| {
            let names = Format::ALL.map(Format::name).join(", ");
            errors::usage(format!("format `{format}` is unknown; known: {names}"))
        })?;
        let cell = didim::cell::Cell::clone(&self.cell);
        let (model, cell) = StoredModel::parse(self.json()?.as_bytes(), "result".as_ref(), cell)
            .map_err(errors::identification)?;
        let consistent = ConsistentModel::from_result(&cell, &model, total_mass)
            .map_err(errors::identification)?;
        let exported = consistent.write(format, name).map_err(errors::identification)?;
        if let Some(path) = path {
            write(&path, &exported.text)?;
        }
        log(python, Level::INFO, consistent_summary(&consistent.outcome).trim_end())?;
        for refusal in model.refusals(&cell.options.required_uses) {
            log(python, Level::WARN, &refusal)?;
        }
        if consistent.has_no_friction() {
            log(python, Level::WARN, NO_FRICTION)?;
        }
        let left_out: Vec<String> = exported.left_out.iter().map(ToString::to_string).collect();
        for part in &left_out {
            log(python, Level::WARN, &format!("left out: {part}"))?;
        }
        Ok((exported.text, left_out))
    }

    /// Writes the report (one HTML file).
    fn report(&self, path: PathBuf) -> PyResult<()> {
        let mut origins = self.origins.iter();
        let Some((input, samples)) = origins.next() else {
            return Err(errors::data("the result has no recording"));
        };
        let named = |(file, range): &(Option<InputFile>, SampleRange)| {
            file.clone().map(|file| (file, range.clone()))
        };
        let origin = Origin {
            input: input.clone(),
            samples: samples.clone(),
            further_files: origins.filter_map(named).collect(),
            note: None,
        };
        let html = Report::new(&self.cell, &self.identification, &origin).to_html();
        write(&path, &html)
    }

    /// Writes the JSON object of the result to a file, for the commands of `didim`.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write(&path, &(self.json()? + "\n"))
    }
}

/// Writes a file completely or not at all.
fn write(path: &std::path::Path, text: &str) -> PyResult<()> {
    Ok(replace(path, |out| out.write_all(text.as_bytes()))?)
}

/// Pieces of recordings that count, and where they are from.
type Counted = (Vec<CountedPiece>, Vec<(Option<InputFile>, SampleRange)>);

fn counted(
    python: Python<'_>,
    cell: &didim::cell::Cell,
    recordings: &[PyRef<'_, Recording>],
    from_to: [Option<f64>; 2],
) -> PyResult<Counted> {
    let (mut parts, mut origins) = Counted::default();
    for recording in recordings {
        let counted = recording.counted_pieces(python, cell, from_to)?;
        origins.extend(
            counted.iter().map(|piece| (recording.file.clone(), SampleRange::from_piece(piece))),
        );
        parts.extend(counted);
    }
    match parts.is_empty() {
        true => Err(errors::usage("give at least one recording")),
        false => Ok((parts, origins)),
    }
}

/// Identifies from recordings of the same robot.
#[pyfunction]
#[pyo3(signature = (cell, recordings, method=None, start=None, end=None))]
pub(crate) fn identify(
    python: Python<'_>,
    cell: &Cell,
    recordings: Vec<PyRef<'_, Recording>>,
    method: Option<&str>,
    start: Option<f64>,
    end: Option<f64>,
) -> PyResult<Result> {
    let method = method.map(str::parse::<Method>).transpose().map_err(errors::usage)?;
    let (mut parts, origins) = counted(python, &cell.cell, &recordings, [start, end])?;
    let sources: Vec<SignalSource> = recordings.iter().map(|of| of.source).collect();
    let mut cell = didim::cell::Cell::clone(&cell.cell);
    let (cell, identification) = work::run(python, move || -> PyResult<_> {
        let choices = DataChoices::make_choices(&mut cell, &measurement_pairs(&parts), |_| {})
            .map_err(errors::identification)?;
        let method = method.unwrap_or(cell.method);
        let how = (&choices, &sources[..], false);
        let identified = identify_recordings(&mut cell, method, &mut parts, how);
        let identification = identified.map_err(|error| match error {
            didim::analysis::identify::IdentifyError::Identification(
                IdentificationError::NoController { .. },
            )
            | didim::analysis::identify::IdentifyError::NotRobust(_) => {
                errors::configuration(error)
            }
            error => errors::identification(error),
        })?;
        Ok((cell, identification))
    })??;
    Ok(Result { cell: Arc::new(cell), identification: Arc::new(identification), origins })
}
