//! `didim fleet`: compares arms of one type.

use std::path::PathBuf;

use clap::Args;

use crate::CliError;
use crate::output::print;
use didim::archive::fleet::{Fleet, read_members};
use didim::text::{align_table, significant_digits, to_uncertainty};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Histories of arms of one type, as `didim history --out` writes them: *.csv or *.parquet
    #[arg(value_name = "FILE", required = true)]
    histories: Vec<PathBuf>,
    /// Print one JSON object and nothing else
    #[arg(long)]
    json: bool,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let arms = read_members(&arguments.histories).map_err(CliError::from_failure)?;
    let fleet = Fleet::new(arms).map_err(CliError::from_failure)?;
    if arguments.json {
        let json = serde_json::to_string(&fleet).map_err(CliError::from_failure)?;
        return print(&format!("{json}\n"));
    }
    print(&text(&fleet))
}

/// Minimum number of table rows. The table has more rows if more parameters are outside their
/// limits.
const MIN_TABLE_ROWS: usize = 5;

fn text(fleet: &Fleet) -> String {
    let (arms, parameters, outside) =
        (fleet.arms.len(), fleet.parameters.len(), fleet.outside_count());
    let furthest = fleet.by_share_of_limit();
    let rows = furthest.iter().take(outside.max(MIN_TABLE_ROWS)).map(|(of, arm)| {
        let digits = |value, uncertainty| to_uncertainty(value, uncertainty, 5);
        let uncertainty = arm.combined_standard_deviation;
        let answer = match (of.is_outside(arm), of.is_outside_for_certain(arm)) {
            (true, true) => "yes",
            (true, false) => "perhaps",
            (false, _) => "no",
        };
        vec![
            arm.arm.clone(),
            of.name.clone(),
            digits(arm.value, uncertainty),
            significant_digits(uncertainty, 2),
            digits(of.median, of.scatter),
            significant_digits(of.scatter, 2),
            of.unit.clone(),
            format!("{:+.1}", arm.deviation),
            format!("{:+.1}", arm.combined_deviation),
            format!("{:.1}", of.limit),
            answer.to_owned(),
        ]
    });
    let header = [
        "arm",
        "parameter",
        "value",
        "u",
        "median",
        "scatter",
        "unit",
        "deviation",
        "with u",
        "limit",
        "outside",
    ];
    let table = align_table(&header, &rows.collect::<Vec<_>>());
    format!(
        "{arms} arms {}, by {}; {parameters} parameters; outside of the population: {outside}; the \
         furthest:\n\n\
         {table}\nu: combined standard uncertainty; scatter: of the arms, as a standard \
         deviation.\n\
         deviation: from the median, over scatter and statistical standard deviation; with u: over \
         scatter and u.\n\
         perhaps: not with u, should what is uncertain of the model not be common to all arms.\n",
        fleet.robot, fleet.method
    )
}
