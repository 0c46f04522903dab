//! `didim replay`: sends a log, an MCAP recording or a capture through the same pipeline as `run`.

use std::path::PathBuf;

use clap::Args;
use didim_drivers::source::InterfaceName;
use didim_dynamics::robot::Robot;
use didim_formats::foreign_container;
use didim_identification::identification::Identification;

use crate::CliError;
use crate::bundle::OpenedBundle;
use crate::names::DEFAULT_CELL;
use crate::next::NextCommand;
use crate::notes::print_note;
use crate::outcome::last_identification;
use crate::output::{check_outputs, count_with_noun, print, write_figure, write_report};
use crate::progress::WorkIndicator;
use crate::required_uses::RequiredUses;
use crate::stream::InputFileOrStream;
use crate::terminal::print_for_terminal;
use didim::analysis::identify::{LastIdentification, LastWindow};
use didim::cell::Cell;
use didim::live::recording::{NamedInterfaces, RecordedWindow, open_bus_log};
use didim::live::stream::Pace;
use didim::live::worker::TimeOfDay;
use didim::report;
use didim::report::html::{Origin, Report, SampleRange};
use didim::service::pipeline::{OneRun, build_acquisition, build_estimation};
use didim::service::status::Snapshot;
use didim::service::supervision::{Parts, ServiceOptions, run};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The candump log, MCAP recording, EtherCAT capture (pcap, pcapng), the folder of a ring, or a
    /// bundle with a recording (*.tar.zst), whose own cell is used
    log: PathBuf,
    /// The interface of a log or a recording whose frames count; repeat for several. Without it
    /// those of the cell's bus, where several have the same identifiers
    #[arg(long = "interface", value_name = "NAME")]
    interfaces: Vec<InterfaceName>,
    /// Store the results in this folder, as `run` does; otherwise only the last one is shown
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// Print the last estimate as one JSON object and nothing else
    #[arg(long)]
    json: bool,
    /// Write a figure of measured and predicted torque (SVG)
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Write a report (one HTML file)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    required: RequiredUses,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let bundle = OpenedBundle::open_if_bundle(&arguments.log)?;
    let (cell, log) = read_input(arguments, bundle.as_ref())?;
    let Arguments { cell: cell_file, log: input_path, figure, report, .. } = arguments;
    let log = log.as_path();
    check_outputs(figure.iter().chain(report), &[cell_file, input_path, log, &cell.robot_file])?;
    let input = InputFileOrStream::open(log)?;
    if let Some(container) = foreign_container(input.path()) {
        return Err(CliError::in_file(log, container));
    }
    let (snapshot, LastWindow { window, identification }) =
        replay_recording(&cell, &input, &arguments.interfaces, arguments.state.clone())?;
    if arguments.json {
        let json =
            serde_json::to_string(&identification.estimate).map_err(CliError::from_failure)?;
        print(&format!("{json}\n"))?;
    } else {
        print_for_terminal(&text(&identification, &cell.robot, &snapshot))?;
    }
    // Files are written after the result is printed, so that a write error does not cost the
    // result.
    if let Some(path) = &arguments.figure {
        write_figure(path, &cell, &identification)?;
    }
    if let Some(path) = &arguments.report {
        let origin = Origin {
            input: Some(input.input_file()?),
            samples: SampleRange::Window(window),
            further_files: Vec::new(),
            note: None,
        };
        let report = Report::new(&cell, &identification, &origin);
        write_report(path, &report)?;
    }
    if !arguments.json {
        print_note(&NextCommand::with_report(arguments.report.as_ref(), input.is_stream()));
    }
    arguments.required.check_estimate(&identification.estimate)
}

/// Sends a recording through the pipeline of `run`. Returns the status at its end and the last
/// result. Results are stored in `state`, if it is given.
///
/// # Errors
/// The recording cannot be read, or gives no result.
pub(super) fn replay_recording(
    cell: &Cell,
    input: &InputFileOrStream,
    interfaces: &[InterfaceName],
    state: Option<PathBuf>,
) -> Result<(Snapshot, LastWindow), CliError> {
    let bus = cell.bus().map_err(CliError::from_configuration)?;
    let configured = bus.interfaces();
    let named = NamedInterfaces { requested: interfaces, configured: &configured };
    let source = input.with_displayed_path(
        open_bus_log(input.path(), &bus.layout, named).map_err(CliError::from_failure),
    )?;
    let since_1970_ns = source.since_1970_ns();
    let one_run = OneRun::new(state).map_err(CliError::from_failure)?;
    let paths = &one_run.paths;
    let last = LastIdentification::default();
    let mut bus =
        build_acquisition(cell, paths, source, Pace::Replay).map_err(CliError::from_failure)?;
    let mut work = build_estimation(cell, paths, &last).map_err(CliError::from_failure)?;
    work.options.time_of_day = TimeOfDay::Log { since_1970_ns };
    // A recording that belongs to a result contains its window and the number of its first cycle.
    if let Some(window) = RecordedWindow::of_file(input.path()).map_err(CliError::from_failure)? {
        let assembler = cell.bus().map_err(CliError::from_configuration)?.assembler();
        let first =
            window.sequence_at_start(input.path(), assembler).map_err(CliError::from_failure)?;
        match first {
            Some(sequence) => {
                if !window.is_of(&cell.configuration_sha256) {
                    tracing::warn!(
                        "{}: recorded with another configuration; the result may differ",
                        input.displayed_path().display()
                    );
                }
                bus.assembler = bus.assembler.starting_at(sequence);
                work.options.recorded = Some(window);
            }
            None => tracing::warn!(
                "{}: the frames do not reproduce the window of this recording; does the cell \
                    match the recording? The cell file chooses the windows instead",
                input.displayed_path().display()
            ),
        }
    }
    let parts = Parts::Both(bus, work);
    let replaying =
        WorkIndicator::start(&format!("replaying {}", input.displayed_path().display()));
    let report = replaying.show_during(|| run(&ServiceOptions::default(), parts));
    let report = report.map_err(CliError::from_failure)?;
    let last = last_identification(&report, &last)?;
    Ok((report.snapshot, last))
}

/// Returns the cell and the recording: those of the bundle, or those of the arguments.
fn read_input(
    arguments: &Arguments,
    bundle: Option<&OpenedBundle>,
) -> Result<(Cell, PathBuf), CliError> {
    if let Some(bundle) = bundle {
        return Ok((bundle.cell()?, bundle.recording()?));
    }
    let cell = Cell::read_decided(&arguments.cell).map_err(CliError::from_configuration)?;
    Ok((cell, arguments.log.clone()))
}

fn text(identification: &Identification, robot: &Robot, snapshot: &Snapshot) -> String {
    let estimate = &identification.estimate;
    let mut text = report::estimate::parameter_table(estimate);
    text += "\n";
    text += &report::estimate::summary(estimate, robot);
    if let (Some(bus), Some(work)) = (&snapshot.acquisition, &snapshot.estimation) {
        text += &format!(
            "{}, {}, {} identified, {} rejected\n",
            count_with_noun(bus.frames, "frame"),
            count_with_noun(bus.samples, "sample"),
            count_with_noun(work.windows_identified, "window"),
            work.windows_rejected.values().sum::<u64>()
        );
    }
    text
}
