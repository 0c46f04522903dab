//! `didim status`: what a running service knows.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use super::output::print;
use crate::cell::{Cell, ServiceSection};
use crate::pipeline::Places;
use crate::status::{ClientError, Colour, Health, Snapshot, fetch_status, render};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    service: WhichService,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Which running service is meant.
#[derive(Debug, Args)]
pub(super) struct WhichService {
    /// The cell file of the service, for the folder of its sockets
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// The folder of its sockets [default: the cell's, or /run/didim]
    #[arg(long, value_name = "FOLDER")]
    runtime: Option<PathBuf>,
}

impl WhichService {
    /// Where its sockets are.
    pub(super) fn places(&self) -> Result<Places, CliError> {
        let runtime = match (&self.runtime, &self.cell) {
            (Some(runtime), _) => runtime.clone(),
            (None, Some(cell)) => {
                Cell::read(Path::new(cell))
                    .map_err(CliError::configuration)?
                    .service
                    .runtime_directory
            }
            (None, None) => ServiceSection::default().runtime_directory,
        };
        Ok(Places::with_sockets_in(&runtime))
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let snapshot = fetch(&arguments.service.places()?).map_err(CliError::failed)?;
    if arguments.json {
        let json = serde_json::to_string(&snapshot).map_err(CliError::failed)?;
        return print(&format!("{json}\n"));
    }
    let colour = if std::io::stdout().is_terminal() { Colour::Always } else { Colour::Never };
    print(&render(&snapshot, colour))
}

/// The status of the whole service: where it runs in two processes, of both together. One of them
/// that does not answer is a reason why all is not well.
pub(super) fn fetch(places: &Places) -> Result<Snapshot, ClientError> {
    let mut snapshot = match fetch_status(&places.status_socket()) {
        Ok(snapshot) if snapshot.acquisition.is_some() => return Ok(snapshot),
        Ok(snapshot) => snapshot,
        Err(error) => {
            // Without the other one either, it is the first that a person is told of.
            let Ok(mut snapshot) = fetch_status(&places.acquisition_socket()) else {
                return Err(error);
            };
            snapshot.health.add(format!("the estimation does not answer: {error}"));
            return Ok(snapshot);
        }
    };
    match fetch_status(&places.acquisition_socket()) {
        Ok(other) => {
            snapshot.acquisition = other.acquisition;
            snapshot.health =
                Health::of(snapshot.acquisition.as_ref(), snapshot.estimation.as_ref());
            let own = snapshot.process.reasons();
            let others = other.process.reasons();
            let others = others.into_iter().map(|reason| format!("acquisition: {reason}"));
            own.into_iter().chain(others).for_each(|reason| snapshot.health.add(reason));
        }
        Err(error) => snapshot.health.add(format!("the acquisition does not answer: {error}")),
    }
    Ok(snapshot)
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::os::unix::net::UnixListener;
    use std::time::Instant;

    use super::*;
    use crate::acquire::SharedAcquisition;
    use crate::status::Collector;
    use crate::stream::StreamOptions;
    use crate::worker::SharedEstimation;

    /// Answers once, as the process with this half of the service does.
    fn answer(socket: &Path, acquires: bool) {
        let options = StreamOptions::new("cell", (Path::new("/tmp/x"), "x"), 6, 500.0, 1.0);
        let acquisition = acquires.then(SharedAcquisition::default);
        let estimation = (!acquires).then(SharedEstimation::default);
        let now = Instant::now();
        let snapshot =
            Collector::new(&options.unwrap(), acquisition, estimation, None, now).snapshot(now);
        let listener = UnixListener::bind(socket).unwrap();
        std::thread::spawn(move || {
            let mut stream = listener.accept().unwrap().0;
            stream.write_all(&serde_json::to_vec(&snapshot).unwrap()).unwrap();
        });
    }

    #[test]
    fn one_half_is_shown_without_the_other() {
        let folder = tempfile::tempdir_in("/tmp").unwrap();
        let places = Places::with_sockets_in(folder.path());
        assert!(matches!(fetch(&places), Err(ClientError::NoService { .. })));

        answer(&places.acquisition_socket(), true);
        let snapshot = fetch(&places).unwrap();
        assert!(snapshot.acquisition.is_some() && snapshot.estimation.is_none());
        let says = |snapshot: &Snapshot, words| {
            !snapshot.health.ok && snapshot.health.reasons.iter().any(|why| why.contains(words))
        };
        assert!(says(&snapshot, "the estimation does not answer"), "{snapshot:?}");
        assert!(says(&snapshot, "no frame has come yet"), "{snapshot:?}");

        answer(&places.status_socket(), false);
        let snapshot = fetch(&places).unwrap();
        assert!(snapshot.acquisition.is_none() && snapshot.estimation.is_some());
        assert!(says(&snapshot, "the acquisition does not answer"), "{snapshot:?}");
    }
}
