//! `didim study`: computes the effects of noise and model errors on the methods.

use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{HumanDuration, ProgressBar};

use crate::CliError;
use crate::notes::print_note;
use crate::output::{check_outputs, print, write_text};
use crate::progress::style_bar;
use crate::terminal::print_for_terminal;
use didim::signals::stop_flag;
use didim_lab::study::{
    Grid, Header, Progress, Run, Shard, Store, Summary, execute as run_study, heat_maps, markdown,
    merge, table,
};

/// File with the results of a study for programs; `MARKDOWN_FILE` is for people.
const JSON_FILE: &str = "study.json";
const MARKDOWN_FILE: &str = "study.md";

/// Interval of the progress lines if stderr is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(60);

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The plan: methods, axes and levels
    #[arg(long, value_name = "FILE")]
    plan: PathBuf,
    /// The folder for the runs and their summary; an existing study is continued
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Run one of N equal parts, to divide a study among machines: I from 0 to N − 1
    #[arg(long, value_name = "I/N", conflicts_with = "json")]
    shard: Option<Shard>,
    /// Run nothing; merge the folders of all parts
    #[arg(long, value_name = "FOLDER", num_args = 1.., conflicts_with_all = ["shard", "jobs"])]
    merge: Vec<PathBuf>,
    /// Number of threads [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let grid = Grid::read(&arguments.plan).map_err(CliError::from_configuration)?;
    if !arguments.merge.is_empty() {
        let runs =
            merge(&grid, &arguments.merge, &arguments.out).map_err(CliError::from_failure)?;
        let summary = write_tables(&grid, &runs, &arguments.out)?;
        return print_summary(arguments, &summary, "");
    }
    let shard = arguments.shard.unwrap_or(Shard::COMPLETE);
    let header = Header { shard, ..Header::from_grid(&grid) };
    let (mut store, done) = Store::open(&arguments.out, &header).map_err(CliError::from_failure)?;
    let tables = [JSON_FILE, MARKDOWN_FILE].map(|name| arguments.out.join(name));
    check_outputs(&tables, &[&arguments.plan])?;
    let stop = stop_flag().map_err(CliError::from_failure)?;
    let threads = match arguments.jobs {
        Some(jobs) => usize::from(jobs),
        None => std::thread::available_parallelism().map_err(CliError::from_failure)?.get(),
    };
    let begin = Instant::now();
    let mut watcher = StudyProgress::new(grid.plan.run_count());
    let ended = run_study(&grid, shard, &done, &mut store, threads, &stop, &mut |progress| {
        watcher.show_progress(progress);
    });
    watcher.bar.finish_and_clear();
    let progress = ended.map_err(CliError::from_failure)?;
    drop(store);
    let times = run_times(&grid, &progress, threads, begin.elapsed());

    let (done, planned) = (progress.completed_runs(), progress.runs);
    let interrupted = stop.load(Ordering::Relaxed) && done < planned;
    let interrupted = interrupted.then(|| {
        CliError::Interrupted(format!(
            "interrupted after {done} of {planned} runs; the same command continues from there"
        ))
    });
    if !shard.is_whole() {
        // Tables of a part would be misleading.
        return match interrupted {
            Some(interrupted) => Err(interrupted),
            None => print(&format!(
                "{times}part {shard}: {done} of {planned} runs in {}; --merge puts all parts \
                together\n",
                arguments.out.display()
            )),
        };
    }
    // Use the runs as read from disk, so that a continued study gives the same figures.
    let (_store, runs) = Store::open(&arguments.out, &header).map_err(CliError::from_failure)?;
    let summary = write_tables(&grid, &runs, &arguments.out)?;
    match interrupted {
        Some(interrupted) => Err(interrupted),
        None => print_summary(arguments, &summary, &times),
    }
}

/// Writes all files that are computed from the runs.
fn write_tables(grid: &Grid, runs: &[Run], out: &Path) -> Result<Summary, CliError> {
    let summary = Summary::new(grid, runs);
    let json = serde_json::to_string_pretty(&summary).map_err(CliError::from_failure)? + "\n";
    write_text(&out.join(JSON_FILE), &json)?;
    write_text(&out.join(MARKDOWN_FILE), &markdown(grid, &summary))?;
    for (file, svg) in heat_maps(grid, &summary) {
        write_text(&out.join(file), &svg)?;
    }
    Ok(summary)
}

fn print_summary(arguments: &Arguments, summary: &Summary, times: &str) -> Result<(), CliError> {
    if arguments.json {
        let line = serde_json::to_string(summary).map_err(CliError::from_failure)?;
        return print(&format!("{line}\n"));
    }
    print_for_terminal(&table(summary))?;
    print(&format!("\n{times}"))?;
    print(&format!("study.md, study.json and heat maps: {}\n", arguments.out.display()))
}

/// Returns the run times as text for people; no file contains them.
fn run_times(grid: &Grid, progress: &Progress, threads: usize, elapsed: Duration) -> String {
    let seconds = |time: Option<Duration>| {
        time.map_or_else(|| "–".to_owned(), |time| format!("{:.2} s", time.as_secs_f64()))
    };
    let mut text = format!(
        "{} runs added in {:.1} s on {threads} threads; on average the simulation took {}",
        progress.added_runs(),
        elapsed.as_secs_f64(),
        seconds(progress.simulation_time())
    );
    for (method, time) in grid.plan.method.iter().zip(progress.method_times()) {
        text += &format!(", {} {}", method.name(), seconds(time));
    }
    text + "\n"
}

/// Progress bar on a terminal, otherwise one line per minute; both on stderr.
struct StudyProgress {
    bar: ProgressBar,
    started: Instant,
    last_line: Instant,
}

impl StudyProgress {
    fn new(runs: u64) -> Self {
        let template = "{bar:40} {percent:>3} %  {pos}/{len} runs  {msg}";
        let bar = style_bar(ProgressBar::new(runs), template);
        Self { bar, started: Instant::now(), last_line: Instant::now() }
    }

    fn show_progress(&mut self, progress: &Progress) {
        let elapsed = self.started.elapsed();
        #[expect(clippy::cast_precision_loss, reason = "runs are far fewer than 2^52")]
        let rate = 60.0 * progress.added_runs() as f64 / elapsed.as_secs_f64().max(1e-3);
        let remaining = progress.remaining().map_or_else(
            || "time left not known yet".to_owned(),
            |time_left| format!("{} left", HumanDuration(time_left)),
        );
        let message = format!("{rate:.0} a minute, {remaining}");
        if !std::io::stderr().is_terminal() {
            if self.last_line.elapsed() >= LINE_INTERVAL {
                self.last_line = Instant::now();
                let (done, runs) = (progress.completed_runs(), progress.runs);
                print_note(&format!("didim: {done} of {runs} runs, {message}\n"));
            }
            return;
        }
        self.bar.set_length(progress.runs);
        self.bar.set_message(message);
        self.bar.set_position(progress.completed_runs());
    }
}
