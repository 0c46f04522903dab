//! `didim robot`: shows the arm that a robot file or a URDF describes.

use std::path::PathBuf;

use clap::Args;
use didim_dynamics::dynamics::{BaseParameters, Model};

use crate::CliError;
use crate::input::read_robot;
use crate::output::{check_outputs, print, write_text};
use crate::terminal::print_for_terminal;
use didim::cell::CellError;
use didim::report::robot::{picture, robot_description};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A robot file, or a URDF
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The base link of the arm in a URDF
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// The last link of the arm in a URDF
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// Print the arm as a robot file; for a URDF the drives are assumed and have to be checked
    #[arg(long)]
    toml: bool,
    /// Draw the arm at q = 0 (one SVG file)
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { file, base, tip, toml, picture: to } = arguments;
    check_outputs(to, &[file])?;
    let source = read_robot(file, base.as_ref(), tip.as_ref())?;
    if let Some(to) = to {
        let names: Vec<&str> = source.joint_names().collect();
        write_text(to, &picture(&source.robot, &names))?;
    }
    if *toml {
        return print(&source.toml);
    }
    let base = BaseParameters::compute(&Model::new(&source.robot)).map_err(|error| {
        CliError::from_configuration(CellError::BaseParameters {
            file: file.clone(),
            source: error,
        })
    })?;
    print_for_terminal(&robot_description(&source, &base))
}
