//! Fault counters of the bus thread. Each counter is declared once, here. The causes of lost frames
//! and cycles are declared by the drivers.

use serde::{Deserialize, Serialize};

use super::counts::AcquisitionCounts;

/// A counter with the texts for its display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counter {
    /// Display name.
    pub label: &'static str,
    /// Metric name.
    pub metric: &'static str,
    /// Meaning of the counter.
    pub help: &'static str,
    /// Current count.
    pub count: u64,
}

/// For each counter: JSON key, source of the count, display name, metric name and meaning.
macro_rules! counters {
    ($($key:ident = $($from:ident).+, $label:literal, $metric:literal, $help:literal;)+) => {
        /// Counters of faults.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(default)]
        pub struct FaultCounters {
            $(#[doc = $help] pub $key: u64,)+
        }

        impl FaultCounters {
            pub(super) fn of(counts: &AcquisitionCounts) -> Self {
                Self { $($key: counts.$($from).+,)+ }
            }

            /// Returns all counters in display order.
            pub fn each(&self) -> impl Iterator<Item = Counter> + use<> {
                [$(Counter { label: $label, metric: $metric, help: $help, count: self.$key },)+]
                    .into_iter()
            }
        }
    };
}

counters! {
    queue_drops = source.queue_drops, "frames dropped unread", "didim_frames_dropped_total",
        "Frames dropped unread, by the kernel or an in-process bus.";
    error_frames = source.error_frames, "error frames", "didim_error_frames_total",
        "Error frames of the controller.";
    link_down = source.link_down, "times down", "didim_interface_down_total",
        "Times an interface was found down.";
    reopened = source.reopened, "times opened again", "didim_interface_reopened_total",
        "Times an interface was opened again.";
    source_failures = source_failures, "source failures", "didim_source_failures_total",
        "Times the bus could not be read.";
    frames_passed_over = source.passed_over, "frames passed over",
        "didim_frames_passed_over_total", "Frames of another interface or of an unknown kind.";
    frames_stamped_late = source.stamped_late, "frames stamped late",
        "didim_frames_stamped_late_total", "Frames without a stamp of the kernel.";
    samples_without_reference = losses.samples_without_reference, "samples without reference",
        "didim_samples_without_reference_total",
        "Samples without the reference that the layout has.";
    clock_steps = clock.steps, "clock steps", "didim_clock_steps_total",
        "Times the computer's clock was set.";
    stamps_held_back = clock.held_back, "stamps held back", "didim_stamps_held_back_total",
        "Stamps that would have gone backwards and were held at the last one.";
    stamps_in_future = clock.future_stamps, "stamps in the future", "didim_stamps_in_future_total",
        "Stamps that lay in the future and were put to the present.";
}
