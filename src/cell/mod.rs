//! The cell file: the robot, the bus, the drives, and the options and times of identification.
//!
//! [`CellFile`] is the text that a person writes. [`Cell`] is its validated form: the robot, the
//! DBC file and the drives have been read and checked, and fit each other.

mod address;
mod bus;
mod contact;
mod data;
mod error;
mod file;
mod layout;
mod library;
mod load_frame;
mod mistyped;
mod open;
mod read;
mod restart;
mod robot;
mod screening;
mod setting;
mod signal_source;
mod suggestion;
mod table;
mod torque_joints;
mod unit;
mod values;

use std::path::{Path, PathBuf};

use didim_dynamics::SignalTiming;
use didim_dynamics::dynamics::{BaseParameters, BaseParametersError, Model};
use didim_dynamics::robot::{JointFriction, JointIndex, Robot};
use didim_formats::{BagSpec, Columns, OwnColumns, UrdfArm};
use didim_identification::identification::{KeptParameters, Method, Options, SignalDelays};

pub use address::{BusAddress, BusAddressError};
pub use bus::CellBus;
pub use contact::ContactSection;
pub(crate) use data::DATE_UNIT;
pub use data::{DataColumns, DataSection};
pub use error::{CellError, Faults};
pub use file::{
    BusSection, CellFile, IdentificationSection, PayloadSection, Processes, ServiceSection,
    UrdfSection,
};
pub use library::{Library, SHIPPED_FILES};
pub use load_frame::LoadFrame;
pub use mistyped::WrongKey;
pub use open::{MISSING_VALUE, OpenKey};
pub use robot::{RobotSource, joint_names};
pub use screening::{CommandCheck, LimitCheck, RateCheck, RestCheck, ScreeningOptions};
pub use signal_source::SignalSource;
pub use torque_joints::{JointReference, TorqueJointsError};
pub(crate) use unit::{CURRENT_UNITS, POSITION_UNITS, QuantityUnits, TORQUE_UNITS};

use crate::archive::ResultOptions;
use crate::archive::store::ConfigurationTexts;
use crate::live::recording::JointCurves;
use crate::live::window_options::WindowOptions;
use crate::text::sha256;

/// A cell, validated.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Name of the cell.
    pub name: String,
    /// Path of the cell file, as it was named.
    pub file: PathBuf,
    /// Path of the robot file.
    pub robot_file: PathBuf,
    /// The arm, with the sign law of friction that the cell chooses.
    pub robot: Robot,
    /// The arm as described in its own file. A simulated arm uses it, because it must not depend on
    /// identification settings.
    pub robot_as_described: Robot,
    /// The arm in the URDF, if the robot is described by one.
    pub urdf: Option<UrdfArm>,
    /// Notes on an arm from a URDF.
    pub robot_notes: Vec<String>,
    /// Dynamic model of the arm.
    pub model: Model,
    /// Base parameters of the arm.
    pub base: BaseParameters,
    pub(crate) bus: Option<CellBus>,
    /// Nominal sample rate \[Hz\].
    sample_rate_hz: f64,
    /// Time at which a torque is valid.
    pub torque_timing: SignalTiming,
    /// Delays of the signals of single axes.
    pub signal_delays: SignalDelays,
    /// Columns of the tables. `None` if the tables have didim's own format.
    pub columns: Option<Columns>,
    /// Corrections of tables with didim's own columns.
    pub own_columns: OwnColumns,
    /// Content to read from ROS 2 bags.
    pub bag: Option<BagSpec>,
    /// Options of the windows, which set the times of identification.
    pub window: WindowOptions,
    /// Options of the screening checks before a fit.
    pub screening: ScreeningOptions,
    /// Identification method.
    pub method: Method,
    /// Identification options, for all methods.
    pub options: Options,
    /// True if the cell sets the sign law of friction for all joints.
    pub overrides_sign: bool,
    /// True if the cut-off of the position filter is chosen from the data first.
    pub chooses_cutoff: bool,
    /// True if the friction laws are chosen from the data first.
    pub chooses_friction: bool,
    /// Frame of loads.
    pub payload: PayloadSection,
    /// Estimation of external torque. `None` if there is none.
    pub contact: Option<ContactSection>,
    /// Options for the operation of the service.
    pub service: ServiceSection,
    /// SHA-256 over the cell, robot and DBC or device files. It identifies the configuration of a
    /// result.
    pub configuration_sha256: String,
    /// The texts of these files as they were read.
    pub configuration: ConfigurationTexts,
}

impl Cell {
    /// Returns the cell without its corrections of tables with didim's own columns.
    pub fn without_table_corrections(self) -> Self {
        Self { own_columns: OwnColumns::default(), ..self }
    }

    /// Returns the bus.
    ///
    /// # Errors
    /// [`CellError::NoBus`], if the cell has only recordings of other programs.
    pub fn bus(&self) -> Result<&CellBus, CellError> {
        self.bus.as_ref().ok_or_else(|| CellError::NoBus { cell: self.name.clone() })
    }

    /// Returns the converter from frames of the bus to joint curves.
    pub fn joint_curves(&self, bus: &CellBus) -> JointCurves {
        let names = joint_names(self.urdf.as_ref(), self.robot.joints());
        JointCurves::new(bus.assembler(), self.robot.transmission().clone(), names)
    }

    /// Returns true if the data contain a reference, as far as the cell shows this. didim's own
    /// tables may contain one.
    pub fn has_reference(&self) -> bool {
        match (&self.bus, &self.columns) {
            (Some(bus), _) => bus.layout.has_reference(),
            (None, Some(columns)) => columns.reference.is_some(),
            (None, None) => self.bag.is_none(),
        }
    }

    /// Returns true if the commands on the bus contain their control law.
    pub fn has_commanded_law(&self) -> bool {
        self.bus.as_ref().is_some_and(|bus| bus.states_law())
    }

    /// Returns the cell with other parameters to identify. These parameters are then no longer
    /// fixed at their nominal values.
    #[must_use]
    pub fn with_parameters(mut self, names: &[String]) -> Self {
        self.options.parameters = Some(names.to_vec());
        if let Some(KeptParameters::Named(fixed)) = &mut self.options.keep_nominal {
            fixed.retain(|name| !names.contains(name));
        }
        self
    }

    /// Returns the cell with these friction laws, one entry per joint.
    ///
    /// # Errors
    /// [`BaseParametersError`], if no base parameters can be distinguished.
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

    /// Returns the cell with the torques of these joints alone.
    ///
    /// # Errors
    /// [`TorqueJointsError`].
    pub fn with_torque_joints(self, joints: &[JointReference]) -> Result<Self, TorqueJointsError> {
        let joints = JointReference::find_all(joints, &self.robot)?;
        let robot = self.robot.clone().with_torque_joints(&joints);
        let base = BaseParameters::compute(&Model::new(&robot));
        Ok(Self { model: Model::new(&robot), base: base?, robot, ..self })
    }

    /// Returns the cell with the torques of `used` joints alone, and the base parameters that the
    /// torques of `identified` joints identify.
    ///
    /// # Errors
    /// [`BaseParametersError`], if no base parameters can be distinguished.
    pub(crate) fn with_joints_of_result(
        self,
        used: &[JointIndex],
        identified: &[JointIndex],
    ) -> Result<Self, BaseParametersError> {
        let of_result = self.robot.clone().with_torque_joints(identified);
        let base = BaseParameters::compute(&Model::new(&of_result))?;
        let robot = self.robot.with_torque_joints(used);
        Ok(Self { model: Model::new(&robot), base, robot, ..self })
    }

    /// Reads a cell like [`Self::read`], but refuses a cell that leaves choices to the data.
    /// Services and studies need this, because all their results must be of the same model.
    ///
    /// # Errors
    /// See [`CellError`].
    pub fn read_decided(path: &Path) -> Result<Self, CellError> {
        Self::read(path)?.require_decided(path)
    }

    /// Returns the cell if it leaves no choice to the data; `path` is its file.
    ///
    /// # Errors
    /// [`CellError::Value`].
    pub fn require_decided(self, path: &Path) -> Result<Self, CellError> {
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
                "\"auto\" is for a recording; results that are compared over time need one \
                    model. Run `didim identify` on a recording, and {instead}"
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

    /// Reads a cell like [`Self::read`], from files on disk or from the copies inside the program.
    ///
    /// # Errors
    /// See [`CellError`].
    pub fn from_library(library: Library<'_>, path: &Path) -> Result<Self, CellError> {
        Self::read_all(library, path).map_err(|faults| *faults.first_fault)
    }

    /// Returns the data that are stored with the results of the cell.
    pub fn result_options(&self) -> ResultOptions {
        ResultOptions {
            texts: self.configuration.clone(),
            regrouping: self.regrouping_sha256(),
            drift: self.service.drift,
        }
    }

    /// Returns the SHA-256 of the composition of the base parameters. If it is equal for two
    /// results, a name means the same sum of parameters in both.
    pub fn regrouping_sha256(&self) -> String {
        let sums =
            self.base.names().iter().map(|name| {
                format!("{name} = {}\n", self.base.expression(name).unwrap_or_default())
            });
        let friction = self.robot.own_friction();
        let plain = friction.iter().all(|own| own.laws.is_empty() && own.sign == friction[0].sign);
        let laws =
            if plain { format!("{:?}", self.robot.sign_model(0)) } else { format!("{friction:?}") };
        // Known torques and fixed values are not part of any parameter.
        let known_torques = self.robot.known_torques();
        let known_torques =
            known_torques.iter().any(Option::is_some).then(|| format!("{known_torques:?}"));
        let nominal = self.options.keep_nominal.as_ref();
        let nominal = nominal.map(|fixed| format!("{fixed:?} {}", self.nominal_text()));
        let additional: String = known_torques.into_iter().chain(nominal).collect();
        sha256(&[&(laws + &additional), &sums.collect::<String>()])
    }

    /// Returns the nominal values in the text form that results of earlier versions hashed. The
    /// text must not change, even if fields are renamed.
    fn nominal_text(&self) -> String {
        self.robot.nominal().map_or_else(
            || "None".to_owned(),
            |nominal| {
                let (listed, standard) = (nominal.given_values(), nominal.standard_parameters());
                format!("Some(NominalParameters {{ listed: {listed:?}, standard: {standard:?} }})")
            },
        )
    }

    /// Returns the nominal sample rate \[Hz\].
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }
}

#[cfg(test)]
mod tests {
    use super::Cell;

    /// Its hash is in the history of every service: another text would end each comparison with
    /// its baseline.
    #[test]
    fn nominal_values_are_hashed_as_they_always_were() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/config/cells/tx40-cia402.toml");
        let text = Cell::read(file.as_ref()).unwrap().nominal_text();
        let begin =
            "Some(NominalParameters { listed: [(\"zz1r\", 1.24), (\"fv1\", 8.0), (\"fc1\", 7.34), ";
        assert!(text.starts_with(begin), "{text}");
        assert!(text.contains("], standard: [") && text.ends_with("] })"), "{text}");
    }
}
