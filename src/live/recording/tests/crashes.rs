//! A crash at every change of a recording that is kept, and the budget of a day.

use super::archive::{Recorded, window};
use super::*;
use crate::files::simulated::{Crash, DiskState, SimulatedDisk};
use crate::live::recording::archive::Archive;
use crate::live::recording::archive_folder::ArchiveFolder;
use crate::live::recording::request::Request;

/// Keeps the recording of a result.
fn keep(archive: &mut Archive, number: u64) {
    archive.take_request(Request::Result { number, window: window(2_000_000_000) });
    let nobody = std::sync::mpsc::channel().1;
    archive.run(&nobody, &AtomicBool::new(true));
}

/// Returns the number of frames of a recording that has its end.
fn frames_of(path: &Path) -> Option<usize> {
    let mut source = McapSource::open(path, &[]).ok()?;
    let mut frames = 0;
    while source.next_frame().ok()?.is_some() {
        frames += 1;
    }
    (source.file_end() == Some(FileEnd::Finished)).then_some(frames)
}

/// Crashes after every change. The disk ignores syncs of one kind. Returns the first problem.
fn crash_everywhere(ignored: Option<&str>) -> Result<usize, String> {
    let recorded = Recorded::record(0..20_000);
    let mut archive = recorded.archive();
    let target = archive.folder.clone();
    std::fs::create_dir_all(&target).unwrap();
    let mut state = DiskState::of_folder(&target);
    let disk = SimulatedDisk::new(&target);
    let mut done = Vec::new();
    for number in 0..2 {
        disk.run(|| keep(&mut archive, number));
        done.push(disk.count());
    }
    let changes = disk.changes();
    let mut crashes = 0;
    for until in 0..=changes.len() {
        if let Some(change) = until.checked_sub(1).map(|last| &changes[last])
            && (ignored.is_none() || state.sync_label(change).as_deref() != ignored)
        {
            state.apply(change);
        }
        for crash in Crash::kinds(until as u64) {
            let folder = tempfile::tempdir().unwrap();
            state.write_remains(crash, folder.path());
            // The next recording is kept here.
            ArchiveFolder::open(folder.path(), 10, u64::MAX).unwrap();
            let remaining: Vec<_> =
                files(folder.path()).iter().map(|file| frames_of(file)).collect();
            let acknowledged = done.iter().filter(|at| **at <= until).count();
            let is_whole = remaining.iter().all(|frames| *frames == Some(1_750));
            if remaining.len() < acknowledged || !is_whole {
                return Err(format!("{crash:?} after change {until}: {remaining:?}"));
            }
            crashes += 1;
        }
    }
    assert!(changes.len() > 8);
    Ok(crashes)
}

#[test]
fn a_kept_recording_is_whole_or_absent_after_a_crash() {
    println!("{} crashes", crash_everywhere(None).unwrap());
    for label in ["content of result-.mcap", "name of result-.mcap"] {
        let problem = crash_everywhere(Some(label)).unwrap_err();
        println!("{label}: {problem}");
    }
}

#[test]
fn recordings_give_way_to_the_budget_of_a_day_and_say_so() {
    let recorded = Recorded::record(0..20_000);
    let file = recorded.folder.path().join("written.json");
    let mut archive = Archive { budget: WriteBudget::new(Some(10), &file), ..recorded.archive() };
    let now = crate::archive::store::Timestamp::now();
    keep(&mut archive, 0);
    let status = archive.shared.snapshot();
    assert_eq!((status.fixed, status.failed), (1, 0), "{status:?}");
    assert_eq!(archive.budget.status(now).day_bytes[&WriteKind::ResultRecordings], status.bytes);
    // They may have 2 MB.
    archive.budget.count(WriteKind::ResultRecordings, 1_900_000, now);
    keep(&mut archive, 1);
    let status = archive.shared.snapshot();
    assert_eq!((status.fixed, status.failed), (1, 1), "{status:?}");
    assert!(status.last_failure.unwrap().contains("service.write_mb_per_day"));
    assert_eq!(archive.budget.status(now).given_way[&WriteKind::ResultRecordings], 1);
}

#[test]
fn the_ring_stops_at_its_share_of_the_budget_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let ring = folder.path().join("ring");
    let options = options(&ring, 100_000_000).with_budget(Some(1));
    let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
    let shared = recorder.shared().clone();
    let mut n = 0;
    eventually("the budget is used up", || {
        (n..n + 100).for_each(|n| tap.pass_on(&[frame(n)], 0));
        n += 100;
        shared.snapshot().state == RecordingState::Failed
    });
    let status = end(recorder, tap);
    assert!(status.frames_unrecorded > 0);
    assert!(status.why.unwrap().contains("ring may write 0.6 MB of service.write_mb_per_day"));
    let bytes: u64 = files(&ring).iter().map(|file| file.metadata().unwrap().len()).sum();
    // What closes a file comes on top, however many frames wait for a writer that is late.
    assert!((500_000..620_000).contains(&bytes), "{bytes}");
    // A restart goes on with what was written.
    let options = super::options(&ring, 100_000_000).with_budget(Some(1));
    let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
    let shared = recorder.shared().clone();
    tap.pass_on(&[frame(0)], 0);
    eventually("no frame is recorded", || shared.snapshot().frames_unrecorded > 0);
    assert_eq!(end(recorder, tap).frames_recorded, 0);
}
