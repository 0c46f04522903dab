//! The thread that looks for a load in the last seconds of motion.

use core::time::Duration;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;

use super::track::{LoadTrack, Look};
use crate::archive::drift::{Baseline, BaselineWatch};
use crate::archive::store::{FoundLoad, Timestamp, mass_text};
use crate::live::worker::configuration::Identifier;
use crate::live::worker::load_status::{LoadState, LoadStatus};
use crate::live::worker::log_rate::LogRate;
use crate::live::worker::setup::{WhenBusy, WorkerError};
use crate::live::worker::state::SharedEstimation;
use crate::window::Window;

/// How soon a baseline that is set or cleared is noticed.
const LOOK_EVERY: Duration = Duration::from_millis(500);
/// How often a wait for the thread looks whether it is over.
const POLL: Duration = Duration::from_millis(2);
/// What is said while there is no baseline.
const NO_BASELINE: &str = "there is no baseline; `didim baseline set` sets one, with the arm empty";

/// Some seconds of motion, and what looks for a load in them.
struct Piece {
    window: Window,
    identifier: Identifier,
}

/// The sending side. One piece is looked at, one may wait.
#[derive(Debug)]
pub(in crate::live::worker) struct LoadWatch {
    pieces: SyncSender<Piece>,
    thread: JoinHandle<()>,
    shared: SharedEstimation,
}

impl LoadWatch {
    /// Starts the thread; the baseline is that of the folder.
    pub(in crate::live::worker) fn start(
        folder: &Path,
        shared: &SharedEstimation,
    ) -> Result<Self, WorkerError> {
        let (pieces, waiting) = sync_channel(1);
        shared.update().load = Some(LoadStatus::default());
        let mut watcher = Watcher::new(folder, shared.clone());
        let thread = std::thread::Builder::new()
            .name("load".into())
            .spawn(move || watcher.run(&waiting))
            .map_err(WorkerError::Thread)?;
        Ok(Self { pieces, thread, shared: shared.clone() })
    }

    /// Has a piece looked at. Of a living bus it is left out, and counted, while the thread is busy.
    pub(in crate::live::worker) fn submit(
        &self,
        mut window: Window,
        identifier: Identifier,
        when_busy: WhenBusy,
        stop: &AtomicBool,
    ) -> Result<(), WorkerError> {
        window.note.clone_from(&self.shared.update().note);
        let mut piece = Piece { window, identifier };
        loop {
            piece = match self.pieces.try_send(piece) {
                Ok(()) => return Ok(()),
                // It panicked; its message is in the log.
                Err(TrySendError::Disconnected(_)) => return Err(WorkerError::IdentificationEnded),
                Err(TrySendError::Full(piece)) => piece,
            };
            if when_busy == WhenBusy::Reject {
                if let Some(load) = &mut self.shared.update().load {
                    load.looks_left_out += 1;
                }
                return Ok(());
            }
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            self.shared.count_iteration();
            std::thread::sleep(POLL);
        }
    }

    /// Lets what waits be looked at, unless it is told to stop. A stop leaves the thread behind, which has nothing to take down.
    pub(in crate::live::worker) fn finish(self, stop: &AtomicBool) {
        drop(self.pieces);
        while !self.thread.is_finished() && !stop.load(Ordering::Relaxed) {
            self.shared.count_iteration();
            std::thread::sleep(POLL);
        }
    }
}

struct Watcher {
    watch: BaselineWatch,
    baseline: Option<Baseline>,
    track: LoadTrack,
    shared: SharedEstimation,
    /// An arm that picks and places changes its load with each cycle.
    changes: LogRate,
}

impl Watcher {
    fn new(folder: &Path, shared: SharedEstimation) -> Self {
        let watch = BaselineWatch::new(folder);
        Self {
            watch,
            baseline: None,
            track: LoadTrack::from(Look::NONE),
            shared,
            changes: LogRate::default(),
        }
    }

    fn run(&mut self, pieces: &Receiver<Piece>) {
        self.look_for_baseline();
        loop {
            match pieces.recv_timeout(LOOK_EVERY) {
                Ok(Piece { window, identifier }) => {
                    self.look_for_baseline();
                    if let Some(baseline) = &self.baseline
                        && let Some(found) = identifier.load(baseline, &window)
                    {
                        self.take(found.map_err(|why| why.to_string()));
                    }
                }
                Err(RecvTimeoutError::Timeout) => self.look_for_baseline(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// With another baseline everything begins anew.
    fn look_for_baseline(&mut self) {
        let (baseline, why_not) = match self.watch.look() {
            None => return,
            Some(Ok(Some(baseline))) => {
                (Some(baseline), "the arm has not moved long enough yet".to_owned())
            }
            Some(Ok(None)) => (None, NO_BASELINE.to_owned()),
            Some(Err(error)) => {
                // It may be readable again without being another file.
                self.watch.forget();
                (None, error.to_string())
            }
        };
        self.baseline = baseline;
        self.track = LoadTrack::from(Look::NONE);
        tell(&self.shared, |status| {
            *status = LoadStatus {
                why_not: Some(why_not),
                changes: status.changes,
                looks_left_out: status.looks_left_out,
                ..LoadStatus::default()
            };
        });
    }

    fn take(&mut self, found: Result<FoundLoad, String>) {
        let found = match found {
            Ok(found) => found,
            Err(why) => return tell(&self.shared, |status| status.why_not = Some(why)),
        };
        let before = self.track.handle_look(Look::of(&found));
        let (level, suspects) = (self.track.level(), self.track.suspects());
        let log = &mut self.changes;
        tell(&self.shared, |status| {
            status.why_not = None;
            status.last_look = Some(found);
            let first = status.state == LoadState::Unknown;
            // Before two looks agree that there is a load, it is not known that there is none.
            if before.is_none() && (!first || suspects) {
                return;
            }
            status.state = state_of(level);
            status.since = Some(Timestamp::now());
            status.mass_kg = level.mass.filter(|_| before.is_some());
            if let Some(before) = before.filter(|_| !first) {
                status.before_kg = before.mass;
                status.changes += 1;
                let [from, to] = [before, level].map(text_of);
                if let Some(unlogged) = log.admit("load", Instant::now()) {
                    tracing::info!(
                        unlogged,
                        "the load on the flange has changed: {from} before, {to} now"
                    );
                }
            } else {
                tracing::info!("the load on the flange: {}", text_of(level));
            }
        });
    }
}

fn tell(shared: &SharedEstimation, change: impl FnOnce(&mut LoadStatus)) {
    change(shared.update().load.get_or_insert_default());
}

fn state_of(look: Look) -> LoadState {
    match look.mass {
        _ if look.seen => LoadState::Load,
        Some(mass) if mass.differs_from_none() => LoadState::Less,
        _ => LoadState::None,
    }
}

fn text_of(look: Look) -> String {
    match state_of(look) {
        LoadState::Unknown | LoadState::None => "none".to_owned(),
        LoadState::Load | LoadState::Less => mass_text(look.mass),
    }
}
