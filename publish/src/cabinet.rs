//! One cabinet: what is read of its service, and what is to be sent next.

use core::time::Duration;
use std::path::Path;
use std::time::Instant;

use didim::archive::drift::DriftStatus;
use didim::archive::store::{HistoryFollower, HistoryLine, HistoryMark, Timestamp};
use didim::service::paths::Paths;
use didim::service::status::fetch;

use crate::configuration::CabinetSection;
use crate::ledger::{Ledger, LedgerError};
use crate::message::{Content, DriftMessage, Envelope, ResultMessage, Service, State};

/// A state that does not change is sent so often.
const STATE_EVERY: Duration = Duration::from_secs(60);
/// One that changes is sent no oftener.
const STATE_AT_MOST: Duration = Duration::from_secs(5);

/// A message, and what its acknowledgement means.
#[derive(Debug)]
pub(crate) struct Message {
    /// Last level of its topic.
    pub(crate) kind: Kind,
    /// JSON.
    pub(crate) payload: Vec<u8>,
}

/// The kinds of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    State,
    Alarm,
    Drift,
    Result,
}

impl Kind {
    /// The last level of its topic.
    pub(crate) fn level(self) -> &'static str {
        match self {
            Self::State => "state",
            Self::Alarm => "alarm",
            Self::Drift => "drift",
            Self::Result => "result",
        }
    }

    /// Whether the broker keeps the last one for who comes later: what is so now, and not what has happened.
    pub(crate) fn is_retained(self) -> bool {
        matches!(self, Self::State | Self::Drift)
    }
}

/// A cabinet.
#[derive(Debug)]
pub(crate) struct Cabinet {
    name: String,
    paths: Paths,
    ledger: Ledger,
    history: HistoryFollower,
    /// The line that is to be sent, until the broker has it.
    line: Option<HistoryLine>,
    /// What the last look found.
    state: State,
    drift: Option<DriftStatus>,
    /// What the broker has of them.
    sent_state: Option<(Instant, State)>,
    sent_drift: Option<Option<DriftStatus>>,
    /// The history could not be read, and that was told.
    unreadable: bool,
}

impl Cabinet {
    /// Of a section of the configuration, with its ledger in a folder.
    ///
    /// # Errors
    /// [`LedgerError`].
    pub(crate) fn open(section: &CabinetSection, folder: &Path) -> Result<Self, LedgerError> {
        let ledger = Ledger::open(folder, &section.name)?;
        let history = HistoryFollower::new(&section.state_directory, ledger.mark().cloned());
        Ok(Self {
            name: section.name.clone(),
            paths: Paths::with_sockets_in(&section.runtime_directory),
            ledger,
            history,
            line: None,
            state: State::default(),
            drift: None,
            sent_state: None,
            sent_drift: None,
            unreadable: false,
        })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// What the broker says when the connection ends.
    pub(crate) fn will(&self) -> Vec<u8> {
        let why = Some("its publisher has no connection to the broker any more".to_owned());
        self.json(State { why, ..State::default() })
    }

    /// There is a new connection: the broker has said the last will, or may have.
    pub(crate) fn connected(&mut self) {
        self.sent_state = None;
        self.sent_drift = None;
    }

    /// Asks the service how it is.
    pub(crate) fn look(&mut self) {
        let asked = fetch(&self.paths);
        let answered = asked.is_ok();
        if answered != self.state.online || self.state.time.is_none() {
            match &asked {
                Ok(_) => tracing::info!("{}: the service answers", self.name),
                Err(why) => tracing::warn!("{}: the service does not answer: {why}", self.name),
            }
        }
        let mut state =
            State { online: answered, time: Some(Timestamp::now()), ..State::default() };
        match asked {
            Err(why) => state.why = Some(why.to_string()),
            Ok(snapshot) => {
                state.service = Some(Service::of(&snapshot));
                if let Some(estimation) = snapshot.estimation {
                    // Without a baseline nothing is known of alarms, and none is cleared.
                    if let Some(drift) = &estimation.drift {
                        self.ledger.take_alarms(&drift.alarms);
                    }
                    self.drift = estimation.drift;
                }
            }
        }
        state.unsent = Some(self.ledger.unsent());
        self.state = state;
    }

    /// What is to be sent: how it is now first, then alarms, and the results as they come.
    pub(crate) fn next(&mut self, now: Instant) -> Option<Message> {
        let message = |kind, payload| Some(Message { kind, payload });
        if self.state_is_due(now) {
            return message(Kind::State, self.json(self.state.clone()));
        }
        if let Some(alarm) = self.ledger.alarm() {
            return message(Kind::Alarm, self.json(alarm.clone()));
        }
        if self.sent_drift.as_ref() != Some(&self.drift) {
            return message(Kind::Drift, self.json(DriftMessage { drift: self.drift.as_ref() }));
        }
        if self.line.is_none() {
            self.line = self.next_line();
        }
        let line = self.line.as_ref()?;
        let HistoryMark { identity, .. } = HistoryMark::of(line);
        message(Kind::Result, self.json(ResultMessage { identity: &identity, line }))
    }

    /// The broker has what was to be sent.
    pub(crate) fn acknowledge(&mut self, kind: Kind, now: Instant) {
        match kind {
            Kind::State => self.sent_state = Some((now, self.state.clone())),
            Kind::Alarm => self.ledger.acknowledge_alarm(),
            Kind::Drift => self.sent_drift = Some(self.drift.clone()),
            Kind::Result => {
                if let Some(line) = self.line.take() {
                    self.ledger.acknowledge_result(&line);
                }
            }
        }
    }

    fn state_is_due(&self, now: Instant) -> bool {
        let Some((then, sent)) = &self.sent_state else { return true };
        let age = now.saturating_duration_since(*then);
        age >= STATE_EVERY || age >= STATE_AT_MOST && !self.state.is_like(sent)
    }

    fn next_line(&mut self) -> Option<HistoryLine> {
        match self.history.next_line() {
            Ok(line) => {
                self.unreadable = false;
                line
            }
            Err(why) => {
                if !self.unreadable {
                    tracing::warn!("{}: no result is sent: {why}", self.name);
                }
                self.unreadable = true;
                None
            }
        }
    }

    /// No message of ours fails to be JSON: its keys are texts.
    fn json<T: Content>(&self, content: T) -> Vec<u8> {
        Envelope::json(&self.name, content).unwrap_or_default()
    }
}
