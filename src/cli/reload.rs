//! `didim reload`: has the running service read its cell file again.

use clap::Args;

use super::CliError;
use super::status::WhichService;
use crate::status::{Request, send_request};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    service: WhichService,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let socket = arguments.service.places()?.command_socket();
    send_request(&socket, &Request::Reload).map_err(CliError::failed)
}
