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
