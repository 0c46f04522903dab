//! `didim reload`: makes the running service read its cell file again.

use clap::Args;

use super::status::WhichService;
use crate::CliError;
use didim::service::status::Request;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    service: WhichService,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    arguments.service.send_and_print(&Request::Reload)
}
