//! mosquitto, on a port of its own. It keeps its sessions on disk, so that it may be killed.

use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::{free_port, wait_for};

pub(crate) struct Broker {
    pub(crate) port: u16,
    folder: tempfile::TempDir,
    process: Child,
}

impl Broker {
    /// With these lines in its configuration; FOLDER stands for its folder.
    pub(crate) fn start(more: &str) -> Self {
        Self::start_with(more, |_| ())
    }

    /// The same, with files that are put into its folder before.
    pub(crate) fn start_with(more: &str, put: impl FnOnce(&Path)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path());
        let port = free_port();
        let folder_text = folder.path().display().to_string();
        let configuration = format!(
            "listener {port} 127.0.0.1\nuser root\npersistence true\npersistence_location FOLDER/\n\
             autosave_on_changes true\nautosave_interval 1\nlog_type error\n{more}\n"
        );
        std::fs::write(
            folder.path().join("broker.conf"),
            configuration.replace("FOLDER", &folder_text),
        )
        .unwrap();
        let process = run(folder.path(), port);
        Self { port, folder, process }
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }

    /// As a power cut would.
    pub(crate) fn kill(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }

    /// With so many descriptors at most.
    pub(crate) fn start_again_with_files(&mut self, files: &str) {
        let mut command = Command::new("prlimit");
        command.arg(format!("--nofile={files}")).arg("mosquitto");
        self.process = run_by(command, self.folder.path(), self.port);
    }

    pub(crate) fn start_again(&mut self) {
        self.process = run(self.folder.path(), self.port);
    }
}

fn run(folder: &Path, port: u16) -> Child {
    run_by(Command::new("mosquitto"), folder, port)
}

fn run_by(mut command: Command, folder: &Path, port: u16) -> Child {
    command.arg("-c").arg(folder.join("broker.conf")).stderr(Stdio::null());
    let process = command.spawn().unwrap();
    wait_for("the broker", || TcpStream::connect(("127.0.0.1", port)).ok());
    process
}

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
