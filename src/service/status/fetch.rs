//! The status of a service that runs in one process or in two.

use super::client::{ClientError, fetch_status};
use super::snapshot::{Health, Snapshot};
use crate::service::paths::Paths;

/// Returns the status of the complete service. If it runs in two processes, both are merged. If one
/// of them does not answer, this is a reason for bad health.
///
/// # Errors
/// [`ClientError`] if no process answers.
pub fn fetch_snapshot(paths: &Paths) -> Result<Snapshot, ClientError> {
    let mut snapshot = match fetch_status(&paths.status_socket()) {
        Ok(snapshot) if snapshot.acquisition.is_some() => return Ok(snapshot),
        Ok(snapshot) => snapshot,
        Err(error) => {
            // If the other process does not answer either, the error of the first is returned.
            let Ok(mut snapshot) = fetch_status(&paths.acquisition_socket()) else {
                return Err(error);
            };
            snapshot.health.add(format!("the estimation does not answer: {error}"));
            return Ok(snapshot);
        }
    };
    match fetch_status(&paths.acquisition_socket()) {
        Ok(other) => merge(&mut snapshot, other),
        Err(error) => snapshot.health.add(format!("the acquisition does not answer: {error}")),
    }
    Ok(snapshot)
}

/// Adds the acquisition to the status of the estimation.
fn merge(snapshot: &mut Snapshot, other: Snapshot) {
    snapshot.acquisition = other.acquisition;
    for (kind, events) in &other.process.events {
        let entry = snapshot.process.events.entry(kind.clone()).or_default();
        entry.count += events.count;
        entry.lasted_ms += events.lasted_ms;
    }
    snapshot.health = Health::new(snapshot.acquisition.as_ref(), snapshot.estimation.as_ref());
    let reasons = snapshot.process.reasons();
    let others = other.process.reasons();
    let others = others.into_iter().map(|reason| format!("acquisition: {reason}"));
    reasons.into_iter().chain(others).for_each(|reason| snapshot.health.add(reason));
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::os::unix::net::UnixListener;
    use std::path::Path;
    use std::time::{Duration, Instant};

    use super::*;
    use crate::live::acquire::{AcquisitionStatus, BusState, RecentCounts, SharedAcquisition};
    use crate::live::stream::StreamOptions;
    use crate::live::worker::SharedEstimation;
    use crate::service::status::Collector;

    /// Answers once, like the process with this half of the service.
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

    /// Returns the health from both processes when the worker has received nothing for five
    /// seconds.
    fn without_samples(acquisition: &AcquisitionStatus) -> (Health, Health) {
        let options = StreamOptions::new("cell", (Path::new("/tmp/x"), "x"), 6, 500.0, 1.0);
        let start = Instant::now();
        let now = start + Duration::from_secs(5);
        let estimation = Some(SharedEstimation::default());
        let mut half = Collector::new(&options.unwrap(), None, estimation, None, start);
        let json = serde_json::json!({ "acquisition": acquisition });
        half.handle_document(&serde_json::to_vec(&json).unwrap(), now);
        let mut snapshot = half.snapshot(now);
        let alone = snapshot.health.clone();
        let other = Snapshot { acquisition: Some(acquisition.clone()), ..snapshot.clone() };
        merge(&mut snapshot, other);
        (alone, snapshot.health)
    }

    #[test]
    fn a_worker_that_gets_nothing_is_unwell_unless_there_is_nothing() {
        let recent = RecentCounts { seconds: 5.0, frames: 100, ..RecentCounts::default() };
        let flowing = AcquisitionStatus {
            bus: BusState::Ok,
            samples_per_second: 500.0,
            recent: RecentCounts { samples: 2500, ..recent.clone() },
            ..AcquisitionStatus::default()
        };
        let (alone, both) = without_samples(&flowing);
        assert!(alone.reasons[0].starts_with("no sample has come for 5 s: "), "{alone:?}");
        let [reason] = &both.reasons[..] else { panic!("{both:?}") };
        assert!(!both.ok && reason.ends_with("and the acquisition sends some"), "{reason}");

        // Drives that were disabled just now, and long ago.
        let stopped = AcquisitionStatus { samples_per_second: 0.0, ..flowing };
        let recent = RecentCounts { cycles_idle: 100, ..recent };
        let idle = AcquisitionStatus { recent, ..stopped.clone() };
        for (resting, idle) in [(stopped, false), (idle, true)] {
            let (alone, both) = without_samples(&resting);
            assert_eq!((alone.ok, alone.idle), (true, idle), "{alone:?}");
            assert_eq!((both.ok, both.idle), (true, idle), "{both:?}");
        }
    }

    #[test]
    fn one_half_is_shown_without_the_other() {
        let folder = tempfile::tempdir_in("/tmp").unwrap();
        let paths = Paths::with_sockets_in(folder.path());
        assert!(matches!(fetch_snapshot(&paths), Err(ClientError::NoService { .. })));

        answer(&paths.acquisition_socket(), true);
        let snapshot = fetch_snapshot(&paths).unwrap();
        assert!(snapshot.acquisition.is_some() && snapshot.estimation.is_none());
        let says = |snapshot: &Snapshot, words| {
            !snapshot.health.ok && snapshot.health.reasons.iter().any(|why| why.contains(words))
        };
        assert!(says(&snapshot, "the estimation does not answer"), "{snapshot:?}");
        assert!(says(&snapshot, "no frame has come yet"), "{snapshot:?}");

        answer(&paths.status_socket(), false);
        let snapshot = fetch_snapshot(&paths).unwrap();
        assert!(snapshot.acquisition.is_none() && snapshot.estimation.is_some());
        assert!(says(&snapshot, "the acquisition does not answer"), "{snapshot:?}");
    }
}
