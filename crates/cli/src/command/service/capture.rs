//! `didim capture`: stores the bus frames from now on.

use clap::{Args, Subcommand};

use super::status::WhichService;
use crate::CliError;
use didim::live::recording::{CaptureError, check_capture_name};
use didim::service::status::{CaptureRequest, Request};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Begin a capture; the cell needs [service.recordings]
    Start {
        /// Part of the file's name: letters, digits, _ and -
        #[arg(default_value = "bus", value_parser = name)]
        name: String,
        #[command(flatten)]
        service: WhichService,
    },
    /// End it; the file is in recordings/kept some seconds later
    Stop {
        #[command(flatten)]
        service: WhichService,
    },
}

/// Parses the name of a capture from an argument.
fn name(text: &str) -> Result<String, CaptureError> {
    check_capture_name(text).map(|()| text.to_owned())
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let (request, service) = match &arguments.action {
        Action::Start { name, service } => (CaptureRequest::Start(name.clone()), service),
        Action::Stop { service } => (CaptureRequest::Stop, service),
    };
    service.send_and_print(&Request::Capture(request))
}
