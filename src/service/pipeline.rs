//! Creation of the running parts from a validated cell.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use didim_drivers::source::{
    InterfaceName, SocketCanOptions, SocketCanSource, Source, SourceError, TapSource,
};

use crate::analysis::find_load;
use crate::analysis::identify::{LastIdentification, LastWindow, identify_window};
use crate::archive::store::WindowProvenance;
use crate::cell::{BusAddress, Cell, CellError};
use crate::files::{FolderError, own_folder};
use crate::live::acquire::{AcquireOptions, ReceiveBuffer};
use crate::live::limits::LiveLimits;
use crate::live::recording::{
    ArchiverOptions, RecorderOptions, RecordingOptions, WriteBudget, open_log, recording_folders,
};
use crate::live::stream::{Pace, PrivateNetwork, SHARED_MEMORY, StreamError};
use crate::live::window_options::WindowOptionError;
use crate::live::worker::{Configuration, FindLoad, IdentifiedWindow, TimeOfDay, WorkerOptions};
use crate::service::contact_model::model_source;
use crate::service::limits::{LimitTooLow, require_limits};
use crate::service::paths::Paths;
use crate::service::supervision::{AcquisitionPart, EstimationPart, ExternalTorquePart};
use crate::window::Window;

/// Maximum number of windows that wait while one is identified.
const WINDOWS_WAITING: usize = 4;
/// Maximum number of windows in memory: the open one, the waiting ones, and the one being
/// identified.
pub(crate) const MAX_WINDOWS: usize = WINDOWS_WAITING + 2;
/// Number of sample periods without a frame after which a live bus is silent. The time is at least
/// half a second.
const SILENT_PERIODS: f64 = 100.0;
/// Maximum length of the path for temporary files \[bytes\]. Longer paths leave no space for the
/// stream's own paths.
const MAX_TEMPORARY: usize = 20;
/// Reason why the running parts cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The options of the stream are invalid: the cell's name, the runtime folder or the buffer.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The cell has no bus.
    #[error(transparent)]
    Cell(Box<CellError>),
    /// The window options do not fit the sample rate.
    #[error(transparent)]
    Windows(#[from] WindowOptionError),
    /// The bus cannot be opened.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The buses cannot be combined.
    #[error("bus.source: {0}")]
    Sources(&'static str),
    /// A folder cannot be created, or other users may change its content.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A limit of the process is too low.
    #[error(transparent)]
    Limit(#[from] LimitTooLow),
    /// The files of a single run cannot be created. Check the permissions and the free space.
    #[error("{}: {cause}; check its permissions and the space left", place.display())]
    OneRun {
        /// Path at which the files were to be created.
        place: PathBuf,
        /// Error of the system.
        cause: io::Error,
    },
}

impl From<CellError> for PipelineError {
    fn from(error: CellError) -> Self {
        Self::Cell(Box::new(error))
    }
}

/// Paths that only a single run uses. All files except the results are removed at its end.
#[derive(Debug)]
pub struct OneRun {
    /// The paths.
    pub paths: Paths,
    // The order of the fields is the order in which they are dropped: first the files in shared
    // memory, then the folder.
    _network: PrivateNetwork,
    _folder: tempfile::TempDir,
}

impl OneRun {
    /// Creates a folder for the run. If `state` is given, results are stored there.
    ///
    /// # Errors
    /// [`PipelineError::Limit`], [`PipelineError::Folder`] and [`PipelineError::OneRun`].
    pub fn new(state: Option<PathBuf>) -> Result<Self, PipelineError> {
        require_limits()?;
        let usual = std::env::temp_dir();
        let base = if usual.as_os_str().len() > MAX_TEMPORARY { "/tmp".into() } else { usual };
        let folder = tempfile::Builder::new()
            .prefix("didim-")
            .tempdir_in(&base)
            .map_err(|cause| PipelineError::OneRun { place: base, cause })?;
        let network = PrivateNetwork::new(folder.path())
            .map_err(|cause| PipelineError::OneRun { place: SHARED_MEMORY.into(), cause })?;
        let prefix = network.prefix().to_owned();
        let paths = Paths { runtime: folder.path().to_path_buf(), state, prefix };
        paths.create_folders()?;
        Ok(Self { paths, _network: network, _folder: folder })
    }
}

/// Creates the part that reads the bus.
///
/// # Errors
/// [`PipelineError::Stream`].
pub fn build_acquisition(
    cell: &Cell,
    paths: &Paths,
    source: Box<dyn Source>,
    pace: Pace,
) -> Result<Box<AcquisitionPart>, PipelineError> {
    let bus = cell.bus()?;
    let period = bus.layout.period_ns() * 1e-9;
    // The frames of a log are recorded already.
    let recorder =
        recording_options(cell, paths).filter(|_| pace == Pace::Live).map(|(options, folder)| {
            RecorderOptions::new(options, &folder, &cell.name, &cell.configuration_sha256)
                .with_budget(cell.service.write_mb_per_day)
        });
    Ok(Box::new(AcquisitionPart {
        source,
        assembler: bus.assembler(),
        options: AcquireOptions {
            stream: paths.stream_options(cell)?,
            pace,
            real_time: cell.service.real_time,
            silence_after: Duration::from_secs_f64((SILENT_PERIODS * period).max(0.5)),
        },
        recorder,
        external_torque: cell.contact.as_ref().map(|contact| ExternalTorquePart {
            models: model_source(cell, contact, paths.state.as_deref()),
            clients: None,
        }),
    }))
}

/// Creates the folders of the recordings, if the cell records frames. Refuses folders that other
/// users may change.
///
/// # Errors
/// [`PipelineError::Folder`].
pub fn make_recordings(cell: &Cell, paths: &Paths) -> Result<(), PipelineError> {
    let Some(ArchiverOptions { folder, .. }) = archiver_options(cell, paths) else { return Ok(()) };
    own_folder(&folder)?;
    let parts = recording_folders(&folder);
    Ok(parts.iter().try_for_each(|part| own_folder(part))?)
}

/// Returns the recording options and the folder of the recordings.
fn recording_options<'a>(cell: &'a Cell, paths: &Paths) -> Option<(&'a RecordingOptions, PathBuf)> {
    let options = cell.service.recordings.as_ref()?;
    Some((options, options.folder(paths.state.as_deref()?)))
}

/// Returns true if frames come from a file.
pub fn reads_log(cell: &Cell) -> bool {
    let is_log = |bus: &BusAddress| matches!(bus, BusAddress::Log(_) | BusAddress::Pcap(_));
    cell.bus().is_ok_and(|bus| bus.sources.iter().any(is_log))
}

/// Returns the archiver options of `didim run`. `None` for a log, because its frames are recorded
/// already.
pub fn archiver_options(cell: &Cell, paths: &Paths) -> Option<ArchiverOptions> {
    let bus = cell.bus().ok()?;
    let (options, folder) = recording_options(cell, paths).filter(|_| !reads_log(cell))?;
    Some(ArchiverOptions { folder, recordings: options.clone(), curves: cell.joint_curves(bus) })
}

/// Returns the functions and options that cut and identify the windows of a cell. The last
/// identification is also stored in `last`.
///
/// # Errors
/// [`PipelineError::Windows`].
pub fn build_configuration(
    cell: &Cell,
    last: &LastIdentification,
) -> Result<Configuration, PipelineError> {
    let (cell_of_worker, last) = (Arc::new(cell.clone()), last.clone());
    let cell_of_load = Arc::clone(&cell_of_worker);
    let find_load: FindLoad =
        Arc::new(move |baseline, window| Ok(find_load(&cell_of_load, baseline, window)?));
    let identify = move |window: &Window| {
        let cell = &*cell_of_worker;
        let identification = identify_window(cell, window)?;
        let provenance = WindowProvenance::from_window(window);
        let estimate = identification.estimate.clone();
        last.set(LastWindow { window: provenance, identification });
        Ok(IdentifiedWindow { estimate })
    };
    Ok(Configuration {
        windows: cell.window.plan(cell.sample_rate_hz())?,
        identify: Box::new(identify),
        find_load: Some(find_load),
        sha256: cell.configuration_sha256.clone(),
        results: cell.result_options(),
    })
}

/// Returns the time of day of a cell's buses.
fn time_of_day(cell: &Cell) -> TimeOfDay {
    let sources = cell.bus().map_or(&[][..], |bus| &bus.sources);
    match sources {
        [BusAddress::Ethercat(_)] => TimeOfDay::Arrival,
        _ if sources.iter().all(|bus| matches!(bus, BusAddress::Can(_))) => TimeOfDay::ThisMachine,
        _ => TimeOfDay::Log { since_1970_ns: 0 },
    }
}

/// Name of the file with the written bytes, in the folder of the results.
const WRITTEN_FILE: &str = ".written.json";

/// Returns the budget for results and kept recordings. A replay is not counted.
fn write_budget(cell: &Cell, paths: &Paths) -> WriteBudget {
    match &paths.state {
        Some(state) if !reads_log(cell) => {
            WriteBudget::new(cell.service.write_mb_per_day, &state.join(WRITTEN_FILE))
        }
        _ => WriteBudget::default(),
    }
}

/// Creates the part that identifies. The last identification is also stored in `last`.
///
/// # Errors
/// [`PipelineError::Stream`] and [`PipelineError::Windows`].
pub fn build_estimation(
    cell: &Cell,
    paths: &Paths,
    last: &LastIdentification,
) -> Result<EstimationPart, PipelineError> {
    let Configuration { windows, identify, find_load, sha256, results } =
        build_configuration(cell, last)?;
    Ok(EstimationPart {
        identify,
        find_load,
        options: WorkerOptions {
            stream: paths.stream_options(cell)?,
            time_of_day: time_of_day(cell),
            windows,
            queue: WINDOWS_WAITING,
            folder: paths.state.clone(),
            time_limit: LiveLimits::DEFAULT.identification,
            max_results: cell.service.keep_results,
            configuration: sha256,
            recorded: None,
            archiver: None,
            results,
            budget: write_budget(cell, paths),
        },
    })
}

/// The opened buses of a cell.
pub struct OpenedSource {
    /// Source of the frames.
    pub source: Box<dyn Source>,
    /// Pace of the stream. A live bus does not wait for its reader, but a log does.
    pub pace: Pace,
    /// Receive buffer of the sockets.
    pub receive_buffer: Option<ReceiveBuffer>,
}

/// Opens the buses of a cell. The source waits for interfaces that are missing.
///
/// # Errors
/// [`PipelineError::Source`] and [`PipelineError::Sources`].
pub fn open_source(cell: &Cell) -> Result<OpenedSource, PipelineError> {
    let bus = cell.bus()?;
    let mut interfaces: Vec<InterfaceName> = Vec::new();
    for address in &bus.sources {
        match address {
            BusAddress::Can(name) => interfaces.push(*name),
            BusAddress::Log(file) | BusAddress::Pcap(file) if bus.sources.len() == 1 => {
                return Ok(OpenedSource {
                    source: open_log(file, Some(&bus.layout), &[])?,
                    pace: Pace::Replay,
                    receive_buffer: None,
                });
            }
            BusAddress::Ethercat(name) if bus.sources.len() == 1 => {
                let asked = bus.receive_buffer_bytes;
                let source =
                    TapSource::open(*name, &bus.layout, asked, true).map_err(SourceError::from)?;
                let receive_buffer = Some(ReceiveBuffer {
                    asked_bytes: asked.into(),
                    granted_bytes: source.receive_buffer_bytes().map(u64::from),
                });
                let source = Box::new(source);
                return Ok(OpenedSource { source, pace: Pace::Live, receive_buffer });
            }
            BusAddress::Log(_) | BusAddress::Pcap(_) | BusAddress::Ethercat(_) => {
                return Err(PipelineError::Sources(
                    "a log, a capture or a tap must be the only bus",
                ));
            }
            BusAddress::InProcess => {
                return Err(PipelineError::Sources(
                    "inproc: is the bus of `didim demo`; name can:INTERFACE, ethercat:INTERFACE, \
                    log:FILE or pcap:FILE",
                ));
            }
        }
    }
    let options = SocketCanOptions {
        accepts_fd: bus.layout.messages().iter().any(|message| message.format.is_fd),
        ids: Some(bus.layout.messages().iter().map(|message| message.format.id).collect()),
        receive_buffer_bytes: bus.receive_buffer_bytes,
        waits_for_interfaces: true,
    };
    let source = SocketCanSource::open(&interfaces, &options).map_err(SourceError::from)?;
    let receive_buffer = Some(ReceiveBuffer {
        asked_bytes: u64::from(bus.receive_buffer_bytes),
        granted_bytes: source.receive_buffer_bytes().map(u64::from),
    });
    Ok(OpenedSource { source: Box::new(source), pace: Pace::Live, receive_buffer })
}
