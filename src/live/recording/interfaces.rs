//! Choice of the interfaces of a log whose frames count.

use core::time::Duration;
use std::path::{Path, PathBuf};

use didim_drivers::ethercat::Capture;
use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::layout::CompiledLayout;
use didim_drivers::source::{
    BlfSource, InterfaceName, McapSource, Received, Source, SourceError, TextLog,
};

use super::input::{is_mcap, open_log};

/// Number of frames that are searched for an identifier on two interfaces. Convention: buses that
/// are recorded together alternate within a few frames.
const SEARCHED_FRAMES: usize = 20_000;
/// Number of frames that are read at a time.
const BATCH_FRAMES: usize = 1024;

/// Interfaces that a person names.
#[derive(Clone, Copy, Debug, Default)]
pub struct NamedInterfaces<'a> {
    /// Those of the command line. Only they count.
    pub requested: &'a [InterfaceName],
    /// Those of the cell. They decide if the log has the same identifiers on several interfaces.
    pub configured: &'a [InterfaceName],
}

/// Error when a log cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenLogError {
    /// The log cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The log does not have a requested interface.
    #[error("{}: there is no interface {wanted} in it; its interfaces are {available}",
        file.display())]
    NoSuchInterface {
        /// The log.
        file: PathBuf,
        /// The requested interface.
        wanted: InterfaceName,
        /// Those of the log.
        available: String,
    },
    /// Several interfaces carry the identifiers of the layout.
    #[error(
        "{}: {id} is on several interfaces: {interfaces}. Name that of this arm with --interface, \
        or as `source = \"can:…\"` in [bus] of the cell",
        file.display()
    )]
    SeveralInterfaces {
        /// The log.
        file: PathBuf,
        /// An identifier of the layout.
        id: FrameId,
        /// The interfaces of the log.
        interfaces: String,
    },
}

/// Opens a log like [`open_log`], with the frames of the interfaces that count.
///
/// # Errors
/// [`OpenLogError`].
pub fn open_bus_log(
    path: &Path,
    layout: &CompiledLayout,
    named: NamedInterfaces<'_>,
) -> Result<Box<dyn Source>, OpenLogError> {
    // A capture has no interfaces, and a folder has only those of its service.
    let chosen = match path.is_dir() || Capture::is_one(path) {
        true => Vec::new(),
        false => choose_interfaces(path, layout, named)?,
    };
    Ok(open_log(path, Some(layout), &chosen)?)
}

/// Returns the interfaces whose frames count; all of them if the list is empty.
fn choose_interfaces(
    path: &Path,
    layout: &CompiledLayout,
    named: NamedInterfaces<'_>,
) -> Result<Vec<InterfaceName>, OpenLogError> {
    // Without the warnings of `open_log`, which follow when the frames are used.
    let mut source: Box<dyn Source> = if is_mcap(path) {
        Box::new(McapSource::open(path, &[]).map_err(SourceError::from)?)
    } else if BlfSource::is_one(path) {
        Box::new(BlfSource::open(path, &[]).map_err(SourceError::from)?)
    } else {
        Box::new(TextLog::open(path, &[]).map_err(SourceError::from)?)
    };
    let mut batch: Vec<Frame> = Vec::with_capacity(BATCH_FRAMES);
    // The first interface of each identifier of the layout.
    let ids = layout.messages().iter().map(|message| message.format.id);
    let mut first: Vec<(FrameId, Option<u8>)> = ids.map(|id| (id, None)).collect();
    let (mut searched, mut repeated) = (0, None);
    while searched < SEARCHED_FRAMES && repeated.is_none() {
        batch.clear();
        // A fault is reported when the frames are used.
        let received = source.receive(&mut batch, Duration::ZERO);
        for frame in batch.iter().filter(|frame| !frame.is_error()) {
            if let Some((id, interface)) = first.iter_mut().find(|(id, _)| *id == frame.id) {
                let on_another = *interface.get_or_insert(frame.interface) != frame.interface;
                repeated = repeated.or(on_another.then_some(*id));
            }
        }
        searched += batch.len();
        if !matches!(received, Ok(Received::Frames)) {
            break;
        }
    }
    let available = source.interfaces();
    let names = || {
        let names: Vec<&str> = available.iter().map(InterfaceName::as_str).collect();
        names.join(" ")
    };
    let file = path.to_path_buf();
    if let Some(wanted) = named.requested.iter().find(|name| !available.contains(name)) {
        let (wanted, available) = (*wanted, names());
        return Err(OpenLogError::NoSuchInterface { file, wanted, available });
    }
    let is_available = |name: &&InterfaceName| available.contains(name);
    let configured: Vec<InterfaceName> =
        named.configured.iter().filter(is_available).copied().collect();
    match repeated {
        _ if !named.requested.is_empty() => Ok(named.requested.to_vec()),
        None => Ok(Vec::new()),
        Some(id) if configured.is_empty() => {
            Err(OpenLogError::SeveralInterfaces { file, id, interfaces: names() })
        }
        Some(_) => Ok(configured),
    }
}
