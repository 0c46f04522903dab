//! Recordings kept from a ring.

use didim_formats::RecordingStart;

use super::*;
use crate::live::recording::archive::Archive;
use crate::live::recording::request::Request;
use crate::live::recording::ring::{DiskSpace, disk_space};
use crate::window::WindowEnd;

/// A ring that was recorded in two runs with the same stamps, and an archiver for it. The frames of
/// the second run contain other numbers.
pub(super) struct Recorded {
    pub(super) folder: tempfile::TempDir,
    options: RecordingOptions,
}

impl Recorded {
    pub(super) fn record(run: core::ops::Range<u64>) -> Self {
        Self::new(core::slice::from_ref(&run))
    }

    fn new(runs: &[core::ops::Range<u64>]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for run in runs {
            let recording = RecordingOptions { ring_mb: 16, ..RecordingOptions::default() };
            let options = RecorderOptions::new(&recording, folder.path(), "cell", "c0ffee");
            let (recorder, mut tap) =
                Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
            let shared = recorder.shared().clone();
            for n in run.clone() {
                let stamp_ns = (n - run.start) * 200_000;
                tap.pass_on(&[frame(n).with_stamp(stamp_ns)], 0);
            }
            let length = run.end - run.start;
            eventually("all is recorded", || shared.snapshot().frames_recorded == length);
            let status = end(recorder, tap);
            assert_eq!(status.frames_unrecorded, 0);
        }
        let options =
            RecordingOptions { before_s: 0.1, after_s: 0.05, ..RecordingOptions::default() };
        Self { folder, options }
    }

    /// Creates a folder without recorded frames.
    pub(super) fn empty() -> Self {
        Self::new(&[])
    }

    pub(super) fn archive(&self) -> Archive {
        Archive {
            ring: self.folder.path().join("ring"),
            folder: self.folder.path().join("kept"),
            options: self.options.clone(),
            curves: curves(),
            shared: SharedArchive::default(),
            budget: WriteBudget::default(),
            waiting_requests: Vec::new(),
            capture: None,
            step_time: Instant::now(),
            end_seen: None,
            disk_space,
        }
    }

    fn keep(&self, requests: impl FnOnce(&Archiver)) -> ArchiveStatus {
        let folder = self.folder.path().to_owned();
        let options =
            ArchiverOptions { folder, recordings: self.options.clone(), curves: curves() };
        let (archiver, thread) = Archiver::start(&options, &WriteBudget::default()).unwrap();
        requests(&archiver);
        thread.finish();
        archiver.shared().snapshot()
    }

    pub(super) fn archived(&self) -> Vec<PathBuf> {
        files(&self.folder.path().join("kept"))
    }

    pub(super) fn names(&self) -> Vec<String> {
        let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
        self.archived().iter().map(name).collect()
    }
}

/// Returns the curves of a bus that has no frame in the ring.
fn curves() -> JointCurves {
    let cells = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/cells");
    let cell = crate::cell::Cell::read(&cells.join("tx40-packed-fd.toml")).unwrap();
    cell.joint_curves(cell.bus().unwrap())
}

/// Returns a window of a thousand samples that starts at a stamp.
pub(super) fn window(first_stamp_ns: u64) -> RecordedWindow {
    RecordedWindow {
        number: 7,
        first_sequence: 1234,
        first_stamp_ns,
        last_stamp_ns: first_stamp_ns + 999 * 200_000,
        samples: 1000,
        end: WindowEnd::Command,
        start: RecordingStart::of_unix_ns(1_795_331_849_250_000_000),
        configuration: None,
    }
}

#[test]
fn a_result_keeps_its_window_with_margins_and_what_a_replay_has_to_know() {
    let recorded = Recorded::record(0..20_000);
    let window = window(2_000_000_000);
    let status = recorded.keep(|archiver| archiver.keep_result(12, &window));
    assert_eq!((status.fixed, status.failed, status.files), (1, 0, 1), "{status:?}");
    assert_eq!(status.waiting, 0, "{status:?}");
    assert_eq!(recorded.names(), ["result-00000012.mcap"]);
    let file = &recorded.archived()[0];
    assert_eq!(status.bytes, file.metadata().unwrap().len());
    let configuration = Some("c0ffee".to_owned());
    let expected = RecordedWindow { configuration, ..window };
    assert_eq!(RecordedWindow::of_file(file).unwrap(), Some(expected));
    // 0.1 s before 2 s, 0.05 s after 2.1998 s, at 5 kHz.
    assert!(read(file, false).into_iter().eq(9_500..=11_249));
}

#[test]
fn what_the_disk_has_left_for_results_is_not_taken() {
    let recorded = Recorded::record(0..20_000);
    let rooms: [fn(&Path) -> _; 2] = [
        |_| Ok(DiskSpace { free_bytes: 2_000_000, spare_bytes: 10_000 }),
        |_| Ok(DiskSpace { free_bytes: 2_000_000, spare_bytes: 2_000_000 }),
    ];
    for (archived, disk_space) in (0..).zip(rooms) {
        let mut keeping = Archive { disk_space, ..recorded.archive() };
        keeping.take_request(Request::Result { number: 12, window: window(2_000_000_000) });
        let nobody = std::sync::mpsc::channel().1;
        keeping.run(&nobody, &AtomicBool::new(true));
        let status = keeping.shared.snapshot();
        assert_eq!((status.fixed, status.failed), (archived, 1 - archived), "{status:?}");
        assert!(status.last_failure.is_none_or(|why| why.contains("make room")));
    }
}

#[test]
fn a_result_names_the_configuration_that_made_it_not_that_of_the_recorder() {
    let recorded = Recorded::record(0..20_000);
    let configuration = Some("cafe".to_owned());
    let window = RecordedWindow { configuration, ..window(2_000_000_000) };
    recorded.keep(|archiver| archiver.keep_result(0, &window));
    assert_eq!(RecordedWindow::of_file(&recorded.archived()[0]).unwrap(), Some(window));
}

#[test]
fn a_fault_whose_last_moment_was_lost_with_the_recorder_is_kept() {
    let recorded = Recorded::record(0..20_000);
    // The ring ends at 3.9998 s.
    let status =
        recorded.keep(|archiver| archiver.keep_fault("restarted", 4_900_000_000, Instant::now()));
    assert_eq!((status.fixed, status.failed), (1, 0), "{status:?}");
    assert!(read(&recorded.archived()[0], false).into_iter().eq(0..20_000));
    let status =
        recorded.keep(|archiver| archiver.keep_fault("restarted", 5_100_000_000, Instant::now()));
    assert_eq!((status.fixed, status.failed), (0, 1), "more than that was not recorded at all");
}

#[test]
fn a_capture_that_nobody_waits_for_any_more_does_not_begin() {
    let recorded = Recorded::record(0..100);
    let mut archive = recorded.archive();
    let (answer, answered) = std::sync::mpsc::sync_channel(1);
    archive.take_request(Request::Start { name: "one".into(), answer: answer.clone() });
    assert_eq!(answered.recv().unwrap(), Ok(()));
    assert_eq!(archive.shared.snapshot().capture.as_deref(), Some("one"));
    archive.take_request(Request::Stop { answer: answer.clone() });
    drop(answered);
    archive.take_request(Request::Start { name: "two".into(), answer });
    assert!(archive.capture.is_none());
    assert_eq!(archive.shared.snapshot().capture, None);
}

#[test]
fn of_two_runs_the_later_one_that_has_it_counts() {
    let recorded = Recorded::new(&[0..20_000, 100_000..105_000]);
    let both = recorded.keep(|archiver| {
        archiver.keep_result(0, &window(500_000_000));
        archiver.keep_result(1, &window(3_000_000_000));
    });
    assert_eq!((both.fixed, both.failed), (2, 0), "{both:?}");
    let files = recorded.archived();
    assert!(read(&files[0], false).into_iter().eq(102_000..=103_749), "in both: the later");
    assert!(read(&files[1], false).into_iter().eq(14_500..=16_249), "only in the earlier");
}

#[test]
fn what_the_ring_does_not_hold_is_reported_and_leaves_nothing() {
    let recorded = Recorded::record(0..5_000);
    let status = recorded.keep(|archiver| archiver.keep_result(3, &window(900_000_000)));
    assert_eq!((status.fixed, status.failed, status.files), (0, 1, 0));
    let why = status.last_failure.unwrap();
    assert!(why.starts_with("result 3: not in the ring"), "{why}");
    assert_eq!(recorded.names(), [""; 0]);
    // The ring does not exist.
    fs::remove_dir_all(recorded.folder.path().join("ring")).unwrap();
    let status = recorded.keep(|archiver| archiver.keep_result(3, &window(0)));
    assert_eq!((status.fixed, status.failed), (0, 1));
}

#[test]
fn faults_are_numbered_named_and_not_more_often_than_asked() {
    let mut recorded = Recorded::record(0..20_000);
    recorded.options.fault_before_s = 1.0;
    let (now, every) = (Instant::now(), Duration::from_secs_f64(recorded.options.fault_every_s));
    let status = recorded.keep(|archiver| {
        archiver.keep_fault("sample-gap", 3_000_000_000, now);
        archiver.keep_fault("silence", 3_100_000_000, now + every / 2);
        archiver.keep_fault("queue-drops", 3_000_000_000, now + every);
        archiver.keep_fault("silence", 3_100_000_000, now + every);
    });
    assert_eq!((status.fixed, status.failed, status.faults_passed_over), (2, 0, 2));
    assert_eq!(status.files, 2);
    assert_eq!(
        recorded.names(),
        ["fault-00000000-sample-gap.mcap", "fault-00000001-queue-drops.mcap"]
    );
    assert!(read(&recorded.archived()[0], false).into_iter().eq(10_000..=15_250));
}

#[test]
fn of_a_fault_that_ended_the_recording_is_kept_what_there_is() {
    let mut recorded = Recorded::record(0..20_000);
    recorded.options.fault_before_s = 1.0;
    // The last frames of a killed process are not on disk. A fault much later is not covered by
    // this.
    let status =
        recorded.keep(|archiver| archiver.keep_fault("silence", 4_400_000_000, Instant::now()));
    assert_eq!((status.fixed, status.failed), (1, 0), "{status:?}");
    assert!(read(&recorded.archived()[0], false).into_iter().eq(17_000..=19_999));
    let status =
        recorded.keep(|archiver| archiver.keep_fault("silence", 5_100_000_000, Instant::now()));
    assert_eq!((status.fixed, status.failed), (0, 1), "{status:?}");
}

#[test]
fn number_and_size_of_what_is_kept_are_bounded() {
    let mut recorded = Recorded::record(0..20_000);
    recorded.options.keep = 3;
    recorded.keep(|archiver| archiver.keep_fault("silence", 1_000_000_000, Instant::now()));
    for n in 0..5 {
        let status = recorded.keep(|archiver| archiver.keep_result(n, &window(1_000_000_000)));
        assert_eq!(status.failed, 0, "{status:?}");
    }
    let results = ["result-00000002.mcap", "result-00000003.mcap", "result-00000004.mcap"];
    assert_eq!(recorded.names()[1..], results);
    assert_eq!(
        recorded.names()[0],
        "fault-00000000-silence.mcap",
        "kinds do not push each other out"
    );

    // By size: the oldest of any kind are removed. A recording larger than the total limit is
    // refused.
    let archive = crate::live::recording::archive_folder::ArchiveFolder::open(
        &recorded.folder.path().join("kept"),
        3,
        size(&recorded.folder.path().join("kept")),
    )
    .unwrap();
    assert!(!archive.make_room(u64::MAX).unwrap());
    assert_eq!(recorded.names().len(), 4);
    assert!(archive.make_room(1).unwrap());
    assert_eq!(recorded.names(), results, "the oldest went");
}

#[test]
fn a_capture_that_grows_too_large_is_stopped_by_itself() {
    let mut recorded = Recorded::record(0..100);
    recorded.options.ring_mb = 1;
    let recording = RecordingOptions { ring_mb: 16, ..RecordingOptions::default() };
    let options = RecorderOptions::new(&recording, recorded.folder.path(), "cell", "c0ffee");
    let (recorder, mut tap) = Recorder::start(options, &interfaces(), StampClock::Own).unwrap();
    tap.pass_on(&[frame(0)], 0);
    let part = recorded.folder.path().join("ring/segment-00000001.mcap.part");
    eventually("the run is on disk", || {
        McapScan::read(&part).is_ok_and(|scan| !scan.chunks.is_empty())
    });
    let status = recorded.keep(|archiver| {
        archiver.start_capture("endless").unwrap();
        let mut n = 1;
        eventually("it is stopped", || {
            for _ in 0..20 {
                tap.pass_on(&[frame(n)], 0);
                n += 1;
            }
            archiver.shared().snapshot().capture.is_none()
        });
        eventually("it is kept", || archiver.shared().snapshot().fixed == 1);
        assert_eq!(archiver.stop_capture(), Err(CaptureError::NotRunning));
    });
    end(recorder, tap);
    assert_eq!((status.fixed, status.failed), (1, 0), "{status:?}");
    assert!(!read(&recorded.archived()[0], false).is_empty());
}
