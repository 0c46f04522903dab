//! Messages: JSON objects with the name and the version of their layout. Units are those of the
//! history.

use didim::archive::drift::{AlarmStatus, DriftStatus};
use didim::archive::store::{HistoryLine, Timestamp};
use didim::live::acquire::BusState;
use didim::service::status::{Health, Snapshot};
use didim::text::sha256;
use serde::{Deserialize, Serialize};

/// Version of the layouts: it changes when a key changes its meaning or is removed.
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

/// Kind of message.
pub(crate) trait Content: Serialize {
    /// Name of the layout.
    const SCHEMA: &'static str;
}

/// State of a cabinet. The broker itself reports it as offline when the connection ends.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct State {
    /// True if its service answers.
    pub(crate) online: bool,
    /// Reason if it does not answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) why: Option<String>,
    /// Time of this state; `None` in the last will.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) time: Option<Timestamp>,
    /// Status of the service.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) service: Option<Service>,
    /// Counts of all messages that were never sent; `None` in the last will.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unsent: Option<UnsentCounts>,
}

/// Counts of messages that cannot be sent any more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct UnsentCounts {
    /// Results whose history line was gone or unreadable when their turn came.
    pub(crate) results: u64,
    /// Alarms beyond the capacity while the broker was away.
    pub(crate) alarms: u64,
}

impl State {
    /// Returns true if the states differ only in time and counts.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let health = |of: &Self| of.service.as_ref().map(|service| service.health.clone());
        let rest = |of: &Self| (of.online, of.why.clone(), of.unsent);
        rest(self) == rest(other) && health(self) == health(other)
    }
}

impl Content for State {
    const SCHEMA: &'static str = "didim.state";
}

/// Part of a service's status that a plant needs.
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

/// Bus status since the start of the service.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Bus {
    state: BusState,
    frames: u64,
    samples: u64,
    samples_per_second: f64,
}

/// Window counts since the start of the service.
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

/// Result: its unchanged history line.
#[derive(Debug, Serialize)]
pub(crate) struct ResultMessage<'a> {
    /// Unique identity: a receiver that has seen it already has the result.
    pub(crate) identity: &'a str,
    pub(crate) line: &'a HistoryLine,
}

impl Content for ResultMessage<'_> {
    const SCHEMA: &'static str = "didim.result";
}

/// Difference of the last result from the baseline; `None` without a baseline.
#[derive(Debug, Serialize)]
pub(crate) struct DriftMessage<'a> {
    pub(crate) drift: Option<&'a DriftStatus>,
}

impl Content for DriftMessage<'_> {
    const SCHEMA: &'static str = "didim.drift";
}

/// Change of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum AlarmTurn {
    Raised,
    Cleared,
}

/// An alarm that was raised or cleared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AlarmMessage {
    /// Unique identity of the message.
    identity: String,
    pub(crate) event: AlarmTurn,
    /// Alarm in its last status.
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
