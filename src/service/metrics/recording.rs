//! Recording and kept recordings, as metric families.

use super::exposition::{FamilyKind, MetricsText, count_value, flag_value, write};
use crate::live::recording::{
    ArchiveStatus, RecordingState, RecordingStatus, WriteKind, WriteStatus,
};

use FamilyKind::{Counter, Gauge};

pub(super) fn add_recording(text: &mut MetricsText, status: &RecordingStatus) {
    let gauges = [
        (
            "didim_recording",
            "Whether frames are being written: 0 before the first frame, after a failure, at the \
            end.",
            flag_value(status.state == RecordingState::Recording),
        ),
        ("didim_recording_ring_bytes", "Size of the ring on disk.", count_value(status.ring_bytes)),
        (
            "didim_recording_ring_limit_bytes",
            "The largest size of the ring.",
            count_value(status.ring_limit_bytes),
        ),
        (
            "didim_recording_gives_way",
            "Whether the disk has no room for the whole ring, which gives way to results.",
            flag_value(status.gives_way),
        ),
    ];
    write(text, Gauge, &gauges);
    if let Some(oldest_s) = status.oldest_s {
        let help = "How far the ring goes back.";
        text.family("didim_recording_oldest_seconds", Gauge, help).value(oldest_s);
    }
    let counters = [
        ("didim_recording_frames_total", "Frames written.", status.frames_recorded),
        (
            "didim_recording_frames_unrecorded_total",
            "Frames not written: the disk was too slow, or failed.",
            status.frames_unrecorded,
        ),
        ("didim_recording_failures_total", "Times that writing failed.", status.write_errors),
        (
            "didim_recording_segments_given_way_total",
            "Files of the ring that were removed before their time, for want of room on the disk.",
            status.segments_given_way,
        ),
    ];
    write(text, Counter, &counters.map(|(name, help, value)| (name, help, count_value(value))));
}

/// Adds what the processes have written within 24 hours.
pub(super) fn add_written(text: &mut MetricsText, statuses: &[&WriteStatus]) {
    let labels = |kind: &WriteKind| kind.label().replace(' ', "-");
    let help = "Bytes written to disk within 24 hours, by kind.";
    let mut family = text.family("didim_written_day_bytes", Gauge, help);
    for (kind, bytes) in statuses.iter().flat_map(|status| &status.day_bytes) {
        family.add_labelled(&[("kind", &labels(kind))], count_value(*bytes));
    }
    let help = "Recordings not kept and pauses of the ring, for want of budget, by kind.";
    let mut family = text.family("didim_write_budget_refusals_total", Counter, help);
    for (kind, count) in statuses.iter().flat_map(|status| &status.given_way) {
        family.add_labelled(&[("kind", &labels(kind))], count_value(*count));
    }
    if let Some(budget) = statuses.iter().find_map(|status| status.budget_bytes) {
        let help = "Bytes that may be written to disk within 24 hours.";
        text.family("didim_write_budget_bytes", Gauge, help).value(count_value(budget));
    }
}

pub(super) fn add_archive(text: &mut MetricsText, status: &ArchiveStatus) {
    let gauges = [
        ("didim_kept_recordings", "Recordings that are kept.", count_value(status.files as u64)),
        (
            "didim_kept_recordings_bytes",
            "Size of the recordings that are kept.",
            count_value(status.bytes),
        ),
        (
            "didim_capture_running",
            "Whether a capture by command is running.",
            flag_value(status.capture.is_some()),
        ),
    ];
    write(text, Gauge, &gauges);
    let help = "Recordings that could not be kept.";
    text.family("didim_kept_recordings_failures_total", Counter, help)
        .value(count_value(status.failed));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_that_gives_way_is_reported() {
        let mut text = MetricsText::default();
        let status =
            RecordingStatus { gives_way: true, segments_given_way: 3, ..Default::default() };
        add_recording(&mut text, &status);
        let text = text.finish();
        assert!(text.contains("\ndidim_recording_gives_way 1\n"), "{text}");
        assert!(text.contains("\ndidim_recording_segments_given_way_total 3\n"), "{text}");
    }
}
