//! `didim note`: attaches facts that the bus does not report to the open window or the next one.

use clap::Args;

use super::status::WhichService;
use crate::CliError;
use didim::service::status::Request;
use didim::window::Note;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Mass at the flange that the robot file does not describe; 0 means none, as does a baseline
    /// without this note
    #[arg(long, value_name = "KG", allow_negative_numbers = true)]
    payload_kg: Option<f64>,
    /// Temperature of the arm
    #[arg(long, value_name = "CELSIUS", allow_negative_numbers = true)]
    temperature_c: Option<f64>,
    /// Anything else, in one line
    #[arg(long)]
    text: Option<String>,
    #[command(flatten)]
    service: WhichService,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let note = Note {
        payload_kg: arguments.payload_kg,
        temperature_c: arguments.temperature_c,
        text: arguments.text.clone(),
    };
    let note = note.validated().map_err(|error| CliError::Usage(error.to_string()))?;
    arguments.service.send_and_print(&Request::Note(note))
}
