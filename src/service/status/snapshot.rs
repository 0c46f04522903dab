//! The status as one JSON object.

use serde::{Deserialize, Serialize};

use crate::archive::events::EventCounts;
use crate::live::acquire::{AcquisitionStatus, BusState, Grant, InterfaceProblem, SampleFlow};
use crate::live::recording::RecordingState;
use crate::live::worker::{EstimationStatus, Rejection};

/// Version of the object's layout. It changes when a key changes its meaning or is removed.
pub const SCHEMA: u32 = 2;

/// Status of the service. Fields of a later version are ignored, so that an old client can read a
/// new service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Name of the cell.
    pub cell: String,
    /// Time since the start of the service \[s\].
    pub uptime_s: f64,
    /// Health of the service.
    pub health: Health,
    /// Status of the answering process. If there are two processes, it is that of the estimating
    /// one.
    #[serde(default)]
    pub process: ProcessStatus,
    /// Stream between acquisition and estimation.
    pub stream: StreamStatus,
    /// The bus thread. `None` if another process runs it.
    pub acquisition: Option<AcquisitionStatus>,
    /// The worker. `None` if another process runs it.
    pub estimation: Option<EstimationStatus>,
}

/// Health of the service. If it is bad, the reasons are listed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// True if there are no reasons for bad health.
    pub ok: bool,
    /// Readable reasons.
    pub reasons: Vec<String>,
    /// True if no drive is enabled, so that no samples can arrive.
    #[serde(default)]
    pub idle: bool,
}

/// Health text of an idle service.
pub const IDLE_TEXT: &str = "idle, no drive is enabled";

/// Status of the process, apart from its threads.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ProcessStatus {
    /// Reason why a reloaded configuration was refused. `None` if it was accepted, or if there was
    /// no reload.
    pub reload_refused: Option<String>,
    /// Sockets whose files were removed, and the reasons why they cannot be created again.
    pub sockets_missing: Vec<String>,
    /// Folder of the stream, if it was removed while the service is running.
    pub stream_folder_gone: Option<String>,
    /// Numbers of events since the start, by kind. Kinds that did not occur are omitted.
    #[serde(skip_serializing_if = "EventCounts::is_empty")]
    pub events: EventCounts,
}

impl ProcessStatus {
    /// Returns the reasons for bad health of the process.
    pub fn reasons(&self) -> Vec<String> {
        let refused = self.reload_refused.iter();
        let refused = refused.map(|why| {
            format!("reload refused, the previous configuration stays in effect: {why}")
        });
        let gone = self.stream_folder_gone.iter().map(|folder| {
            format!(
                "{folder} was removed while the service runs: no other process finds the stream; \
                 restart the service"
            )
        });
        refused.chain(gone).chain(self.sockets_missing.iter().cloned()).collect()
    }
}

/// Dimensions of the stream.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StreamStatus {
    /// Nominal sample rate \[Hz\].
    pub sample_rate_hz: f64,
    /// Time that a worker may be inactive before samples are lost \[s\].
    pub buffer_s: f64,
    /// Shared memory of the cell \[bytes\].
    pub shared_memory_bytes: u64,
}

impl Health {
    /// Derives the health from the statuses. For the bus, only the last seconds are considered.
    /// Earlier faults remain in the counts, but are not a reason for bad health.
    pub fn new(
        acquisition: Option<&AcquisitionStatus>,
        estimation: Option<&EstimationStatus>,
    ) -> Self {
        let (mut reasons, mut idle) = (Vec::new(), false);
        acquisition_reasons(acquisition, &mut reasons, &mut idle);
        if let Some(estimation) = estimation {
            if let Some(seconds) = estimation.without_samples_s {
                match acquisition {
                    None => reasons.push(format!(
                        "no sample has come for {seconds} s: the bus is silent, no drive is \
                         enabled, or the acquisition does not run"
                    )),
                    Some(acquisition) if acquisition.samples_per_second > 0.0 => {
                        reasons.push(format!(
                            "no sample has come for {seconds} s, and the acquisition sends some"
                        ));
                    }
                    // The status of the acquisition already gives the reason.
                    Some(_) => {}
                }
            }
            // The remainder of a motion after `window identify` is not a fault.
            let rejected = estimation.last_rejection.as_ref();
            let rejected =
                rejected.filter(|of| !matches!(of.rejection, Rejection::Remainder { .. }));
            if let Some(rejected) = rejected {
                let later = estimation.last_estimate.as_ref();
                if later.is_none_or(|estimate| estimate.window < rejected.number) {
                    reasons.push(format!(
                        "the last window, {}, was rejected: {}",
                        rejected.number, rejected.rejection
                    ));
                }
            }
            if let Some(estimate) = &estimation.last_estimate
                && !estimate.monitoring_reasons.is_empty()
            {
                reasons.push(format!(
                    "the last estimate is not usable for monitoring: {}",
                    estimate.monitoring_reasons.join("; ")
                ));
            }
            if let Some(why) = &estimation.results_wait_for {
                let waiting = estimation.results_waiting;
                reasons.push(format!("{waiting} results wait to be stored: {why}"));
            }
            if let Some(why) = &estimation.history_waits_for {
                let waiting = estimation.history_lines_waiting;
                reasons.push(format!("{waiting} lines of the history wait to be written: {why}"));
            }
            if let Some((written, budget)) = estimation.written.results_over_budget() {
                reasons.push(format!(
                    "results alone have written {written} MB within 24 h, and \
                     service.write_mb_per_day allows {budget}; raise it, or identify less often"
                ));
            }
            if let Some(why) = &estimation.baseline_unreadable {
                reasons.push(format!(
                    "no result is compared with the baseline: {why}, or remove it with `didim \
                     baseline clear`"
                ));
            }
            if let Some(drift) = &estimation.drift {
                reasons.extend(drift.reasons());
            }
        }
        Self { ok: reasons.is_empty(), reasons, idle }
    }

    /// Returns the health text of a service that has no reason for bad health.
    pub fn label(&self) -> &'static str {
        if self.idle { IDLE_TEXT } else { "ok" }
    }

    /// Adds a reason for bad health.
    pub fn add(&mut self, reason: String) {
        self.ok = false;
        self.reasons.push(reason);
    }
}

fn acquisition_reasons(
    acquisition: Option<&AcquisitionStatus>,
    reasons: &mut Vec<String>,
    idle: &mut bool,
) {
    if let Some(acquisition) = acquisition {
        for (interface, problem) in &acquisition.interfaces_down {
            reasons.push(match problem {
                InterfaceProblem::Down => format!("the interface {interface} is down"),
                InterfaceProblem::Missing => format!("there is no interface {interface}"),
            });
        }
        let is_named = acquisition.bus == BusState::Down && !acquisition.interfaces_down.is_empty();
        if !acquisition.bus.is_well() && !is_named {
            reasons.push(acquisition.bus.sentence().to_owned());
        }
        match acquisition.flow() {
            SampleFlow::Well => {}
            SampleFlow::Idle => *idle = true,
            SampleFlow::Stopped { causes } => {
                reasons.push(format!("frames come, but no sample is complete: {causes}"));
            }
            SampleFlow::Lossy { lost, of, causes } => {
                reasons.push(format!("bus cycles are lost, {lost} of the last {of}: {causes}"));
            }
        }
        let grants =
            acquisition.real_time.iter().flat_map(|is| [&is.priority, &is.cpu, &is.memory]);
        for grant in grants {
            if let Grant::Refused { why } = grant {
                reasons.push(format!("not granted: {why}"));
            }
        }
        if let Some(recording) = &acquisition.recording
            && recording.state == RecordingState::Failed
        {
            let why = recording.why.as_deref().unwrap_or("see the log");
            reasons.push(format!("the bus is not recorded: {why}"));
        }
        if let Some(recording) = &acquisition.recording
            && recording.gives_way
        {
            let why = "the disk is nearly full: recordings of the ring are deleted to leave \
                           room for results; free disk space, or reduce the ring";
            reasons.push(why.to_owned());
        }
        let observer = acquisition.external_torque.as_ref();
        if let Some(problem) = observer.and_then(|of| of.problem.as_ref()) {
            reasons.push(format!("external torque: {problem}"));
        }
        let buffer = (acquisition.receive_buffer_bytes, acquisition.receive_buffer_asked_bytes);
        if let (Some(granted), Some(asked)) = buffer
            && granted < asked
        {
            reasons.push(format!(
                "the receive buffer has {granted} bytes instead of {asked}: raise \
                     net.core.rmem_max, or give the service CAP_NET_ADMIN"
            ));
        }
    }
}
