//! Messages to the broker. They are JSON objects with the name and the version of their layout.
//! Their units are those of the history.

use didim::archive::drift::{AlarmStatus, DriftStatus};
use didim::archive::store::{HistoryLine, Timestamp};
use didim::live::acquire::BusState;
use didim::service::status::{Health, Snapshot};
use didim::text::sha256;
use serde::{Deserialize, Serialize};

/// Version of the layouts. It increases when a key changes its meaning or is removed.
const VERSION: u32 = 1;

/// Fields of every message.
#[derive(Debug, Serialize)]
pub(crate) struct Envelope<'a, T> {
    schema: &'static str,
    version: u32,
    cabinet: &'a str,
    #[serde(flatten)]
    content: T,
}

impl<'a, T: Content> Envelope<'a, T> {
    pub(crate) fn json(cabinet: &'a str, content: T) -> Result<Vec<u8>, serde_json::Error> {
        serde_json::to_vec(&Self { schema: T::SCHEMA, version: VERSION, cabinet, content })
    }
}

/// Content of one kind of message.
pub(crate) trait Content: Serialize {
    /// Name of the message's layout.
    const SCHEMA: &'static str;
}

/// State of a cabinet. When the connection ends, the broker itself publishes the state as offline.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct State {
    /// True if the service of the cabinet answers.
    pub(crate) online: bool,
    /// Reason why the service does not answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) why: Option<String>,
    /// Time of this state; `None` in the last will.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) time: Option<Timestamp>,
    /// Status of the service.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) service: Option<Service>,
    /// Numbers of results and alarms that were never sent; `None` in the last will.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unsent: Option<UnsentCounts>,
}

/// Numbers of results and alarms that cannot be sent any more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct UnsentCounts {
    /// Number of results whose line in the history was missing or unreadable when it was to be
    /// sent.
    pub(crate) results: u64,
    /// Number of alarms that were dropped because too many waited for the broker.
    pub(crate) alarms: u64,
}

impl State {
    /// Returns true if two states have the same availability, reason, unsent counts and health of
    /// the service. Their times and the counts of the service may differ.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let health = |of: &Self| of.service.as_ref().map(|service| service.health.clone());
        let rest = |of: &Self| (of.online, of.why.clone(), of.unsent);
        rest(self) == rest(other) && health(self) == health(other)
    }
}

impl Content for State {
    const SCHEMA: &'static str = "didim.state";
}

/// Status of a service, as far as a plant needs it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Service {
    version: String,
    cell: String,
    uptime_s: f64,
    pub(crate) health: Health,
    sample_rate_hz: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    bus: Option<Bus>,
    #[serde(skip_serializing_if = "Option::is_none")]
    windows: Option<Windows>,
}

/// Counts of the bus since the start of the service.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Bus {
    state: BusState,
    frames: u64,
    samples: u64,
    samples_per_second: f64,
}

/// Counts of windows since the start of the service.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Windows {
    identified: u64,
    rejected: u64,
}

impl Service {
    pub(crate) fn from_snapshot(snapshot: &Snapshot) -> Self {
        let bus = snapshot.acquisition.as_ref().map(|of| Bus {
            state: of.bus,
            frames: of.frames,
            samples: of.samples,
            samples_per_second: of.samples_per_second,
        });
        let windows = snapshot.estimation.as_ref().map(|of| Windows {
            identified: of.windows_identified,
            rejected: of.windows_rejected.values().sum(),
        });
        Self {
            version: snapshot.version.clone(),
            cell: snapshot.cell.clone(),
            uptime_s: snapshot.uptime_s,
            health: snapshot.health.clone(),
            sample_rate_hz: snapshot.stream.sample_rate_hz,
            bus,
            windows,
        }
    }
}

/// Message with a result, which is its unchanged line of the history.
#[derive(Debug, Serialize)]
pub(crate) struct ResultMessage<'a> {
    /// Unique identity of the message. A receiver that already has a message with this identity can
    /// ignore this one.
    pub(crate) identity: &'a str,
    pub(crate) line: &'a HistoryLine,
}

impl Content for ResultMessage<'_> {
    const SCHEMA: &'static str = "didim.result";
}

/// Message with the difference of the last result from the baseline; `None` without a baseline.
#[derive(Debug, Serialize)]
pub(crate) struct DriftMessage<'a> {
    pub(crate) drift: Option<&'a DriftStatus>,
}

impl Content for DriftMessage<'_> {
    const SCHEMA: &'static str = "didim.drift";
}

/// Direction in which an alarm changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum AlarmTurn {
    Raised,
    Cleared,
}

/// Message about an alarm that was raised or cleared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AlarmMessage {
    /// Unique identity of the message.
    identity: String,
    pub(crate) event: AlarmTurn,
    /// Latest status of the alarm.
    pub(crate) alarm: AlarmStatus,
}

impl Content for AlarmMessage {
    const SCHEMA: &'static str = "didim.alarm";
}

impl AlarmMessage {
    pub(crate) fn new(cabinet: &str, event: AlarmTurn, alarm: &AlarmStatus) -> Self {
        let since = alarm.since.to_string();
        let turn = if event == AlarmTurn::Raised { "raised" } else { "cleared" };
        let identity = sha256(&[cabinet, &alarm.parameter, &since, turn]);
        Self { identity, event, alarm: alarm.clone() }
    }
}
