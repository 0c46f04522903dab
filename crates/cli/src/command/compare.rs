//! `didim compare`: compares the methods on one experiment.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use didim_identification::identification::{IdentificationError, Method, Use};
use didim_sim::Scenario;
use indicatif::{MultiProgress, ProgressBar};

use super::sim::read_scenario;
use crate::CliError;
use crate::choices::{choices_text, make_choices};
use crate::input::Samples;
use crate::names::{DEFAULT_CELL, method_parser};
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_text};
use crate::progress::style_bar;
use crate::required_uses::RequiredUses;
use crate::stream::InputFileOrStream;
use crate::terminal::{print_for_terminal, width};
use crate::torque_joints::TorqueJoints;
use didim::analysis::identify::law_of_commands;
use didim::analysis::{CountedPiece, JudgedUse};
use didim::cell::Cell;
use didim::files::read_text;
use didim::report::html::{InputFile, Origin, SampleRange};
use didim_formats::Piece;
use didim_lab::comparison::{
    Comparison, ComparisonInput, Framework, LimitOutcome, Limits, Progress, Published, Task, Trial,
    compare, list_tasks, trials,
};
use didim_lab::report::html::{ComparisonReport, SimulatedInput};
use didim_lab::report::{View, autocorrelation_figure, markdown, terminal};
use didim_lab::study::simulate;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The experiment: a table (CSV, Parquet), or a candump log or an MCAP recording of the cell's
    /// bus
    #[arg(long, value_name = "FILE", required_unless_present = "scenario")]
    input: Option<PathBuf>,
    /// A simulated experiment instead, whose parameters are known: a scenario file, or the name of
    /// a shipped scenario
    #[arg(
        long,
        value_name = "NAME|FILE",
        conflicts_with_all = ["input", "sample_rate", "from", "to"]
    )]
    scenario: Option<String>,
    /// Seed of the noise; the scenario's when left out
    #[arg(long, value_name = "N", conflicts_with = "input")]
    seed: Option<u64>,
    /// The methods, separated by commas; all when left out. IDIM-LS, the reference, always runs
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = method_parser())]
    methods: Vec<Method>,
    /// Identify without the decimation filter, too, as the paper does; for comparison only
    #[arg(long)]
    strict: bool,
    /// Cross-validate with this number of consecutive blocks of samples; 0 for no cross-validation
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = parse_folds)]
    folds: usize,
    /// Published figures to compare with (TOML)
    #[arg(long, value_name = "FILE")]
    published: Option<PathBuf>,
    /// Limits of the figures (TOML); exit code 3 if one is violated
    #[arg(long, value_name = "FILE")]
    limits: Option<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write the tables as Markdown
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write the residuals' autocorrelations of every method (SVG)
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    samples: Samples,
    #[command(flatten)]
    required: RequiredUses,
    #[command(flatten)]
    torque_joints: TorqueJoints,
}

impl Arguments {
    /// Refuses values of other sums of parameters than those that some torques alone identify.
    fn check_joints(&self, cell: &Cell) -> Result<(), CliError> {
        let option = match (&self.published, &self.scenario) {
            (Some(_), _) => "--published",
            (None, Some(_)) => "--scenario",
            (None, None) => return Ok(()),
        };
        match cell.robot.recorded_torque().missing_joints() {
            [] => Ok(()),
            _ => Err(CliError::Usage(format!(
                "the torques of some joints alone identify other sums of parameters than the \
                 values of {option}, under the same names; use all joints, or leave {option} out"
            ))),
        }
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let mut cell = arguments.torque_joints.read_cell(&arguments.cell)?;
    let methods = if arguments.methods.is_empty() { &Method::ALL } else { &arguments.methods[..] };
    let mut trials = trials(methods, arguments.strict);
    arguments.check_joints(&cell)?;
    let base_names = cell.base.names();
    let published =
        read_toml(arguments.published.as_deref(), |text| Published::from_toml(text, base_names))?;
    let limits = read_toml(arguments.limits.as_deref(), |text| {
        Limits::from_toml(text, base_names, &trials)
    })?;
    // Outputs are checked first, so that no work is lost.
    let Arguments { markdown: to_markdown, figure, report, published: figures, .. } = arguments;
    let others = [&arguments.input, figures, &arguments.limits].into_iter().flatten();
    let read = others.chain([&arguments.cell, &cell.robot_file]);
    let read: Vec<&Path> = read.map(PathBuf::as_path).collect();
    check_outputs(to_markdown.iter().chain(figure).chain(report), &read)?;
    let source = arguments.input.as_deref().map(InputFileOrStream::open).transpose()?;
    let (experiment, scenario) = experiment(arguments, source.as_ref(), &cell)?;
    let CountedPiece { piece, counted_range: counted, .. } = &experiment;
    let measurement = &piece.measurement;

    let label = arguments.input.as_deref().unwrap_or(&arguments.cell);
    let choices = make_choices(&mut cell, &[(measurement, counted.clone())], label)?;

    if source.is_some() {
        use_law_of_commands(&mut cell, &experiment, label);
    }
    leave_out_simulating(arguments, &cell, &mut trials)?;

    let bars = TaskProgress::new(&list_tasks(&trials, arguments.folds));
    let input = ComparisonInput {
        cell: &cell,
        measurement,
        counted_samples: counted,
        truth: scenario.as_ref().map(Scenario::truth),
    };
    let mut comparison =
        compare(input, &trials, arguments.folds, &|progress| bars.show_progress(progress));
    bars.clear();
    for estimate in comparison.methods.iter_mut().filter_map(|of| of.estimate.as_mut()) {
        choices.write_to_estimate(estimate);
    }

    let outcomes = limits.as_ref().map(|limits| limits.check_all(&comparison)).unwrap_or_default();
    let view = View {
        comparison: &comparison,
        published: published.as_ref(),
        outcomes: &outcomes,
        shows_times: true,
    };
    if arguments.json {
        let json = serde_json::to_string(&comparison).map_err(CliError::from_failure)?;
        print(&format!("{json}\n"))?;
    } else {
        print(&choices_text(&choices, &cell))?;
        print_for_terminal(&terminal(&view, width()))?;
    }
    // Files are written after the result, so that a write error does not cost the result. Files
    // contain no run times: the same input gives the same bytes.
    let view = View { shows_times: false, ..view };
    if let Some(path) = &arguments.markdown {
        write_text(path, &markdown(&view))?;
    }
    if let Some(path) = &arguments.figure {
        write_text(path, &autocorrelation_figure(&view))?;
    }
    if let Some(path) = &arguments.report {
        let origin = origin(arguments, source.as_ref(), SampleRange::from_piece(&experiment))?;
        let scenario = scenario.as_ref().map(|scenario| SimulatedInput {
            name: scenario.name(),
            noise_seed: scenario.simulation().noise.as_ref().map(|noise| noise.seed),
        });
        let report = ComparisonReport { cell: &cell, view, origin: &origin, scenario };
        write_text(path, &report.to_html())?;
    }
    let is_stream = source.as_ref().is_some_and(InputFileOrStream::is_stream);
    conclude(arguments, is_stream, &comparison, &outcomes)
}

/// Prints the next command, and checks limits, failures and the required uses.
fn conclude(
    arguments: &Arguments,
    is_stream: bool,
    comparison: &Comparison,
    outcomes: &[LimitOutcome<'_>],
) -> Result<(), CliError> {
    if !arguments.json {
        print_note(&NextCommand::with_report(arguments.report.as_ref(), is_stream));
    }
    check_limits(outcomes)?;
    without_result(comparison)?;
    check_failures(comparison)?;
    arguments.required.check(|usage| judged_use(usage, comparison, &arguments.methods))
}

/// Leaves out the methods that simulate the closed loop if there is no controller, with a note.
///
/// # Errors
/// [`CliError::Configuration`] if the command line names such a method.
fn leave_out_simulating(
    arguments: &Arguments,
    cell: &Cell,
    trials: &mut Vec<Trial>,
) -> Result<(), CliError> {
    if cell.options.controller.is_some() {
        return Ok(());
    }
    let cell_file = arguments.cell.display();
    if let Some(method) = arguments.methods.iter().copied().find(|method| method.simulates()) {
        let error = IdentificationError::NoController { method };
        return Err(CliError::from_configuration(format!("{cell_file}: {error}")));
    }
    let is_left_out = |trial: &Trial| trial.method.simulates();
    let left_out: Vec<String> =
        trials.iter().filter(|trial| is_left_out(trial)).map(ToString::to_string).collect();
    trials.retain(|trial| !is_left_out(trial));
    if left_out.is_empty() {
        return Ok(());
    }
    print_note(&format!(
        "note: {cell_file} has no [controller], which {} need: they are left out; describe it to \
         compare them\n",
        left_out.join(", ")
    ));
    Ok(())
}

/// Returns the first verdict on a use that is not yes, of the methods that the command line names,
/// or of all. Methods without the decimation filter are for comparison only and do not count.
fn judged_use(usage: Use, comparison: &Comparison, named: &[Method]) -> JudgedUse {
    let is_counted = |trial: Trial| {
        let is_named = named.is_empty() || named.contains(&trial.method);
        trial.framework == Framework::Decimated && is_named
    };
    let counted = comparison.methods.iter().filter(|of| is_counted(of.trial));
    let judged = counted.map(|of| {
        let judged = match &of.estimate {
            Some(estimate) => JudgedUse::new(usage, estimate.verdict.uses.get(usage)),
            None => JudgedUse {
                usage,
                applicable: Some(false),
                reasons: of.failure.iter().cloned().collect(),
            },
        };
        let reasons = judged.reasons.iter().map(|reason| format!("{}: {reason}", of.trial));
        JudgedUse { reasons: reasons.collect(), ..judged }
    });
    let usable = JudgedUse { usage, applicable: Some(true), reasons: Vec::new() };
    judged.into_iter().find(|of| of.applicable != Some(true)).unwrap_or(usable)
}

/// Takes the controller from the commands of a recording, if the commands contain a control law and
/// the cell configures no controller.
fn use_law_of_commands(cell: &mut Cell, experiment: &CountedPiece, label: &Path) {
    let range = SampleRange::from_piece(experiment);
    let record = (&experiment.piece.measurement, &experiment.counted_range, range.readings());
    match law_of_commands(cell, Method::Didim, [record]) {
        Ok(Some(law)) => cell.options.controller = Some(law),
        Ok(None) => {}
        Err(error) => tracing::warn!("{}: {error}", label.display()),
    }
}

/// Returns an error if no method has a result to compare.
fn without_result(comparison: &Comparison) -> Result<(), CliError> {
    if comparison.methods.iter().any(|of| of.estimate.is_some()) {
        return Ok(());
    }
    let first = comparison.methods.iter().find_map(|of| Some((of.trial, of.failure.as_ref()?)));
    let cause = first.map(|(trial, failure)| format!("; {trial}: {failure}")).unwrap_or_default();
    Err(CliError::from_failure(format!("no method has a result{cause}")))
}

/// Returns an error that names the methods without a result. The tables have the reasons.
fn check_failures(comparison: &Comparison) -> Result<(), CliError> {
    let failed = comparison.methods.iter().filter(|of| of.estimate.is_none());
    let failed: Vec<String> = failed.map(|of| of.trial.to_string()).collect();
    if failed.is_empty() {
        return Ok(());
    }
    let (count, all) = (failed.len(), comparison.methods.len());
    Err(CliError::NotUsable(format!("{count} of {all} runs have no result: {}", failed.join(", "))))
}

/// Parses the number of folds. Fewer than two blocks leave no data for the identification. A block
/// has to be longer than the filters' reach, so the number of blocks is limited.
fn parse_folds(text: &str) -> Result<usize, String> {
    let folds: usize = text.parse().map_err(|error| format!("{error}"))?;
    let fits = folds == 0 || (2..=20).contains(&folds);
    fits.then_some(folds).ok_or_else(|| "has to be 2 to 20, or 0 for none".to_owned())
}

/// Reads a configuration file, if the command line names one.
fn read_toml<T>(
    path: Option<&Path>,
    read: impl Fn(&str) -> Result<T, String>,
) -> Result<Option<T>, CliError> {
    let Some(path) = path else { return Ok(None) };
    let wrong = |what: String| CliError::from_configuration(format!("{}: {what}", path.display()));
    let text = read_text(path).map_err(|error| wrong(error.to_string()))?;
    read(&text).map(Some).map_err(wrong)
}

/// Reads or simulates the experiment. Returns it with its counted samples, and the scenario if it
/// was simulated.
fn experiment(
    arguments: &Arguments,
    input: Option<&InputFileOrStream>,
    cell: &Cell,
) -> Result<(CountedPiece, Option<Scenario>), CliError> {
    if let Some(name) = &arguments.scenario {
        let mut scenario = read_scenario(name, cell)?;
        if let Some(seed) = arguments.seed {
            scenario = scenario.with_seed(seed);
        }
        let (measurement, counted) = simulate(&scenario, cell)
            .map_err(|error| CliError::from_failure(format!("{name}: {error}")))?;
        let piece = Piece::new(0.0, measurement);
        return Ok((
            CountedPiece {
                piece,
                counted_range: counted,
                recording_start: None,
                unused_frames: BTreeMap::new(),
            },
            Some(scenario),
        ));
    }
    let Some(input) = input else {
        return Err(CliError::Usage("name an experiment: --input or --scenario".to_owned()));
    };
    Ok((arguments.samples.read_longest(input, cell)?, None))
}

fn origin(
    arguments: &Arguments,
    input: Option<&InputFileOrStream>,
    samples: SampleRange,
) -> Result<Origin, CliError> {
    let read =
        |path: &PathBuf| InputFile::read(path).map_err(|error| CliError::in_file(path, error));
    // A scenario is a file or the name of a shipped scenario.
    let scenario = arguments.scenario.as_ref().map(PathBuf::from).filter(|path| path.is_file());
    let input = match input {
        Some(input) => Some(input.input_file()?),
        None => scenario.as_ref().map(read).transpose()?,
    };
    Ok(Origin { input, samples, further_files: Vec::new(), note: None })
}

/// Returns an error that names every violated limit.
fn check_limits(outcomes: &[LimitOutcome<'_>]) -> Result<(), CliError> {
    let bound = |name: &str, value: Option<f64>| {
        value.map(|value| format!(", has to be {name} {value}")).unwrap_or_default()
    };
    let violations: Vec<String> = outcomes
        .iter()
        .filter(|outcome| !outcome.is_met())
        .map(|outcome| {
            let figure =
                outcome.found.map_or("no result".to_owned(), |found| format!("{found:.4}"));
            let least = bound("at least", outcome.limit.at_least);
            let most = bound("at most", outcome.limit.at_most);
            format!("\n  {}: {figure}{least}{most}", outcome.limit)
        })
        .collect();
    if violations.is_empty() {
        return Ok(());
    }
    let count = format!("{} of {} limits do not hold:", violations.len(), outcomes.len());
    Err(CliError::NotUsable(count + &violations.concat()))
}

/// Progress bars of the running tasks, on stderr if it is a terminal.
struct TaskProgress {
    overall: ProgressBar,
    running: Vec<(Task, ProgressBar)>,
}

impl TaskProgress {
    fn new(tasks: &[Task]) -> Self {
        let together = MultiProgress::new();
        let count = u64::try_from(tasks.len()).unwrap_or(u64::MAX);
        let progress_bar = together.add(ProgressBar::new(count));
        let progress_bar = style_bar(progress_bar, "{bar:40} {pos}/{len} runs  {elapsed}");
        let running = tasks.iter().map(|task| {
            let bar = style_bar(ProgressBar::new_spinner(), "{spinner} {msg}  {elapsed}");
            (*task, together.add(bar))
        });
        let running = running.collect();
        progress_bar.tick();
        Self { overall: progress_bar, running }
    }

    fn show_progress(&self, progress: Progress) {
        let bar = |task: Task| self.running.iter().find(|(of, _)| *of == task);
        match progress {
            Progress::Begun(task) => {
                if let Some((_, bar)) = bar(task) {
                    bar.reset_elapsed();
                    bar.set_message(task.to_string());
                    bar.enable_steady_tick(std::time::Duration::from_millis(200));
                }
            }
            Progress::Ended(task) => {
                if let Some((_, bar)) = bar(task) {
                    bar.finish_and_clear();
                }
                self.overall.inc(1);
            }
        }
    }

    fn clear(&self) {
        self.overall.finish_and_clear();
    }
}
