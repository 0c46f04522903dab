//! The program itself.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use super::cabinet::Cabinet;

pub(crate) struct Program {
    process: Child,
    log: PathBuf,
}

impl Program {
    /// Sends what these cabinets say to a broker, of which the configuration has these lines.
    pub(crate) fn start(folder: &Path, broker: &str, cabinets: &[Cabinet]) -> Self {
        let state = folder.join("sent");
        let mut text = format!("state_directory = \"{}\"\n[broker]\n{broker}\n", state.display());
        for cabinet in cabinets {
            let (name, folder) = (&cabinet.name, cabinet.folder.display());
            text += &format!(
                "[[cabinets]]\nname = \"{name}\"\nruntime_directory = \"{folder}\"\n\
                 state_directory = \"{folder}\"\n"
            );
        }
        let (config, log) = (folder.join("publish.toml"), folder.join("log"));
        std::fs::write(&config, text).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_didim-publish"));
        command.arg("--config").arg(config).env_remove("RUST_LOG");
        let process = command.stderr(File::create(&log).unwrap()).spawn().unwrap();
        Self { process, log }
    }

    /// SIGKILL.
    pub(crate) fn kill(mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }

    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }

    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
