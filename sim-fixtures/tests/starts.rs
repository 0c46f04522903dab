//! How often CLIE and CLOE find their way, from where, on which motion.

use std::time::{Duration, Instant};

use crate::common::experiment::{MOTIONS, experiment, loop_options, on_motion, with_nominal_error};
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, writing};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_identification::identification::{self, Experiment, IdentificationError, Method, Start};
use didim_sim::Scenario;

/// Where an identification begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    /// 15 % off the truth, more or less for every parameter, by a seed.
    NominalError(u32),
    IdimLs,
    /// The paper's start, after so many steps of DIDIM.
    Paper(u32),
}

impl From {
    fn description(self) -> String {
        match self {
            Self::NominalError(_) => "15 % off the truth".to_owned(),
            Self::IdimLs => "IDIM-LS".to_owned(),
            Self::Paper(0) => "the paper's".to_owned(),
            Self::Paper(1) => "the paper's, 1 step of DIDIM".to_owned(),
            Self::Paper(steps) => format!("the paper's, {steps} steps of DIDIM"),
        }
    }
}

/// What came of a start.
struct Outcome {
    /// Simulations and linear steps, or the cause of failure.
    found: Result<(u32, u32), &'static str>,
    elapsed: Duration,
}

fn identify(scenario: &Scenario, experiment: &Experiment, method: &str, from: From) -> Outcome {
    let robot = match from {
        // A bit pattern without period for every seed (Weyl's sequence).
        From::NominalError(seed) => with_nominal_error(
            scenario,
            0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(2 * u64::from(seed) + 1),
        ),
        _ => scenario.robot().clone(),
    };
    let (start, didim_steps) = match from {
        From::NominalError(_) => (Start::Nominal, 0),
        From::IdimLs => (Start::IdimLs, 0),
        From::Paper(steps) => (Start::UnitDriveInertias, steps),
    };
    let mut options = loop_options(scenario, POSITION_FILTER_HZ, start);
    options.simulation.didim_steps = didim_steps;
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let begin = Instant::now();
    let method = if method == "CLIE" { Method::Clie } else { Method::Cloe };
    let outcome = match identification::identify(method, &robot, &base, experiment, &options) {
        Ok(found) => {
            let estimate = found.estimate;
            let beyond = estimate.parameters.iter().any(|p| {
                (p.value - scenario.truth_of(&p.name).unwrap()).abs() > 6.0 * p.standard_deviation
            });
            match estimate.verdict.failure {
                Some(failure) => Err(failure.name()),
                None if beyond => Err("wrong"),
                None => Ok((estimate.simulations, estimate.iterations)),
            }
        }
        Err(error) => Err(cause(&error)),
    };
    Outcome { found: outcome, elapsed: begin.elapsed() }
}

fn cause(error: &IdentificationError) -> &'static str {
    error.failure().map_or("refused", |failure| failure.name())
}

/// The paper's 50 Hz distorts the reversals of friction; levels and start of IDIM-LS would be
/// better than they are.
const POSITION_FILTER_HZ: f64 = 200.0;

/// No failure may take longer than some thirty simulations with sensitivities.
const LONGEST_FAILURE: Duration = Duration::from_secs(60);

/// Scenario and experiment of every motion.
fn experiments() -> [(Scenario, Experiment); MOTIONS.len()] {
    MOTIONS.map(|motion| {
        let scenario = on_motion(motion);
        let experiment = experiment(&scenario);
        (scenario, experiment)
    })
}

/// A start of a method on one of the motions.
type Run = (From, &'static str, usize);

/// Every start by both methods, on the motions that are its own.
fn runs(starts: &[From], motions: impl Fn(From) -> Vec<usize>) -> Vec<Run> {
    starts
        .iter()
        .flat_map(|&from: &From| {
            let motions = motions(from);
            let of_method =
                move |method| motions.clone().into_iter().map(move |m| (from, method, m));
            ["CLIE", "CLOE"].into_iter().flat_map(of_method)
        })
        .collect()
}

fn outcomes(runs: &[Run]) -> Vec<Outcome> {
    let experiments = experiments();
    in_parallel(runs.len(), |run| {
        let (from, method, motion) = runs[run];
        let (scenario, experiment) = &experiments[motion];
        identify(scenario, experiment, method, from)
    })
}

/// The table of these starts.
fn table(starts: &[From], runs: &[Run], outcomes: &[Outcome]) -> Table {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut descriptions: Vec<String> = starts.iter().map(|from| from.description()).collect();
    descriptions.dedup();
    for description in &descriptions {
        for method in ["CLIE", "CLOE"] {
            let of_row = runs
                .iter()
                .zip(outcomes)
                .filter(|((from, own, _), _)| from.description() == *description && *own == method);
            let outcomes: Vec<&Outcome> = of_row.map(|(_, outcome)| outcome).collect();
            rows.push(row(description, method, &outcomes));
        }
    }
    let columns = ["start", "method", "runs", "converged", "iterations", "simulations", "failures"];
    let columns = columns.map(Column::exact).into();
    Table { document: "paper.md", name: "starts", columns, rows }
}

/// From near the truth, from IDIM-LS and from the paper's start after two steps of DIDIM both
/// methods find the truth on the shipped motion; from IDIM-LS on every motion, as the table has it.
///
/// `DIDIM_WRITE_DOCS=1 cargo test -p didim-sim starts` tries every start and writes the table, in
/// minutes.
#[test]
fn usual_starts_lead_to_the_truth() {
    let starts = [From::NominalError(1), From::NominalError(2), From::IdimLs, From::Paper(2)];
    let runs = runs(&starts, |from| match from {
        From::IdimLs => (0..MOTIONS.len()).collect(),
        _ => vec![0],
    });
    let outcomes = outcomes(&runs);
    for (run, outcome) in runs.iter().zip(&outcomes) {
        let outcome_found = outcome.found;
        assert!(
            outcome_found.is_ok_and(|(simulations, _)| simulations <= 9),
            "{run:?}: {outcome_found:?}"
        );
    }
    if writing() {
        write_every_start();
    } else {
        table(&[From::IdimLs], &runs, &outcomes).check_part(2);
    }
}

fn write_every_start() {
    let all_starts = (0..20).map(From::NominalError);
    let of_the_paper = [From::Paper(0), From::Paper(1), From::Paper(2)];
    let starts: Vec<_> = all_starts.chain([From::IdimLs]).chain(of_the_paper).collect();
    let runs = runs(&starts, |from| match from {
        // The seeds take turns on the motions.
        From::NominalError(seed) => vec![seed as usize % MOTIONS.len()],
        _ => (0..MOTIONS.len()).collect(),
    });
    let outcomes = outcomes(&runs);
    let failures = outcomes.iter().filter(|outcome| outcome.found.is_err());
    let longest = failures.map(|outcome| outcome.elapsed).max().unwrap_or_default();
    println!("longest failure: {longest:.1?}");
    assert!(longest < LONGEST_FAILURE);
    table(&starts, &runs, &outcomes).check();
}

fn row(start: &str, method: &str, outcomes: &[&Outcome]) -> Vec<String> {
    let converged: Vec<(u32, u32)> = outcomes.iter().filter_map(|run| run.found.ok()).collect();
    fn span(number: fn(&(u32, u32)) -> u32, converged: &[(u32, u32)]) -> String {
        let (least, most) =
            (converged.iter().map(number).min(), converged.iter().map(number).max());
        match (least, most) {
            (Some(least), Some(most)) if least == most => least.to_string(),
            (Some(least), Some(most)) => format!("{least} to {most}"),
            _ => "–".to_owned(),
        }
    }
    let mut causes: Vec<&str> = outcomes.iter().filter_map(|run| run.found.err()).collect();
    causes.sort_unstable();
    let failures = if causes.is_empty() { "–".to_owned() } else { causes.join(", ") };
    vec![
        start.to_owned(),
        method.to_owned(),
        outcomes.len().to_string(),
        converged.len().to_string(),
        span(|(_, iterations)| *iterations, &converged),
        span(|(simulations, _)| *simulations, &converged),
        failures,
    ]
}
