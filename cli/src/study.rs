//! `didim study`: what the methods make of noise and of errors of the model.

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use super::CliError;
use super::output::{check_outputs, print, write_text};
use super::tell::tell;
use super::terminal::show;
use didim::signals::stop_flag;
use didim_lab::{
    Grid, Header, Progress, Store, Summary, execute as run_study, heat_maps, markdown, table,
};

/// Where nobody watches, so often a line tells how far it is.
const LINE_EVERY: Duration = Duration::from_secs(60);

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The plan: methods, axes and levels
    #[arg(long, value_name = "FILE")]
    plan: PathBuf,
    /// The folder for the runs and their summary; a study that is there is continued
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Number of threads [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let grid = Grid::read(&arguments.plan).map_err(CliError::configuration)?;
    let header = Header::of(&grid);
    let (mut store, done) = Store::open(&arguments.out, &header).map_err(CliError::failed)?;
    let [json_file, markdown_file] =
        ["study.json", "study.md"].map(|name| arguments.out.join(name));
    check_outputs([&json_file, &markdown_file], &[&arguments.plan])?;
    let stop = stop_flag().map_err(CliError::failed)?;
    let threads = match arguments.jobs {
        Some(jobs) => usize::from(jobs),
        None => std::thread::available_parallelism().map_err(CliError::failed)?.get(),
    };
    let begin = Instant::now();
    let mut watcher = Watcher::new(grid.plan.runs());
    let ended = run_study(&grid, &done, &mut store, threads, &stop, &mut |progress| {
        watcher.show(progress);
    });
    watcher.bar.finish_and_clear();
    let progress = ended.map_err(CliError::failed)?;
    drop(store);

    // As they are read, not as they were made: a study that was continued gives the same figures.
    let (_store, runs) = Store::open(&arguments.out, &header).map_err(CliError::failed)?;
    let summary = Summary::new(&grid, &runs);
    let json = serde_json::to_string_pretty(&summary).map_err(CliError::failed)? + "\n";
    write_text(&json_file, &json)?;
    write_text(&markdown_file, &markdown(&grid, &summary))?;
    for (file, svg) in heat_maps(&grid, &summary) {
        write_text(&arguments.out.join(file), &svg)?;
    }
    if stop.load(Ordering::Relaxed) && (summary.runs as u64) < summary.planned {
        return Err(CliError::Interrupted(format!(
            "interrupted after {} of {} runs; the same command continues from there",
            summary.runs, summary.planned
        )));
    }
    if arguments.json {
        let line = serde_json::to_string(&summary).map_err(CliError::failed)?;
        return print(&format!("{line}\n"));
    }
    show(&table(&summary))?;
    print(&format!("\n{}", times(&grid, &progress, threads, begin.elapsed())))?;
    print(&format!("study.md, study.json and heat maps: {}\n", arguments.out.display()))
}

/// What the runs took; for people, and no part of any file.
fn times(grid: &Grid, progress: &Progress, threads: usize, elapsed: Duration) -> String {
    let seconds = |time: Option<Duration>| {
        time.map_or_else(|| "–".to_owned(), |time| format!("{:.2} s", time.as_secs_f64()))
    };
    let mut text = format!(
        "{} runs added in {:.1} s on {threads} threads; on average the simulation took {}",
        progress.added(),
        elapsed.as_secs_f64(),
        seconds(progress.simulation_time())
    );
    for (method, time) in grid.plan.method.iter().zip(progress.method_times()) {
        text += &format!(", {} {}", method.name(), seconds(time));
    }
    text + "\n"
}

/// A progress bar on a terminal, a line a minute elsewhere; both on stderr.
struct Watcher {
    bar: ProgressBar,
    begin: Instant,
    last_line: Instant,
}

impl Watcher {
    fn new(runs: u64) -> Self {
        let style =
            ProgressStyle::with_template("{bar:40} {percent:>3} %  {pos}/{len} runs  {msg}");
        // Hidden where stderr is no terminal.
        let bar = ProgressBar::new(runs);
        // A template that does not parse would be a mistake of ours; the default bar does as well.
        if let Ok(style) = style {
            bar.set_style(style);
        }
        Self { bar, begin: Instant::now(), last_line: Instant::now() }
    }

    fn show(&mut self, progress: &Progress) {
        let elapsed = self.begin.elapsed();
        #[expect(clippy::cast_precision_loss, reason = "runs are far fewer than 2^52")]
        let rate = 60.0 * progress.added() as f64 / elapsed.as_secs_f64().max(1e-3);
        let left = progress.remaining().map_or_else(
            || "time left not known yet".to_owned(),
            |left| format!("{} left", HumanDuration(left)),
        );
        let message = format!("{rate:.0} a minute, {left}");
        if !std::io::stderr().is_terminal() {
            if self.last_line.elapsed() >= LINE_EVERY {
                self.last_line = Instant::now();
                let (done, runs) = (progress.done(), progress.runs);
                tell(&format!("didim: {done} of {runs} runs, {message}\n"));
            }
            return;
        }
        self.bar.set_message(message);
        self.bar.set_position(progress.done());
    }
}
