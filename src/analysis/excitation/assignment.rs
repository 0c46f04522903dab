//! The task of a designed motion. It is created from an arm alone, or from a cell and a stored
//! result with insufficient parameters.

use std::path::Path;

use didim_dynamics::Signals;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, Limits, NamedFrame, Parameter, ParameterKind, Robot};
use didim_formats::UrdfArm;
use didim_identification::excitation::{
    Bounds, Course, DesignObjective, ExcitationError, Margins, Noise, Task, first_motion, rows,
    simulate_record,
};
use didim_identification::identification::{
    DeclaredLoad, Experiment, IdentificationError, KnownLoad, LoadSums, Payload, PayloadError,
    Selection, find_payload,
};
use nalgebra::DMatrix;

use super::assumptions::DesignAssumptions;
use super::separation::{CheckedLinks, RequestedChecks, separated_shapes};
use crate::analysis::identify::IdentifyError;
use crate::analysis::payload::LoadError;
use crate::analysis::stored_model::StoredModel;
use crate::cell::{Cell, RobotSource};

/// Error when a motion cannot be requested. The inner errors state the remedy.
#[derive(Debug, thiserror::Error)]
pub enum AssignmentError {
    /// The limits or the requested motion make no sense.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// The cell's list of parameters does not fit its robot.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// No load can be identified with this arm, or the arm's parameters are too uncertain for that.
    #[error(transparent)]
    Payload(#[from] PayloadError),
    /// A requested joint does not exist. Name joints of the arm.
    #[error("there is no joint {joint}: the arm has {joints}; number the moving joints from 1")]
    NoSuchJoint {
        /// Requested joint number.
        joint: usize,
        /// Number of joints of the arm.
        joints: usize,
    },
    /// The result has no covariance of its parameters. Identify again with this version.
    #[error("the result has no covariance of its parameters; identify again with this version")]
    NoCovariance,
    /// The assumed noise is a share of the torque limit, which the robot file leaves open.
    /// Configure the limit, or give a result.
    #[error(
        "joint {joint}: its torque limit is unknown, and without a result noise is assumed by it; \
         state torque_max_nm (force_max_n) in the robot file, or in [urdf.joints]"
    )]
    NoTorqueLimit {
        /// The joint.
        joint: JointIndex,
    },
    /// A box or a floor is configured, but the links have no shapes. Configure shapes, or leave
    /// both out.
    #[error(
        "a box or a floor is configured, but the size of the links is unknown. State `capsules` in \
         the robot file, or give the folder of a URDF's meshes by --package-path"
    )]
    NoShapes,
}

/// Requirements of a motion.
#[derive(Clone, Copy, Debug)]
pub struct RequestedDesign<'a> {
    /// Its length \[s\].
    pub duration_s: f64,
    /// Shares of the limits that the motion leaves unused.
    pub margins: Margins,
    /// Largest acceleration of each joint, in place of the robot file's value \[rad/s²\].
    pub accelerations: Option<&'a [f64]>,
    /// Requested collision checks.
    pub checks: RequestedChecks<'a>,
    /// First posture of the motion \[rad or m\]; `None` for any. Then links that overlap in the
    /// middle of the ranges count as larger than they are.
    pub first_posture: Option<&'a [f64]>,
    /// Joints that move, counted from 1. `None` for all joints.
    pub moving_joints: Option<&'a [usize]>,
    /// Load on the last link, which is identified instead of the arm's parameters, and the frame in
    /// which it is described. Its centre is in the frame of the last link.
    pub load: Option<(KnownLoad, &'a NamedFrame)>,
    /// Parameters to identify. `None` for all parameters that the cell identifies.
    pub parameters: Option<&'a [String]>,
    /// True if the aim is a small condition number instead of small standard deviations.
    pub condition_number: bool,
}

/// The load that a motion has to identify.
#[derive(Clone, Debug, PartialEq)]
pub struct WantedLoad {
    /// The expected load.
    pub expected_load: KnownLoad,
    /// Frame in which the load is described.
    pub frame: NamedFrame,
    /// Standard parameters of the arm with the load.
    standard_parameters: Vec<f64>,
}

impl WantedLoad {
    /// Returns the load that `didim payload` identifies with this result from a simulated recording
    /// of a motion. The simulation uses the noise of the task, and is the same at every call.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn simulate_load(
        &self,
        cell: &Cell,
        result: &StoredModel,
        task: &Task,
        motion: &dyn Course,
    ) -> Result<Payload, LoadError> {
        let rate_hz = cell.sample_rate_hz();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a second")]
        let rest = rate_hz as usize;
        let [position_rad, torque_nm] =
            simulate_record(task, &self.standard_parameters, motion, rate_hz, rest);
        let moves = rest..position_rad[0].len() - rest;
        let signals =
            Signals { sample_rate_hz: rate_hz, position_rad, torque_nm, reference_rad: None };
        let experiment = Experiment::joint_side(signals).and_then(|of| of.with_counted(moves));
        let experiment = experiment.map_err(IdentifyError::from)?;
        let (named, declared) = (result.named_parameters(), DeclaredLoad::default());
        let (arm, options) = (result.known_arm(&named), &cell.options);
        let (robot, base) = (&cell.robot, &cell.base);
        Ok(find_payload(robot, base, &experiment, options, arm, declared, &self.frame)?)
    }
}

/// Parameter of a design task: one to identify, or one that the result knows.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskParameter {
    /// Its name.
    pub name: String,
    /// The joint or the links that it describes, by their names in the URDF.
    pub description: Option<String>,
    /// The SI unit of its value.
    pub unit: &'static str,
    /// Its value in the result.
    pub value: Option<f64>,
    /// Its standard deviation in the result.
    pub standard_deviation: Option<f64>,
}

/// A task, and the data that its numbers refer to.
#[derive(Clone, Debug)]
pub struct Assignment {
    /// The task.
    pub task: Task,
    /// Parameter of each column of the task, without the columns of the load.
    pub parameters: Vec<TaskParameter>,
    /// True if the noise comes from a result, false if it is assumed.
    pub measured_noise: bool,
    /// The load to identify.
    pub load: Option<WantedLoad>,
    /// Number and name of each joint.
    pub joint_labels: Vec<String>,
    /// Coverage of the collision check.
    pub checked_links: CheckedLinks,
}

type Designed<T> = Result<T, AssignmentError>;

/// The arm that a motion is designed for.
struct DesignArm<'a> {
    robot: &'a Robot,
    /// File of the robot.
    file: &'a Path,
    urdf: Option<&'a UrdfArm>,
    base: &'a BaseParameters,
    parameters: Vec<TaskParameter>,
    /// Standard parameters for the arm's torques.
    standard_parameters: Option<Vec<f64>>,
    prior_information: Option<DMatrix<f64>>,
    noise: Option<Vec<f64>>,
    rows_per_s: f64,
    /// Uncertainty that a use requires of each parameter, relative to its value.
    required_uncertainty: f64,
}

impl Assignment {
    /// Creates the task for an arm that is described by its file alone.
    ///
    /// # Errors
    /// [`AssignmentError`].
    pub fn of_robot(
        (file, source): (&Path, &RobotSource),
        base: &BaseParameters,
        wanted: &RequestedDesign<'_>,
    ) -> Result<Self, AssignmentError> {
        let robot = &source.robot;
        let arm = DesignArm {
            robot,
            file,
            urdf: source.urdf.as_ref(),
            base,
            parameters: unknown_parameters(robot, base, base.names()),
            standard_parameters: robot
                .nominal()
                .map(|nominal| nominal.standard_parameters().to_vec()),
            prior_information: None,
            noise: None,
            rows_per_s: DesignAssumptions::DEFAULT.rows_per_s,
            required_uncertainty: 0.0,
        };
        arm.into_assignment(wanted)
    }

    /// Creates the task for the arm of a cell, with the data of one of its results.
    ///
    /// # Errors
    /// [`AssignmentError`].
    pub fn of_cell(
        cell: &Cell,
        result: Option<&StoredModel>,
        wanted: &RequestedDesign<'_>,
    ) -> Result<Self, AssignmentError> {
        let (robot, base) = (&cell.robot, &cell.base);
        let factor = cell.options.decimation_filter.factor;
        let mut arm = DesignArm {
            robot,
            file: &cell.robot_file,
            urdf: cell.urdf.as_ref(),
            base,
            parameters: Vec::new(),
            standard_parameters: robot
                .nominal()
                .map(|nominal| nominal.standard_parameters().to_vec()),
            prior_information: None,
            noise: None,
            rows_per_s: cell.sample_rate_hz() / factor as f64,
            required_uncertainty: DesignAssumptions::DEFAULT.noise_part
                * cell.options.limits.parameter_uncertainty,
        };
        let Some(result) = result else {
            let selection = Selection::new(robot, base, cell.options.parameters.as_deref())?;
            arm.parameters = unknown_parameters(robot, base, selection.names());
            arm.keep_identifiable();
            return arm.into_assignment(wanted);
        };
        let covariance = result.covariance.as_ref();
        let covariance = covariance.and_then(|of| of.matrix(result.parameters.len()));
        let covariance = covariance.ok_or(AssignmentError::NoCovariance)?;
        let names: Vec<String> = result.parameters.iter().map(|(name, _)| name.clone()).collect();
        arm.parameters = unknown_parameters(robot, base, &names);
        for (k, (own, (_, value))) in arm.parameters.iter_mut().zip(&result.parameters).enumerate()
        {
            own.value = Some(*value);
            own.standard_deviation = Some(covariance[(k, k)].max(0.0).sqrt());
        }
        let parameters = result.parameters.iter().chain(&result.fixed_parameters);
        arm.standard_parameters =
            base.to_standard(parameters.map(|(name, value)| (name, *value))).ok();
        let identifiable = arm.keep_identifiable();
        let covariance = covariance.select_rows(&identifiable).select_columns(&identifiable);
        let inverse = covariance.cholesky().ok_or(AssignmentError::NoCovariance)?.inverse();
        arm.prior_information = Some(inverse);
        arm.noise = (result.noise.len() == robot.joints()).then(|| result.noise.clone());
        arm.into_assignment(wanted)
    }
}

/// Returns the standard parameter that gives a base parameter its name.
fn naming_parameter(robot: &Robot, base: &BaseParameters, name: &str) -> Option<Parameter> {
    let column = base.columns()[base.find(name)?];
    Some(robot.parameters().parameters()[column])
}

/// Lists parameters without known values.
fn unknown_parameters(
    robot: &Robot,
    base: &BaseParameters,
    names: &[String],
) -> Vec<TaskParameter> {
    let unit = |name: &String| {
        let parameter = naming_parameter(robot, base, name)?;
        Some(parameter.kind.unit(robot.chain()[parameter.joint].kind))
    };
    names
        .iter()
        .map(|name: &String| {
            let (value, standard_deviation) = (None, None);
            TaskParameter {
                name: name.clone(),
                description: robot.parameter_description(name),
                unit: unit(name).unwrap_or(""),
                value,
                standard_deviation,
            }
        })
        .collect()
}

impl DesignArm<'_> {
    /// Keeps the parameters that a motion can identify, and returns their previous indices.
    fn keep_identifiable(&mut self) -> Vec<usize> {
        let is_identifiable =
            |of: &TaskParameter| match naming_parameter(self.robot, self.base, &of.name)
                .map(|own| own.kind)
            {
                // Load-dependent friction needs the joint load, which is unknown without standard
                // parameters.
                Some(ParameterKind::FcLoad) => self.standard_parameters.is_some(),
                // The parameter differs from Coulomb friction only at reversals, and a designed
                // motion has few samples there. It is therefore fixed.
                Some(ParameterKind::Fh) => false,
                _ => true,
            };
        let identifiable: Vec<usize> =
            (0..self.parameters.len()).filter(|k| is_identifiable(&self.parameters[*k])).collect();
        self.parameters = identifiable.iter().map(|k| self.parameters[*k].clone()).collect();
        identifiable
    }

    /// Returns the objective: the condition number, or the deviations of the wanted parameters.
    fn objective(&self, wanted: &RequestedDesign<'_>) -> Designed<DesignObjective> {
        let need = |of: &TaskParameter| {
            of.value.map_or(0.0, |value| self.required_uncertainty * value.abs())
        };
        let Some(names) = wanted.parameters.filter(|_| !wanted.condition_number) else {
            let needs = self.parameters.iter().map(need).enumerate();
            return Ok(match wanted.condition_number {
                true => DesignObjective::ConditionNumber,
                false => DesignObjective::Deviations(needs.collect()),
            });
        };
        let needs = names.iter().map(|name| {
            let place = self.parameters.iter().position(|of| of.name == *name);
            let need = place.map(|place| (place, need(&self.parameters[place])));
            need.ok_or_else(|| ExcitationError::UnknownParameter {
                name: name.clone(),
                available: self.parameters.iter().map(|of| of.name.clone()).collect(),
            })
        });
        Ok(DesignObjective::Deviations(needs.collect::<Result<_, _>>()?))
    }

    fn into_assignment(mut self, wanted: &RequestedDesign<'_>) -> Designed<Assignment> {
        let (robot, base) = (self.robot, self.base);
        let joints = robot.joints();
        let unknown = |joint: &&usize| !(1..=joints).contains(*joint);
        if let Some(&joint) = wanted.moving_joints.and_then(|of| of.iter().find(unknown)) {
            return Err(AssignmentError::NoSuchJoint { joint, joints });
        }
        let moves = |joint| wanted.moving_joints.is_none_or(|of| of.contains(&joint));
        let column_of = |kind| robot.parameters().column(kind, JointIndex::new(joints - 1));
        if let (Some((load, _)), Some(standard)) = (wanted.load, &mut self.standard_parameters) {
            for (kind, value) in ParameterKind::LINK.into_iter().zip(load.parameters()) {
                if let Some(column) = column_of(kind) {
                    standard[column] += value;
                }
            }
        }
        let mut model = Model::new(robot);
        if let Some(standard) = &self.standard_parameters {
            model = model.with_load(standard.clone());
        }
        let places = self.parameters.iter().filter_map(|of| base.find(&of.name));
        let columns: Vec<usize> = places.map(|index| base.columns()[index]).collect();
        let objective = self.objective(wanted)?;
        let measured_noise = self.noise.is_some();
        let deviations = self.noise.map_or_else(|| assumed_noise(robot), Ok)?;
        let count = columns.len();
        if let Some(first) = wanted.first_posture
            && first.len() != joints
        {
            let (what, expected, found) = ("the first posture", joints, first.len());
            return Err(ExcitationError::Length { what, expected, found }.into());
        }
        let middle = robot.limits().map(|of| 0.5 * (of.position_min + of.position_max));
        let reference = wanted.first_posture.map_or_else(|| middle.collect(), <[f64]>::to_vec);
        let arm = (robot, self.urdf);
        let (shapes, checked_links) = separated_shapes(arm, self.file, &wanted.checks, &reference);
        if wanted.checks.needs_shapes() && shapes.is_none() {
            return Err(AssignmentError::NoShapes);
        }
        let standard = self.standard_parameters.clone();
        let bounds =
            Bounds::new(robot, wanted.margins, wanted.accelerations, self.standard_parameters)?;
        let bounds = bounds.with_shapes(shapes);
        let prior_information =
            self.prior_information.unwrap_or_else(|| DMatrix::zeros(count, count));
        let mut task = Task {
            model,
            bounds,
            duration_s: wanted.duration_s,
            first_posture: wanted.first_posture.map(<[f64]>::to_vec),
            moving_joints: (1..=joints).map(moves).collect(),
            columns,
            prior_information,
            noise: Noise { deviations, rows_per_s: self.rows_per_s },
            objective,
        };
        let mut load = None;
        if let Some((expected_load, frame)) = wanted.load {
            let names: Vec<String> = self.parameters.iter().map(|of| of.name.clone()).collect();
            let sums = LoadSums::new(robot, base, &names)?;
            // If one motion of these joints does not identify a sum, no motion of these joints
            // does.
            let sums = sums.identifiable_by(&rows(&task, &first_motion(&task, 1)?))?;
            task.columns.extend(sums.kinds().filter_map(column_of));
            let columns = task.columns.len();
            // The arm has prior information, the load has none.
            task.prior_information = task.prior_information.resize(columns, columns, 0.0);
            task.objective =
                DesignObjective::Deviations((count..columns).map(|place| (place, 0.0)).collect());
            let standard_parameters = standard.ok_or(AssignmentError::NoCovariance)?;
            load = Some(WantedLoad { expected_load, frame: frame.clone(), standard_parameters });
        }
        let labels = (0..joints).map(|joint| robot.joint_label(JointIndex::new(joint)));
        let (parameters, joint_labels) = (self.parameters, labels.collect());
        Ok(Assignment { task, parameters, measured_noise, load, joint_labels, checked_links })
    }
}

/// Returns the assumed noise of each joint's torque, from its limit \[N·m or N\].
///
/// # Errors
/// [`AssignmentError::NoTorqueLimit`].
pub(super) fn assumed_noise(robot: &Robot) -> Result<Vec<f64>, AssignmentError> {
    let limits = robot.limits().enumerate();
    let noise = limits.map(|(joint, limits): (usize, &Limits)| {
        let joint = JointIndex::new(joint);
        Ok(DesignAssumptions::DEFAULT.noise_share
            * limits.torque_max.ok_or(AssignmentError::NoTorqueLimit { joint })?)
    });
    noise.collect()
}
