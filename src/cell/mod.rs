//! The cell file: which robot, which bus, which drives, and what to identify when.
//!
//! [`CellFile`] is what a person types; [`Cell`] is what the program needs, and cannot be wrong:
//! the robot, the DBC file and the drives were read, checked and found to fit each other.

mod address;
mod bus;
mod data;
mod error;
mod file;
mod layout;
mod library;
mod mistyped;
mod open;
mod read;
mod restart;
mod robot;
mod suggestion;
mod values;

use std::path::{Path, PathBuf};

use didim_core::dynamics::{BaseParameters, BaseParametersError, Model};
use didim_core::identification::{KeptParameters, Method, Options, SignalTiming};
use didim_core::robot::{JointFriction, Robot};
use didim_formats::{BagSpec, Columns, UrdfArm};

pub use address::{BusAddress, BusAddressError};
pub use bus::CellBus;
pub(crate) use data::{CURRENTS, DATES};
pub use data::{DataColumns, DataSection};
pub use error::{CellError, Faults};
pub use file::{
    BusSection, CellFile, IdentificationSection, Processes, ServiceSection, UrdfSection,
};
pub use library::{Library, SHIPPED};
pub use mistyped::WrongKey;
pub use open::{OPEN, OpenKey};
pub use robot::{RobotSource, joint_names};

use crate::archive::store::ConfigurationTexts;
use crate::live::recording::JointCurves;
use crate::live::worker::WindowOptions;
use crate::text::sha256;

/// A cell, validated.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Name of the cell.
    pub name: String,
    /// The file of the robot.
    pub robot_file: PathBuf,
    /// The arm, with the sign model that the cell chose.
    pub robot: Robot,
    /// The arm as its own file describes it: what is simulated must not follow from how the cell
    /// identifies.
    pub robot_as_described: Robot,
    /// The arm in a URDF, where that describes it.
    pub urdf: Option<UrdfArm>,
    /// What has to be known of an arm that a URDF describes.
    pub robot_notes: Vec<String>,
    /// Its dynamics.
    pub model: Model,
    /// Its base parameters.
    pub base: BaseParameters,
    pub(crate) bus: Option<CellBus>,
    /// The nominal sample rate \[Hz\].
    sample_rate_hz: f64,
    /// When a torque is valid.
    pub torque_timing: SignalTiming,
    /// The columns of tables, where they are not didim's own.
    pub columns: Option<Columns>,
    /// What is asked of ROS 2 bags.
    pub bag: Option<BagSpec>,
    /// When to identify.
    pub window: WindowOptions,
    /// The method.
    pub method: Method,
    /// How it identifies, by whatever method.
    pub options: Options,
    /// Whether the cell states the law for the sign, for all joints.
    pub overrides_sign: bool,
    /// Whether the data choose the cut-off of the position filter before.
    pub chooses_cutoff: bool,
    /// Whether the data choose the friction laws before.
    pub chooses_friction: bool,
    /// How the service runs.
    pub service: ServiceSection,
    /// SHA-256 over the cell, robot and DBC or device files, so that a result names what it was made with.
    pub configuration_sha256: String,
    /// The texts of these files as they were read.
    pub configuration: ConfigurationTexts,
}

impl Cell {
    /// The bus.
    ///
    /// # Errors
    /// [`CellError::NoBus`], where the cell has recordings of other programs alone.
    pub fn bus(&self) -> Result<&CellBus, CellError> {
        self.bus.as_ref().ok_or_else(|| CellError::NoBus { cell: self.name.clone() })
    }

    /// What makes the joints' curves of the frames of its bus.
    pub fn joint_curves(&self, bus: &CellBus) -> JointCurves {
        let names = joint_names(self.urdf.as_ref(), self.robot.joints());
        JointCurves::new(bus.assembler(), self.robot.transmission().clone(), names)
    }

    /// Whether a reference is recorded, as far as the cell tells: didim's own tables may have one.
    pub fn has_reference(&self) -> bool {
        match (&self.bus, &self.columns) {
            (Some(bus), _) => bus.layout.has_reference(),
            (None, Some(columns)) => columns.reference.is_some(),
            (None, None) => self.bag.is_none(),
        }
    }

    /// Whether the commands on its bus state their law.
    pub fn has_commanded_law(&self) -> bool {
        self.bus.as_ref().is_some_and(|bus| bus.states_law())
    }

    /// The same cell with other parameters to identify; they do not keep their nominal values.
    #[must_use]
    pub fn with_parameters(mut self, names: &[String]) -> Self {
        self.options.parameters = Some(names.to_vec());
        if let Some(KeptParameters::Named(kept)) = &mut self.options.keep_nominal {
            kept.retain(|name| !names.contains(name));
        }
        self
    }

    /// The same cell with these friction laws, one entry per joint.
    ///
    /// # Errors
    /// [`BaseParametersError`], where no base parameters can be told apart.
    pub fn with_friction(
        mut self,
        friction: Vec<JointFriction>,
    ) -> Result<Self, BaseParametersError> {
        self.robot = self.robot.with_friction(friction);
        self.model = Model::new(&self.robot);
        self.base = BaseParameters::compute(&self.model)?;
        self.options = self.options.with_friction(&self.robot);
        Ok(self)
    }

    /// As [`Self::read`], of a cell that leaves nothing to the data: for a service and for studies, whose
    /// results have to be of one model.
    ///
    /// # Errors
    /// See [`CellError`].
    pub fn read_decided(path: &Path) -> Result<Self, CellError> {
        Self::read(path)?.decided(path)
    }

    /// Itself, where it leaves nothing to the data; `path` is its file.
    ///
    /// # Errors
    /// [`CellError::Value`].
    pub fn decided(self, path: &Path) -> Result<Self, CellError> {
        let (key, instead) = match self {
            Self { chooses_cutoff: true, .. } => {
                ("identification.position_filter", "state the cut-off that it prints")
            }
            Self { chooses_friction: true, .. } => (
                "identification.friction",
                "put the laws that it prints into the robot file, and remove this key",
            ),
            _ => return Ok(self),
        };
        Err(CellError::Value {
            file: path.to_path_buf(),
            line: open::line_of(&self.configuration.cell, key),
            key: key.to_owned(),
            problem: format!(
                "\"auto\" is for a recording, and what is compared over years or runs has to be of one \
                 model; run `didim identify` on a recording, and {instead}"
            ),
        })
    }

    /// Reads a cell file and every file that it names.
    ///
    /// # Errors
    /// See [`CellError`].
    pub fn read(path: &Path) -> Result<Self, CellError> {
        Self::from_library(Library::Files, path)
    }

    /// As [`Self::read`], from files or from what is shipped inside the program.
    ///
    /// # Errors
    /// See [`CellError`].
    pub fn from_library(library: Library, path: &Path) -> Result<Self, CellError> {
        Self::read_all(library, path).map_err(|faults| *faults.first)
    }

    /// SHA-256 over how the base parameters are made up: where two results have the same one, a name
    /// stands for the same sum of parameters in both.
    pub fn regrouping_sha256(&self) -> String {
        let sums =
            self.base.names().iter().map(|name| {
                format!("{name} = {}\n", self.base.expression(name).unwrap_or_default())
            });
        let friction = self.robot.own_friction();
        let plain = friction.iter().all(|own| own.laws.is_empty() && own.sign == friction[0].sign);
        let laws =
            if plain { format!("{:?}", self.robot.sign_model(0)) } else { format!("{friction:?}") };
        // What is known or kept is in no parameter.
        let known = self.robot.known_torques();
        let known = known.iter().any(Option::is_some).then(|| format!("{known:?}"));
        let kept = self.options.keep_nominal.as_ref();
        let kept = kept.map(|kept| format!("{kept:?} {:?}", self.robot.nominal()));
        let beside: String = known.into_iter().chain(kept).collect();
        sha256(&[&(laws + &beside), &sums.collect::<String>()])
    }

    /// The nominal sample rate \[Hz\].
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }
}
