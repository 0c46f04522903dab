//! Conversion of a status into metric families.

use std::collections::BTreeMap;

use super::exposition::{FamilyKind, MAX_LABELS, MetricsText, count_value, flag_value, write};
use super::{drift, load, recording};
use crate::archive::store::ParameterValue;
use crate::live::acquire::{AcquisitionStatus, BusState, Grant};
use crate::live::external_torque::ExternalTorqueStatus;
use crate::live::latency::LatencySummary;
use crate::live::worker::{EstimateSummary, EstimationStatus, WindowState};
use crate::service::status::Snapshot;
use crate::window::JointReading;

use FamilyKind::{Counter, Gauge, Summary};

/// Returns the metrics of a service. `None` means that the service does not answer.
pub fn metrics_text(snapshot: Option<&Snapshot>) -> String {
    let mut text = MetricsText::default();
    let up = flag_value(snapshot.is_some());
    text.family("didim_up", Gauge, "Whether the service answers at its status socket.").value(up);
    let version = env!("CARGO_PKG_VERSION");
    text.family("didim_build_info", Gauge, "The program that serves the metrics; always 1.")
        .add_labelled(&[("version", version)], 1.0);
    if let Some(snapshot) = snapshot {
        add_service(&mut text, snapshot);
        snapshot.acquisition.iter().for_each(|status| add_acquisition(&mut text, status));
        snapshot.estimation.iter().for_each(|status| add_estimation(&mut text, status));
        let recording = snapshot.acquisition.iter().flat_map(|status| &status.recording);
        let written = recording.map(|status| &status.written);
        let written = written.chain(snapshot.estimation.iter().map(|status| &status.written));
        recording::add_written(&mut text, &written.collect::<Vec<_>>());
    }
    text.finish()
}

fn add_service(text: &mut MetricsText, snapshot: &Snapshot) {
    text.family("didim_service_info", Gauge, "The service and its cell; always 1.")
        .add_labelled(&[("version", &snapshot.version), ("cell", &snapshot.cell)], 1.0);
    let gauges = [
        ("didim_uptime_seconds", "Time since the service began.", snapshot.uptime_s),
        ("didim_healthy", "Health: 1, or 0 for a reason.", flag_value(snapshot.health.ok)),
        ("didim_idle", "Whether no drive is enabled.", flag_value(snapshot.health.idle)),
        (
            "didim_health_reasons",
            "Number of reasons why the service is not healthy; `didim status` lists them.",
            count_value(snapshot.health.reasons.len() as u64),
        ),
        (
            "didim_nominal_samples_per_second",
            "Rate of the bus cycle that the cell states.",
            snapshot.stream.sample_rate_hz,
        ),
        (
            "didim_buffer_seconds",
            "How long the worker may be away before samples are lost.",
            snapshot.stream.buffer_s,
        ),
        (
            "didim_shared_memory_bytes",
            "Shared memory that the cell uses.",
            count_value(snapshot.stream.shared_memory_bytes),
        ),
    ];
    write(text, Gauge, &gauges);
    let mut family = text.family("didim_events_total", Counter, "Events, by kind.");
    for (kind, events) in &snapshot.process.events {
        family.add_labelled(&[("event", kind)], count_value(events.count));
    }
    let help = "How long states that have ended lasted, by kind of event.";
    let mut family = text.family("didim_event_seconds_total", Counter, help);
    for (kind, events) in &snapshot.process.events {
        family.add_labelled(&[("event", kind)], count_value(events.lasted_ms) * 1e-3);
    }
}

fn add_acquisition(text: &mut MetricsText, status: &AcquisitionStatus) {
    let mut state = text.family("didim_bus_state", Gauge, "State of the bus: 1 if current.");
    for is in BusState::ALL {
        state.add_labelled(&[("state", is.key())], flag_value(status.bus == is));
    }
    let counters = [
        ("didim_frames_total", "Frames received, error frames included.", status.frames),
        ("didim_samples_total", "Samples assembled.", status.samples),
        ("didim_batches_total", "Batches of samples sent to the worker.", status.batches),
    ];
    write(text, Counter, &counters.map(|(name, help, value)| (name, help, count_value(value))));
    for counter in status.counters.each() {
        text.family(counter.metric, Counter, counter.help).value(count_value(counter.count));
    }
    let unused = "Frames not used, by cause.";
    add_by_label(text, ("didim_frames_unused_total", "cause"), unused, &status.frames_unused);
    let loss_help = "Bus cycles without a sample, by cause.";
    add_by_label(text, ("didim_cycles_lost_total", "cause"), loss_help, &status.cycles_lost);
    let buffers = [
        (
            "didim_receive_buffer_bytes",
            "Receive buffer that the kernel granted.",
            status.receive_buffer_bytes,
        ),
        (
            "didim_receive_buffer_asked_bytes",
            "Receive buffer that the cell requests.",
            status.receive_buffer_asked_bytes,
        ),
    ];
    for (name, help, bytes) in buffers {
        if let Some(bytes) = bytes {
            text.family(name, Gauge, help).value(count_value(bytes));
        }
    }
    let readings = [
        (
            "didim_motor_temperature_celsius",
            "Last temperature of the motors that the drives reported.",
            &status.readings.temperature,
        ),
        (
            "didim_supply_voltage_volts",
            "Last supply voltage that the drives reported.",
            &status.readings.supply_voltage,
        ),
    ];
    for (name, help, joints) in readings.into_iter().filter(|(.., joints)| !joints.is_empty()) {
        let mut family = text.family(name, Gauge, help);
        for JointReading { joint, last, .. } in joints.iter().take(MAX_LABELS) {
            family.add_labelled(&[("joint", &joint.to_string())], *last);
        }
    }
    if let Some(grants) = &status.real_time {
        let wishes =
            [("priority", &grants.priority), ("cpu", &grants.cpu), ("memory", &grants.memory)];
        let asked = wishes.into_iter().filter(|(_, grant)| **grant != Grant::NotAsked);
        let asked: Vec<_> = asked.collect();
        if !asked.is_empty() {
            let help = "What the acquisition requested: 1 where it was granted.";
            let mut family = text.family("didim_real_time_granted", Gauge, help);
            for (wish, grant) in asked {
                family.add_labelled(&[("wish", wish)], flag_value(*grant == Grant::Granted));
            }
        }
    }
    add_latency(
        text,
        ("didim_frame_to_buffer_seconds", "didim_frame_to_buffer_max_seconds"),
        "From the frame that completed a sample until it was in the buffer.",
        status.frame_to_buffer.map(|latency| latency.times),
    );
    status.recording.iter().for_each(|status| recording::add_recording(text, status));
    status.external_torque.iter().for_each(|status| add_external_torque(text, status));
}

fn add_external_torque(text: &mut MetricsText, status: &ExternalTorqueStatus) {
    let help = "Whether the newest external torque is usable.";
    let is_valid = flag_value(!status.joints.is_empty());
    text.family("didim_external_torque_valid", Gauge, help).value(is_valid);
    let joints = (1_usize..).zip(&status.joints).take(MAX_LABELS);
    let joints: Vec<_> =
        joints.filter_map(|(joint, of)| Some((joint.to_string(), (*of)?))).collect();
    if !joints.is_empty() {
        let help = "Torque of the environment on each joint; newtons of a prismatic joint.";
        let mut family = text.family("didim_external_torque_newton_metres", Gauge, help);
        for (joint, torque) in &joints {
            family.add_labelled(&[("joint", joint)], torque.value);
        }
        let name = "didim_external_torque_standard_deviation_newton_metres";
        let mut family = text.family(name, Gauge, "Standard deviation of this torque.");
        for (joint, torque) in &joints {
            family.add_labelled(&[("joint", joint)], torque.standard_deviation);
        }
    }
    let counters = [
        ("didim_external_torques_total", "External torques published.", status.published),
        ("didim_external_torques_valid_total", "Those that are usable.", status.valid),
        (
            "didim_external_torque_samples_skipped_total",
            "Samples that the observer was too slow for.",
            status.skipped,
        ),
        (
            "didim_external_torques_unpublished_total",
            "External torques that could not be published.",
            status.unpublished,
        ),
        (
            "didim_external_torques_lost_total",
            "Messages that clients of the socket were too slow for.",
            status.messages_lost,
        ),
    ];
    write(text, Counter, &counters.map(|(name, help, value)| (name, help, count_value(value))));
    add_latency(
        text,
        ("didim_read_to_torque_seconds", "didim_read_to_torque_max_seconds"),
        "From the reading of a sample's frames until its external torque was published.",
        status.read_to_published,
    );
}

fn add_estimation(text: &mut MetricsText, status: &EstimationStatus) {
    let counters = [
        ("didim_worker_samples_total", "Samples that the worker received.", status.samples),
        (
            "didim_worker_samples_missing_total",
            "Samples that the sequence numbers show to be missing.",
            status.samples_missing,
        ),
        (
            "didim_worker_batches_lost_total",
            "Batches overwritten because the worker was too slow.",
            status.batches_lost,
        ),
        (
            "didim_acquisition_restarts_total",
            "Times the acquisition was restarted while the worker was running.",
            status.restarts,
        ),
        ("didim_windows_opened_total", "Windows opened.", status.windows_opened),
        (
            "didim_windows_identified_total",
            "Windows identified, whatever the verdict.",
            status.windows_identified,
        ),
    ];
    write(text, Counter, &counters.map(|(name, help, value)| (name, help, count_value(value))));
    let rejected = "Windows rejected, by cause.";
    add_by_label(
        text,
        ("didim_windows_rejected_total", "cause"),
        rejected,
        &status.windows_rejected,
    );
    let samples = match status.window {
        WindowState::Idle => None,
        WindowState::Open { samples } => Some(samples as u64),
    };
    let gauges = [
        ("didim_window_open", "Whether a window is open.", flag_value(samples.is_some())),
        ("didim_window_samples", "Samples in the open window.", count_value(samples.unwrap_or(0))),
        (
            "didim_windows_pending",
            "Windows waiting for the identification or in it.",
            count_value(status.windows_pending),
        ),
        (
            "didim_results_waiting",
            "Results that are not on disk yet, and are tried again.",
            count_value(status.results_waiting),
        ),
        (
            "didim_history_lines_waiting",
            "Lines of stored results that the history lacks, and that are tried again.",
            count_value(status.history_lines_waiting),
        ),
    ];
    write(text, Gauge, &gauges);
    let names = ("didim_buffer_to_worker_seconds", "didim_buffer_to_worker_max_seconds");
    let help = "How long samples lay in the buffer until the worker took them.";
    add_latency(text, names, help, status.buffer_to_worker);
    let names = ("didim_batch_to_worker_seconds", "didim_batch_to_worker_max_seconds");
    add_latency(
        text,
        names,
        "From the sending of a batch until the worker took it.",
        status.batch_to_worker,
    );
    status.last_estimate.iter().for_each(|last| add_estimate(text, last));
    status.kept_recordings.iter().for_each(|archive| recording::add_archive(text, archive));
    status.drift.iter().for_each(|status| drift::add_drift(text, status));
    status.load.iter().for_each(|status| load::add_load(text, status));
}

fn add_estimate(text: &mut MetricsText, last: &EstimateSummary) {
    let gauges = [
        (
            "didim_estimate_window",
            "Number of the window of the last estimate.",
            Some(count_value(last.window)),
        ),
        (
            "didim_estimate_applicable",
            "Whether the last estimate may be used.",
            Some(flag_value(last.applicable)),
        ),
        (
            "didim_estimate_relative_error_ratio",
            "Relative error of the last estimate's torques.",
            last.relative_error,
        ),
        (
            "didim_estimate_condition_number",
            "Condition number of the last estimate's regressor.",
            last.condition_number,
        ),
    ];
    for (name, help, value) in gauges {
        if let Some(value) = value {
            text.family(name, Gauge, help).value(value);
        }
    }
    if last.parameters.is_empty() {
        return;
    }
    let method = last.method.as_str();
    let shown = || last.parameters.iter().take(MAX_LABELS);
    // The values have the different units of the parameters, so the metric name contains no unit.
    let mut family = text.family(
        "didim_estimate_parameter",
        Gauge,
        "Parameters of the last estimate, in SI units.",
    );
    for value in shown() {
        family.add_labelled(&parameter_labels(value, method), value.value);
    }
    let help = "Standard deviations of the last estimate's parameters, in SI units.";
    let mut family = text.family("didim_estimate_parameter_standard_deviation", Gauge, help);
    for value in shown() {
        family.add_labelled(&parameter_labels(value, method), value.standard_deviation);
    }
}

/// Returns the labels of a parameter. The names of joints and links are in its description.
fn parameter_labels<'a>(value: &'a ParameterValue, method: &'a str) -> Vec<(&'a str, &'a str)> {
    let description = value.description.as_deref().map(|of| ("description", of));
    let labels = [("parameter", value.name.as_str()), ("method", method)];
    labels.into_iter().chain(description).collect()
}

fn add_latency(
    text: &mut MetricsText,
    (name, max_name): (&'static str, &'static str),
    help: &str,
    times: Option<LatencySummary>,
) {
    let Some(times) = times else { return };
    let seconds = |ns: u64| count_value(ns) * 1e-9;
    let mut family = text.family(name, Summary, help);
    for (quantile, ns) in [("0.5", times.p50_ns), ("0.99", times.p99_ns), ("0.999", times.p999_ns)]
    {
        family.add_labelled(&[("quantile", quantile)], seconds(ns));
    }
    family.add_sample("_count", &[], count_value(times.count));
    text.family(max_name, Gauge, &format!("The longest: {help}")).value(seconds(times.max_ns));
}

fn add_by_label(
    text: &mut MetricsText,
    (name, label): (&'static str, &str),
    help: &str,
    counts: &BTreeMap<String, u64>,
) {
    // A family is written without samples if no cause has occurred.
    let mut family = text.family(name, Counter, help);
    for (cause, value) in counts.iter().take(MAX_LABELS) {
        family.add_labelled(&[(label, cause)], count_value(*value));
    }
}
