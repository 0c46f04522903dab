//! Plan file of a study: methods, axes, and number of runs.

use std::path::{Path, PathBuf};

use didim_identification::identification::{Method, PositionFilter, Start};
use serde::Deserialize;

use super::PlanError;
use super::level::Level;
use didim::files::read_text;

/// Content of a plan file. Unknown keys are errors.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the study.
    pub name: String,
    /// Cell file for the identification; the path is relative to the plan.
    pub cell: PathBuf,
    /// Scenario to simulate: a shipped scenario's name, or a file relative to the plan.
    pub scenario: String,
    /// Maximum number of runs. A plan with more runs is refused, because the number of combinations
    /// of levels grows fast.
    #[serde(default = "Plan::default_max_runs")]
    pub max_runs: u64,
    /// Limit of the root mean square of the parameters' deviations from their true values
    /// \[standard deviations\]. A result above this limit counts as wrong. The expected value for a
    /// correct model is 1; with 28 parameters its standard deviation is 0.13.
    #[serde(default = "Plan::default_largest_rms_deviation")]
    pub largest_rms_deviation: f64,
    /// The compared methods.
    pub method: Vec<MethodPlan>,
    /// Varied quantities. Every level of each axis is combined with every level of all other axes.
    #[serde(default)]
    pub axis: Vec<AxisPlan>,
}

/// Table `[[method]]` of the plan.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodPlan {
    /// The method.
    pub method: Method,
    /// Name in tables; the method's own name by default.
    #[serde(default)]
    pub name: Option<String>,
    /// Number of runs in each cell of the grid; the seeds start at 1.
    pub seeds: u64,
    /// Choice of the parameters for the first simulation; the cell's setting by default.
    #[serde(default)]
    pub start: Option<Start>,
    /// Relative change of each nominal parameter for the nominal start. The seed determines the
    /// sign of each change.
    #[serde(default)]
    pub nominal_deviation: Option<f64>,
    /// Number of DIDIM iterations at the start of CLIE and CLOE; the cell's setting by default.
    #[serde(default)]
    pub didim_steps: Option<u32>,
    /// True if the rows of the regression pass the decimation filter; the cell's setting by
    /// default.
    #[serde(default)]
    pub decimated: Option<bool>,
    /// Filter of the positions; the cell's setting by default.
    #[serde(default)]
    pub position_filter: Option<PositionFilter>,
}

/// Table `[[axis]]` of the plan.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisPlan {
    /// Name of the varied quantity in tables.
    pub name: String,
    /// Levels, in the order of the tables.
    pub level: Vec<Level>,
}

impl Plan {
    fn default_max_runs() -> u64 {
        100_000
    }

    fn default_largest_rms_deviation() -> f64 {
        1.5
    }

    /// Reads a plan and checks it without other files.
    ///
    /// # Errors
    /// [`PlanError`] names file and key.
    pub fn read(path: &Path) -> Result<Self, PlanError> {
        let text = read_text(path)
            .map_err(|source| PlanError::Read { file: path.to_path_buf(), source })?;
        let plan: Self = toml::from_str(&text).map_err(|source| PlanError::Format {
            file: path.to_path_buf(),
            source: Box::new(source),
        })?;
        plan.check().map_err(|(key, problem)| PlanError::value(path, key, problem))?;
        Ok(plan)
    }

    /// Returns the number of grid cells: the product of the numbers of levels.
    pub fn cell_count(&self) -> u64 {
        self.axis.iter().fold(1, |cells, axis| cells.saturating_mul(axis.level.len() as u64))
    }

    /// Returns the number of runs of all methods.
    pub fn run_count(&self) -> u64 {
        let seeds = self.method.iter().fold(0, |sum: u64, m| sum.saturating_add(m.seeds));
        self.cell_count().saturating_mul(seeds)
    }

    /// Returns the plan as text, without the number of runs and without the limit for wrong
    /// results. Two plans with the same text have the same runs, so a study can be continued with
    /// more seeds.
    pub(super) fn identity(&self) -> String {
        let mut plan = self.clone();
        (plan.max_runs, plan.largest_rms_deviation) = (0, 0.0);
        plan.method.iter_mut().for_each(|method| method.seeds = 0);
        format!("{plan:?}")
    }

    /// Checks the plan. The error is the key of an invalid value and its problem.
    fn check(&self) -> Result<(), (String, String)> {
        let wrong = |key: &str, problem: &str| Err((key.to_owned(), problem.to_owned()));
        if self.method.is_empty() {
            return wrong("method", "is empty; list at least one [[method]]");
        }
        let limit = self.largest_rms_deviation;
        if !(limit.is_finite() && limit > 0.0) {
            return wrong("largest_rms_deviation", "has to be finite and positive");
        }
        check_unique("method.name", self.method.iter().map(MethodPlan::name))?;
        check_unique("axis.name", self.axis.iter().map(|axis| axis.name.as_str()))?;
        self.method.iter().try_for_each(MethodPlan::check)?;
        for axis in &self.axis {
            let key = format!("axis {:?}", axis.name);
            if axis.level.is_empty() {
                return wrong(&key, "has no level; list at least one [[axis.level]]");
            }
            check_unique(&key, axis.level.iter().map(|level| level.name.as_str()))?;
        }
        let (runs, most) = (self.run_count(), self.max_runs);
        if runs > most {
            let (cells, problem) =
                (self.cell_count(), "fewer levels or seeds, or a larger max_runs");
            let problem = format!(
                "{runs} runs in {cells} cells of the grid, and {most} are the most; choose \
                {problem}"
            );
            return Err(("max_runs".to_owned(), problem));
        }
        Ok(())
    }
}

impl MethodPlan {
    /// Returns the name in tables.
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or(self.method.name())
    }

    fn check(&self) -> Result<(), (String, String)> {
        let wrong = |key: &str, problem: &str| {
            Err((format!("method {:?}, {key}", self.name()), problem.to_owned()))
        };
        if self.seeds == 0 {
            return wrong("seeds", "has to be at least 1");
        }
        if !self.method.simulates() {
            let set = [("start", self.start.is_some()), ("decimated", self.decimated.is_some())];
            if let Some((key, _)) = set.into_iter().find(|(_, set)| *set) {
                return wrong(
                    key,
                    "idim-ls simulates nothing and has no such option; leave it out",
                );
            }
        }
        if self.didim_steps.is_some() && !self.method.uses_sensitivities() {
            return wrong("didim_steps", "goes with clie and cloe; leave it out");
        }
        match self.nominal_deviation {
            Some(_) if self.start != Some(Start::Nominal) => {
                wrong("nominal_deviation", "goes with start = \"nominal\"")
            }
            Some(part) if !(part.is_finite() && part > 0.0 && part < 1.0) => {
                wrong("nominal_deviation", "has to be above 0 and below 1")
            }
            _ => Ok(()),
        }
    }
}

/// Checks that names are unique and not empty, because they distinguish entries and appear in
/// tables.
fn check_unique<'a>(
    key: &str,
    names: impl Iterator<Item = &'a str>,
) -> Result<(), (String, String)> {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if name.trim().is_empty() {
            return Err((key.to_owned(), "a name is empty; tables need one".to_owned()));
        }
        if seen.contains(&name) {
            return Err((key.to_owned(), format!("{name:?} is there twice; name them apart")));
        }
        seen.push(name);
    }
    Ok(())
}
