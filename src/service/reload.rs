//! The cell file of a running service, read again.

use std::path::PathBuf;

use crate::cell::Cell;
use crate::offline::identify::LastIdentification;
use crate::service::paths::Paths;
use crate::service::pipeline::configuration;
use crate::service::supervision::Reload;

/// Reads the file again each time that it is called. What concerns the bus or the service itself must
/// be as in `running`: nothing of it changes until a restart, so that no sample is lost. `estimates`
/// says whether this process has a worker that is to use the rest.
pub fn reload_of(file: PathBuf, running: Cell, paths: Paths, estimates: bool) -> Reload {
    Box::new(move || {
        let cell = Cell::read_decided(&file).map_err(|error| error.to_string())?;
        if let Some(key) = running.needs_restart_for(&cell) {
            return Err(format!(
                "{}: `{key}` has changed, which needs a restart of the service; only [window], \
                 [identification], [controller], [service.drift] and the robot can change without \
                 one",
                file.display()
            ));
        }
        if !estimates {
            return Ok(None);
        }
        configuration(&cell, &paths, &LastIdentification::default())
            .map(Some)
            .map_err(|error| error.to_string())
    })
}
