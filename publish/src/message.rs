//! What is sent: JSON objects with the name and the version of their layout. Units are those of the history.

use didim::archive::drift::{AlarmStatus, DriftStatus};
use didim::archive::store::{HistoryLine, Timestamp};
use didim::live::acquire::BusState;
use didim::service::status::{Health, Snapshot};
use didim::text::sha256;
use serde::{Deserialize, Serialize};

/// Version of the layouts: it changes when a key changes its meaning or goes away.
const VERSION: u32 = 1;

/// Of every message.
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

/// A kind of message.
pub(crate) trait Content: Serialize {
    /// Name of its layout.
    const SCHEMA: &'static str;
}

/// How it is with a cabinet. The broker says by itself that it is offline when the connection ends.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct State {
    /// Whether its service answers.
    pub(crate) online: bool,
    /// Why it does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) why: Option<String>,
    /// When this was so; nothing in what the broker says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) time: Option<Timestamp>,
    /// What the service says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) service: Option<Service>,
    /// What was not sent, ever; nothing in what the broker says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unsent: Option<Unsent>,
}

/// What cannot be sent any more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Unsent {
    /// Results of which there was no line in the history any more when their turn came, or none that can be read.
    pub(crate) results: u64,
    /// Alarms that had no room while the broker was away.
    pub(crate) alarms: u64,
}

impl State {
    /// Whether it differs in nothing but time and counts.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let health = |of: &Self| of.service.as_ref().map(|service| service.health.clone());
        let rest = |of: &Self| (of.online, of.why.clone(), of.unsent);
        rest(self) == rest(other) && health(self) == health(other)
    }
}

impl Content for State {
    const SCHEMA: &'static str = "didim.state";
}

/// Of the status of a service, what a plant looks at.
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

/// Since the start of the service.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Bus {
    state: BusState,
    frames: u64,
    samples: u64,
    samples_per_second: f64,
}

/// Since the start of the service.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Windows {
    identified: u64,
    rejected: u64,
}

impl Service {
    pub(crate) fn of(snapshot: &Snapshot) -> Self {
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

/// A result: its line of the history as it stands there.
#[derive(Debug, Serialize)]
pub(crate) struct ResultMessage<'a> {
    /// Tells it from every other one: who has seen it has the result.
    pub(crate) identity: &'a str,
    pub(crate) line: &'a HistoryLine,
}

impl Content for ResultMessage<'_> {
    const SCHEMA: &'static str = "didim.result";
}

/// How the last result differs from the baseline; nothing without one.
#[derive(Debug, Serialize)]
pub(crate) struct DriftMessage<'a> {
    pub(crate) drift: Option<&'a DriftStatus>,
}

impl Content for DriftMessage<'_> {
    const SCHEMA: &'static str = "didim.drift";
}

/// What became of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum AlarmTurn {
    Raised,
    Cleared,
}

/// An alarm that was raised or cleared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AlarmMessage {
    /// Tells it from every other one.
    identity: String,
    pub(crate) event: AlarmTurn,
    /// As the status had it last.
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
