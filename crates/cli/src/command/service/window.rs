//! `didim window`: opens, closes and identifies the running service's window by hand.

use clap::{Args, ValueEnum};

use super::status::WhichService;
use crate::CliError;
use didim::live::worker::Command;
use didim::service::status::Request;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The action; `begin` and `end` need a cell whose windows are triggered `by = "command"`
    action: Action,
    #[command(flatten)]
    service: WhichService,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Action {
    /// Open a window at the next sample
    Begin,
    /// Close the window after its margin, and identify
    End,
    /// Close the open window at once, whatever opened it, and identify
    Identify,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let command = match arguments.action {
        Action::Begin => Command::Begin,
        Action::End => Command::End,
        Action::Identify => Command::Identify,
    };
    arguments.service.send_and_print(&Request::Window(command))
}
