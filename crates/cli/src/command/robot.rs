//! `didim robot`: shows the arm that a robot file or a URDF describes.

use std::path::PathBuf;

use clap::Args;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::Robot;

use crate::CliError;
use crate::input::read_robot;
use crate::names::{MOTION_FILE, PREVIEW_FILE};
use crate::next::NextCommand;
use crate::notes::print_note;
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

impl Arguments {
    /// Returns the line with the next command: a motion that shows the parameters. Empty if
    /// neither accelerations nor torques of the arm can be limited.
    fn next_command(&self, robot: &Robot) -> String {
        let has_accelerations = robot.limits().all(|limits| limits.acceleration_max.is_some());
        if robot.nominal().is_none() && !has_accelerations {
            return String::new();
        }
        let ends = [("--base", &self.base), ("--tip", &self.tip)];
        let next = NextCommand::new("design").with_option("--robot", &self.file);
        let next = ends.into_iter().fold(next, |line, (option, link)| match link {
            Some(link) => line.with_option(option, link),
            None => line,
        });
        next.with_option("--duration", MOTION_DURATION_S)
            .with_option("--out", MOTION_FILE)
            .with_option("--preview", PREVIEW_FILE)
            .to_string()
    }
}

/// Length of a motion in the next command \[s\], as in the guide.
const MOTION_DURATION_S: &str = "20";

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
    print_for_terminal(&robot_description(&source, &base))?;
    print_note(&arguments.next_command(&source.robot));
    Ok(())
}
