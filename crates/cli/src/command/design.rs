//! `didim design`: designs the next motion and writes it to files, which people run. The command
//! does not move the arm.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::Robot;
use didim_identification::excitation::{
    Corners, Course, Design, ExcitationError, Margins, Progress, Task, design, predict_result,
    predict_terms, sweep,
};
use didim_identification::identification::KnownLoad;
use didim_identification::parallel::map;
use didim_sim::MAX_MOTION_S;
use indicatif::ProgressBar;

use crate::CliError;
use crate::first_posture::read_first_posture;
use crate::frame::{FrameOfLoads, note_lines};
use crate::input::{parse_finite, parse_numbers, parse_point, parse_positive, read_robot};
use crate::names::{PREVIEW_FILE, SIMULATED_FILE};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_text};
use crate::progress::style_bar;
use didim::analysis::{
    Assignment, Floor, OTHER_CONFIGURATION, RequestedChecks, RequestedDesign, StoredModel,
};
use didim::cell::{Cell, CellError, LoadFrame, joint_names};
use didim::report::{
    CheckedMotion, collision_statement, conditions_text, design_header, design_text, html,
    load_lines, prediction_lines, sweep_lines, sweep_text,
};
use didim::threads::Threads;
use didim_formats::{MotionFile, MotionFormat};

/// Number of parallel searches from random motions; the best result is used.
const PARALLEL_SEARCHES: usize = 2;

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("arm").required(true).args(["robot", "cell"])))]
pub(crate) struct Arguments {
    /// The arm: a robot file, or a URDF
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    /// The base link of the arm in a URDF
    #[arg(long, value_name = "LINK", requires = "robot")]
    base: Option<String>,
    /// The last link of the arm in a URDF
    #[arg(long, value_name = "LINK", requires = "robot")]
    tip: Option<String>,
    /// The cell file: its robot, and the parameters that it identifies
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// Prior knowledge: a result that the service stored, or the file of `didim identify --out`
    #[arg(long, value_name = "FILE", requires = "cell", required_if_eq("objective", "payload"))]
    result: Option<PathBuf>,
    /// Length of the motion [s]; up to 600
    #[arg(long, value_name = "S", value_parser = parse_duration)]
    duration: f64,
    /// A file to write; may be given more than once: .csv (table), .yaml (ROS 2), .script
    /// (Universal Robots), .src (KUKA), .mod (ABB)
    #[arg(long, value_name = "FILE", required = true)]
    out: Vec<PathBuf>,
    /// A page to inspect before anything moves: the arm along the motion, and its joints over time
    /// (HTML)
    #[arg(long, value_name = "FILE")]
    preview: Option<PathBuf>,
    /// The first posture: a file with one angle for each joint, from the base [rad, or m], or a
    /// recording whose first sample counts. When left out, the search starts in the middle of the
    /// ranges and chooses the first posture
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// The quantity to minimise
    #[arg(long, value_enum, default_value_t = Objective::Deviations)]
    objective: Objective,
    /// Joints that move, from 1, separated by commas; all when left out. The others rest at the
    /// best position, and their measurements do not count
    #[arg(long, value_name = "N", value_delimiter = ',')]
    joints: Option<Vec<usize>>,
    /// Sweep these joints at constant speeds for their friction, instead of a search; from 1,
    /// separated by commas. One joint after the other moves there and back, each in an equal part
    /// of the duration
    #[arg(
        long,
        value_name = "N",
        value_delimiter = ',',
        conflicts_with_all = ["joints", "objective", "parameters", "declared_mass_kg", "steps"]
    )]
    friction_sweep: Option<Vec<usize>>,
    /// Expected mass of the load for `--objective payload` [kg]
    #[arg(
        long,
        value_name = "KG",
        value_parser = parse_positive,
        allow_negative_numbers = true,
        required_if_eq("objective", "payload")
    )]
    declared_mass_kg: Option<f64>,
    /// Its centre [m], in the frame of --frame
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_parser = parse_point,
        allow_hyphen_values = true,
        requires = "declared_mass_kg",
        required_if_eq("objective", "payload")
    )]
    declared_centre_m: Option<[f64; 3]>,
    #[command(flatten)]
    frame: FrameOfLoads,
    /// Parameters to identify, separated by commas; all identified ones when left out
    #[arg(long, value_name = "NAME", value_delimiter = ',', conflicts_with = "declared_mass_kg")]
    parameters: Option<Vec<String>>,
    #[command(flatten)]
    within: LimitShares,
    /// Steps of the search; the same number gives the same motion
    #[arg(
        long,
        value_name = "N",
        default_value_t = 600,
        value_parser = clap::value_parser!(u32).range(1..=100_000)
    )]
    steps: u32,
}

/// Usable share of the limits.
#[derive(Debug, Args)]
pub(super) struct LimitShares {
    /// Usable share of the limits of speed, acceleration and jerk [%]
    #[arg(
        long,
        value_name = "PERCENT",
        value_parser = parse_positive,
        default_value_t = Self::default().speed
    )]
    speed: f64,
    /// Largest acceleration [rad/s²] of all joints, or of each, separated by commas; replaces the
    /// robot file's
    #[arg(long, value_name = "A", value_delimiter = ',', value_parser = parse_positive)]
    acceleration: Option<Vec<f64>>,
    /// A box that the arm stays in: two opposite corners in the frame of its base [m], that of the
    /// base link in a URDF; the links need shapes
    #[arg(
        long = "box",
        value_name = "X,Y,Z,X,Y,Z",
        value_parser = parse_corners,
        allow_hyphen_values = true
    )]
    inside: Option<Corners>,
    /// Height of the floor in the frame of the base [m]. The arm stays above it; for a URDF, the
    /// floor is the mounting plane when left out: z = 0 of its base link
    #[arg(long, value_name = "Z", value_parser = parse_height, allow_negative_numbers = true)]
    floor: Option<f64>,
    /// No floor: the arm may reach below the plane on which it is mounted
    #[arg(long, conflicts_with = "floor")]
    no_plane: bool,
    /// A folder in which the packages of `package://` are searched for the meshes of a URDF; may be
    /// given more than once. The folders above the URDF are searched as well
    #[arg(long, value_name = "FOLDER")]
    package_path: Vec<PathBuf>,
}

/// Parses a finite number.
fn parse_height(text: &str) -> Result<f64, String> {
    parse_finite(text, "give one number").map(|[height_m]| height_m)
}

/// Parses six numbers separated by commas.
fn parse_corners(text: &str) -> Result<Corners, String> {
    let [a, b, c, d, e, f] = parse_numbers(text, "give six numbers, as -0.8,-0.8,0,0.8,0.8,1.5")?;
    let sides = [[a, d], [b, e], [c, f]];
    match sides.map(|[from, to]| to - from).iter().all(|of| of.is_finite() && of.abs() > 0.0) {
        true => Ok([sides.map(|[from, to]| from.min(to)), sides.map(|[from, to]| from.max(to))]),
        false => Err("the corners have to be finite, and apart along every axis".to_owned()),
    }
}

impl Default for LimitShares {
    fn default() -> Self {
        Self {
            speed: 50.0,
            acceleration: None,
            inside: None,
            floor: None,
            no_plane: false,
            package_path: Vec::new(),
        }
    }
}

impl LimitShares {
    /// Returns the requested collision checks.
    fn checks(&self) -> RequestedChecks<'_> {
        let floor = match (self.floor, self.no_plane) {
            (Some(height_m), _) => Floor::Height(height_m),
            (None, true) => Floor::Missing,
            (None, false) => Floor::Mounting,
        };
        let package_folders = &self.package_path;
        RequestedChecks { box_corners: self.inside, floor, package_folders }
    }

    /// Returns one acceleration for each joint; a single value applies to all.
    pub(super) fn accelerations(&self, joints: usize) -> Option<Vec<f64>> {
        self.acceleration.as_ref().map(|accelerations| match accelerations[..] {
            [all] => vec![all; joints],
            _ => accelerations.clone(),
        })
    }
}

/// Parses the duration of a motion, which can be simulated.
fn parse_duration(text: &str) -> Result<f64, String> {
    let duration_s = parse_positive(text)?;
    match duration_s <= MAX_MOTION_S {
        true => Ok(duration_s),
        false => Err(format!("is longer than {MAX_MOTION_S} s; repeat a shorter motion")),
    }
}

/// Returns the request for a motion of this duration that identifies all parameters.
pub(super) fn requested_motion<'a>(
    within: &'a LimitShares,
    accelerations: Option<&'a [f64]>,
    duration_s: f64,
) -> RequestedDesign<'a> {
    RequestedDesign {
        duration_s,
        margins: Margins { speed: within.speed / 100.0, ..Margins::default() },
        accelerations,
        checks: within.checks(),
        first_posture: None,
        moving_joints: None,
        load: None,
        parameters: None,
        condition_number: false,
    }
}

/// The quantity to minimise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Objective {
    /// The geometric mean of the parameters' standard deviations
    Deviations,
    /// The condition number of the base columns of inertia, unweighted and without friction
    ConditionNumber,
    /// The geometric mean of the standard deviations of the load that `didim payload` finds
    Payload,
}

/// Arm for which a motion is designed.
pub(super) struct DesignSubject {
    pub(super) robot: Robot,
    pub(super) joints: Vec<String>,
    pub(super) assignment: Assignment,
    /// Cell and stored result, if the motion is designed to find a load.
    identified: Option<(Cell, StoredModel)>,
}

impl DesignSubject {
    /// Creates the subject from a cell and, if given, a stored result of this cell.
    pub(super) fn of_cell(
        cell: &Cell,
        stored: Option<&StoredModel>,
        wanted: &RequestedDesign<'_>,
    ) -> Result<Self, CliError> {
        let assignment = Assignment::of_cell(cell, stored, wanted);
        let joints = joint_names(cell.urdf.as_ref(), cell.robot.joints());
        let assignment = assignment.map_err(CliError::from_configuration)?;
        Ok(Self { robot: cell.robot.clone(), joints, assignment, identified: None })
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { robot, cell, result, out, preview, start, .. } = arguments;
    let read = [robot, cell, result, start].into_iter().flatten().map(PathBuf::as_path);
    check_outputs(out.iter().chain(preview), &read.collect::<Vec<&Path>>())?;
    let subject = arguments.subject()?;
    let DesignSubject { joints, assignment, .. } = &subject;
    let formats = out.iter().map(|path| format_of(path, joints.len()));
    let formats = formats.collect::<Result<Vec<_>, _>>()?;
    if let Some(joints) = &arguments.friction_sweep {
        return design_sweep(arguments, joints, &formats, &subject);
    }
    let best = search_best(&assignment.task, arguments.steps).map_err(CliError::from_failure)?;
    let (predicted, text) = match (&assignment.load, &subject.identified) {
        (Some(load), Some((cell, result))) => {
            let load_result = load.simulate_load(cell, result, &assignment.task, &best.series);
            let lines = load_lines(load, &load_result.map_err(CliError::from_failure)?);
            let text = lines.join("\n") + "\n\n" + &conditions_text(assignment, &best.used);
            (if assignment.measured_noise { lines } else { Vec::new() }, text)
        }
        _ => {
            let prediction =
                predict_result(&assignment.task, &best.series).map_err(CliError::from_failure)?;
            let text = design_text(assignment, &best, &prediction);
            (prediction_lines(assignment, &prediction.deviations), text)
        }
    };
    let mut texts = Vec::new();
    for (path, format) in out.iter().zip(&formats) {
        texts.push(motion_text(path, *format, &subject, &best.series, (&best).into(), &predicted)?);
    }
    arguments.write(&subject, &best.series, (&best).into(), &predicted, &texts)?;
    for (path, _) in out.iter().zip(formats).filter(|(_, format)| !format.keeps_time()) {
        let explanation =
            "the controller makes the time law, and the standard deviations do not hold for it";
        print_note(&format!("note: {}: {explanation}\n", path.display()));
    }
    print(&text)?;
    print_note(&arguments.next_command());
    Ok(())
}

/// Designs a friction sweep and writes its files.
fn design_sweep(
    arguments: &Arguments,
    joints: &[usize],
    formats: &[MotionFormat],
    subject: &DesignSubject,
) -> Result<(), CliError> {
    let DesignSubject { robot, assignment, .. } = subject;
    for (path, format) in arguments.out.iter().zip(formats) {
        format.takes_sweeps().map_err(|error| CliError::in_file(path, error))?;
    }
    let places: Vec<usize> = joints.iter().map(|joint| joint - 1).collect();
    let designed = sweep(&assignment.task, &places).map_err(CliError::from_failure)?;
    let identifiable = predict_terms(&assignment.task, robot, &designed.sweep);
    let lines = sweep_lines(robot, assignment, &designed.sweep, &identifiable);
    let mut texts = Vec::new();
    for (path, format) in arguments.out.iter().zip(formats) {
        texts.push(motion_text(
            path,
            *format,
            subject,
            &designed.sweep,
            (&designed).into(),
            &lines,
        )?);
    }
    arguments.write(subject, &designed.sweep, (&designed).into(), &lines, &texts)?;
    print(&sweep_text(assignment, (&designed).into(), &lines))?;
    print_note(&arguments.next_command());
    Ok(())
}

/// Formats a motion as the content of the file `path`.
pub(super) fn motion_text(
    path: &Path,
    format: MotionFormat,
    subject: &DesignSubject,
    motion: &dyn Course,
    checked: CheckedMotion<'_>,
    predicted: &[String],
) -> Result<String, CliError> {
    let DesignSubject { robot, joints, assignment, .. } = subject;
    let header = design_header(robot.name(), assignment, checked, predicted, format.keeps_time());
    let file = MotionFile { motion, joints, header: &header };
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("motion");
    format.write(&file, stem).map_err(|error| CliError::in_file(path, error))
}

/// Returns the format for a file name, and checks that it supports this number of joints.
pub(super) fn format_of(path: &Path, joints: usize) -> Result<MotionFormat, CliError> {
    let format = MotionFormat::from_path(path);
    let format = format.map_err(|error| CliError::Usage(format!("{}: {error}", path.display())))?;
    format.check_joint_count(joints).map_err(|error| CliError::in_file(path, error))?;
    Ok(format)
}

impl Arguments {
    /// Returns the line with the next command: look at the motion, then simulate it on the robot of
    /// the cell.
    fn next_command(&self) -> String {
        let is_table = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "csv");
        match (&self.preview, &self.cell, self.out.iter().find(is_table)) {
            (None, ..) => {
                NextCommand::repeated().with_option("--preview", PREVIEW_FILE).to_string()
            }
            (Some(_), Some(cell), Some(table)) => NextCommand::new("sim")
                .with_option("--cell", cell)
                .with_option("--motion", table)
                .with_option("--out", SIMULATED_FILE)
                .to_string(),
            _ => String::new(),
        }
    }

    /// Writes the files. It is called when all texts are complete, so that only a write can fail.
    fn write(
        &self,
        subject: &DesignSubject,
        motion: &dyn Course,
        checked: CheckedMotion<'_>,
        predicted: &[String],
        texts: &[String],
    ) -> Result<(), CliError> {
        for (path, text) in self.out.iter().zip(texts) {
            write_text(path, text)?;
        }
        let Some(path) = &self.preview else { return Ok(()) };
        let header =
            design_header(subject.robot.name(), &subject.assignment, checked, predicted, true);
        let collision = collision_statement(&subject.assignment);
        write_text(path, &html::preview_page(&subject.robot, motion, &header, &collision))
    }

    fn subject(&self) -> Result<DesignSubject, CliError> {
        if self.objective != Objective::Payload && self.declared_mass_kg.is_some() {
            let explanation =
                "--declared-mass-kg and --declared-centre-m go with --objective payload";
            return Err(CliError::Usage(explanation.to_owned()));
        }
        if self.objective != Objective::Payload && self.frame.is_given() {
            return Err(CliError::Usage("--frame goes with --objective payload".to_owned()));
        }
        match (&self.cell, &self.robot) {
            (Some(file), _) => self.of_cell(file),
            (None, Some(file)) => self.of_robot(file),
            (None, None) => Err(CliError::Usage("give --robot or --cell".to_owned())),
        }
    }

    fn of_cell(&self, file: &Path) -> Result<DesignSubject, CliError> {
        let mut cell = Cell::read(file).map_err(CliError::from_configuration)?;
        let mut stored = None;
        if let Some(result) = &self.result {
            let (model, with_its_choices) =
                StoredModel::read_stored_model(result, cell).map_err(CliError::from_failure)?;
            cell = with_its_choices;
            if model.is_of(&cell) == Some(false) {
                print_note(&format!("note: {OTHER_CONFIGURATION}\n"));
            }
            stored = Some(model);
        }
        let accelerations = self.within.accelerations(cell.robot.joints());
        let first = self.first_posture(&cell.robot, Some(&cell))?;
        let frame = self.frame.of_cell(&cell)?;
        print_note(&note_lines(&frame.findings(self.declared_centre_m.is_some())));
        let wanted = self.wanted(accelerations.as_deref(), (Some(&frame), first.as_deref()));
        let subject = DesignSubject::of_cell(&cell, stored.as_ref(), &wanted)?;
        let identified = stored.map(|stored| (cell, stored));
        Ok(DesignSubject { identified, ..subject })
    }

    fn of_robot(&self, file: &Path) -> Result<DesignSubject, CliError> {
        if self.result.is_some() {
            let explanation =
                "--result goes with the --cell that it was identified with, not with --robot";
            return Err(CliError::Usage(explanation.to_owned()));
        }
        let source = read_robot(file, self.base.as_ref(), self.tip.as_ref())?;
        let robot = &source.robot;
        let base = BaseParameters::compute(&Model::new(robot)).map_err(|error| {
            let file = file.to_path_buf();
            CliError::from_configuration(CellError::BaseParameters { file, source: error })
        })?;
        let accelerations = self.within.accelerations(robot.joints());
        let first = self.first_posture(robot, None)?;
        let wanted = self.wanted(accelerations.as_deref(), (None, first.as_deref()));
        let assignment = Assignment::of_robot((file, &source), &base, &wanted);
        let joints = joint_names(source.urdf.as_ref(), robot.joints());
        let assignment = assignment.map_err(CliError::from_configuration)?;
        let (robot, identified) = (source.robot, None);
        Ok(DesignSubject { robot, joints, assignment, identified })
    }

    /// Reads the first posture, if a file is given.
    fn first_posture(
        &self,
        robot: &Robot,
        cell: Option<&Cell>,
    ) -> Result<Option<Vec<f64>>, CliError> {
        let file = self.start.as_deref();
        file.map(|file| read_first_posture(file, robot, cell)).transpose()
    }

    /// Returns the request, with the frame of the load if there is one, and the first posture.
    fn wanted<'a>(
        &'a self,
        accelerations: Option<&'a [f64]>,
        (frame, first_posture): (Option<&'a LoadFrame>, Option<&'a [f64]>),
    ) -> RequestedDesign<'a> {
        RequestedDesign {
            first_posture,
            moving_joints: self.joints.as_deref().or(self.friction_sweep.as_deref()),
            load: frame.and_then(|frame| Some((self.load(frame)?, &frame.frame))),
            parameters: self.parameters.as_deref(),
            condition_number: self.objective == Objective::ConditionNumber,
            ..requested_motion(&self.within, accelerations, self.duration)
        }
    }

    /// Returns the declared load; `None` unless the objective is `payload`.
    fn load(&self, frame: &LoadFrame) -> Option<KnownLoad> {
        let (mass_kg, centre_m) = (self.declared_mass_kg?, self.declared_centre_m?);
        let centre_m = frame.centre_in_link(centre_m);
        (self.objective == Objective::Payload).then_some(KnownLoad { mass_kg, centre_m })
    }
}

/// Returns the best design of the searches. Among equal designs, the first is returned, so that the
/// order of the threads has no effect.
fn search_best(task: &Task, steps: u32) -> Result<Design, ExcitationError> {
    let bar = ProgressBar::new(PARALLEL_SEARCHES as u64 * u64::from(steps));
    let bar = style_bar(bar, "{bar:40} {percent:>3} %  {eta} left");
    let designs = map(&Threads::ALL, PARALLEL_SEARCHES, |at| {
        design(task, at as u64 + 1, steps, |_: Progress| bar.inc(1))
    });
    bar.finish_and_clear();
    let mut best: Option<Design> = None;
    for design in designs {
        let design = design?;
        if best.as_ref().is_none_or(|best| design.value < best.value) {
            best = Some(design);
        }
    }
    best.ok_or(ExcitationError::NotIdentifiable { duration_s: task.duration_s })
}
