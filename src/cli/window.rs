//! `didim window`: opens and closes the running service's window by hand.

use clap::{Args, ValueEnum};

use super::CliError;
use super::status::WhichService;
use crate::status::send_command;
use crate::worker::Command;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// What to do; the cell's windows have to be `by = "command"`
    action: Action,
    #[command(flatten)]
    service: WhichService,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Action {
    /// Open a window at the next sample
    Begin,
    /// Close it, once it has its margin, and identify
    End,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let socket = arguments.service.places()?.command_socket();
    let command = match arguments.action {
        Action::Begin => Command::Begin,
        Action::End => Command::End,
    };
    send_command(&socket, command).map_err(CliError::failed)
}
