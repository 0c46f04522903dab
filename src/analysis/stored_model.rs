//! A stored result, with its cell.

use std::fs;
use std::path::{Path, PathBuf};

use didim_dynamics::robot::JointIndex;
use didim_formats::TextKind;
use didim_identification::identification::{
    ChosenCutoff, Estimate, KnownArm, KnownModel, Method, ModelUncertainty, ParameterCovariance,
    ParameterEstimate, ReachedRange, SCHEMA, Use, UseVerdict, Verdict,
};
use serde::Deserialize;
use serde::de::{Error as _, IgnoredAny};

use crate::archive::drift::Baseline;
use crate::archive::store::ResultRecord;
use crate::cell::Cell;

/// Error when a result cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ResultError {
    /// The file cannot be read. Check its name and permissions.
    #[error("{}: {source}; check its name and permissions", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a result. Use one that the service stored, or the output of `didim identify
    /// --json`.
    #[error(
        "{}: {found}; give a result that the service stored, or the output of `didim identify \
         --json`", file.display()
    )]
    NoResult {
        /// The file.
        file: PathBuf,
        /// Kind of the file, or the problem of its JSON.
        found: String,
    },
    /// The parameters of the result are not those of the robot. Use the cell of its identification.
    #[error(
        "{}: {what}: give the result as it was stored, and the cell that it was identified with",
        file.display()
    )]
    Parameters {
        /// The file.
        file: PathBuf,
        /// The problem.
        what: String,
    },
    /// The result belongs to another robot. Use the cell of its identification.
    #[error("{}: the result is of the robot {found}, the cell's is {robot}; give the cell \
             that it was identified with", file.display())]
    OtherRobot {
        /// The file.
        file: PathBuf,
        /// Robot of the result.
        found: String,
        /// Robot of the cell.
        robot: String,
    },
}

impl ResultError {
    /// Creates the error of a file that is no result, by its kind or by the problem of its JSON.
    pub(super) fn no_result(file: &Path, text: &[u8], problem: &serde_json::Error) -> Self {
        let begin = text.utf8_chunks().next().map_or("", |chunk| chunk.valid());
        let found = match TextKind::detect(begin) {
            None | Some(TextKind::Json) => problem.to_string(),
            Some(kind) => format!("this is {kind}, not a result"),
        };
        Self::NoResult { file: file.to_path_buf(), found }
    }
}

/// Note on a result that [does not belong to](StoredModel::is_of) the cell.
pub const OTHER_CONFIGURATION: &str = "the result was identified with another configuration";

/// Model of an arm from a stored result.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredModel {
    pub(super) parameters: Vec<(String, f64)>,
    /// Parameters that were fixed at their nominal values.
    pub(super) fixed_parameters: Vec<(String, f64)>,
    /// Name of the method.
    pub method: String,
    /// Hash of the configuration of the identification, if the result contains it; see
    /// [`Self::is_of`].
    pub(super) configuration: Option<String>,
    pub(super) uncertainty: Option<ModelUncertainty>,
    pub(super) covariance: Option<ParameterCovariance>,
    /// Standard deviation of the torque noise per row, by joint \[N·m or N\]. It is enlarged for
    /// autocorrelated residuals, so that rows may be treated as independent. Empty if the result
    /// does not report it.
    pub(super) noise: Vec<f64>,
    /// Root mean square of the residuals, by joint \[N·m or N\]; 0 of a joint without torque.
    /// Empty if the result does not report it.
    pub(super) residual_rms: Vec<f64>,
    /// Range of the motion, by joint. Empty in results of versions that did not report it.
    pub(super) reached: Vec<ReachedRange>,
    /// Combined standard uncertainty of each parameter, if the result reports it.
    pub(super) combined_deviations: Vec<Option<f64>>,
    /// Verdict for each use, if the result has one.
    pub(super) uses: Vec<JudgedUse>,
}

impl StoredModel {
    /// Returns the combined standard uncertainty of a parameter, if the result reports it.
    pub fn combined_deviation(&self, name: &str) -> Option<f64> {
        let index = self.parameters.iter().position(|(own, _)| own == name)?;
        self.combined_deviations.get(index).copied().flatten()
    }
}

/// Verdict of a stored result on a use.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedUse {
    /// The use.
    pub usage: Use,
    /// True if the result is usable for this use. `None` if that is unknown.
    pub applicable: Option<bool>,
    /// Reasons against the use.
    pub reasons: Vec<String>,
}

impl JudgedUse {
    /// Takes the verdict of a result on a use.
    pub fn new(usage: Use, verdict: &UseVerdict) -> Self {
        let reasons = verdict.reasons.iter().map(ToString::to_string).collect();
        Self { usage, applicable: verdict.applicable, reasons }
    }

    /// Describes the answer with its first reason. `None` if the result is usable.
    pub fn objection(&self) -> Option<String> {
        let answer = match self.applicable {
            Some(true) => return None,
            Some(false) => "the result is not usable for",
            None => "it is undecided whether the result is usable for",
        };
        let why = self.reasons.first().map(|reason| format!(": {reason}"));
        Some(format!("{answer} {}{}", self.usage.name(), why.unwrap_or_default()))
    }
}

/// Parses a result file or a result without its window. Also returns the hash of the configuration,
/// if the file has it.
pub(super) fn parse_result(text: &[u8]) -> Result<(Option<String>, Estimate), serde_json::Error> {
    #[derive(Deserialize)]
    struct Head {
        #[serde(default)]
        estimate: Option<IgnoredAny>,
    }

    let (configuration, estimate) = match serde_json::from_slice::<Head>(text)?.estimate {
        Some(_) => {
            let ResultRecord { configuration, estimate, .. } = serde_json::from_slice(text)?;
            (Some(configuration), estimate)
        }
        None => (None, serde_json::from_slice::<Estimate>(text)?),
    };
    if estimate.robot.is_empty() {
        return Err(serde_json::Error::missing_field("robot"));
    }
    if estimate.schema > SCHEMA {
        let why = format!("schema {} is of a later version of this program", estimate.schema);
        return Err(serde_json::Error::custom(why));
    }
    Ok((configuration, estimate))
}

/// Returns the RMS residuals, scaled by the median factor by which coloured residuals increase the
/// standard deviations.
fn noise_levels(estimate: &Estimate) -> Vec<f64> {
    let ratios = estimate
        .parameters
        .iter()
        .map(|of: &ParameterEstimate| of.standard_deviation / of.classical_standard_deviation);
    let mut ratios: Vec<f64> = ratios.filter(|ratio| ratio.is_finite() && *ratio > 0.0).collect();
    ratios.sort_by(f64::total_cmp);
    let colour = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
    // A joint without a recorded torque has no noise.
    let rms = estimate.rms_error_per_joint_nm.iter();
    rms.map(|rms| if rms.is_nan() { 0.0 } else { colour * rms }).collect()
}

/// Returns the verdict for each use that has one.
fn judged_uses(verdict: &Verdict) -> Vec<JudgedUse> {
    let judged = Use::ALL.into_iter().map(|usage| JudgedUse::new(usage, verdict.uses.get(usage)));
    judged.filter(|of| of.applicable.is_some() || !of.reasons.is_empty()).collect()
}

impl StoredModel {
    /// Reads a result file, or the output of `didim identify --json`. Also returns the cell to use
    /// for predictions. Its friction laws are those of the result. Its position filter is that of
    /// the result as well if the filter was chosen from the data.
    ///
    /// # Errors
    /// [`ResultError`].
    pub fn read_stored_model(file: &Path, cell: Cell) -> Result<(Self, Cell), ResultError> {
        let text = fs::read(file)
            .map_err(|source| ResultError::Read { file: file.to_path_buf(), source })?;
        Self::parse(&text, file, cell)
    }

    /// Parses the text of a result file like [`read_stored_model`](Self::read_stored_model). `file`
    /// is the name in errors.
    ///
    /// # Errors
    /// Same as [`read_stored_model`](Self::read_stored_model).
    pub fn parse(text: &[u8], file: &Path, mut cell: Cell) -> Result<(Self, Cell), ResultError> {
        let wrong = |problem| ResultError::no_result(file, text, &problem);
        let (configuration, estimate) = parse_result(text).map_err(wrong)?;
        let robot = cell.robot.name();
        if estimate.robot != robot {
            return Err(ResultError::OtherRobot {
                file: file.to_path_buf(),
                found: estimate.robot,
                robot: robot.to_owned(),
            });
        }
        let (noise, uses) = (noise_levels(&estimate), judged_uses(&estimate.verdict));
        let residual_rms = estimate.rms_error_per_joint_nm.iter();
        let residual_rms = residual_rms.map(|rms| if rms.is_nan() { 0.0 } else { *rms }).collect();
        let reached = estimate.reached_per_joint;
        let combined = estimate.parameters.iter().map(|p| p.combined_standard_deviation);
        let combined = combined.map(|value| Some(value).filter(|value| value.is_finite()));
        let combined_deviations = combined.collect();
        let unfit = |what| ResultError::Parameters { file: file.to_path_buf(), what };
        match estimate.position_cutoff {
            Some(ChosenCutoff { cutoff_hz, .. }) => {
                cell.options.position_filter.cutoff_hz = cutoff_hz;
                let design = cell.options.position_filter.design(cell.sample_rate_hz());
                design.map_err(|error| {
                    unfit(format!("`position_cutoff` has {cutoff_hz} Hz: {error}"))
                })?;
            }
            None if cell.chooses_cutoff => {
                let explanation = "the cell lets the data choose the cut-off of the position \
                    filter, and the result does not state it";
                return Err(unfit(explanation.to_owned()));
            }
            None => {}
        }
        let chosen = estimate.friction.map(|of| of.friction);
        let laws = Some(estimate.friction_laws).filter(|laws| !laws.is_empty()).or(chosen);
        if let Some(friction) = laws.filter(|laws| laws != cell.robot.own_friction()) {
            let (found, joints) = (friction.len(), cell.robot.joints());
            if found != joints {
                return Err(unfit(format!(
                    "it has the friction of {found} joints, not of {joints}"
                )));
            }
            cell = cell.with_friction(friction).map_err(|error| unfit(error.to_string()))?;
        }
        let identified = estimate.parameters.into_iter().map(|p| (p.name, p.value));
        let parameters: Vec<(String, f64)> = identified.collect();
        let fixed = estimate.nominal.into_iter().map(|p| (p.name, p.value));
        let fixed: Vec<(String, f64)> = fixed.collect();
        cell = with_joints_of(&estimate.rms_error_per_joint_nm, cell).map_err(unfit)?;
        check_names(&parameters, &fixed, &cell).map_err(unfit)?;
        let uncertainty = estimate.model_uncertainty;
        // The method name goes into other files unchanged.
        if !estimate.method.is_empty()
            && let Err(unknown) = estimate.method.parse::<Method>()
        {
            return Err(unfit(unknown.to_string()));
        }
        let (method, covariance) = (estimate.method, estimate.covariance);
        let model = Self {
            parameters,
            fixed_parameters: fixed,
            method,
            configuration,
            uncertainty,
            covariance,
            noise,
            residual_rms,
            reached,
            combined_deviations,
            uses,
        };
        Ok((model, cell))
    }

    /// Creates the model of a baseline. Its parameters are those of the cell's robot.
    pub(super) fn of_baseline(baseline: &Baseline) -> Self {
        let Baseline { result, available, .. } = baseline;
        Self {
            parameters: result.parameters.iter().map(|p| (p.name.clone(), p.value)).collect(),
            fixed_parameters: available
                .fixed
                .iter()
                .map(|fixed| (fixed.name.clone(), fixed.value))
                .collect(),
            method: result.method.clone(),
            configuration: Some(result.configuration.clone()),
            uncertainty: available.model_uncertainty.clone(),
            covariance: available.covariance.clone(),
            noise: Vec::new(),
            residual_rms: Vec::new(),
            reached: Vec::new(),
            combined_deviations: Vec::new(),
            uses: Vec::new(),
        }
    }

    /// Returns true if the result was identified with the configuration of a cell. `None` if the
    /// result does not report it.
    pub fn is_of(&self, cell: &Cell) -> Option<bool> {
        self.configuration.as_ref().map(|hash| *hash == cell.configuration_sha256)
    }

    /// Returns the verdict on a use, if the result has one.
    pub fn judged_use(&self, usage: Use) -> Option<&JudgedUse> {
        self.uses.iter().find(|of| of.usage == usage)
    }

    /// Describes each of the required uses for which the verdict is no.
    pub fn refusals(&self, required: &[Use]) -> Vec<String> {
        let judged = required.iter().filter_map(|usage| self.judged_use(*usage));
        judged.filter(|of| of.applicable == Some(false)).filter_map(JudgedUse::objection).collect()
    }

    /// Returns the identified parameters, and those fixed at their nominal values.
    pub(super) fn named_parameters(&self) -> [Vec<(&str, f64)>; 2] {
        [&self.parameters, &self.fixed_parameters]
            .map(|of| of.iter().map(|(name, value)| (name.as_str(), *value)).collect())
    }

    /// Returns the arm with fixed parameters. `named` comes from [`Self::named_parameters`].
    pub(super) fn known_arm<'s>(&'s self, named: &'s [Vec<(&'s str, f64)>; 2]) -> KnownArm<'s> {
        let [parameters, fixed_part] = named;
        let uncertainty = self.uncertainty.as_ref();
        let model = KnownModel { parameters, fixed_parameters: fixed_part, uncertainty };
        KnownArm { model, covariance: self.covariance.as_ref() }
    }

    /// Returns the robot's base parameters that the result does not contain. Predictions use 0 for
    /// them.
    pub fn missing_parameters<'a>(&self, cell: &'a Cell) -> Vec<&'a str> {
        let names = cell.base.names().iter().map(String::as_str);
        let parameters = || self.parameters.iter().chain(&self.fixed_parameters);
        names.filter(|name| parameters().all(|(own, _)| own != name)).collect()
    }
}

/// Returns the joints whose torques a result was identified from: those that have an error.
fn identified_joints(errors_nm: &[f64]) -> Vec<JointIndex> {
    let finite = errors_nm.iter().enumerate().filter(|(_, error)| error.is_finite());
    finite.map(|(joint, _)| JointIndex::new(joint)).collect()
}

/// Returns a cell without the torques that a result does not describe. The torques of some joints
/// identify other sums of parameters than those of all joints, under the same names: the sums are
/// those of the result.
fn with_joints_of(errors_nm: &[f64], cell: Cell) -> Result<Cell, String> {
    let of_result = identified_joints(errors_nm);
    let recorded = cell.robot.recorded_torque();
    let is_complete =
        of_result.len() == cell.robot.joints() && recorded.missing_joints().is_empty();
    // A result of an earlier version may have no errors.
    if of_result.is_empty() || is_complete {
        return Ok(cell);
    }
    let used = of_result.iter().copied().filter(|joint| recorded.has_joint(*joint));
    let used: Vec<JointIndex> = used.collect();
    if used.is_empty() {
        return Err("it has no torque of the joints that the cell uses".to_owned());
    }
    cell.with_joints_of_result(&used, &of_result).map_err(|error| error.to_string())
}

/// Checks that every parameter belongs to the robot and occurs once.
fn check_names(
    parameters: &[(String, f64)],
    fixed: &[(String, f64)],
    cell: &Cell,
) -> Result<(), String> {
    if parameters.is_empty() {
        return Err("it has no parameters".to_owned());
    }
    let all_parameters = || parameters.iter().chain(fixed);
    for (index, (name, value)) in all_parameters().enumerate() {
        if !value.is_finite() {
            return Err(format!("the value of `{name}` is not a number"));
        }
        if cell.base.find(name).is_none() {
            return Err(format!("{} has no base parameter `{name}`", cell.robot.name()));
        }
        if all_parameters().take(index).any(|(other, _)| other == name) {
            return Err(format!("`{name}` stands there twice"));
        }
    }
    Ok(())
}
