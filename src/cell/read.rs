//! Conversion of a cell file's text to the cell. Each part is checked even if other parts are
//! invalid.

use std::path::{Path, PathBuf};

use didim_dynamics::SignalTiming;
use didim_dynamics::control::{JointController, SimulatedController};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_dynamics::simulation::SetupError;
use didim_formats::{BagSpec, Columns, OwnColumns, TextKind};
use didim_identification::identification::{
    IdentificationError, Options, PositionFilter, SignalDelays,
};

use super::data::delays_s;
use super::file::Cutoff;
use super::{
    Cell, CellBus, CellError, CellFile, Faults, JointReference, Library, RobotSource,
    ScreeningOptions, mistyped, open, values,
};
use crate::archive::store::ConfigurationTexts;
use crate::live::window_options::WindowOptions;
use crate::text::sha256;

/// The faults found so far in a cell file.
struct FoundFaults<'a> {
    file: &'a Path,
    text: &'a str,
    faults: Vec<CellError>,
}

impl FoundFaults<'_> {
    /// Adds the fault of a key with an invalid value.
    fn add_fault(&mut self, key: &str, problem: String) {
        let line = open::line_of(self.text, key);
        let (file, key) = (self.file.to_path_buf(), key.to_owned());
        self.faults.push(CellError::Value { file, line, key, problem });
    }

    /// Returns the value of a result, or adds its error as a fault.
    fn value_or_fault<T>(&mut self, of: Result<T, CellError>) -> Option<T> {
        of.map_err(|fault| self.faults.push(fault)).ok()
    }

    /// Returns the value of a result, or adds its error as the fault of a key.
    fn keep_value<T>(&mut self, key: &str, of: Result<T, impl ToString>) -> Option<T> {
        of.map_err(|problem| self.add_fault(key, problem.to_string())).ok()
    }
}

/// The arm of a cell.
struct CellArm {
    source: RobotSource,
    robot: Robot,
    model: Model,
    base: BaseParameters,
}

/// Sources of the signals, and the times at which the signals are valid.
struct CellSignals {
    bus: Option<(CellBus, Vec<(String, String)>)>,
    columns: Option<Columns>,
    bag: Option<BagSpec>,
    own_columns: OwnColumns,
    rate_hz: f64,
    torque_timing: SignalTiming,
    signal_delays: SignalDelays,
}

impl Cell {
    /// Reads a cell like [`Self::from_library`], but returns all faults that can be reported and
    /// not only the first.
    ///
    /// # Errors
    /// [`Faults`].
    pub fn read_all(library: Library<'_>, path: &Path) -> Result<Self, Faults> {
        read_text(library, path, library.read(path)?)
    }

    /// Checks the text of a cell file that is to be written to `path`.
    ///
    /// # Errors
    /// See [`CellError`].
    pub fn check_text(text: String, path: &Path) -> Result<(), CellError> {
        let checked = read_text(Library::Files, path, text);
        checked.map(drop).map_err(|faults| *faults.first_fault)
    }
}

fn read_text(library: Library<'_>, path: &Path, text: String) -> Result<Cell, Faults> {
    let file = parse(path, &text)?;
    let mut problems = FoundFaults { file: path, text: &text, faults: Vec::new() };
    let robot_path = path.parent().unwrap_or(Path::new("")).join(&file.robot);
    let arm = read_arm(library, &robot_path, &file, &mut problems);
    let signals = signals(library, &file, arm.as_ref(), &mut problems);
    let stream = arm.as_ref().zip(signals.as_ref());
    let stream = stream.map(|(arm, signals)| (arm.robot.joints(), signals.rate_hz));
    for (key, problem) in values::check(&file, stream) {
        problems.add_fault(key, problem);
    }
    let window = file.window.clone().unwrap_or_else(WindowOptions::by_command);
    let options = options(&file, signals.as_ref().map(|signals| signals.rate_hz));
    check_options(&file, (&options, &window), (arm.as_ref(), signals.as_ref()), &mut problems);
    let mut errors = problems.faults.into_iter();
    match (errors.next(), arm, signals) {
        (None, Some(arm), Some(signals)) => Ok(assemble_cell(
            (file, text),
            [path.to_path_buf(), robot_path],
            (arm, signals),
            (options, window),
        )),
        (first, ..) => {
            // If a part is missing, the list has a fault for it.
            let none = || CellError::NoBus { cell: path.display().to_string() };
            Err(Faults {
                first_fault: Box::new(first.unwrap_or_else(none)),
                further_faults: errors.collect(),
            })
        }
    }
}

fn parse(path: &Path, text: &str) -> Result<CellFile, Faults> {
    let keys = open::open_keys(text);
    if !keys.is_empty() {
        let wrong = mistyped::wrong_keys(text);
        return Err(CellError::Open { file: path.to_path_buf(), open: keys, wrong }.into());
    }
    toml::from_str(text).map_err(|source: toml::de::Error| {
        let file = path.to_path_buf();
        if let Some(kind) = TextKind::detect(text).filter(|kind| *kind != TextKind::Cell) {
            let wanted = "a cell file; `didim new CELL.toml --robot ARM.urdf --log RECORDING` \
                writes one";
            return CellError::OtherKind { file, kind, wanted }.into();
        }
        let first_line = source.span().map(|span| mistyped::line_at(text, span.start));
        let others = mistyped::wrong_keys(text).into_iter();
        let others = others.filter(|other| Some(other.line) != first_line);
        let others = others.map(|other| CellError::Value {
            file: path.to_path_buf(),
            line: Some(other.line),
            key: other.key,
            problem: other.problem,
        });
        Faults {
            first_fault: Box::new(CellError::Cell { file, source: Box::new(source) }),
            further_faults: others.collect(),
        }
    })
}

fn read_arm(
    library: Library<'_>,
    file: &Path,
    cell: &CellFile,
    found: &mut FoundFaults<'_>,
) -> Option<CellArm> {
    let named = |source| CellError::Named {
        cell: found.file.to_path_buf(),
        key: "robot",
        source: Box::new(source),
    };
    let source = library.read(file).map_err(named);
    let source = source.and_then(|text| RobotSource::read(file, text, cell.urdf.as_ref()));
    let source = match found.value_or_fault(source)?.with_drives(cell.urdf.as_ref()) {
        Ok(source) => source,
        Err((key, problem)) => {
            found.add_fault(&key, problem);
            return None;
        }
    };
    if let Err(error) = source.robot.load_frame(cell.payload.frame.as_deref()) {
        found.add_fault("payload.frame", error.to_string());
    }
    let mut robot = source.robot.clone();
    if let Some(sign) = cell.identification.sign {
        let friction = robot.own_friction();
        if friction.iter().any(|one| one.sign != friction[0].sign) {
            let problem = "goes for all joints, and the robot file states laws that differ by \
                joint; remove the key, or state one law in the robot file";
            found.add_fault("identification.sign", problem.to_owned());
        }
        robot = robot.with_sign_model(sign);
    }
    robot = robot.without_torque_terms(cell.excluded_terms());
    if let Some(joints) = &cell.identification.joints {
        let joints = JointReference::find_all(joints, &robot);
        if let Some(joints) = found.keep_value("identification.joints", joints) {
            robot = robot.with_torque_joints(&joints);
        }
    }
    let model = Model::new(&robot);
    let base = BaseParameters::compute(&model)
        .map_err(|source| CellError::BaseParameters { file: file.to_path_buf(), source });
    Some(CellArm { base: found.value_or_fault(base)?, source, robot, model })
}

fn signals(
    library: Library<'_>,
    file: &CellFile,
    arm: Option<&CellArm>,
    found: &mut FoundFaults<'_>,
) -> Option<CellSignals> {
    let own_columns = match arm.map(|arm| file.table.read(&arm.robot)) {
        None => OwnColumns::default(),
        Some(Ok(own_columns)) => own_columns,
        Some(Err((key, problem))) => {
            found.add_fault(key, problem);
            return None;
        }
    };
    match (&file.bus, &file.data) {
        (Some(section), None) => {
            if file.window.is_none() {
                found.add_fault("window", "is missing; say when to identify".to_owned());
            }
            let joints = arm.map(|arm| arm.robot.joints());
            let bus = CellBus::read(library, found.file, section, joints);
            let (bus, texts) = found.value_or_fault(bus)?;
            let (rate_hz, torque_timing) =
                (1e9 / bus.layout.period_ns(), bus.layout.torque_timing());
            let axes = bus.layout.axes();
            let [position, torque] = [
                ("bus.position_delay_us", &section.position_delay_us),
                ("bus.torque_delay_us", &section.torque_delay_us),
            ]
            .map(|(key, us)| found.keep_value(key, delays_s(us.as_ref(), axes)));
            let signal_delays = SignalDelays { position_s: position?, torque_s: torque? };
            let (bus, columns, bag) = (Some((bus, texts)), None, None);
            Some(CellSignals {
                bus,
                columns,
                bag,
                own_columns,
                rate_hz,
                torque_timing,
                signal_delays,
            })
        }
        (None, Some(data)) => {
            let arm = arm?;
            let named: Vec<String> = arm.source.joint_names().map(str::to_owned).collect();
            match data.read(&arm.robot, &named, &arm.source.continuous_joints()) {
                Ok(data) => Some(CellSignals {
                    bus: None,
                    columns: data.columns,
                    bag: data.bag,
                    own_columns,
                    rate_hz: data.rate_hz,
                    torque_timing: data.torque_timing,
                    signal_delays: data.signal_delays,
                }),
                Err((key, problem)) => {
                    found.add_fault(key, problem);
                    None
                }
            }
        }
        (None, None) => {
            let problem =
                "and [data] are both missing; describe the bus, or recordings of other programs";
            found.add_fault("bus", problem.to_owned());
            None
        }
        (Some(_), Some(_)) => {
            let problem = "is for a cell without a bus; remove it, or [bus]";
            found.add_fault("data", problem.to_owned());
            None
        }
    }
}

/// Collects the identification options. Without a sample rate the cell is invalid.
fn options(file: &CellFile, rate_hz: Option<f64>) -> Options {
    let section = &file.identification;
    let decimation_filter = section.decimation_filter;
    let cutoff_hz = match section.position_filter.cutoff_hz {
        Cutoff::Hz(configured) => configured,
        // Until the cut-off is chosen from the data, it is that of the decimation filter.
        Cutoff::Auto => decimation_filter.cutoff_hz(rate_hz.unwrap_or(f64::NAN)),
    };
    let position_filter = PositionFilter { order: section.position_filter.order, cutoff_hz };
    Options {
        parameters: section.parameters.clone(),
        keep_nominal: section.keep_nominal.clone(),
        robust: section.robust,
        limits: section.limits,
        required_uses: section.required_uses.clone(),
        required_parameters: section.required_parameters.clone(),
        tolerances: section.tolerances,
        controller: file.controller.clone(),
        simulation: section.simulation.clone().unwrap_or_default(),
        ..Options::new(position_filter, decimation_filter)
    }
}

fn check_options(
    file: &CellFile,
    (options, window): (&Options, &WindowOptions),
    (arm, signals): (Option<&CellArm>, Option<&CellSignals>),
    found: &mut FoundFaults<'_>,
) {
    let method = file.identification.method;
    found.keep_value("identification.robust", options.validate_robust(method));
    if let Some(CellSignals { rate_hz, .. }) = signals {
        found.keep_value("window", window.plan(*rate_hz));
        let cutoff_hz = options.position_filter.cutoff_hz;
        let designed = options.position_filter.design(*rate_hz);
        let designed =
            designed.map_err(|source| format!("{cutoff_hz} Hz at {rate_hz} samples/s: {source}"));
        found.keep_value("identification.position_filter", designed);
    }
    let decimation = options.decimation_filter.design();
    found.keep_value("identification.decimation_filter", decimation);
    if let Some(arm) = arm {
        let before = found.faults.len();
        check_parameters(options.parameters.as_deref(), arm, found);
        // Further checks need valid names.
        if found.faults.len() == before {
            let selected = options.selection(&arm.robot, &arm.base);
            found.keep_value("identification.keep_nominal", selected);
        }
    }
    if let (Some(arm), Some(SimulatedController::Cabinet { joints, .. })) = (arm, &file.controller)
    {
        check_torque_limits(file, arm, joints, found);
    }
    let joints = arm.map_or(&[][..], |arm| arm.robot.recorded_torque().missing_joints()).to_vec();
    if method.simulates() && !joints.is_empty() {
        let problem = IdentificationError::MissingTorques { method, joints }.to_string();
        found.add_fault("identification.joints", problem);
    }
    let commanded = signals.and_then(|of| of.bus.as_ref()).is_some_and(|(bus, _)| bus.states_law());
    if options.controller.is_none()
        && !commanded
        && (method.simulates() || file.identification.simulation.is_some())
    {
        let key = match method.simulates() {
            true => "identification.method",
            false => "identification.simulation",
        };
        let problem = format!(
            "needs [controller], which describes the controller of the arm, or `law` of the \
             layout, to simulate the closed loop (the method is {method})"
        );
        found.add_fault(key, problem);
    } else if let (Some(arm), Some(signals)) = (arm, signals) {
        // The controller is checked for every method: if it contradicts the layout, one of the two
        // is wrong.
        let simulated =
            options.validate_simulation(&arm.robot, signals.rate_hz, signals.torque_timing);
        if let Err(source) = simulated {
            found.add_fault(simulation_key(&source), source.to_string());
        }
    }
}

/// Checks that the commands of the controller are within the torques of the drives.
fn check_torque_limits(
    file: &CellFile,
    arm: &CellArm,
    controllers: &[JointController],
    found: &mut FoundFaults<'_>,
) {
    for (number, (own, limits)) in (1..).zip(controllers.iter().zip(arm.robot.limits())) {
        let (Some(commanded), Some(largest)) = (own.torque_limit_nm, limits.torque_max) else {
            continue;
        };
        if commanded <= largest {
            continue;
        }
        let joint = JointIndex::new(number - 1);
        let key = "torque_max_nm";
        let place = match (&arm.source.urdf, arm.robot.joint_name(joint)) {
            (None, _) => {
                let place = format!("joint.{number}.{key}");
                let line = open::line_of(&arm.source.toml, &place).unwrap_or(1);
                format!("{}:{line} joint[{number}].{key}", file.robot.display())
            }
            (Some(_), Some(name)) if has_limit(file, name, key) => {
                let place = format!("urdf.joints.{name}.{key}");
                let line = open::line_of(found.text, &place).unwrap_or(1);
                format!("line {line} {place}")
            }
            (Some(_), _) => format!("effort of the joint in {}", file.robot.display()),
        };
        let problem = format!(
            "is {commanded} N·m, above the largest torque of the drive, {largest} N·m (`{place}`); \
             correct the wrong one"
        );
        found.add_fault(&format!("controller.joints.{number}.torque_limit_nm"), problem);
    }
}

/// Returns true if the cell file has a limit of a joint of a URDF.
fn has_limit(file: &CellFile, joint: &str, key: &str) -> bool {
    file.urdf
        .as_ref()
        .and_then(|urdf| urdf.joints.get(joint))
        .is_some_and(|of| of.contains_key(key))
}

fn check_parameters(listed: Option<&[String]>, arm: &CellArm, found: &mut FoundFaults<'_>) {
    const PARAMETERS_KEY: &str = "identification.parameters";
    let Some(listed) = listed else { return };
    if listed.is_empty() {
        let problem = "is empty; leave it out to identify every base parameter";
        found.add_fault(PARAMETERS_KEY, problem.to_owned());
    }
    let base = arm.base.names();
    for (k, name) in listed.iter().enumerate() {
        if listed[..k].contains(name) {
            found.add_fault(
                PARAMETERS_KEY,
                format!("`{name}` is listed more than once; list it once"),
            );
        } else if !base.contains(name) {
            let (robot, available) = (arm.robot.name(), base.join(" "));
            let problem =
                format!("`{name}` is not a base parameter of {robot}; known: {available}");
            found.add_fault(PARAMETERS_KEY, problem);
        }
    }
}

/// Creates the cell from valid parts.
fn assemble_cell(
    (file, text): (CellFile, String),
    [path, robot_file]: [PathBuf; 2],
    (arm, signals): (CellArm, CellSignals),
    (options, window): (Options, WindowOptions),
) -> Cell {
    let CellArm { source, robot, model, base } = arm;
    let robot_notes = source.notes().iter().map(ToString::to_string).collect();
    let RobotSource { robot: robot_as_described, toml: robot_text, urdf } = source;
    let CellSignals { bus, columns, bag, own_columns, rate_hz, torque_timing, signal_delays } =
        signals;
    let (bus, layout_texts) = bus.map_or((None, Vec::new()), |(bus, texts)| (Some(bus), texts));
    let contact = file.contact.map(|contact| contact.resolved(&path));
    Cell {
        name: file.name,
        file: path,
        robot_file,
        configuration_sha256: {
            let mut texts = vec![text.as_str(), &robot_text];
            texts.extend(layout_texts.iter().map(|(_, text)| text.as_str()));
            sha256(&texts)
        },
        configuration: ConfigurationTexts { cell: text, robot: robot_text, layout: layout_texts },
        robot,
        robot_as_described,
        urdf,
        robot_notes,
        model,
        base,
        bus,
        sample_rate_hz: rate_hz,
        torque_timing,
        signal_delays,
        columns,
        own_columns,
        bag,
        window,
        screening: ScreeningOptions::default(),
        method: file.identification.method,
        options,
        overrides_sign: file.identification.sign.is_some(),
        chooses_cutoff: file.identification.position_filter.cutoff_hz == Cutoff::Auto,
        chooses_friction: file.identification.friction.is_some(),
        payload: file.payload,
        contact,
        service: file.service,
    }
}

/// Returns the key of the cell file that caused the error.
fn simulation_key(error: &IdentificationError) -> &'static str {
    match error {
        IdentificationError::Convergence { .. } => "identification.simulation.convergence",
        IdentificationError::DidimSteps { .. } => "identification.simulation.didim_steps",
        IdentificationError::NoNominalParameters { .. } => "identification.simulation.start",
        IdentificationError::Consistency(_) => "identification.simulation.bodies",
        IdentificationError::Setup(SetupError::BadValue { what: "substeps", .. }) => {
            "identification.simulation.substeps"
        }
        _ => "controller",
    }
}
