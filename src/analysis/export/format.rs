//! A consistent model in the formats of other tools.

use didim_dynamics::robot::{ParameterKind, TorqueTerm};
use didim_formats::{
    CodeError, CodeModel, ExportError, ExportKind, ExportModel, LeftOut, UrdfError, UrdfValues,
    WRITTEN_BY, to_c, to_matlab, to_mjcf, to_robot_file, to_rust, to_urdf,
};
use didim_identification::feasibility::{Outcome, ValueSource};

use super::model::ConsistentModel;

/// Output format of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The robot's own URDF with new inertials, damping and friction, or a new URDF if the robot
    /// has a robot file.
    Urdf,
    /// MuJoCo's format.
    Mjcf,
    /// The robot's file with new nominal values.
    Toml,
    /// Every standard parameter with its uncertainty and the source of its value.
    Json,
    /// A MATLAB function file.
    Matlab,
    /// Inverse dynamics as one C99 file.
    C,
    /// Inverse dynamics as one Rust file without the standard library.
    Rust,
}

impl Format {
    /// All formats, in the order in which they are offered.
    pub const ALL: [Self; 7] =
        [Self::Urdf, Self::Mjcf, Self::Toml, Self::Json, Self::Matlab, Self::C, Self::Rust];

    /// Returns the format's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Urdf => "urdf",
            Self::Mjcf => "mjcf",
            Self::Toml => "toml",
            Self::Json => "json",
            Self::Matlab => "matlab",
            Self::C => "c",
            Self::Rust => "rust",
        }
    }
}

/// Error when a consistent model cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The format cannot hold the model.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The model cannot be written as code.
    #[error(transparent)]
    Code(#[from] CodeError),
    /// The model cannot be written into the robot's URDF.
    #[error(transparent)]
    Urdf(#[from] UrdfError),
    /// The model cannot be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

/// A model in one format.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The file's content.
    pub text: String,
    /// Parts of the model that the format cannot hold.
    pub left_out: Vec<LeftOut>,
}

impl ConsistentModel<'_> {
    /// Returns the model in a format. `name` is the file name without its extension; MATLAB calls
    /// the function by this name.
    ///
    /// # Errors
    /// [`WriteError`].
    pub fn write(&self, format: Format, name: &str) -> Result<Exported, WriteError> {
        let (robot, standard, origin) =
            (&self.cell.robot, self.outcome.standard_values(), self.origin_lines());
        let model = ExportModel { robot, standard_parameters: &standard, origin: &origin };
        let holder = match format {
            Format::Urdf => Some(ExportKind::Urdf),
            Format::Mjcf => Some(ExportKind::Mjcf),
            Format::Matlab | Format::Json => Some(ExportKind::Parameters),
            Format::Toml | Format::C | Format::Rust => None,
        };
        let left_out = holder.map_or_else(Vec::new, |holder| LeftOut::list(&model, holder));
        let identified: Vec<&str> =
            self.model.parameters.iter().map(|(name, _)| name.as_str()).collect();
        let code = CodeModel {
            robot,
            base: &self.cell.base,
            standard_parameters: &standard,
            identified_names: &identified,
            covariance: &self.covariance,
            origin: &origin,
        };
        let text = match (format, &self.cell.urdf) {
            (Format::Urdf, Some(arm)) => {
                let left_out = left_out.iter().map(|remaining| format!("left out: {remaining}"));
                let remarks: Vec<String> = origin.iter().cloned().chain(left_out).collect();
                arm.with_values(&self.urdf_values(&model), &remarks)?
            }
            (Format::Urdf, None) => to_urdf(&model)?,
            (Format::Mjcf, _) => to_mjcf(&model)?,
            (Format::Toml, _) => to_robot_file(&model, &self.cell.configuration.robot)?,
            (Format::Json, _) => self.json(&left_out)?,
            (Format::Matlab, _) => to_matlab(&model, name)?,
            (Format::C, _) => to_c(code)?,
            (Format::Rust, _) => to_rust(code)?,
        };
        Ok(Exported { text, left_out })
    }

    fn urdf_values(&self, model: &ExportModel<'_>) -> UrdfValues {
        let joints = 0..self.cell.robot.joints();
        UrdfValues {
            link_bodies: self.outcome.link_bodies.clone(),
            damping: joints.clone().map(|joint| model.value(ParameterKind::Fv, joint)).collect(),
            friction: joints.map(|joint| model.sliding_friction(joint)).collect(),
        }
    }

    /// Returns true if the model has no friction, because the recorded torques do not contain it.
    pub fn has_no_friction(&self) -> bool {
        self.cell.robot.recorded_torque().excluded_terms().contains(&TorqueTerm::Friction)
    }

    /// Describes the origin of the model and the source of each mass.
    fn origin_lines(&self) -> Vec<String> {
        let Outcome { cost, least_cost, threshold, prior, parameters, judgement, .. } =
            &self.outcome;
        let mut lines = vec![
            WRITTEN_BY.to_owned(),
            format!(
                "{}, identified by {}, made consistent by didim {}: {judgement}.",
                self.cell.robot.name(),
                self.model.method,
                env!("CARGO_PKG_VERSION")
            ),
            format!(
                "Cost of the nearest consistent parameters {least_cost:.1} (correct results \
                    stay below {threshold:.0}, 99 %), of these {cost:.1}; parameters without \
                    enough data come from {prior}."
            ),
        ];
        if self.has_no_friction() {
            lines.push(format!("Warning: {NO_FRICTION}."));
        }
        let refusals = self.model.refusals(&self.cell.options.required_uses);
        lines.extend(refusals.iter().map(|refusal| format!("Warning: {refusal}")));
        let masses = parameters.iter().zip(self.cell.robot.parameters().parameters());
        let masses = masses.filter(|(_, parameter)| parameter.kind == ParameterKind::M);
        lines.extend(masses.map(|(mass, parameter)| {
            format!(
                "Mass of link {}{}: {:.4} kg, decided by {}.",
                parameter.joint,
                self.cell
                    .robot
                    .link_name(parameter.joint)
                    .map_or_else(String::new, |name| { format!(" ({name})") }),
                mass.value,
                source_of_value(mass.class)
            )
        }));
        lines
    }
}

/// Note on a model from torques without friction.
pub const NO_FRICTION: &str =
    "the model has no friction, because the recorded torques do not contain it";

/// Returns a readable name for the source of a parameter's value.
fn source_of_value(class: ValueSource) -> &'static str {
    match class {
        ValueSource::Data => "the data",
        ValueSource::Prior => "the prior",
        ValueSource::Combination => "the prior, within a sum from the data",
        ValueSource::Absent => "nothing: the model does not have it",
    }
}
