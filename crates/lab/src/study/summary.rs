//! Results of the runs in each cell of the grid, by method.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;

use super::grid::Grid;
use super::run::{Outcome, Run, TruthComparison};
use super::store::Header;

/// Results of a study. They do not depend on the order of the runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Header that identifies the study.
    #[serde(flatten)]
    pub header: Header,
    /// Number of existing runs.
    pub runs: usize,
    /// Number of runs in the plan.
    pub planned: u64,
    /// Limit of the root mean square of z \[standard deviations\]. A result above this limit counts
    /// as wrong.
    pub largest_rms_deviation: f64,
    /// Names of the axes.
    pub axes: Vec<String>,
    /// Summaries by cell of the grid and method, in the order of the plan.
    pub cells: Vec<CellSummary>,
}

/// Summary of the runs of one method in one cell of the grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellSummary {
    /// Name of the level on each axis.
    pub levels: Vec<String>,
    /// Name of the method in the plan.
    pub method: String,
    /// Number of runs.
    pub runs: usize,
    /// Number of runs with a result.
    pub results: usize,
    /// Number of runs without a failure. A local minimum is a failure, although it gives a result.
    pub converged: usize,
    /// Number of results that the verdict calls applicable.
    pub applicable: usize,
    /// Number of wrong results.
    pub wrong: usize,
    /// Number of wrong results that the verdict calls applicable.
    pub wrongly_accepted: usize,
    /// Number of wrong results that the verdict refuses.
    pub rightly_refused: usize,
    /// Number of results that are not wrong but that the verdict refuses.
    pub wrongly_refused: usize,
    /// Number of runs that did not converge, by cause.
    pub failures: BTreeMap<String, usize>,
    /// First reason of the verdict on the first refused result, in the order of the seeds.
    pub first_reason: Option<String>,
    /// Figures of the results; `None` if there is no result.
    pub figures: Option<Figures>,
}

/// Figures over the results of one method in one cell of the grid. [`TruthComparison`] defines z.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Median of the torque deviation ‖X(θ̂ − θ)‖ / ‖Xθ‖.
    pub torque_deviation_median: f64,
    /// Torque deviation that 95 % of the results do not exceed.
    pub torque_deviation_95: f64,
    /// Root mean square of z over all parameters and results.
    pub rms_deviation: f64,
    /// Fraction of the parameters with |z| ≤ 2, mean over the results.
    pub within_2: f64,
    /// Fraction of the parameters with |z| ≤ 3, mean over the results.
    pub within_3: f64,
    /// Name of the parameter with the largest |z| of all results.
    pub largest_deviation_of: String,
    /// Deviation z of this parameter.
    pub largest_deviation: f64,
    /// Root mean square of the relative errors of the parameters that contribute at least 5 % of
    /// the torque.
    pub rms_relative_error: f64,
    /// Largest magnitude of these relative errors.
    pub largest_relative_error: f64,
    /// Median of ‖y − Xθ‖ / ‖y‖.
    pub relative_error_median: f64,
    /// Mean number of closed-loop simulations per result.
    pub simulations: f64,
}

impl Summary {
    /// Computes the results of a plan from its runs. Runs that are not in the plan do not count.
    pub fn new(grid: &Grid, runs: &[Run]) -> Self {
        let mut by_cell: HashMap<(&[String], &str), Vec<&Run>> = HashMap::new();
        for run in runs {
            by_cell.entry((run.levels.as_slice(), run.method.as_str())).or_default().push(run);
        }
        let limit = grid.plan.largest_rms_deviation;
        let mut cells = Vec::new();
        for cell in &grid.cells {
            let levels = grid.level_names(cell);
            for method in &grid.plan.method {
                let mut own_runs =
                    by_cell.get(&(levels.as_slice(), method.name())).cloned().unwrap_or_default();
                own_runs.retain(|run| (1..=method.seeds).contains(&run.seed));
                // The rounding error of a sum depends on the order of its terms.
                own_runs.sort_by_key(|run| run.seed);
                cells.push(CellSummary::new(levels.clone(), method.name(), limit, &own_runs));
            }
        }
        Self {
            header: Header::from_grid(grid),
            runs: cells.iter().map(|cell| cell.runs).sum(),
            planned: grid.plan.run_count(),
            largest_rms_deviation: limit,
            axes: grid.plan.axis.iter().map(|axis| axis.name.clone()).collect(),
            cells,
        }
    }
}

impl CellSummary {
    fn new(levels: Vec<String>, method: &str, limit: f64, runs: &[&Run]) -> Self {
        let mut failures = BTreeMap::new();
        let mut results: Vec<&TruthComparison> = Vec::new();
        for run in runs {
            match &run.outcome {
                Outcome::Result(judged) => results.push(judged),
                Outcome::Failed { .. } => {}
            }
            if let Some(failure) = run.outcome.failure() {
                *failures.entry(failure.to_owned()).or_insert(0) += 1;
            }
        }
        let count = |of: &dyn Fn(bool, bool) -> bool| {
            results.iter().filter(|r| of(r.rms_deviation > limit, r.applicable)).count()
        };
        Self {
            levels,
            method: method.to_owned(),
            runs: runs.len(),
            results: results.len(),
            converged: runs.len() - failures.values().sum::<usize>(),
            applicable: count(&|_, applicable| applicable),
            wrong: count(&|wrong, _| wrong),
            wrongly_accepted: count(&|wrong, applicable| wrong && applicable),
            rightly_refused: count(&|wrong, applicable| wrong && !applicable),
            wrongly_refused: count(&|wrong, applicable| !wrong && !applicable),
            failures,
            first_reason: results.iter().find_map(|result| result.first_reason.clone()),
            figures: Figures::new(&results),
        }
    }

    /// Returns a number of runs as a share of all runs \[%\]; `None` if there are no runs.
    #[expect(clippy::cast_precision_loss, reason = "runs are far fewer than 2^52")]
    pub fn percent_of_runs(&self, count: usize) -> Option<f64> {
        (self.runs > 0).then(|| 100.0 * count as f64 / self.runs as f64)
    }
}

impl Figures {
    fn new(results: &[&TruthComparison]) -> Option<Self> {
        let by_size = |a: &&&TruthComparison, b: &&&TruthComparison| {
            a.largest_deviation.abs().total_cmp(&b.largest_deviation.abs())
        };
        let farthest = results.iter().max_by(by_size)?;
        #[expect(clippy::cast_precision_loss, reason = "runs are far fewer than 2^52")]
        let count = results.len() as f64;
        let mean = |of: &dyn Fn(&TruthComparison) -> f64| {
            results.iter().map(|r| of(r)).sum::<f64>() / count
        };
        let sorted = |of: &dyn Fn(&TruthComparison) -> f64| {
            let mut values: Vec<f64> = results.iter().map(|r| of(r)).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let torque = sorted(&|result| result.torque_deviation);
        let largest =
            |largest: f64, result: &&TruthComparison| largest.max(result.largest_relative_error);
        Some(Self {
            torque_deviation_median: median(&torque),
            torque_deviation_95: percentile_95(&torque),
            rms_deviation: mean(&|result| result.rms_deviation.powi(2)).sqrt(),
            within_2: mean(&|result| result.within_2),
            within_3: mean(&|result| result.within_3),
            largest_deviation_of: farthest.largest_deviation_of.clone(),
            largest_deviation: farthest.largest_deviation,
            rms_relative_error: mean(&|result| result.rms_relative_error.powi(2)).sqrt(),
            largest_relative_error: results.iter().fold(0.0, largest),
            relative_error_median: median(&sorted(&|result| result.relative_error)),
            simulations: mean(&|result| f64::from(result.simulations)),
        })
    }
}

/// Returns the median of `sorted`, which needs at least one value and ascending order.
fn median(sorted: &[f64]) -> f64 {
    let half = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[half] } else { 0.5 * (sorted[half - 1] + sorted[half]) }
}

/// Returns the smallest value of `sorted` that at least 95 % of its values do not exceed. `sorted`
/// needs at least one value and ascending order.
fn percentile_95(sorted: &[f64]) -> f64 {
    sorted[(95 * sorted.len()).div_ceil(100) - 1]
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that are picked, or exact in binary")]
mod tests {
    use super::*;

    fn run(seed: u64, rms_deviation: f64, applicable: bool) -> Run {
        let judged = TruthComparison {
            applicable,
            failure: None,
            first_reason: (!applicable).then(|| format!("reason {seed}")),
            simulations: 4,
            iterations: 5,
            relative_error: 0.01,
            rms_deviation,
            within_2: 0.5,
            within_3: 1.0,
            largest_deviation_of: format!("p{seed}"),
            largest_deviation: -rms_deviation,
            rms_relative_error: 0.1,
            largest_relative_error: 0.2,
            #[allow(clippy::cast_precision_loss, reason = "small")]
            torque_deviation: seed as f64,
        };
        let outcome = Outcome::Result(Box::new(judged));
        Run { levels: vec!["low".to_owned()], method: "didim".to_owned(), seed, outcome }
    }

    #[test]
    fn results_are_wrong_or_right_and_accepted_or_refused() {
        let mut runs = vec![run(1, 1.0, true), run(2, 1.0, false), run(3, 3.0, true)];
        runs.extend([run(4, 2.0, false), run(5, 2.0, false)]);
        let failed = Outcome::Failed { cause: "diverged".to_owned(), message: String::new() };
        runs.push(Run { outcome: failed, ..run(6, 0.0, false) });
        // A local minimum is a result, but not the required one.
        let mut minimum = run(7, 9.0, false);
        if let Outcome::Result(judged) = &mut minimum.outcome {
            judged.failure = Some("local-minimum".to_owned());
        }
        runs.push(minimum);
        let runs: Vec<&Run> = runs.iter().collect();
        let cell = CellSummary::new(vec![], "didim", 1.5, &runs);
        let counts = (cell.runs, cell.results, cell.converged, cell.applicable, cell.wrong);
        assert_eq!(counts, (7, 6, 5, 2, 4));
        let verdicts = (cell.wrongly_accepted, cell.rightly_refused, cell.wrongly_refused);
        assert_eq!(verdicts, (1, 3, 1));
        let causes = ["diverged", "local-minimum"].map(|cause| (cause.to_owned(), 1));
        assert_eq!(cell.failures, BTreeMap::from(causes));
        assert_eq!(cell.first_reason.as_deref(), Some("reason 2"));
        assert_eq!(cell.percent_of_runs(7), Some(100.0));
        let figures = cell.figures.unwrap();
        assert_eq!((figures.torque_deviation_median, figures.torque_deviation_95), (3.5, 7.0));
        assert_eq!(figures.rms_deviation, (100.0_f64 / 6.0).sqrt());
        assert_eq!(figures.largest_deviation_of, "p7");
    }

    #[test]
    fn no_run_and_no_result_have_no_figures() {
        let cell = CellSummary::new(vec![], "didim", 1.5, &[]);
        assert_eq!((cell.percent_of_runs(0), cell.figures), (None, None));
    }

    #[test]
    fn percentiles_are_values_that_were_met() {
        let values: Vec<f64> = (1..=20).map(f64::from).collect();
        assert_eq!((median(&values), percentile_95(&values)), (10.5, 19.0));
        assert_eq!((median(&values[..1]), percentile_95(&values[..1])), (1.0, 1.0));
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(percentile_95(&hundred), 95.0);
    }
}
