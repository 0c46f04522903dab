//! Events in the log and in the file of events. The file is written by a thread of its own, so that
//! a slow disk holds up nothing.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use crate::archive::events::{Event, Phase, append_events};

/// Maximum number of events that wait for the disk. Further ones are only in the log.
const MAX_WAITING: usize = 256;

/// Journal of a service.
#[derive(Debug)]
pub(super) struct Journal(Option<SyncSender<Event>>);

impl Journal {
    /// Creates the journal. Without a file, events are only in the log.
    pub(super) fn new(file: Option<PathBuf>) -> Self {
        let Some(file) = file else { return Self(None) };
        let (sender, events) = sync_channel(MAX_WAITING);
        let thread = std::thread::Builder::new().name("events".into());
        match thread.spawn(move || write_events(&file, &events)) {
            Ok(_) => Self(Some(sender)),
            Err(cause) => {
                tracing::warn!("events are not stored: {cause}");
                Self(None)
            }
        }
    }

    /// Logs an event, and stores it.
    pub(super) fn record(&self, event: Event) {
        let (kind, count) = (event.event.key(), event.count);
        let (interface, duration_s) = (event.interface.as_deref(), event.duration_s);
        match event.phase {
            Phase::Ends => {
                tracing::info!(event = kind, interface, count, duration_s, "{event}");
            }
            Phase::Begins | Phase::Once => {
                tracing::warn!(event = kind, interface, count, duration_s, "{event}");
            }
        }
        if let Some(sender) = &self.0 {
            // If the disk hangs, the event is in the log only.
            let _ = sender.try_send(event);
        }
    }
}

fn write_events(file: &std::path::Path, events: &Receiver<Event>) {
    let mut is_refused = false;
    while let Ok(first) = events.recv() {
        let batch: Vec<Event> = std::iter::once(first).chain(events.try_iter()).collect();
        let written = append_events(file, &batch);
        if let (Err(cause), false) = (&written, is_refused) {
            tracing::warn!("{}: events are not stored: {cause}", file.display());
        }
        is_refused = written.is_err();
    }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};
    use std::sync::Arc;
    use std::time::Duration;

    use super::*;
    use crate::archive::events::EventKind;
    use crate::archive::store::Timestamp;

    fn event() -> Event {
        Event {
            time: Timestamp::from_unix_s(1_700_000_000),
            event: EventKind::Unhealthy,
            phase: Phase::Once,
            interface: None,
            count: 1,
            duration_s: None,
            cause: None,
        }
    }

    /// Sends four events. The folder of the file exists when the third one comes.
    fn send_four(folder: &std::path::Path, sender: &SyncSender<Event>) {
        for number in 0..4 {
            match number {
                2 => fs::create_dir(folder).unwrap(),
                3 => fs::remove_dir_all(folder).unwrap(),
                _ => {}
            }
            sender.send(event()).unwrap();
            // Each is a write of its own.
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    #[test]
    fn a_disk_that_refuses_events_is_reported_once_until_it_takes_them() {
        let folder = tempfile::tempdir().unwrap();
        let (log, state) = (folder.path().join("log"), folder.path().join("state"));
        let writer = Arc::new(File::create(&log).unwrap());
        let subscriber = tracing_subscriber::fmt().with_writer(writer).finish();
        let (sender, events) = sync_channel(MAX_WAITING);
        let file = state.join("events.jsonl");
        let sending = std::thread::spawn(move || send_four(&state, &sender));
        tracing::subscriber::with_default(subscriber, || write_events(&file, &events));
        sending.join().unwrap();
        let words = fs::read_to_string(&log).unwrap();
        assert_eq!(words.matches("events are not stored").count(), 2, "{words}");
    }
}
