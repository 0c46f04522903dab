//! `didim reload`: has the running service read its cell file again.

use clap::Args;

use super::CliError;
use super::status::WhichService;
use didim::service::status::Request;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    service: WhichService,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    arguments.service.ask(&Request::Reload)
}
