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
mod restart;
mod robot;
mod suggestion;
mod values;

use std::path::{Path, PathBuf};

use didim_core::dynamics::{BaseParameters, BaseParametersError, Model};
use didim_core::identification::{
    IdentificationError, KeptParameters, Method, Options, PositionFilter, SignalTiming,
};
use didim_core::robot::{JointFriction, Robot};
use didim_core::simulation::SetupError;
use didim_formats::{BagSpec, Columns, UrdfArm};

pub use address::{BusAddress, BusAddressError};
pub use bus::CellBus;
pub(crate) use data::DATES;
pub use data::{DataColumns, DataSection};
pub use error::CellError;
pub use file::{
    BusSection, CellFile, IdentificationSection, Processes, ServiceSection, UrdfSection,
};
pub use library::{Library, SHIPPED};
pub use mistyped::WrongKey;
pub use open::{OPEN, OpenKey};
pub use robot::RobotSource;

use self::file::Cutoff;
use crate::archive::store::ConfigurationTexts;
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

    /// Whether a reference is recorded, as far as the cell tells: didim's own tables may have one.
    pub fn has_reference(&self) -> bool {
        match (&self.bus, &self.columns) {
            (Some(bus), _) => bus.layout.has_reference(),
            (None, Some(columns)) => columns.reference.is_some(),
            (None, None) => self.bag.is_none(),
        }
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
        let text = library.read(path)?;
        let open = open::open_keys(&text);
        if !open.is_empty() {
            let wrong = mistyped::wrong_keys(&text);
            return Err(CellError::Open { file: path.to_path_buf(), open, wrong });
        }
        let file: CellFile = toml::from_str(&text).map_err(|source| CellError::Cell {
            file: path.to_path_buf(),
            source: Box::new(source),
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));

        let robot_path = folder.join(&file.robot);
        let named = |key| {
            move |source| CellError::Named { cell: path.into(), key, source: Box::new(source) }
        };
        let robot_text = library.read(&robot_path).map_err(named("robot"))?;
        let wrong = |key: &str, problem: String| CellError::Value {
            file: path.to_path_buf(),
            line: open::line_of(&text, key),
            key: key.to_owned(),
            problem,
        };
        let source = RobotSource::read(&robot_path, robot_text, file.urdf.as_ref())?;
        let source = source.with_drives(file.urdf.as_ref());
        let source = source.map_err(|(key, problem)| wrong(&key, problem))?;
        let named: Vec<String> = source.joint_names().map(str::to_owned).collect();
        let robot_notes = source.notes().iter().map(ToString::to_string).collect();
        let RobotSource { robot: robot_as_described, toml: robot_text, urdf } = source;
        let mut robot = robot_as_described.clone();
        if let Some(sign) = file.identification.sign {
            robot = robot.with_sign_model(sign);
        }
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model)
            .map_err(|source| CellError::BaseParameters { file: robot_path.clone(), source })?;

        let own = robot_as_described.own_friction();
        if file.identification.sign.is_some() && own.iter().any(|one| one.sign != own[0].sign) {
            let problem = "goes for all joints, and the robot file states laws that differ by joint; \
                           remove the key, or state one law in the robot file";
            return Err(wrong("identification.sign", problem.to_owned()));
        }
        let (bus, layout_texts, (columns, bag), sample_rate_hz, torque_timing) = match (
            &file.bus, &file.data,
        ) {
            (Some(section), None) => {
                if file.window.is_none() {
                    return Err(wrong("window", "is missing; say when to identify".to_owned()));
                }
                let (bus, texts) = CellBus::read(library, path, section, robot.joints())?;
                let (rate_hz, timing) = (1e9 / bus.layout.period_ns(), bus.layout.torque_timing());
                (Some(bus), texts, (None, None), rate_hz, timing)
            }
            (None, Some(data)) => {
                let data =
                    data.read(&robot, &named).map_err(|(key, problem)| wrong(key, problem))?;
                (None, Vec::new(), (data.columns, data.bag), data.rate_hz, data.torque_timing)
            }
            (None, None) => {
                let problem = "and [data] are both missing; describe the bus, or recordings of other programs";
                return Err(wrong("bus", problem.to_owned()));
            }
            (Some(_), Some(_)) => {
                let problem = "is for a cell without a bus; remove it, or [bus]";
                return Err(wrong("data", problem.to_owned()));
            }
        };
        values::check(&file, robot.joints(), sample_rate_hz)
            .map_err(|(key, problem)| wrong(key, problem))?;
        let method = file.identification.method;
        let controlled = file.controller.is_some();
        let simulation = file.identification.simulation;
        let decimation_filter = file.identification.decimation_filter;
        let position_filter = file.identification.position_filter;
        let cutoff_hz = match position_filter.cutoff_hz {
            Cutoff::Hz(stated) => stated,
            // Until the data have chosen: the band that is identified.
            Cutoff::Auto => decimation_filter.cutoff_hz(sample_rate_hz),
        };
        let options = Options {
            position_filter: PositionFilter { order: position_filter.order, cutoff_hz },
            decimation_filter,
            parameters: file.identification.parameters.clone(),
            keep_nominal: file.identification.keep_nominal.clone(),
            robust: file.identification.robust,
            limits: file.identification.limits,
            required_uses: file.identification.required_uses.clone(),
            required_parameters: file.identification.required_parameters.clone(),
            tolerances: file.identification.tolerances,
            controller: file.controller,
            simulation: simulation.clone().unwrap_or_default(),
        };
        options
            .validate_robust(method)
            .map_err(|source| wrong("identification.robust", source.to_string()))?;
        let window = file.window.clone().unwrap_or_else(WindowOptions::by_command);
        window.plan(sample_rate_hz).map_err(|source| wrong("window", source.to_string()))?;
        options.position_filter.design(sample_rate_hz).map_err(|source| {
            let cutoff_hz = options.position_filter.cutoff_hz;
            wrong(
                "identification.position_filter",
                format!("{cutoff_hz} Hz at {sample_rate_hz} samples/s: {source}"),
            )
        })?;
        options
            .decimation_filter
            .design()
            .map_err(|source| wrong("identification.decimation_filter", source.to_string()))?;
        let listed = options.parameters.as_deref();
        if listed.is_some_and(<[String]>::is_empty) {
            return Err(wrong(
                "identification.parameters",
                "is empty; leave it out to identify every base parameter".to_owned(),
            ));
        }
        for (k, name) in listed.into_iter().flatten().enumerate() {
            if listed.is_some_and(|names| names[..k].contains(name)) {
                return Err(wrong(
                    "identification.parameters",
                    format!("`{name}` is listed more than once; list it once"),
                ));
            }
            if !base.names().contains(name) {
                return Err(wrong(
                    "identification.parameters",
                    format!(
                        "`{name}` is not a base parameter of {}; known: {}",
                        robot.name(),
                        base.names().join(" ")
                    ),
                ));
            }
        }
        options
            .selection(&robot, &base)
            .map_err(|source| wrong("identification.keep_nominal", source.to_string()))?;
        if !controlled && (method.simulates() || simulation.is_some()) {
            let key = match method.simulates() {
                true => "identification.method",
                false => "identification.simulation",
            };
            return Err(wrong(
                key,
                format!(
                    "needs [controller], which describes the controller of the arm, to simulate \
                     the closed loop (the method is {method})"
                ),
            ));
        }
        // Whatever the method: a layout and a controller that contradict each other are both in
        // doubt.
        options
            .validate_simulation(&robot, sample_rate_hz, torque_timing)
            .map_err(|source| wrong(simulation_key(&source), source.to_string()))?;
        Ok(Self {
            name: file.name,
            robot_file: robot_path,
            configuration_sha256: {
                let mut texts = vec![text.as_str(), &robot_text];
                texts.extend(layout_texts.iter().map(|(_, text)| text.as_str()));
                sha256(&texts)
            },
            configuration: ConfigurationTexts {
                cell: text,
                robot: robot_text,
                layout: layout_texts,
            },
            robot,
            robot_as_described,
            urdf,
            robot_notes,
            model,
            base,
            bus,
            sample_rate_hz,
            torque_timing,
            columns,
            bag,
            window,
            method,
            options,
            overrides_sign: file.identification.sign.is_some(),
            chooses_cutoff: position_filter.cutoff_hz == Cutoff::Auto,
            chooses_friction: file.identification.friction.is_some(),
            service: file.service,
        })
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

/// The key of the cell file at fault.
fn simulation_key(error: &IdentificationError) -> &'static str {
    match error {
        IdentificationError::Convergence { .. } => "identification.simulation.convergence",
        IdentificationError::DidimSteps { .. } => "identification.simulation.didim_steps",
        IdentificationError::NoNominalParameters { .. } => "identification.simulation.start",
        IdentificationError::Bodies(_) => "identification.simulation.bodies",
        IdentificationError::Setup(SetupError::BadValue { what: "substeps", .. }) => {
            "identification.simulation.substeps"
        }
        _ => "controller",
    }
}
