//! A simulated machine made of files, with faults.

use std::fs;
use std::path::Path;

use super::*;
use crate::cell::Library;
use crate::live::recording::RecordingOptions;

struct Fake {
    folder: tempfile::TempDir,
}

impl Fake {
    /// Creates a machine with enough space and one CAN FD interface that is up.
    fn new() -> Self {
        let fake = Self { folder: tempfile::tempdir().unwrap() };
        fake.interface("vcan0", 280, "0xc1", 72);
        fake.write("proc/sys/net/core/rmem_max", "8388608\n");
        fake.write("proc/meminfo", "MemTotal: 16000000 kB\nMemAvailable:   8000000 kB\n");
        fake
    }

    fn write(&self, file: &str, text: &str) {
        let path = self.folder.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn interface(&self, name: &str, kind: u32, flags: &str, mtu: u32) {
        let folder = format!("sys/class/net/{name}");
        self.write(&format!("{folder}/type"), &format!("{kind}\n"));
        self.write(&format!("{folder}/flags"), &format!("{flags}\n"));
        self.write(&format!("{folder}/mtu"), &format!("{mtu}\n"));
    }

    /// Returns the findings of the packed cell, changed, as `severity key: what`.
    fn findings(&self, change: impl FnOnce(&mut Cell)) -> Vec<String> {
        let path = Path::new("config/cells/tx40-packed-fd.toml");
        let mut cell = Cell::from_library(Library::SHIPPED, path).unwrap();
        cell.service.state_directory = self.folder.path().join("state");
        cell.service.runtime_directory = self.folder.path().join("run");
        change(&mut cell);
        let root = self.folder.path();
        let machine = Machine {
            proc: root.join("proc"),
            sys: root.join("sys"),
            shared_memory: root.to_owned(),
        };
        let shown = |f: Finding| format!("{} {}: {}", f.severity, f.key, f.what);
        check_machine(&cell, &machine).into_iter().map(shown).collect()
    }
}

#[track_caller]
fn assert_single(found: &[String], says: &[&str]) {
    assert_eq!(found.len(), 1, "{found:#?}");
    assert!(says.iter().all(|part| found[0].contains(part)), "{says:?} in {found:#?}");
}

#[test]
fn a_good_machine_has_no_findings() {
    assert_eq!(Fake::new().findings(|_| ()), [""; 0]);
}

#[test]
fn interfaces_have_to_be_there_up_and_of_the_right_kind() {
    let fake = Fake::new();
    fake.interface("vcan0", 280, "0xc0", 72);
    assert_single(&fake.findings(|_| ()), &["warning bus.source", "is down"]);
    fake.interface("vcan0", 280, "0xc1", 16);
    assert_single(&fake.findings(|_| ()), &["error bus.source", "frames of 16 bytes"]);
    fake.interface("vcan0", 1, "0xc1", 1500);
    assert_single(&fake.findings(|_| ()), &["error bus.source", "not a CAN interface"]);
    let missing =
        |cell: &mut Cell| cell.bus.as_mut().unwrap().sources = vec!["can:can7".parse().unwrap()];
    assert_single(&fake.findings(missing), &["error bus.source", "can:can7", "no such interface"]);
    let missing = |cell: &mut Cell| {
        cell.bus.as_mut().unwrap().sources = vec!["log:/no/such.log".parse().unwrap()]
    };
    assert_single(&fake.findings(missing), &["error bus.source", "no such file"]);
    let inside =
        |cell: &mut Cell| cell.bus.as_mut().unwrap().sources = vec!["inproc:".parse().unwrap()];
    assert_single(&fake.findings(inside), &["error bus.source", "not a bus of"]);
}

/// With 768 bytes per frame and 5000 frames per second, twice 212,992 bytes are 554 frames and 111
/// ms.
#[test]
fn receive_buffers_hold_so_many_seconds() {
    let fake = Fake::new();
    fake.write("proc/sys/net/core/rmem_max", "212992\n");
    let says = ["warning bus.receive_buffer_bytes", "allows 425984", "0.11 s of frames"];
    assert_single(&fake.findings(|_| ()), &says);
    let small = |cell: &mut Cell| cell.bus.as_mut().unwrap().receive_buffer_bytes = 100_000;
    assert_single(&fake.findings(small), &["warning bus.receive_buffer_bytes", "hold 0.026 s"]);
}

#[test]
fn memory_and_disk_have_to_have_room() {
    let fake = Fake::new();
    let many = |cell: &mut Cell| cell.service.keep_results = usize::MAX / (1 << 20);
    assert_single(&fake.findings(many), &["warning service.keep_results", "MB left"]);
    fake.write("proc/meminfo", "MemAvailable: 100000 kB\n");
    assert_single(&fake.findings(|_| ()), &["warning window.max_s", "of the 103 MB available"]);
}

#[test]
fn recordings_have_to_fit_the_disk_and_hold_a_window() {
    let path = Path::new("config/cells/tx40-packed-fd.toml");
    let mut cell = Cell::from_library(Library::SHIPPED, path).unwrap();
    let shipped = cell.service.recordings.clone().unwrap();
    let ring = |ring_mb| Some(RecordingOptions { ring_mb, ..shipped.clone() });
    let findings_found = Fake::new().findings(|cell| cell.service.recordings = ring(10_000_000));
    assert_single(&findings_found, &["service.recordings.ring_mb", "10001000 MB", "left"]);
    // 131 bytes at 5 kHz, 93 s: 61 MB.
    for (ring_mb, findings) in [(60, 1), (62, 0)] {
        cell.service.recordings = ring(ring_mb);
        let disk_findings = check_cell(&cell);
        assert_eq!(disk_findings.len(), findings, "{disk_findings:#?}");
    }
}

#[test]
fn folders_have_to_be_folders() {
    let fake = Fake::new();
    fake.write("state", "a file");
    assert_single(&fake.findings(|_| ()), &["error service.state_directory", "is not a folder"]);
}

#[test]
fn sockets_have_short_paths() {
    let fake = Fake::new();
    let deep = "d".repeat(110);
    let long = |cell: &mut Cell| cell.service.runtime_directory.push(&deep);
    assert_single(&fake.findings(long), &["error service.runtime_directory", "at most 107 bytes"]);
}

#[test]
fn a_processor_that_is_not_there_is_refused() {
    let missing = |cell: &mut Cell| cell.service.real_time.cpu = Some(1_000_000);
    assert_single(
        &Fake::new().findings(missing),
        &["warning service.real_time.cpu", "no processor"],
    );
}

#[test]
fn folders_have_to_be_of_the_own_user_and_of_nobody_else() {
    use std::os::unix::fs::PermissionsExt;

    let fake = Fake::new();
    let recordings = fake.folder.path().join("another");
    std::fs::create_dir_all(recordings.join("ring")).unwrap();
    let other_folder = |cell: &mut Cell| {
        let options = RecordingOptions { ring_mb: 200, keep_mb: 8, ..Default::default() };
        let directory = Some(recordings.clone());
        cell.service.recordings = Some(RecordingOptions { directory, ..options });
    };
    assert_eq!(fake.findings(other_folder), [""; 0]);
    let permissions = std::fs::Permissions::from_mode(0o777);
    std::fs::set_permissions(recordings.join("ring"), permissions).unwrap();
    let says = ["error service.recordings.directory", "another/ring", "chmod o-w"];
    assert_single(&fake.findings(other_folder), &says);
}
