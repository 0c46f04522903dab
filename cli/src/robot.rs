//! `didim robot`: what a robot file or a URDF says of an arm.

use std::path::PathBuf;

use clap::Args;
use didim_core::dynamics::{BaseParameters, Model};

use super::CliError;
use super::output::{check_outputs, print, write_text};
use super::terminal::show;
use didim::cell::{CellError, Library, RobotSource, UrdfSection};
use didim::report::robot::{description, picture};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A robot file, or a URDF
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The link of a URDF on which the arm stands
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// The link of a URDF at which it ends
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// Print the arm as a robot file; of a URDF, with drives that are assumed and have to be looked at
    #[arg(long)]
    toml: bool,
    /// Draw the arm at q = 0 (one SVG file)
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { file, base, tip, toml, picture: to } = arguments;
    check_outputs(to, &[file])?;
    let text = Library::Files.read(file).map_err(CliError::configuration)?;
    let ends = UrdfSection { base: base.clone(), tip: tip.clone(), ..UrdfSection::default() };
    let source = RobotSource::read(file, text, Some(&ends)).map_err(CliError::configuration)?;
    if source.urdf.is_none() && (base.is_some() || tip.is_some()) {
        let what = "--base and --tip are links of a URDF, and this is a robot file; leave them out";
        return Err(CliError::Usage(what.to_owned()));
    }
    if let Some(to) = to {
        let names: Vec<&str> = source.joint_names().collect();
        write_text(to, &picture(&source.robot, &names))?;
    }
    if *toml {
        return print(&source.toml);
    }
    let base = BaseParameters::compute(&Model::new(&source.robot)).map_err(|error| {
        CliError::configuration(CellError::BaseParameters { file: file.clone(), source: error })
    })?;
    show(&description(&source, &base))
}
