//! A disk with less space than the ring limit: a separate file system in memory.

use std::process::Command;

use didim_dynamics::JointSample;
use didim_identification::identification::Estimate;

use super::*;
use crate::archive::store::{Attachments, ResultRecord, Store, Timestamp};
use crate::expectation::Expectation;
use crate::window::{Window, WindowEnd};

/// Size of the file system.
const DISK: u64 = 24 << 20;

#[test]
#[ignore = "needs a mount of its own: tests/run"]
fn on_a_full_disk_the_ring_gives_way_to_results() {
    let folder = tempfile::tempdir().unwrap();
    let mount = "mount -t tmpfs -o size=24m tmpfs \"$DIDIM_TEST_DISK\" && exec \"$@\"";
    let ended = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-euc", mount, "sh"])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "live::recording::tests::full::child_on_a_small_disk"])
        .args(["--ignored", "--nocapture", "--test-threads=1"])
        .env("DIDIM_TEST_DISK", folder.path())
        .output()
        .unwrap();
    let output = String::from_utf8_lossy(&ended.stdout) + String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{output}");
    assert!(output.contains("1 passed"), "{output}");
}

/// Stores a result, like the service of a cell with some parameters.
fn store_result(store: &mut Store) -> Result<(), String> {
    let samples = vec![JointSample::zero(0, 0)];
    let window = Window {
        number: 0,
        sample_rate_hz: 500.0,
        samples,
        counted_samples: 0..1,
        end: WindowEnd::Rest,
        recording_start: None,
        note: None,
    };
    let estimate = Estimate::default();
    let record = ResultRecord::new("cell", "c0ffee", &window, estimate);
    let attachments = Attachments { regrouping: "x".repeat(200_000), ..Attachments::default() };
    store
        .write(&record, &attachments, Timestamp::now())
        .map(drop)
        .map_err(|error| error.to_string())
}

#[test]
#[ignore = "the other process of a test"]
fn child_on_a_small_disk() {
    let disk = PathBuf::from(std::env::var_os("DIDIM_TEST_DISK").unwrap());
    let space = rustix::fs::statvfs(&disk).unwrap();
    assert_eq!(space.f_frsize * space.f_blocks, DISK, "not the file system of the test");
    let ring = disk.join("ring");
    let options = options(&ring, 1_000_000_000);
    let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
    let shared = recorder.shared().clone();
    let mut store = Store::open(&disk.join("results"), 20).unwrap();
    // Three times the capacity of the disk, with results in between.
    let total = 3 * DISK / 131;
    let mut taken = 0;
    let mut results = 0;
    while taken < total {
        tap.pass_on(&(taken..taken + 5_000).map(frame).collect::<Vec<_>>(), 0);
        taken += 5_000;
        eventually("the recorder follows", || {
            let status = shared.snapshot();
            status.frames_recorded + status.frames_unrecorded == taken
        });
        if taken.is_multiple_of(50_000) {
            eventually("a result is stored", || store_result(&mut store).is_ok());
            results += 1;
        }
    }
    assert!(results > 5);
    let status = shared.snapshot();
    let expected = Expectation::of("disk-full");
    let fewest: u64 = expected.get("fewest_segments_given_way");
    assert!(status.gives_way && status.segments_given_way >= fewest, "{status:?}");
    assert_eq!(status.state, RecordingState::Recording, "{status:?}");
    assert!(status.frames_unrecorded < total / 10, "{status:?}");
    assert!(status.ring_bytes > DISK / 4, "it keeps what the disk has room for: {status:?}");
    // Other files fill the disk. The ring gives up its last file, and results are still stored.
    let filler = disk.join("filler");
    let mut filling = File::create(&filler).unwrap();
    eventually("the ring is gone", || {
        while filling.write_all(&[1; 4096]).is_ok() {}
        tap.pass_on(&[frame(taken)], 0);
        taken += 1;
        shared.snapshot().state == RecordingState::Failed
    });
    let why = shared.snapshot().why.unwrap();
    expected.assert_said(&why, &[]);
    while filling.write_all(&[1; 4096]).is_ok() {}
    assert!(store_result(&mut store).is_err(), "there is no room at all");
    filling.set_len(filling.metadata().unwrap().len() - 2 * DISK / 16).unwrap();
    store_result(&mut store).unwrap();
    drop(filling);
    fs::remove_file(filler).unwrap();
    eventually("it records again", || {
        tap.pass_on(&[frame(taken)], 0);
        taken += 1;
        shared.snapshot().state == RecordingState::Recording
    });
    end(recorder, tap);
    let files = files(&ring);
    assert_eq!(read(files.last().unwrap(), false).last(), Some(&(taken - 1)));
}
