//! Runs all methods on the available cores.

use std::fmt;
use std::time::Instant;

use didim_identification::identification::Method;
use didim_identification::parallel::map;

use super::agreement::Agreement;
use super::held_out::HeldOut;
use super::input::ComparisonInput;
use super::method_comparison::{Comparison, SCHEMA, TrueParameter};
use super::result::MethodResult;
use super::trial::{Framework, Trial, title};
use didim::analysis::identify::identify_measurement;
use didim::threads::Threads;

/// Maximum number of entries of an observation matrix without decimation. Such a matrix takes 128
/// MB, and a method holds several of them at once. The matrix of the paper's experiment has a third
/// of these entries.
const MAX_ENTRIES: usize = 1 << 24;

/// Maximum number of tasks that run at once, for any number of cores, because each task may need a
/// gigabyte of memory.
const MAX_PARALLEL_TASKS: usize = 4;

/// One task of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Identifies with a method.
    Identify(Trial),
    /// Predicts held-out samples with a method.
    HoldOut(Method),
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identify(trial) => trial.fmt(f),
            Self::HoldOut(method) => write!(f, "{}, held out", title(*method)),
        }
    }
}

/// Progress of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// A task begins.
    Begun(Task),
    /// A task has ended, with or without a result.
    Ended(Task),
}

/// Returns the tasks of a comparison, in order. With fewer than two blocks there are no held-out
/// tasks.
pub fn list_tasks(trials: &[Trial], blocks: usize) -> Vec<Task> {
    let held_out = trials
        .iter()
        .filter(|trial| blocks > 1 && trial.framework == Framework::Decimated)
        .map(|trial| Task::HoldOut(trial.method));
    trials.iter().copied().map(Task::Identify).chain(held_out).collect()
}

/// Identifies with every trial, then cross-validates each method: the method identifies without
/// each of `blocks` blocks of the samples and predicts that block. A failed method gives a result
/// with the cause of the failure and without an estimate.
///
/// The tasks run on the available cores. The number of cores does not affect the results.
/// `progress` is called from the threads of the tasks.
pub fn compare(
    input: ComparisonInput<'_>,
    trials: &[Trial],
    blocks: usize,
    progress: &(dyn Fn(Progress) + Sync),
) -> Comparison {
    // The last tasks start first, because they take longest: they have many identifications, or one
    // without decimation.
    let tasks: Vec<Task> = list_tasks(trials, blocks).into_iter().rev().collect();
    let done = map(&Threads::at_most(MAX_PARALLEL_TASKS), tasks.len(), |at| {
        let task = tasks[at];
        progress(Progress::Begun(task));
        let result = match task {
            Task::Identify(trial) => TaskResult::Identified(Box::new(run(input, trial))),
            Task::HoldOut(method) => TaskResult::HeldOut(HeldOut::new(input, method, blocks)),
        };
        progress(Progress::Ended(task));
        result
    });
    let (mut methods, mut held_out) = (Vec::new(), Vec::new());
    for result in done.into_iter().rev() {
        match result {
            TaskResult::Identified(result) => methods.push(*result),
            TaskResult::HeldOut(errors) => held_out.push(errors),
        }
    }
    let unit = |name: &str| {
        let estimates = methods.iter().filter_map(|of: &MethodResult| of.estimate.as_ref());
        let mut parameters = estimates.flat_map(|estimate| &estimate.parameters);
        parameters.find(|found| found.name == name).map_or("", |found| found.unit)
    };
    let named = |(name, value): &(String, f64)| TrueParameter {
        name: name.clone(),
        unit: unit(name),
        value: *value,
    };
    let truth = input.truth.map(|truth| truth.iter().map(named).collect());
    Comparison {
        schema: SCHEMA,
        robot: input.cell.robot.name().to_owned(),
        agreement: Agreement::of_pairs(&methods),
        methods,
        held_out,
        truth,
    }
}

enum TaskResult {
    Identified(Box<MethodResult>),
    HeldOut(HeldOut),
}

fn run(input: ComparisonInput<'_>, trial: Trial) -> MethodResult {
    let start = Instant::now();
    let identified = too_large(input, trial).map_or_else(
        || {
            let cell = input.cell_in(trial.framework);
            let counted = input.counted_samples.clone();
            identify_measurement(&cell, trial.method, input.measurement, counted)
                .map_err(|error| (error.to_string(), error.failure()))
        },
        |refused| Err((refused, None)),
    );
    let elapsed_ms = start.elapsed().as_secs_f64() * 1e3;
    let (identified, failure, failure_kind) = match identified {
        Ok(identification) => (Some(identification), None, None),
        Err((failure, kind)) => (None, Some(failure), kind),
    };
    let (estimate, fit) = identified.map(|of| (of.estimate, of.fit)).unzip();
    MethodResult { trial, estimate, failure, failure_kind, elapsed_ms, fit }
}

/// Returns a reason to refuse a trial if its observation matrix would exceed `MAX_ENTRIES`.
fn too_large(input: ComparisonInput<'_>, trial: Trial) -> Option<String> {
    let cell = input.cell;
    let parameters = cell.options.parameters.as_ref().map_or(cell.base.names().len(), Vec::len);
    let samples = input.counted_samples.len();
    let most = MAX_ENTRIES / (cell.robot.joints() * parameters).max(1);
    (trial.framework == Framework::Strict && samples > most).then(|| {
        format!(
            "without decimation each of {samples} samples is a row for each joint, and at most \
             {most} are possible; choose fewer with --from and --to"
        )
    })
}
