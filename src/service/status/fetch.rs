//! The status of a whole service, of one process or two.

use super::client::{ClientError, fetch_status};
use super::snapshot::{Health, Snapshot};
use crate::service::paths::Paths;

/// The status of the whole service: where it runs in two processes, of both together. One of them
/// that does not answer is a reason why all is not well.
///
/// # Errors
/// [`ClientError`] when none answers.
pub fn fetch(paths: &Paths) -> Result<Snapshot, ClientError> {
    let mut snapshot = match fetch_status(&paths.status_socket()) {
        Ok(snapshot) if snapshot.acquisition.is_some() => return Ok(snapshot),
        Ok(snapshot) => snapshot,
        Err(error) => {
            // Without the other one either, it is the first that a person is told of.
            let Ok(mut snapshot) = fetch_status(&paths.acquisition_socket()) else {
                return Err(error);
            };
            snapshot.health.add(format!("the estimation does not answer: {error}"));
            return Ok(snapshot);
        }
    };
    match fetch_status(&paths.acquisition_socket()) {
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
    use std::path::Path;
    use std::time::Instant;

    use super::*;
    use crate::live::acquire::SharedAcquisition;
    use crate::live::stream::StreamOptions;
    use crate::live::worker::SharedEstimation;
    use crate::service::status::Collector;

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
        let paths = Paths::with_sockets_in(folder.path());
        assert!(matches!(fetch(&paths), Err(ClientError::NoService { .. })));

        answer(&paths.acquisition_socket(), true);
        let snapshot = fetch(&paths).unwrap();
        assert!(snapshot.acquisition.is_some() && snapshot.estimation.is_none());
        let says = |snapshot: &Snapshot, words| {
            !snapshot.health.ok && snapshot.health.reasons.iter().any(|why| why.contains(words))
        };
        assert!(says(&snapshot, "the estimation does not answer"), "{snapshot:?}");
        assert!(says(&snapshot, "no frame has come yet"), "{snapshot:?}");

        answer(&paths.status_socket(), false);
        let snapshot = fetch(&paths).unwrap();
        assert!(snapshot.acquisition.is_none() && snapshot.estimation.is_some());
        assert!(says(&snapshot, "the acquisition does not answer"), "{snapshot:?}");
    }
}
