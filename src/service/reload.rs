//! Reload of the cell file of a running service.

use std::path::PathBuf;

use crate::analysis::identify::LastIdentification;
use crate::cell::Cell;
use crate::service::pipeline::build_configuration;
use crate::service::supervision::Reload;

/// Creates a function that reads the cell file again at each call. The settings of the bus and of
/// the service itself must be equal to those of `running`. They change only at a restart, so that
/// no sample is lost. `estimates` is true if this process has a worker, which uses the other
/// settings.
pub fn reload_of(file: PathBuf, running: Cell, estimates: bool) -> Reload {
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
        build_configuration(&cell, &LastIdentification::default())
            .map(Some)
            .map_err(|error| error.to_string())
    })
}
