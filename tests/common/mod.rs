//! What several tests of the service need.
#![allow(dead_code, reason = "the tests of the program use a part of it")]

pub(crate) mod bus;
pub(crate) mod expectation;
pub(crate) mod manager;

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use didim::live::stream::{PrivateNetwork, StreamOptions};
use didim_dynamics::{JointSample, Reading};

/// A network of its own for one test; everything it left is removed at the end.
pub(crate) struct Network {
    pub(crate) root: PathBuf,
    pub(crate) prefix: String,
    _removed: Option<PrivateNetwork>,
}

impl Network {
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let id = format!("{}_{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let root = PathBuf::from(format!("/tmp/didim-t{id}"));
        let removed = PrivateNetwork::new(&root).unwrap();
        let prefix = removed.prefix().to_owned();
        Self { _removed: Some(removed), root, prefix }
    }

    /// The network of the process that started this one.
    pub(crate) fn inherited() -> Option<Self> {
        let root = std::env::var_os("DIDIM_TEST_ROOT")?.into();
        let prefix = std::env::var("DIDIM_TEST_PREFIX").ok()?;
        Some(Self { root, prefix, _removed: None })
    }

    /// This test binary again, running one ignored test inside this network.
    pub(crate) fn child(&self, test: &str) -> std::process::Command {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command
            .args(["--exact", test, "--ignored", "--nocapture"])
            // What it counts is no test.
            .stdout(std::process::Stdio::null())
            .env("DIDIM_TEST_ROOT", &self.root)
            .env("DIDIM_TEST_PREFIX", &self.prefix);
        command
    }

    /// Six joints at 1 kHz with one second of buffer.
    pub(crate) fn options(&self) -> StreamOptions {
        StreamOptions::new("cell", (&self.root, &self.prefix), 6, 1000.0, 1.0).unwrap()
    }

    /// Bytes of /dev/shm that files of this network occupy.
    pub(crate) fn occupied_bytes(&self) -> u64 {
        use std::os::unix::fs::MetadataExt;
        self.files().map(|file| file.metadata().map_or(0, |data| data.blocks() * 512)).sum()
    }

    /// Files of this network in /dev/shm, but for the one that says whose they are.
    pub(crate) fn files(&self) -> impl Iterator<Item = std::fs::DirEntry> {
        let prefix = self.prefix.clone();
        std::fs::read_dir("/dev/shm").unwrap().flatten().filter(move |file| {
            let name = file.file_name();
            let suffix = name.to_str().and_then(|name| name.strip_prefix(&prefix));
            suffix.is_some_and(|own| own != "lock")
        })
    }
}

/// Another process, which does not outlive the test.
pub(crate) struct Process(pub(crate) std::process::Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A sample whose values differ from those of every other.
pub(crate) fn sample(sequence: u64) -> JointSample {
    let mut sample = JointSample::zero(sequence, sequence * 1_000_000);
    sample.motor_position_rad[0] = sequence as f64;
    sample.motor_torque_nm[5] = -(sequence as f64);
    sample.has_reference = sequence.is_multiple_of(2);
    if sequence.is_multiple_of(3) {
        let celsius = (sequence % 1000) as f64;
        sample.readings.set(Reading::Temperature, 7, celsius);
        sample.readings.set(Reading::SupplyVoltage, 0, 48.0);
        sample.readings.set(Reading::Mode, 3, -8.0);
    }
    sample
}

/// Waits until it is so.
///
/// # Panics
/// When it is not so within two minutes: slow machines take several times what good ones do.
pub(crate) fn eventually(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(120), "not within 120 s: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}
