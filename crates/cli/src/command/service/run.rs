//! `didim run`: runs the service as a daemon.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::CliError;
use crate::names::DEFAULT_CELL;
use didim::analysis::identify::LastIdentification;
use didim::archive::events::EventSource;
use didim::cell::{Cell, Processes};
use didim::live::stream::{ServiceNetwork, StreamError};
use didim::service::limits::require_limits;
use didim::service::paths::Paths;
use didim::service::pipeline::{
    PipelineError, archiver_options, build_acquisition, build_estimation, make_recordings,
    open_source, reads_log,
};
use didim::service::reload::reload_of;
use didim::service::status::SocketKind;
use didim::service::supervision::{
    Parts, ServiceEnd, ServiceOptions, SocketOptions, run_with_reload,
};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The cell file
    #[arg(long, value_name = "FILE", default_value = DEFAULT_CELL)]
    cell: PathBuf,
    /// The part of a service in two processes (`service.processes = "two"`)
    #[arg(long, value_enum)]
    part: Option<Part>,
    /// Folder of the results, instead of the cell's `service.state_directory`
    #[arg(long, value_name = "FOLDER")]
    state: Option<PathBuf>,
    /// Folder of the sockets, instead of the cell's `service.runtime_directory`
    #[arg(long, value_name = "FOLDER")]
    runtime: Option<PathBuf>,
}

/// One of the two processes of the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Reads the bus
    Acquisition,
    /// Identifies, stores and answers requests
    Estimation,
}

/// Tells a wrong cell, which no second start mends, from a failure of the machine.
fn of_pipeline(error: PipelineError, cell: &Cell) -> CliError {
    let is_of_cell = match &error {
        PipelineError::Cell(_) | PipelineError::Windows(_) | PipelineError::Sources(_) => true,
        PipelineError::Stream(cause) => matches!(cause, StreamError::Option { .. }),
        // A log that is named and not there.
        PipelineError::Source(cause) => reads_log(cell) && is_not_found(cause),
        PipelineError::Folder(_) | PipelineError::Limit(_) | PipelineError::OneRun { .. } => false,
    };
    match is_of_cell {
        true => CliError::from_configuration(error),
        false => CliError::from_failure(error),
    }
}

/// Returns true if a file is not there.
fn is_not_found(error: &(dyn std::error::Error + 'static)) -> bool {
    let cause = std::iter::successors(Some(error), |error| error.source())
        .find_map(|error| error.downcast_ref::<std::io::Error>());
    cause.is_some_and(|cause| cause.kind() == std::io::ErrorKind::NotFound)
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    require_limits().map_err(CliError::from_failure)?;
    let cell = Cell::read_decided(&arguments.cell).map_err(CliError::from_configuration)?;
    let mut paths = Paths::of_service(&cell);
    if let Some(state) = &arguments.state {
        paths.state = Some(state.clone());
    }
    if let Some(runtime) = &arguments.runtime {
        paths.runtime = std::path::absolute(runtime).map_err(CliError::from_failure)?;
    }
    let part = which_part(arguments.part, cell.service.processes)?;
    paths.create_folders().map_err(CliError::from_failure)?;
    // Dropped after the parts of the service, which use its files.
    let network = ServiceNetwork::join(&paths.runtime).map_err(CliError::from_failure)?;
    network.prefix().clone_into(&mut paths.prefix);
    make_recordings(&cell, &paths).map_err(CliError::from_failure)?;
    let mut options = ServiceOptions::default();
    let estimate = || -> Result<_, PipelineError> {
        let mut part = build_estimation(&cell, &paths, &LastIdentification::default())?;
        part.options.archiver = archiver_options(&cell, &paths);
        Ok(part)
    };
    let mut acquire = || -> Result<_, PipelineError> {
        let opened = open_source(&cell)?;
        options.receive_buffer = opened.receive_buffer;
        build_acquisition(&cell, &paths, opened.source, opened.pace)
    };
    let parts = match part {
        None => Parts::Both(
            acquire().map_err(|error| of_pipeline(error, &cell))?,
            estimate().map_err(|error| of_pipeline(error, &cell))?,
        ),
        Some(Part::Acquisition) => {
            Parts::Acquisition(acquire().map_err(|error| of_pipeline(error, &cell))?)
        }
        Some(Part::Estimation) => {
            Parts::Estimation(estimate().map_err(|error| of_pipeline(error, &cell))?)
        }
    };
    let receive_buffer = options.receive_buffer;
    let options = ServiceOptions { receive_buffer, ..service_options(&cell, &paths, part) };
    let bus = cell.bus().map_err(CliError::from_configuration)?;
    let buses: Vec<String> = bus.sources.iter().map(ToString::to_string).collect();
    tracing::info!(
        cell = cell.name,
        bus = buses.join(" "),
        runtime = %paths.runtime.display(),
        "didim {} starts",
        env!("CARGO_PKG_VERSION")
    );
    let estimates = part != Some(Part::Acquisition);
    let reload = reload_of(arguments.cell.clone(), cell, estimates);
    let report = run_with_reload(&options, parts, Some(reload)).map_err(CliError::from_failure)?;
    tracing::info!(
        "ended: {}",
        match report.end {
            ServiceEnd::Signal => "stop requested",
            ServiceEnd::SourceEnded => "the source has ended",
        }
    );
    Ok(())
}

/// Returns the sockets and the file of the events of a part of the service.
fn service_options(cell: &Cell, paths: &Paths, part: Option<Part>) -> ServiceOptions {
    let service = &cell.service;
    let readable = |path, kind| {
        let group = service.status_group.clone();
        Some(SocketOptions { path, kind, mode: service.status_mode, group })
    };
    let is_acquisition = part == Some(Part::Acquisition);
    let has_observer = part != Some(Part::Estimation) && cell.contact.is_some();
    let (process, status) = match is_acquisition {
        true => (EventSource::Acquisition, paths.acquisition_socket()),
        false => (EventSource::Service, paths.status_socket()),
    };
    ServiceOptions {
        status: readable(status, SocketKind::Stream),
        control: (!is_acquisition).then(|| SocketOptions {
            path: paths.command_socket(),
            kind: SocketKind::Stream,
            mode: service.command_mode(),
            group: service.command_group.clone(),
        }),
        external_torque: has_observer
            .then(|| readable(paths.external_torque_socket(), SocketKind::Packets))
            .flatten(),
        receive_buffer: None,
        events: paths.state.as_deref().map(|state| process.file_in(state)),
    }
}

/// Returns the part of the service that this process runs; `None` if one process runs both parts.
/// The option and the cell have to agree, so that a unit file and a cell file that contradict each
/// other are noticed.
fn which_part(asked: Option<Part>, processes: Processes) -> Result<Option<Part>, CliError> {
    match (asked, processes) {
        (None, Processes::One) => Ok(None),
        (Some(part), Processes::Two) => Ok(Some(part)),
        (None, Processes::Two) => Err(CliError::Usage(
            "the cell has `service.processes = \"two\"`: give --part acquisition or --part \
             estimation"
                .to_owned(),
        )),
        (Some(_), Processes::One) => Err(CliError::Usage(
            "--part needs `service.processes = \"two\"` in the cell".to_owned(),
        )),
    }
}
