//! A stored result, with the cell that it belongs to.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use didim_core::identification::{
    KnownArm, KnownModel, Method, ModelUncertainty, ParameterCovariance, Reached, Use,
};
use didim_core::robot::JointFriction;
use serde::Deserialize;

use crate::archive::drift::Baseline;
use crate::cell::Cell;

/// Why a result cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ResultError {
    /// The file cannot be read. Check its name and permissions.
    #[error("{}: {source}; check its name and permissions", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no result. Take one that the service stored, or the output of
    /// `didim identify --json`.
    #[error(
        "{}: {source}; give a result that the service stored, or the output of `didim identify \
         --json`", file.display()
    )]
    NoResult {
        /// The file.
        file: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// The parameters of the result are not those of the robot. Take the cell that it was identified with.
    #[error(
        "{}: {what}: give the result as it was stored, and the cell that it was identified with",
        file.display()
    )]
    Parameters {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// The result is of another robot. Take the cell that it was identified with.
    #[error("{}: the result is of the robot {found}, the cell's is {robot}; give the cell \
             that it was identified with", file.display())]
    OtherRobot {
        /// The file.
        file: PathBuf,
        /// The robot of the result.
        found: String,
        /// That of the cell.
        robot: String,
    },
}

/// What has to be known of a result that [is not of](StoredModel::is_of) the cell.
pub const OTHER_CONFIGURATION: &str = "the result was identified with another configuration";

/// What a stored result says of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredModel {
    pub(super) parameters: Vec<(String, f64)>,
    /// Those beside them that kept their nominal values.
    pub(super) kept: Vec<(String, f64)>,
    /// Name of the method.
    pub method: String,
    /// Hash of the configuration that it was identified with, where it says so; see [`Self::is_of`].
    pub(super) configuration: Option<String>,
    pub(super) uncertainty: Option<ModelUncertainty>,
    pub(super) covariance: Option<ParameterCovariance>,
    /// Standard deviation of a row of each joint \[N·m or N\] as if rows were independent; empty where the result does not say.
    pub(super) noise: Vec<f64>,
    /// How far the motion went, per joint; empty in results of versions that did not say.
    pub(super) reached: Vec<Reached>,
    /// Combined standard uncertainty of each parameter, where the result says so.
    pub(super) combined: Vec<Option<f64>>,
    /// The verdict for each use, where the result has one.
    pub(super) uses: Vec<JudgedUse>,
}

/// What a stored result says of a use.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedUse {
    /// Which.
    pub of: Use,
    /// Whether the result is good for it; none where that cannot be told.
    pub applicable: Option<bool>,
    /// What speaks against it.
    pub reasons: Vec<String>,
}

#[derive(Deserialize)]
struct Stored {
    configuration: Option<String>,
    estimate: Option<StoredEstimate>,
    #[serde(flatten)]
    alone: serde_json::Value,
}

#[derive(Deserialize)]
struct StoredEstimate {
    robot: String,
    #[serde(default)]
    method: String,
    /// Where the data chose the cut-off.
    position_cutoff: Option<StoredCutoff>,
    /// Where the data chose the laws.
    friction: Option<StoredFriction>,
    /// Results of earlier versions have none.
    friction_laws: Option<Vec<JointFriction>>,
    parameters: Vec<StoredParameter>,
    #[serde(default)]
    kept: Vec<StoredParameter>,
    /// Results of earlier versions have none.
    model_uncertainty: Option<ModelUncertainty>,
    /// Neither have they one.
    covariance: Option<ParameterCovariance>,
    #[serde(default)]
    rms_error_per_joint_nm: Vec<f64>,
    #[serde(default)]
    reached_per_joint: Vec<Reached>,
    #[serde(default)]
    verdict: StoredVerdict,
}

#[derive(Default, Deserialize)]
struct StoredVerdict {
    #[serde(default)]
    uses: HashMap<String, StoredUse>,
}

#[derive(Deserialize)]
struct StoredUse {
    applicable: Option<bool>,
    #[serde(default)]
    reasons: Vec<String>,
}

impl StoredVerdict {
    fn judged(mut self) -> Vec<JudgedUse> {
        let judged = |of: Use| {
            let StoredUse { applicable, reasons } = self.uses.remove(of.name())?;
            Some(JudgedUse { of, applicable, reasons })
        };
        Use::ALL.into_iter().filter_map(judged).collect()
    }
}

#[derive(Deserialize)]
struct StoredCutoff {
    cutoff_hz: f64,
}

#[derive(Deserialize)]
struct StoredFriction {
    friction: Vec<JointFriction>,
}

#[derive(Deserialize)]
struct StoredParameter {
    name: String,
    value: f64,
    standard_deviation: Option<f64>,
    classical_standard_deviation: Option<f64>,
    combined_standard_deviation: Option<f64>,
}

impl StoredEstimate {
    /// The residuals, larger by what their colour makes of standard deviations in the median.
    fn noise(&self) -> Vec<f64> {
        let ratio = |of: &StoredParameter| {
            let ratio = of.standard_deviation? / of.classical_standard_deviation?;
            (ratio.is_finite() && ratio > 0.0).then_some(ratio)
        };
        let mut ratios: Vec<f64> = self.parameters.iter().filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let colour = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
        self.rms_error_per_joint_nm.iter().map(|rms| colour * rms).collect()
    }
}

impl StoredModel {
    /// Reads a result file, or what `didim identify --json` printed. Returned with the cell that predicts by
    /// it: friction laws are those of the result, and so is the position filter, where the data chose it.
    ///
    /// # Errors
    /// [`ResultError`].
    pub fn read(file: &Path, cell: Cell) -> Result<(Self, Cell), ResultError> {
        let text = fs::read(file)
            .map_err(|source| ResultError::Read { file: file.to_path_buf(), source })?;
        Self::parse(&text, file, cell)
    }

    /// The same of its text; `file` is what errors call it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &[u8], file: &Path, mut cell: Cell) -> Result<(Self, Cell), ResultError> {
        let wrong = |source| ResultError::NoResult { file: file.to_path_buf(), source };
        let stored: Stored = serde_json::from_slice(text).map_err(wrong)?;
        let estimate = match stored.estimate {
            Some(estimate) => estimate,
            None => serde_json::from_value(stored.alone).map_err(wrong)?,
        };
        let robot = cell.robot.name();
        if estimate.robot != robot {
            return Err(ResultError::OtherRobot {
                file: file.to_path_buf(),
                found: estimate.robot,
                robot: robot.to_owned(),
            });
        }
        let noise = estimate.noise();
        let (reached, uses) = (estimate.reached_per_joint, estimate.verdict.judged());
        let combined = estimate.parameters.iter().map(|p| p.combined_standard_deviation).collect();
        let unfit = |what| ResultError::Parameters { file: file.to_path_buf(), what };
        match estimate.position_cutoff {
            Some(StoredCutoff { cutoff_hz }) => {
                cell.options.position_filter.cutoff_hz = cutoff_hz;
                let design = cell.options.position_filter.design(cell.sample_rate_hz());
                design.map_err(|error| {
                    unfit(format!("`position_cutoff` has {cutoff_hz} Hz: {error}"))
                })?;
            }
            None if cell.chooses_cutoff => {
                let what = "the cell leaves the cut-off of the position filter to the data, and the \
                            result does not say which it was";
                return Err(unfit(what.to_owned()));
            }
            None => {}
        }
        let chosen = estimate.friction.map(|of| of.friction);
        let laws = estimate.friction_laws.or(chosen);
        if let Some(friction) = laws.filter(|laws| laws != cell.robot.own_friction()) {
            let (found, joints) = (friction.len(), cell.robot.joints());
            if found != joints {
                return Err(unfit(format!(
                    "it has the friction of {found} joints, not of {joints}"
                )));
            }
            cell = cell.with_friction(friction).map_err(|error| unfit(error.to_string()))?;
        }
        let [parameters, kept] = [estimate.parameters, estimate.kept]
            .map(|of| of.into_iter().map(|p| (p.name, p.value)).collect::<Vec<_>>());
        check_names(&parameters, &kept, &cell).map_err(unfit)?;
        let (configuration, uncertainty) = (stored.configuration, estimate.model_uncertainty);
        // It goes into other files, as it is.
        if !estimate.method.is_empty()
            && let Err(unknown) = estimate.method.parse::<Method>()
        {
            return Err(unfit(unknown.to_string()));
        }
        let (method, covariance) = (estimate.method, estimate.covariance);
        let model = Self {
            parameters,
            kept,
            method,
            configuration,
            uncertainty,
            covariance,
            noise,
            reached,
            combined,
            uses,
        };
        Ok((model, cell))
    }

    /// What a baseline says of an arm; its parameters are those of the cell's robot.
    pub(super) fn of_baseline(baseline: &Baseline) -> Self {
        let Baseline { result, known, .. } = baseline;
        Self {
            parameters: result.parameters.iter().map(|p| (p.name.clone(), p.value)).collect(),
            kept: known.kept.iter().map(|kept| (kept.name.clone(), kept.value)).collect(),
            method: result.method.clone(),
            configuration: Some(result.configuration.clone()),
            uncertainty: known.model_uncertainty.clone(),
            covariance: known.covariance.clone(),
            noise: Vec::new(),
            reached: Vec::new(),
            combined: Vec::new(),
            uses: Vec::new(),
        }
    }

    /// Whether the result was identified with the configuration of a cell; nothing where it does not say.
    pub fn is_of(&self, cell: &Cell) -> Option<bool> {
        self.configuration.as_ref().map(|hash| *hash == cell.configuration_sha256)
    }

    /// Its parameters, and those that kept their nominal values.
    pub(super) fn named(&self) -> [Vec<(&str, f64)>; 2] {
        [&self.parameters, &self.kept]
            .map(|of| of.iter().map(|(name, value)| (name.as_str(), *value)).collect())
    }

    /// What it knows of the arm; `named` is [`Self::named`].
    pub(super) fn known<'s>(&'s self, named: &'s [Vec<(&'s str, f64)>; 2]) -> KnownArm<'s> {
        let [parameters, kept] = named;
        let uncertainty = self.uncertainty.as_ref();
        let model = KnownModel { parameters, kept, uncertainty };
        KnownArm { model, covariance: self.covariance.as_ref() }
    }

    /// Base parameters of the robot that the result does not have: they count as 0.
    pub fn missing<'a>(&self, cell: &'a Cell) -> Vec<&'a str> {
        let names = cell.base.names().iter().map(String::as_str);
        let all = || self.parameters.iter().chain(&self.kept);
        names.filter(|name| all().all(|(own, _)| own != name)).collect()
    }
}

/// Every parameter is one of the robot's, and stands there once.
fn check_names(
    parameters: &[(String, f64)],
    kept: &[(String, f64)],
    cell: &Cell,
) -> Result<(), String> {
    if parameters.is_empty() {
        return Err("it has no parameters".to_owned());
    }
    let all = || parameters.iter().chain(kept);
    for (index, (name, _)) in all().enumerate() {
        if cell.base.find(name).is_none() {
            return Err(format!("{} has no base parameter `{name}`", cell.robot.name()));
        }
        if all().take(index).any(|(other, _)| other == name) {
            return Err(format!("`{name}` stands there twice"));
        }
    }
    Ok(())
}
