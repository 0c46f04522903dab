//! `--require`: the uses that a script needs. The command has a separate exit code if the result is
//! not usable for one of them.

use clap::Args;
use didim::analysis::JudgedUse;
use didim_identification::identification::{Estimate, Use};

use super::CliError;
use super::names::use_parser;

/// Uses for which the result has to be usable.
#[derive(Debug, Args)]
pub(super) struct RequiredUses {
    /// End with exit code 3 unless the result is usable for this. Give it again for further uses
    #[arg(long, value_name = "USE", value_parser = use_parser())]
    require: Vec<Use>,
}

impl RequiredUses {
    /// Checks the verdict on each required use.
    ///
    /// # Errors
    /// [`CliError::NotUsable`], with the first reason of each use that is refused or undecided.
    pub(super) fn check(&self, judge: impl Fn(Use) -> JudgedUse) -> Result<(), CliError> {
        let objections: Vec<String> =
            self.require.iter().filter_map(|usage| judge(*usage).objection()).collect();
        match objections.is_empty() {
            true => Ok(()),
            false => Err(CliError::NotUsable(objections.join("\n"))),
        }
    }

    /// Checks the verdict of an estimate.
    ///
    /// # Errors
    /// See [`Self::check`].
    pub(super) fn check_estimate(&self, estimate: &Estimate) -> Result<(), CliError> {
        self.check(|usage| JudgedUse::new(usage, estimate.verdict.uses.get(usage)))
    }
}
