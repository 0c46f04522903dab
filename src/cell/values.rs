//! Checks of values in a cell file that their types do not cover.

use super::{BusAddress, CellFile, ServiceSection};
use crate::live::recording::RecordingOptions;
use crate::live::stream::{FOLDER_NAME, SERVICE_PREFIX, StreamError, StreamOptions};

/// Key of an invalid value, and the problem.
type Wrong = (&'static str, String);

/// Returns all problems. The stream is checked only if the joint count and the sample rate \[Hz\]
/// are known.
pub(super) fn check(file: &CellFile, stream: Option<(usize, f64)>) -> Vec<Wrong> {
    let mut checked = Vec::new();
    if let Some(bus) = &file.bus {
        checked.push(check_sources(&bus.source));
        checked.push(check_bitrates(bus.bitrate_bps, bus.data_bitrate_bps));
        checked.extend(stream.map(|(joints, rate_hz)| check_stream(file, joints, rate_hz)));
    }
    if let (Some(contact), Some((_, rate_hz))) = (&file.contact, stream) {
        checked.push(contact.check(rate_hz).map_err(|problem| ("contact.bandwidth_hz", problem)));
    }
    checked.push(check_limits(file));
    checked.push(check_tolerances(file));
    checked.push(check_sockets(&file.service));
    checked.extend(file.service.recordings.as_ref().map(RecordingOptions::check));
    checked.push(file.service.drift.validate().map_err(|error| (error.key, error.problem)));
    if file.name.trim().is_empty() {
        checked.push(Err(("name", "is empty; results carry it".to_owned())));
    }
    if file.service.keep_results == 0 {
        checked.push(Err(("service.keep_results", "has to be at least 1".to_owned())));
    }
    if let Some(megabytes) = file.service.write_mb_per_day
        && !(10..=100_000_000).contains(&megabytes)
    {
        let problem = format!("{megabytes} is not in 10..=100000000");
        checked.push(Err(("service.write_mb_per_day", problem)));
    }
    if !(1..=99).contains(&file.service.real_time.priority.unwrap_or(1)) {
        checked.push(Err(("service.real_time.priority", "has to be 1 to 99".to_owned())));
    }
    checked.into_iter().filter_map(Result::err).collect()
}

fn check_sources(sources: &[BusAddress]) -> Result<(), Wrong> {
    let wrong = |problem: String| Err(("bus.source", problem));
    if sources.is_empty() {
        return wrong("names no bus; write can:INTERFACE".to_owned());
    }
    for (k, source) in sources.iter().enumerate() {
        if sources.len() > 1 && !matches!(source, BusAddress::Can(_)) {
            return wrong(format!("`{source}` must be the only bus unless all are can:"));
        }
        if sources[..k].contains(source) {
            return wrong(format!("`{source}` is listed more than once; list it once"));
        }
    }
    Ok(())
}

/// Checks which users may connect. Connecting needs write permission (unix(7)), and every connected
/// user can read the status.
fn check_sockets(service: &ServiceSection) -> Result<(), Wrong> {
    let command = service.command_mode();
    for (key, mode) in
        [("service.status_mode", service.status_mode), ("service.command_mode", command)]
    {
        if mode & !0o666 != 0 || mode & 0o600 != 0o600 {
            let problem = format!(
                "{mode:#o} has to be 0o600 plus rights to read and write, as in 0o660; octal \
                 numbers begin with 0o"
            );
            return Err((key, problem));
        }
    }
    if command & 0o006 != 0 {
        let problem = format!("{command:#o} lets anyone send commands; set service.command_group");
        return Err(("service.command_mode", problem));
    }
    for (key, group, mode) in [
        ("service.status_group", &service.status_group, service.status_mode),
        ("service.command_group", &service.command_group, command),
    ] {
        if let Some(group) = group
            && (group.is_empty() || mode & 0o020 == 0)
        {
            let problem = format!("`{group}` cannot connect with the permissions {mode:#o}");
            return Err((key, problem));
        }
    }
    Ok(())
}

/// Checks the limits of ISO 11898: arbitration at up to 1 Mbit/s, data at up to 8 Mbit/s.
fn check_bitrates(bitrate: Option<u32>, data: Option<u32>) -> Result<(), Wrong> {
    let nominal = bitrate.unwrap_or(1_000_000);
    if !(1_000..=1_000_000).contains(&nominal) {
        let problem = format!("{nominal} bit/s; the arbitration bit rate is 1000 to 1000000");
        return Err(("bus.bitrate_bps", problem));
    }
    let Some(data) = data else { return Ok(()) };
    if bitrate.is_none() {
        let problem = "needs `bus.bitrate_bps`, the arbitration bit rate, as well";
        return Err(("bus.data_bitrate_bps", problem.to_owned()));
    }
    if !(nominal..=8_000_000).contains(&data) {
        let problem =
            format!("{data} bit/s; the data bit rate is {nominal} (bus.bitrate_bps) to 8000000");
        return Err(("bus.data_bitrate_bps", problem));
    }
    Ok(())
}

/// Checks name, buffer and runtime folder against the stream that the service would open.
fn check_stream(file: &CellFile, joints: usize, sample_rate_hz: f64) -> Result<(), Wrong> {
    let service = &file.service;
    let root = service.runtime_directory.join(FOLDER_NAME);
    let place = (root.as_path(), SERVICE_PREFIX);
    let options = StreamOptions::new(&file.name, place, joints, sample_rate_hz, service.buffer_s);
    match options {
        Err(StreamError::Option { key: "cell", problem }) => Err(("name", problem)),
        Err(StreamError::Option { key: "buffer_s", problem }) => Err(("service.buffer_s", problem)),
        Err(StreamError::Option { key: "runtime_directory", problem }) => Err((
            "service.runtime_directory",
            format!("the stream's folder in it, {problem}; choose a shorter one, as /run/didim"),
        )),
        Err(other) => Err(("bus.layout", other.to_string())),
        Ok(_) => Ok(()),
    }
}

fn check_limits(file: &CellFile) -> Result<(), Wrong> {
    let checked = file.identification.limits.validate();
    checked.map_err(|error| ("identification.limits", error.to_string()))
}

fn check_tolerances(file: &CellFile) -> Result<(), Wrong> {
    let checked = file.identification.tolerances.validate();
    checked.map_err(|error| ("identification.tolerances", error.to_string()))
}
