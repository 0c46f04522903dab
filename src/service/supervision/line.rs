//! The state of the service as one line, for `systemctl status`.

use std::time::Instant;

use crate::live::acquire::{AcquisitionStatus, BusState};
use crate::live::worker::{EstimationStatus, WindowState};
use crate::service::status::{Health, IDLE_TEXT, Snapshot};

/// State that the line needs in addition to the snapshot: the arrival time of the last estimate.
#[derive(Debug, Default)]
pub(super) struct StatusLine {
    identified: u64,
    last_identified_at: Option<Instant>,
}

impl StatusLine {
    /// Returns the line for the time `now`. Facts come first, then the reasons for bad health.
    pub(super) fn next_line(&mut self, snapshot: &Snapshot, now: Instant) -> String {
        let mut parts = Vec::new();
        parts.extend(
            snapshot.acquisition.as_ref().and_then(|status| bus_text(status, &snapshot.health)),
        );
        if let Some(estimation) = &snapshot.estimation {
            parts.push(window_text(estimation, snapshot.stream.sample_rate_hz));
            parts.push(self.estimate(estimation, now));
        }
        let facts = parts.join(", ");
        let reasons = &snapshot.health.reasons;
        if reasons.is_empty() { facts } else { format!("{facts}; {}", reasons.join("; ")) }
    }

    fn estimate(&mut self, estimation: &EstimationStatus, now: Instant) -> String {
        if estimation.windows_identified != self.identified {
            self.identified = estimation.windows_identified;
            self.last_identified_at = Some(now);
        }
        match (&estimation.last_estimate, self.last_identified_at) {
            (Some(estimate), Some(at)) => {
                let verdict = if estimate.applicable { "applicable" } else { "not applicable" };
                format!("last estimate {verdict}, {} s ago", (now - at).as_secs())
            }
            _ => "no estimate yet".to_owned(),
        }
    }
}

/// Returns the state of the bus. `None` if the state is bad, because the reasons contain it.
fn bus_text(acquisition: &AcquisitionStatus, health: &Health) -> Option<String> {
    match acquisition.bus {
        BusState::Ok if health.idle => Some(IDLE_TEXT.to_owned()),
        BusState::Ok => Some(format!("{:.0} samples/s", acquisition.samples_per_second)),
        state => state.is_well().then(|| state.sentence().to_owned()),
    }
}

#[expect(clippy::cast_precision_loss, reason = "a time for people")]
fn window_text(estimation: &EstimationStatus, sample_rate_hz: f64) -> String {
    match estimation.window {
        WindowState::Idle => "no window open".to_owned(),
        WindowState::Open { samples } => {
            format!("window open {:.1} s", samples as f64 / sample_rate_hz)
        }
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use super::*;
    use crate::live::worker::EstimateSummary;
    use crate::service::status::{ProcessStatus, SCHEMA, StreamStatus};

    #[test]
    fn the_line_says_what_flows_what_is_open_and_what_came_of_it() {
        let mut snapshot = Snapshot {
            schema: SCHEMA,
            version: String::new(),
            cell: String::new(),
            uptime_s: 0.0,
            health: Health { ok: true, ..Health::default() },
            process: ProcessStatus::default(),
            stream: StreamStatus { sample_rate_hz: 5000.0, ..StreamStatus::default() },
            acquisition: Some(AcquisitionStatus::default()),
            estimation: Some(EstimationStatus::default()),
        };
        let (mut line, start) = (StatusLine::default(), Instant::now());
        snapshot.health.add(BusState::Waiting.sentence().to_owned());
        let waiting = "no window open, no estimate yet; no frame has come yet";
        assert_eq!(line.next_line(&snapshot, start), waiting);
        snapshot.health = Health { ok: true, idle: true, ..Health::default() };
        let acquisition = AcquisitionStatus { bus: BusState::Ok, ..AcquisitionStatus::default() };
        snapshot.acquisition = Some(acquisition);
        let idle = "idle, no drive is enabled, no window open, no estimate yet";
        assert_eq!(line.next_line(&snapshot, start), idle);
        snapshot.health.idle = false;
        snapshot.acquisition = Some(AcquisitionStatus {
            bus: BusState::Ok,
            samples_per_second: 4999.7,
            ..AcquisitionStatus::default()
        });
        let estimate: EstimateSummary = serde_json::from_value(serde_json::json!({
            "window": 0, "first_sequence": 0, "last_sequence": 1, "method": "idim-ls",
            "parameters": [], "relative_error": null, "condition_number": null,
            "applicable": true, "reasons": []
        }))
        .unwrap();
        snapshot.estimation = Some(EstimationStatus {
            window: WindowState::Open { samples: 16_000 },
            windows_identified: 1,
            last_estimate: Some(estimate),
            ..EstimationStatus::default()
        });
        line.next_line(&snapshot, start);
        let later = start + Duration::from_secs(12);
        let facts = "5000 samples/s, window open 3.2 s, last estimate applicable, 12 s ago";
        assert_eq!(line.next_line(&snapshot, later), facts);
        snapshot.health.add("the receive buffer is small".to_owned());
        assert_eq!(
            line.next_line(&snapshot, later),
            format!("{facts}; the receive buffer is small")
        );
    }
}
