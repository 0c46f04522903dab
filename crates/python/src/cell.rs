//! The robot and the settings of an identification, and the robot's dynamics on arrays.

use std::path::PathBuf;
use std::sync::Arc;

use didim::cell::{Library, RobotSource, UrdfSection};
use didim::proposal::usual_samples_per_row;
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::JointIndex;
use numpy::ndarray::{Array2, Array3};
use numpy::{PyArray2, PyArray3, PyReadonlyArray1, ToPyArray as _};
use pyo3::prelude::*;

use crate::errors;
use crate::rows::{Rows, check_shape, copy_row};

/// Name of the cell file in errors of a cell that has none.
const CELL_NAME: &str = "cell.toml";

/// A cell: the robot, the layout of its recordings, and the settings of the identification.
#[pyclass(frozen, module = "didim._native")]
#[derive(Clone)]
pub(crate) struct Cell {
    pub(crate) cell: Arc<didim::cell::Cell>,
}

impl Cell {
    fn model(&self) -> &Model {
        &self.cell.model
    }

    fn joints(&self) -> usize {
        self.cell.robot.joints()
    }

    /// Checks positions, speeds and accelerations. Returns the number of rows.
    fn check_motion(&self, motion: [(&str, &Rows<'_>); 3]) -> PyResult<usize> {
        let rows = motion[0].1.as_array().nrows();
        for (name, array) in motion {
            check_shape(name, array, (Some(rows), self.joints()))?;
        }
        Ok(rows)
    }

    /// Returns the values of the standard parameters: all of them, or the base parameters.
    fn standard(&self, parameters: &PyReadonlyArray1<'_, f64>) -> PyResult<Vec<f64>> {
        let values = parameters.as_array().to_vec();
        let (standard, base) = (self.model().parameter_names(), self.cell.base.names());
        if values.len() == standard.len() {
            return Ok(values);
        }
        if values.len() == base.len() {
            let named = base.iter().map(String::as_str).zip(values);
            return self.cell.base.to_standard(named).map_err(errors::usage);
        }
        Err(errors::usage(format!(
            "parameters has {} values; give {} standard or {} base parameters",
            values.len(),
            standard.len(),
            base.len()
        )))
    }
}

#[pymethods]
impl Cell {
    /// Reads a cell file and every file that it names.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let cell = didim::cell::Cell::read(&path).map_err(errors::configuration)?;
        Ok(Self { cell: Arc::new(cell) })
    }

    /// Creates a cell from the sections of a cell file as JSON, and the text of its robot file.
    #[staticmethod]
    fn from_json(sections: &str, robot_file: &str, robot: &str) -> PyResult<Self> {
        let text = Self::toml(sections)?;
        let texts = [(CELL_NAME, text.as_str()), (robot_file, robot)];
        let cell = didim::cell::Cell::from_library(Library::Texts(&texts), CELL_NAME.as_ref());
        Ok(Self { cell: Arc::new(cell.map_err(errors::configuration)?) })
    }

    /// The cell with the torques of these joints alone: numbers from 1, or names.
    fn with_torque_joints(&self, joints: Vec<String>) -> PyResult<Self> {
        let Ok(joints) = joints.iter().map(|of| of.parse()).collect::<Result<Vec<_>, _>>();
        let cell = didim::cell::Cell::clone(&self.cell).with_torque_joints(&joints);
        let problem = |error| errors::usage(format!("joints: {error}"));
        Ok(Self { cell: Arc::new(cell.map_err(problem)?) })
    }

    /// Returns a JSON object as TOML.
    #[staticmethod]
    fn toml(json: &str) -> PyResult<String> {
        let value: toml::Value = serde_json::from_str(json).map_err(errors::usage)?;
        toml::to_string(&value).map_err(errors::usage)
    }

    /// The usual number of samples per row at a sample rate \[Hz\].
    #[staticmethod]
    fn usual_samples_per_row(sample_rate: f64) -> f64 {
        usual_samples_per_row(sample_rate)
    }

    /// Number of joints of the arm in a URDF.
    #[staticmethod]
    #[pyo3(signature = (urdf, file, base=None, tip=None))]
    fn urdf_joints(
        urdf: &str,
        file: &str,
        base: Option<String>,
        tip: Option<String>,
    ) -> PyResult<usize> {
        let ends = UrdfSection { base, tip, ..UrdfSection::default() };
        let source = RobotSource::read(file.as_ref(), urdf.to_owned(), Some(&ends));
        Ok(source.map_err(errors::configuration)?.robot.joints())
    }

    #[getter]
    fn name(&self) -> &str {
        &self.cell.name
    }

    #[getter]
    fn configuration(&self) -> &str {
        &self.cell.configuration_sha256
    }

    #[getter]
    fn robot(&self) -> &str {
        self.cell.robot.name()
    }

    /// Labels of the joints: the number, with the name of the robot's file.
    #[getter]
    fn joint_names(&self) -> Vec<String> {
        let robot = &self.cell.robot;
        let name = |joint| robot.joint_name(joint).map(str::to_owned);
        (0..self.joints())
            .map(|joint| name(JointIndex::new(joint)).unwrap_or_else(|| (joint + 1).to_string()))
            .collect()
    }

    #[getter]
    fn sample_rate(&self) -> f64 {
        self.cell.sample_rate_hz()
    }

    #[getter]
    fn method(&self) -> &str {
        self.cell.method.name()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.cell.robot_notes.clone()
    }

    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.model().parameter_names().to_vec()
    }

    /// Name and expression of each base parameter.
    fn base_parameters(&self) -> Vec<(String, String)> {
        let base = &self.cell.base;
        let expression = |name: &String| (name.clone(), base.expression(name).unwrap_or_default());
        base.names().iter().map(expression).collect()
    }

    /// Columns of the standard regressor that are those of the base parameters.
    fn base_columns(&self) -> Vec<usize> {
        self.cell.base.columns().to_vec()
    }

    /// Standard parameters of the robot's file; `None` if it has no bodies.
    fn nominal_parameters(&self) -> Option<Vec<f64>> {
        Some(self.cell.robot.nominal()?.standard_parameters().to_vec())
    }

    /// Base values of standard values.
    fn to_base(&self, standard: PyReadonlyArray1<'_, f64>) -> PyResult<Vec<f64>> {
        let values = standard.as_array().to_vec();
        let wanted = self.model().parameter_names().len();
        match values.len() == wanted {
            true => Ok(self.cell.base.to_base(&values)),
            false => Err(errors::usage(format!(
                "standard has {} values; the model has {wanted} standard parameters",
                values.len()
            ))),
        }
    }

    /// Regressor: rows × joints × standard parameters.
    fn regressor<'py>(
        &self,
        python: Python<'py>,
        q: Rows<'py>,
        dq: Rows<'py>,
        ddq: Rows<'py>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let rows = self.check_motion([("q", &q), ("dq", &dq), ("ddq", &ddq)])?;
        let (joints, width) = (self.joints(), self.model().parameter_names().len());
        let model = self.model();
        let mut out = vec![0.0; rows * joints * width];
        let of_row = |work: &mut Workspace<f64>, [q, dq, ddq]: [&[f64]; 3], out: &mut [f64]| {
            model.regressor(work, q, dq, ddq, out);
        };
        for_each_row(python, [&q, &dq, &ddq], &mut out, of_row);
        let out = Array3::from_shape_vec((rows, joints, width), out).map_err(errors::usage)?;
        Ok(out.to_pyarray(python))
    }

    /// Joint torques: rows × joints.
    fn inverse_dynamics<'py>(
        &self,
        python: Python<'py>,
        q: Rows<'py>,
        dq: Rows<'py>,
        ddq: Rows<'py>,
        parameters: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.check_motion([("q", &q), ("dq", &dq), ("ddq", &ddq)])?;
        let (joints, standard) = (self.joints(), self.standard(&parameters)?);
        let model = self.model();
        let mut out = vec![0.0; rows * joints];
        let of_row = |work: &mut Workspace<f64>, [q, dq, ddq]: [&[f64]; 3], out: &mut [f64]| {
            model.inverse_dynamics(work, &standard, q, dq, ddq, out);
        };
        for_each_row(python, [&q, &dq, &ddq], &mut out, of_row);
        let out = Array2::from_shape_vec((rows, joints), out).map_err(errors::usage)?;
        Ok(out.to_pyarray(python))
    }

    /// Mass matrix of each posture: rows × joints × joints.
    fn mass_matrix<'py>(
        &self,
        python: Python<'py>,
        q: Rows<'py>,
        parameters: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        check_shape("q", &q, (None, self.joints()))?;
        let (joints, standard) = (self.joints(), self.standard(&parameters)?);
        let (model, rows) = (self.model(), q.as_array().nrows());
        let mut out = vec![0.0; rows * joints * joints];
        let of_row = |work: &mut Workspace<f64>, [q]: [&[f64]; 1], out: &mut [f64]| {
            model.mass_matrix(work, &standard, q, out);
        };
        for_each_row(python, [&q], &mut out, of_row);
        let shape = (rows, joints, joints);
        let out = Array3::from_shape_vec(shape, out).map_err(errors::usage)?;
        Ok(out.to_pyarray(python))
    }
}

/// Computes the output of each row of arrays with one shape, without the interpreter's lock.
fn for_each_row<const N: usize>(
    python: Python<'_>,
    arrays: [&Rows<'_>; N],
    out: &mut [f64],
    of_row: impl Fn(&mut Workspace<f64>, [&[f64]; N], &mut [f64]) + Sync,
) {
    let arrays = arrays.map(|rows| rows.as_array());
    let rows = arrays[0].nrows();
    if rows == 0 {
        return;
    }
    let width = out.len() / rows;
    python.detach(|| {
        let mut work = Workspace::new();
        let mut values = arrays.map(|array| vec![0.0; array.ncols()]);
        for (row, out) in out.chunks_exact_mut(width).enumerate() {
            for (from, to) in arrays.iter().zip(&mut values) {
                copy_row(from, row, to);
            }
            of_row(&mut work, values.each_ref().map(Vec::as_slice), out);
        }
    });
}
