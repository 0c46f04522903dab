//! One cabinet of the configuration: the data read from its service, and the next message to send.

use core::time::Duration;
use std::path::Path;
use std::time::Instant;

use didim::archive::drift::DriftStatus;
use didim::archive::store::{HistoryFollower, HistoryLine, HistoryMark, Timestamp};
use didim::service::paths::Paths;
use didim::service::status::fetch_snapshot;

use crate::configuration::CabinetSection;
use crate::ledger::{Ledger, LedgerError};
use crate::message::{Content, DriftMessage, Envelope, ResultMessage, Service, State};

/// Interval at which an unchanged state is sent again.
const STATE_INTERVAL: Duration = Duration::from_secs(60);
/// Minimum time between two messages of a changing state.
const MIN_STATE_INTERVAL: Duration = Duration::from_secs(5);

/// Message to the broker. Its kind decides what its acknowledgement changes.
#[derive(Debug)]
pub(crate) struct Message {
    /// Kind of the message, which gives the last level of its topic.
    pub(crate) kind: Kind,
    /// Content of the message, as JSON.
    pub(crate) payload: Vec<u8>,
}

/// Kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    State,
    Alarm,
    Drift,
    Result,
}

impl Kind {
    /// Returns the last level of the topic of this kind.
    pub(crate) fn topic_level(self) -> &'static str {
        match self {
            Self::State => "state",
            Self::Alarm => "alarm",
            Self::Drift => "drift",
            Self::Result => "result",
        }
    }

    /// Returns true if the broker keeps the last message of this kind for later subscribers. It
    /// does for messages about a present state and not for messages about an event.
    pub(crate) fn is_retained(self) -> bool {
        matches!(self, Self::State | Self::Drift)
    }
}

/// State of one cabinet between two messages.
#[derive(Debug)]
pub(crate) struct Cabinet {
    name: String,
    paths: Paths,
    ledger: Ledger,
    history: HistoryFollower,
    /// Line of the history to send, kept until the broker has acknowledged it.
    line: Option<HistoryLine>,
    /// State of the service from the last poll.
    state: State,
    drift: Option<DriftStatus>,
    /// State and drift that the broker acknowledged last.
    sent_state: Option<(Instant, State)>,
    sent_drift: Option<Option<DriftStatus>>,
    /// True if the history could not be read and the failure was logged.
    logged_unreadable: bool,
}

impl Cabinet {
    /// Opens the cabinet of a section of the configuration, with its ledger in a folder.
    ///
    /// # Errors
    /// [`LedgerError`] if the ledger cannot be read.
    pub(crate) fn open(section: &CabinetSection, folder: &Path) -> Result<Self, LedgerError> {
        let ledger = Ledger::open(folder, &section.name)?;
        let history =
            HistoryFollower::new(&section.state_directory, ledger.last_acknowledged().cloned());
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
            logged_unreadable: false,
        })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Returns the message that the broker publishes when the connection ends.
    pub(crate) fn last_will(&self) -> Vec<u8> {
        let why = Some("its publisher has no connection to the broker any more".to_owned());
        self.json(State { why, ..State::default() })
    }

    /// Handles a new connection. The broker may have published the last will since the last state
    /// was sent.
    pub(crate) fn handle_connection(&mut self) {
        self.sent_state = None;
        self.sent_drift = None;
    }

    /// Polls the status of the service.
    pub(crate) fn poll(&mut self) {
        let asked = fetch_snapshot(&self.paths);
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
                state.service = Some(Service::from_snapshot(&snapshot));
                if let Some(estimation) = snapshot.estimation {
                    // Without a baseline the alarms are unknown, so none of them is cleared.
                    if let Some(drift) = &estimation.drift {
                        self.ledger.take_alarms(&drift.alarms);
                    }
                    self.drift = estimation.drift;
                }
            }
        }
        state.unsent = Some(self.ledger.unsent_counts());
        self.state = state;
    }

    /// Returns the next message, or `None` if there is nothing to send. A due state is sent first,
    /// then alarms, the drift and results.
    pub(crate) fn next(&mut self, now: Instant) -> Option<Message> {
        let message = |kind, payload| Some(Message { kind, payload });
        if self.state_is_due(now) {
            return message(Kind::State, self.json(self.state.clone()));
        }
        if let Some(alarm) = self.ledger.next_alarm() {
            return message(Kind::Alarm, self.json(alarm.clone()));
        }
        if self.sent_drift.as_ref() != Some(&self.drift) {
            return message(Kind::Drift, self.json(DriftMessage { drift: self.drift.as_ref() }));
        }
        if self.line.is_none() {
            self.line = self.next_line();
        }
        let line = self.line.as_ref()?;
        let HistoryMark { identity, .. } = HistoryMark::from_line(line);
        message(Kind::Result, self.json(ResultMessage { identity: &identity, line }))
    }

    /// Handles the acknowledgement of the last message of this kind.
    pub(crate) fn handle_acknowledgement(&mut self, kind: Kind, now: Instant) {
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
        age >= STATE_INTERVAL || age >= MIN_STATE_INTERVAL && !self.state.is_like(sent)
    }

    fn next_line(&mut self) -> Option<HistoryLine> {
        match self.history.next_line() {
            Ok(line) => {
                self.logged_unreadable = false;
                line
            }
            Err(why) => {
                if !self.logged_unreadable {
                    tracing::warn!("{}: no result is sent: {why}", self.name);
                }
                self.logged_unreadable = true;
                None
            }
        }
    }

    /// Serializes a message. It cannot fail, because all keys of the messages are texts.
    fn json<T: Content>(&self, content: T) -> Vec<u8> {
        Envelope::json(&self.name, content).unwrap_or_default()
    }
}
