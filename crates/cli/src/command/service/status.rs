//! `didim status`: shows the state of a running service.

use std::ffi::OsStr;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::CliError;
use crate::names::{ServiceRequirement, service_requirement_parser};
use crate::output::{print, refuses_colour};
use didim::analysis::JudgedUse;
use didim::cell::{Cell, ServiceSection};
use didim::files::read_text;
use didim::live::worker::UseSummary;
use didim::service::paths::Paths;
use didim::service::status::{Colour, Request, Snapshot, fetch_snapshot, render, send_request};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    service: WhichService,
    /// End with exit code 3 unless the last result is usable for this. Give it again for further
    /// requirements. A service that is not healthy gives exit code 3 in any case
    #[arg(long, value_name = "USE|healthy", value_parser = service_requirement_parser())]
    require: Vec<ServiceRequirement>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

/// Selection of the running service.
#[derive(Debug, Args)]
pub(super) struct WhichService {
    /// The cell file of the service, which names the folder of its sockets
    #[arg(long, value_name = "FILE")]
    cell: Option<PathBuf>,
    /// The folder of its sockets [default: the cell's, or /run/didim]
    #[arg(long, value_name = "FOLDER")]
    runtime: Option<PathBuf>,
}

impl WhichService {
    /// Sends a request to the service and prints its reply.
    pub(super) fn send_and_print(&self, request: &Request) -> Result<(), CliError> {
        let socket = self.paths()?.command_socket();
        let done = send_request(&socket, request).map_err(CliError::from_failure)?;
        if done.is_empty() { Ok(()) } else { print(&format!("{done}\n")) }
    }

    /// Returns the paths of the service's sockets.
    pub(super) fn paths(&self) -> Result<Paths, CliError> {
        let runtime = match (&self.runtime, &self.cell) {
            (Some(runtime), _) => runtime.clone(),
            (None, Some(cell)) => runtime_directory(cell)?,
            (None, None) => ServiceSection::default().runtime_directory,
        };
        Ok(Paths::with_sockets_in(&runtime))
    }
}

/// Returns the folder of the sockets that a cell file names. A mistake in another part of the file
/// does not prevent a request to a running service.
fn runtime_directory(cell: &Path) -> Result<PathBuf, CliError> {
    let error = match Cell::read(cell) {
        Ok(cell) => return Ok(cell.service.runtime_directory),
        Err(error) => error,
    };
    let keys = read_text(cell).ok().and_then(|text| text.parse::<toml::Table>().ok());
    let Some(keys) = keys else { return Err(CliError::from_configuration(error)) };
    let named = match keys.get("service").and_then(|service| service.get("runtime_directory")) {
        Some(toml::Value::String(folder)) => PathBuf::from(folder),
        Some(_) => return Err(CliError::from_configuration(error)),
        None => ServiceSection::default().runtime_directory,
    };
    tracing::warn!("{} has mistakes; `didim check` lists them", cell.display());
    Ok(named)
}

/// Returns the use of colours: always on a terminal, unless `NO_COLOR` forbids colours; never on
/// other outputs.
fn choose_colour(is_terminal: bool, no_color: Option<&OsStr>) -> Colour {
    match is_terminal && !refuses_colour(no_color) {
        true => Colour::Always,
        false => Colour::Never,
    }
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let snapshot = fetch_snapshot(&arguments.service.paths()?).map_err(CliError::from_failure)?;
    if arguments.json {
        let json = serde_json::to_string(&snapshot).map_err(CliError::from_failure)?;
        print(&format!("{json}\n"))?;
    } else {
        let no_color = std::env::var_os("NO_COLOR");
        let colour = choose_colour(std::io::stdout().is_terminal(), no_color.as_deref());
        print(&render(&snapshot, colour))?;
    }
    let others = arguments.require.iter().filter(|of| **of != ServiceRequirement::Healthy);
    let required = [&ServiceRequirement::Healthy].into_iter().chain(others);
    let objections: Vec<String> = required.filter_map(|of| objection(&snapshot, *of)).collect();
    match objections.is_empty() {
        true => Ok(()),
        false => Err(CliError::NotUsable(objections.join("\n"))),
    }
}

/// Describes why a service does not meet a requirement; `None` if it does.
fn objection(snapshot: &Snapshot, requirement: ServiceRequirement) -> Option<String> {
    let usage = match requirement {
        ServiceRequirement::Healthy if snapshot.health.ok => return None,
        ServiceRequirement::Healthy => {
            return Some(format!(
                "the service is not healthy: {}",
                snapshot.health.reasons.join("; ")
            ));
        }
        ServiceRequirement::Use(usage) => usage,
    };
    let undecided =
        |reason: &str| JudgedUse { usage, applicable: None, reasons: vec![reason.to_owned()] };
    let estimation = snapshot.estimation.as_ref();
    let judged = match estimation.map(|estimation| &estimation.last_estimate) {
        None => undecided("the process that identifies does not answer"),
        Some(None) => undecided("no window has been identified yet"),
        Some(Some(estimate)) => match estimate.uses.iter().find(|of| of.usage == usage) {
            Some(UseSummary { applicable, reasons, .. }) => {
                JudgedUse { usage, applicable: *applicable, reasons: reasons.clone() }
            }
            None => undecided("the service is of a version that does not report it"),
        },
    };
    judged.objection()
}

#[cfg(test)]
mod tests {
    use didim::live::worker::EstimationStatus;
    use didim::service::status::{Health, ProcessStatus, StreamStatus};
    use didim_identification::identification::Use;

    use super::*;

    /// A status with a result that is usable for monitoring and not for prediction.
    fn snapshot() -> Snapshot {
        let uses = serde_json::json!([
            { "use": "monitoring", "applicable": true },
            { "use": "prediction", "applicable": false, "reasons": ["it is too uncertain"] },
        ]);
        let mut snapshot = Snapshot {
            schema: 2,
            version: String::new(),
            cell: String::new(),
            uptime_s: 0.0,
            health: Health { ok: true, ..Health::default() },
            process: ProcessStatus::default(),
            stream: StreamStatus::default(),
            acquisition: None,
            estimation: Some(EstimationStatus::default()),
        };
        let estimate = serde_json::json!({
            "window": 0, "first_sequence": 0, "last_sequence": 1, "method": "idim-ls",
            "parameters": [], "relative_error": 0.1, "condition_number": 10.0,
            "applicable": false, "reasons": [], "uses": uses,
        });
        let estimation = snapshot.estimation.as_mut().unwrap();
        estimation.last_estimate = Some(serde_json::from_value(estimate).unwrap());
        snapshot
    }

    #[test]
    fn a_requirement_is_met_or_has_an_objection() {
        let mut snapshot = snapshot();
        let required =
            |snapshot: &Snapshot, usage| objection(snapshot, ServiceRequirement::Use(usage));
        assert_eq!(required(&snapshot, Use::Monitoring), None);
        assert_eq!(objection(&snapshot, ServiceRequirement::Healthy), None);
        let refused = required(&snapshot, Use::Prediction).unwrap();
        assert!(refused.ends_with("not usable for prediction: it is too uncertain"), "{refused}");
        let old = required(&snapshot, Use::RigidBody).unwrap();
        assert!(old.contains("version"), "{old}");
        snapshot.health.add("no sample has come".to_owned());
        let ill = objection(&snapshot, ServiceRequirement::Healthy).unwrap();
        assert!(ill.ends_with(": no sample has come"), "{ill}");
        snapshot.estimation = Some(EstimationStatus::default());
        let none = required(&snapshot, Use::Monitoring).unwrap();
        assert!(none.contains("no window has been identified yet"), "{none}");
        snapshot.estimation = None;
        assert!(required(&snapshot, Use::Monitoring).is_some());
    }

    #[test]
    fn colour_is_for_terminals_and_not_for_who_wants_none() {
        let shown = |is_terminal, no_color: Option<&str>| {
            matches!(choose_colour(is_terminal, no_color.map(OsStr::new)), Colour::Always)
        };
        assert!(shown(true, None) && shown(true, Some("")));
        assert!(!shown(true, Some("1")) && !shown(false, None));
    }
}
