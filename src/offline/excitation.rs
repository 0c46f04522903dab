//! The task of a motion: from an arm, or from a cell and a stored result that lacks something.

use didim_core::dynamics::{BaseParameters, Model};
use didim_core::excitation::{
    Aim, Bounds, Corners, Course, ExcitationError, Margins, Noise, Shapes, Task, first, rows,
    simulated,
};
use didim_core::identification::{
    Declared, Experiment, IdentificationError, KnownLoad, LoadSums, Payload, PayloadError,
    Selection, Signals, payload,
};
use didim_core::robot::{Limits, Parameter, ParameterKind, Robot};
use didim_formats::UrdfArm;
use nalgebra::DMatrix;

use super::identify::IdentifyError;
use super::payload::LoadError;
use super::stored::StoredModel;
use crate::cell::{Cell, RobotSource};

/// Without a result: noise of a row, as a share of the torque limit of its joint, and independent rows in a second where no
/// cell says how many there are.
const ASSUMED_NOISE: f64 = 0.01;
const ASSUMED_ROWS_PER_S: f64 = 40.0;
/// Part of what a use needs that noise may take: with a third of it, a tenth of the variance.
const SHARE_OF_NOISE: f64 = 1.0 / 3.0;

/// Why a motion cannot be asked for; the inner errors carry the remedy.
#[derive(Debug, thiserror::Error)]
pub enum AssignmentError {
    /// The limits or what is wanted make no sense.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// The cell's list of parameters does not fit its robot.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// The arm shows no load, or is not known well enough for one.
    #[error(transparent)]
    Payload(#[from] PayloadError),
    /// There is no such joint. Name those that move.
    #[error("there is no joint {joint}: the arm has {joints}; name those that move, from 1")]
    NoSuchJoint {
        /// The joint.
        joint: usize,
        /// Joints of the arm.
        joints: usize,
    },
    /// The result does not say how well its parameters are known. Identify again with this version.
    #[error(
        "the result does not say how well its parameters are known together; identify again with this version"
    )]
    NoCovariance,
    /// Noise would be assumed by a torque limit that the robot file leaves open. State the limit, or give a result.
    #[error(
        "joint {joint}: its torque limit is unknown, and without a result noise is assumed by it; state torque_max_nm (force_max_n of \
         a sliding joint) in the robot file"
    )]
    NoTorqueLimit {
        /// The joint, counted from 1.
        joint: usize,
    },
    /// A box is stated, and no shape of the arm. State shapes, or leave the box out.
    #[error(
        "a box is stated, and nothing says how large the links are; state `capsules` in the robot file, or leave the box out"
    )]
    NoShapes,
}

/// What is wanted of a motion.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// Its length \[s\].
    pub duration_s: f64,
    /// How much of the limits stays free.
    pub margins: Margins,
    /// Largest acceleration of each joint, in place of the robot file's \[rad/s²\].
    pub accelerations: Option<&'a [f64]>,
    /// A box in the frame of the base that the arm stays in.
    pub inside: Option<Corners>,
    /// Joints that move, counted from 1; all when left out.
    pub moving: Option<&'a [usize]>,
    /// A load on the last link that is to be told, and none of the arm's parameters.
    pub load: Option<KnownLoad>,
    /// Parameters that are to be told; all that are identified when left out.
    pub parameters: Option<&'a [String]>,
    /// Whether a small condition number is wanted, and not small standard deviations.
    pub condition_number: bool,
}

/// The load that a motion is to tell.
#[derive(Clone, Debug, PartialEq)]
pub struct WantedLoad {
    /// The load as it is expected.
    pub expected: KnownLoad,
    /// Standard parameters of the arm with it.
    standard: Vec<f64>,
}

impl WantedLoad {
    /// What `didim payload` finds with this result in a recording of a motion, which is simulated with the noise of the task: the same
    /// every time.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn simulated(
        &self,
        cell: &Cell,
        result: &StoredModel,
        task: &Task,
        motion: &dyn Course,
    ) -> Result<Payload, LoadError> {
        let rate_hz = cell.sample_rate_hz();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a second")]
        let rest = rate_hz as usize;
        let [position_rad, torque_nm] = simulated(task, &self.standard, motion, rate_hz, rest);
        let moves = rest..position_rad[0].len() - rest;
        let signals =
            Signals { sample_rate_hz: rate_hz, position_rad, torque_nm, reference_rad: None };
        let experiment = Experiment::joint_side(signals).and_then(|of| of.with_counted(moves));
        let experiment = experiment.map_err(IdentifyError::from)?;
        let (named, declared) = (result.named(), Declared::default());
        let (arm, options) = (result.known(&named), &cell.options);
        Ok(payload(&cell.robot, &cell.base, &experiment, options, arm, declared)?)
    }
}

/// A parameter that is identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Lacking {
    /// Its name.
    pub name: String,
    /// The SI unit of its value.
    pub unit: &'static str,
    /// The value of the result.
    pub value: Option<f64>,
    /// Its standard deviation in the result.
    pub standard_deviation: Option<f64>,
}

/// A task, and what its numbers are about.
#[derive(Clone, Debug)]
pub struct Assignment {
    /// The task.
    pub task: Task,
    /// Of each column of the task that is not a load's.
    pub parameters: Vec<Lacking>,
    /// Whether noise is that of a result, and not assumed.
    pub measured_noise: bool,
    /// The load that is to be told.
    pub load: Option<WantedLoad>,
    /// Links of a URDF with collision shapes that are meshes, or cannot be read.
    pub unread_shapes: Vec<String>,
}

/// An arm as a motion is designed for it.
struct Arm<'a> {
    robot: &'a Robot,
    urdf: Option<&'a UrdfArm>,
    base: &'a BaseParameters,
    parameters: Vec<Lacking>,
    /// Standard parameters for its torques.
    standard: Option<Vec<f64>>,
    before: Option<DMatrix<f64>>,
    noise: Option<Vec<f64>>,
    rows_per_s: f64,
    /// What a use asks of each parameter, relative to its value.
    need: f64,
}

impl Assignment {
    /// For an arm of which nothing is known but what its file says.
    ///
    /// # Errors
    /// [`AssignmentError`].
    pub fn of_robot(
        source: &RobotSource,
        base: &BaseParameters,
        wanted: &Wanted<'_>,
    ) -> Result<Self, AssignmentError> {
        let robot = &source.robot;
        let arm = Arm {
            robot,
            urdf: source.urdf.as_ref(),
            base,
            parameters: unknown(robot, base, base.names()),
            standard: robot.nominal().map(|nominal| nominal.standard().to_vec()),
            before: None,
            noise: None,
            rows_per_s: ASSUMED_ROWS_PER_S,
            need: 0.0,
        };
        arm.assignment(wanted)
    }

    /// For the arm of a cell, with what a result of it says.
    ///
    /// # Errors
    /// [`AssignmentError`].
    pub fn of_cell(
        cell: &Cell,
        result: Option<&StoredModel>,
        wanted: &Wanted<'_>,
    ) -> Result<Self, AssignmentError> {
        let (robot, base) = (&cell.robot, &cell.base);
        let factor = cell.options.decimation_filter.factor;
        let mut arm = Arm {
            robot,
            urdf: cell.urdf.as_ref(),
            base,
            parameters: Vec::new(),
            standard: robot.nominal().map(|nominal| nominal.standard().to_vec()),
            before: None,
            noise: None,
            rows_per_s: cell.sample_rate_hz() / factor as f64,
            need: SHARE_OF_NOISE * cell.options.limits.parameter_uncertainty,
        };
        let Some(result) = result else {
            let selection = Selection::new(robot, base, cell.options.parameters.as_deref())?;
            arm.parameters = unknown(robot, base, selection.names());
            arm.keep_told();
            return arm.assignment(wanted);
        };
        let covariance = result.covariance.as_ref();
        let covariance = covariance.and_then(|of| of.matrix(result.parameters.len()));
        let covariance = covariance.ok_or(AssignmentError::NoCovariance)?;
        let names: Vec<String> = result.parameters.iter().map(|(name, _)| name.clone()).collect();
        arm.parameters = unknown(robot, base, &names);
        for (k, (own, (_, value))) in arm.parameters.iter_mut().zip(&result.parameters).enumerate()
        {
            own.value = Some(*value);
            own.standard_deviation = Some(covariance[(k, k)].max(0.0).sqrt());
        }
        let all = result.parameters.iter().chain(&result.kept);
        arm.standard = base.to_standard(all.map(|(name, value)| (name, *value))).ok();
        let told = arm.keep_told();
        let covariance = covariance.select_rows(&told).select_columns(&told);
        let inverse = covariance.cholesky().ok_or(AssignmentError::NoCovariance)?.inverse();
        arm.before = Some(inverse);
        arm.noise = (result.noise.len() == robot.joints()).then(|| result.noise.clone());
        arm.assignment(wanted)
    }
}

/// The standard parameter that gives a base parameter its name.
fn named(robot: &Robot, base: &BaseParameters, name: &str) -> Option<Parameter> {
    let column = base.columns()[base.find(name)?];
    Some(robot.parameters().parameters()[column])
}

/// Parameters of which no value is known.
fn unknown(robot: &Robot, base: &BaseParameters, names: &[String]) -> Vec<Lacking> {
    let unit = |name: &String| {
        let parameter = named(robot, base, name)?;
        Some(parameter.kind.unit(robot.chain()[parameter.joint].kind))
    };
    let lacking = |name: &String| {
        let (value, standard_deviation) = (None, None);
        Lacking { name: name.clone(), unit: unit(name).unwrap_or(""), value, standard_deviation }
    };
    names.iter().map(lacking).collect()
}

impl Arm<'_> {
    /// Leaves the parameters of which a motion tells something, and says which numbers they had.
    fn keep_told(&mut self) -> Vec<usize> {
        let is_told =
            |of: &Lacking| match named(self.robot, self.base, &of.name).map(|own| own.kind) {
                // Nothing says with which load friction grows.
                Some(ParameterKind::FcLoad) => self.standard.is_some(),
                // Coulomb friction but at reversals, which a design has few samples of: taken for known.
                Some(ParameterKind::Fh) => false,
                _ => true,
            };
        let told: Vec<usize> =
            (0..self.parameters.len()).filter(|k| is_told(&self.parameters[*k])).collect();
        self.parameters = told.iter().map(|k| self.parameters[*k].clone()).collect();
        told
    }

    fn assignment(mut self, wanted: &Wanted<'_>) -> Result<Assignment, AssignmentError> {
        let (robot, base) = (self.robot, self.base);
        let joints = robot.joints();
        let unknown = |joint: &&usize| !(1..=joints).contains(*joint);
        if let Some(&joint) = wanted.moving.and_then(|of| of.iter().find(unknown)) {
            return Err(AssignmentError::NoSuchJoint { joint, joints });
        }
        let moves = |joint| wanted.moving.is_none_or(|of| of.contains(&joint));
        let own = |kind| robot.parameters().column(kind, joints - 1);
        if let (Some(load), Some(standard)) = (wanted.load, &mut self.standard) {
            for (kind, value) in ParameterKind::LINK.into_iter().zip(load.parameters()) {
                if let Some(column) = own(kind) {
                    standard[column] += value;
                }
            }
        }
        let mut model = Model::new(robot);
        if let Some(standard) = &self.standard {
            model = model.with_load(standard.clone());
        }
        let places = self.parameters.iter().filter_map(|of| base.find(&of.name));
        let columns: Vec<usize> = places.map(|index| base.columns()[index]).collect();
        let need = |of: &Lacking| of.value.map_or(0.0, |value| self.need * value.abs());
        let aim = if wanted.condition_number {
            Aim::ConditionNumber
        } else {
            Aim::Deviations(match wanted.parameters {
                None => self.parameters.iter().map(need).enumerate().collect(),
                Some(names) => {
                    let place = |name: &String| {
                        let place = self.parameters.iter().position(|of| of.name == *name);
                        let found = place.map(|place| (place, need(&self.parameters[place])));
                        found.ok_or_else(|| ExcitationError::UnknownParameter {
                            name: name.clone(),
                            known: self.parameters.iter().map(|of| of.name.clone()).collect(),
                        })
                    };
                    names.iter().map(place).collect::<Result<_, _>>()?
                }
            })
        };
        let measured_noise = self.noise.is_some();
        let assumed = |(joint, limits): (usize, &Limits)| -> Result<f64, AssignmentError> {
            let most = limits.torque_max.ok_or(AssignmentError::NoTorqueLimit { joint })?;
            Ok(ASSUMED_NOISE * most)
        };
        let levels = match self.noise {
            Some(levels) => levels,
            None => (1..).zip(robot.limits()).map(assumed).collect::<Result<_, _>>()?,
        };
        let count = columns.len();
        let shapes = Shapes::of(robot, wanted.inside);
        if wanted.inside.is_some() && shapes.is_none() {
            return Err(AssignmentError::NoShapes);
        }
        let standard = self.standard.clone();
        let bounds = Bounds::new(robot, wanted.margins, wanted.accelerations, self.standard)?;
        let bounds = bounds.with_shapes(shapes);
        let mut task = Task {
            model,
            bounds,
            duration_s: wanted.duration_s,
            moving: (1..=joints).map(moves).collect(),
            columns,
            before: self.before.unwrap_or_else(|| DMatrix::zeros(count, count)),
            noise: Noise { levels, rows_per_s: self.rows_per_s },
            aim,
        };
        let load = match wanted.load {
            None => None,
            Some(expected) => {
                let names: Vec<String> = self.parameters.iter().map(|of| of.name.clone()).collect();
                let sums = LoadSums::of(robot, base, &names)?;
                // What one motion of these joints does not tell, none does.
                let sums = sums.told_by(&rows(&task, &first(&task, 1)?))?;
                task.columns.extend(sums.kinds().filter_map(own));
                let all = task.columns.len();
                // Beside what is known of the arm, and of the load nothing.
                task.before = task.before.resize(all, all, 0.0);
                task.aim = Aim::Deviations((count..all).map(|place| (place, 0.0)).collect());
                Some(WantedLoad {
                    expected,
                    standard: standard.ok_or(AssignmentError::NoCovariance)?,
                })
            }
        };
        let unread_shapes = self.urdf.map_or_else(Vec::new, |arm| arm.unread_shapes().to_vec());
        Ok(Assignment { task, parameters: self.parameters, measured_noise, load, unread_shapes })
    }
}
