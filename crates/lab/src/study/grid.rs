//! Cells of the grid: every level of each axis, combined with every level of all other axes.

use std::path::Path;

use didim_dynamics::trajectory::RandomMoves;
use didim_sim::Scenario;

use super::PlanError;
use super::level::Level;
use super::plan::Plan;
use super::simulated::check_fit;
use super::torque::ReferenceTorque;
use didim::cell::Cell;
use didim::files::read_text;
use didim::text::sha256;

/// Name of a scenario, and the random motion that replaces the scenario's own, if there is one.
type Motion = (String, Option<RandomMoves>);

/// Cell of the grid: a simulated arm, and the cell file's content for its identification.
#[derive(Debug)]
pub struct GridCell {
    /// Index of the level on each axis, in the order of the plan.
    pub levels: Vec<usize>,
    /// Scenario with the simulated arm.
    pub scenario: Scenario,
    /// Nominal robot, options and controller that the identification assumes.
    pub cell: Cell,
    /// Index of the arm's motion in [`Grid::reference_torques`].
    pub motion: usize,
}

/// Plan that was checked against its arm, with all cells of the grid.
#[derive(Debug)]
pub struct Grid {
    /// Plan of the study.
    pub plan: Plan,
    /// All cells of the grid; the last axis varies fastest.
    pub cells: Vec<GridCell>,
    /// Reference torque of each distinct motion.
    pub reference_torques: Vec<ReferenceTorque>,
    /// SHA-256 of the files of the plan's `cell`.
    pub cell_sha256: String,
    /// SHA-256 of the simulated scenarios and of the controllers that the identification assumes.
    pub scenario_sha256: String,
}

impl Grid {
    /// Reads a plan and all files that it names, and builds its arms.
    ///
    /// # Errors
    /// [`PlanError`] names file and key.
    pub fn read(path: &Path) -> Result<Self, PlanError> {
        let plan = Plan::read(path)?;
        check_keys(&plan).map_err(|(key, problem)| PlanError::value(path, key, problem))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let cell = Cell::read_decided(&folder.join(&plan.cell)).map_err(|source| {
            PlanError::Cell { file: path.to_path_buf(), source: Box::new(source) }
        })?;
        if let Some(method) = plan.method.iter().find(|m| m.method.simulates())
            && cell.options.controller.is_none()
        {
            let problem = format!(
                "has no [controller], and {} simulates the closed loop; describe it, or study \
                 idim-ls alone",
                method.method
            );
            return Err(PlanError::value(path, "cell", problem));
        }
        let mut grid = Self {
            cell_sha256: cell.configuration_sha256.clone(),
            scenario_sha256: String::new(),
            cells: Vec::new(),
            reference_torques: Vec::new(),
            plan,
        };
        let mut moving: Vec<(Motion, Scenario)> = Vec::new();
        let mut described = String::new();
        for levels in level_combinations(&grid.plan) {
            let level = combine_levels(&grid.plan, &levels);
            let key = key_of(&grid.plan, &levels);
            let wrong = |problem: String| PlanError::value(path, key.clone(), problem);
            let name = level.scenario.as_ref().unwrap_or(&grid.plan.scenario);
            let motion = (name.clone(), level.random_moves.clone());
            let index = match moving.iter().position(|(other, _)| *other == motion) {
                Some(index) => index,
                None => {
                    let scenario = read_scenario(name, folder, &cell).map_err(&wrong)?;
                    let scenario =
                        level.along_motion(scenario).map_err(|e| wrong(e.to_string()))?;
                    let factor = cell.options.decimation_filter.factor;
                    grid.reference_torques
                        .push(ReferenceTorque::new(&scenario, &cell.base, factor));
                    moving.push((motion, scenario));
                    moving.len() - 1
                }
            };
            let scenario = moving[index].1.clone();
            let scenario =
                level.simulated_arm(scenario).map_err(|error| wrong(error.to_string()))?;
            let cell =
                level.described_cell(cell.clone()).map_err(|error| wrong(error.to_string()))?;
            described += &format!("{scenario:?}{:?}", cell.options.controller);
            grid.cells.push(GridCell { levels, scenario, cell, motion: index });
        }
        grid.scenario_sha256 = sha256(&[&described]);
        Ok(grid)
    }

    /// Returns the names of the levels of a grid cell.
    pub fn level_names(&self, cell: &GridCell) -> Vec<String> {
        names(&self.plan, &cell.levels).map(|(_, level)| level.to_owned()).collect()
    }
}

/// Returns the axes and levels of a grid cell as text for an error message.
fn key_of(plan: &Plan, levels: &[usize]) -> String {
    let names = names(plan, levels).map(|(axis, level)| format!("{axis} = {level}"));
    let names: Vec<String> = names.collect();
    if names.is_empty() { "scenario".to_owned() } else { names.join(", ") }
}

fn names<'a>(plan: &'a Plan, levels: &'a [usize]) -> impl Iterator<Item = (&'a str, &'a str)> {
    let axes = plan.axis.iter().zip(levels);
    axes.map(|(axis, level)| (axis.name.as_str(), axis.level[*level].name.as_str()))
}

/// Returns every combination of levels; the last axis varies fastest.
fn level_combinations(plan: &Plan) -> Vec<Vec<usize>> {
    plan.axis.iter().fold(vec![Vec::new()], |so_far, axis| {
        let extended = |levels: &Vec<usize>, level| [levels.as_slice(), &[level]].concat();
        so_far
            .iter()
            .flat_map(|levels| (0..axis.level.len()).map(|l| extended(levels, l)))
            .collect()
    })
}

fn combine_levels(plan: &Plan, levels: &[usize]) -> Level {
    let levels = plan.axis.iter().zip(levels).map(|(axis, level)| &axis.level[*level]);
    levels.fold(Level::default(), Level::combine)
}

/// Checks that only one axis sets each key. If two axes set the same key, it is undefined which
/// value applies.
fn check_keys(plan: &Plan) -> Result<(), (String, String)> {
    let mut owners: Vec<(&str, &str)> = Vec::new();
    for axis in &plan.axis {
        for level in &axis.level {
            let key = format!("axis {:?}, level {:?}", axis.name, level.name);
            if let Some((factor, value)) = level.wrong_factor() {
                return Err((format!("{key}, {factor}"), format!("{value} is not above 0")));
            }
            for own in level.keys_set() {
                match owners.iter().find(|(owned, _)| *owned == own) {
                    Some((_, owner)) if *owner != axis.name => {
                        let problem = format!(
                            "axis {owner:?} sets it too, and levels of both meet; set it in one \
                            axis"
                        );
                        return Err((format!("{key}, {own}"), problem));
                    }
                    Some(_) => {}
                    None => owners.push((own, &axis.name)),
                }
            }
        }
    }
    Ok(())
}

/// Reads a scenario for the cell's robot: a shipped one by its name, or a file relative to the
/// plan.
fn read_scenario(name: &str, folder: &Path, cell: &Cell) -> Result<Scenario, String> {
    let scenario = match didim_sim::shipped(name) {
        Some(scenario) => scenario,
        None => {
            let file = folder.join(name);
            let text = read_text(&file).map_err(|error| {
                format!(
                    "scenario {}: {error}; name a file relative to the plan, or one of the shipped \
                    {}",
                    file.display(),
                    didim_sim::SHIPPED_SCENARIOS.join(", ")
                )
            })?;
            Scenario::from_toml(&text, cell.robot_as_described.clone())
        }
    };
    let scenario = scenario.map_err(|error| format!("scenario {name}: {error}"))?;
    check_fit(&scenario, cell).map_err(|error| format!("scenario {name}: {error}"))?;
    Ok(scenario)
}
