//! ROS 2 bags that another library wrote (golden/bag.py).

use std::fs;
use std::path::{Path, PathBuf};

use didim_formats::{
    BagError, BagSpec, BagTime, Piece, Record, RecordingStart, Side, list_bag, read_bag,
};

use crate::bag_writer::{Bag, State};

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

fn spec(joints: &[&str]) -> BagSpec {
    BagSpec {
        joints: joints.iter().map(|joint| (*joint).to_owned()).collect(),
        topic: None,
        rate_hz: 100.0,
        side: Side::Joint,
        torque_scales: vec![-1.0; joints.len()],
        wraps: Vec::new(),
        time: BagTime::Header,
    }
}

#[test]
fn joint_states_are_mapped_by_name_and_resampled_whatever_the_compression() {
    // In the arm's order, which is not that of any message.
    let spec = spec(&["b", "c", "a"]);
    for name in ["bag_none.mcap", "bag_lz4.mcap", "bag_zstd.mcap"] {
        let record = read_bag(&golden(name), &spec).unwrap();
        let start = RecordingStart::display_text(record.recording_start);
        assert!(
            start.starts_with("2023-11-14 22:13:20.00") || start.ends_with(":19.999 UTC"),
            "{start}"
        );
        let (said, resampled) = (record.notes().join("; "), record.resampled);
        assert!(
            said.contains("1 rows repeat") && said.contains("2 whole pieces: 0.000 to 1.4"),
            "{said}"
        );
        let [Piece { measurement, .. }, rest] = record.segments.as_slice() else {
            panic!("{said}")
        };
        assert!((rest.begins_s - 1.55).abs() < 0.02 && rest.measurement.samples() > 30, "{said}");
        assert!((3e-4..1e-3).contains(&resampled.rms_s) && resampled.largest_s < 2.1e-3, "{said}");
        assert_eq!((measurement.axes(), measurement.samples()), (3, 150));
        // The first message is within a millisecond of 0 s; the grid begins there.
        let start = measurement.signals.position_rad[2][0].asin() / 2.0;
        assert!(start.abs() < 1e-3);
        let mut worst: f64 = 0.0;
        for k in 0..150 {
            let t = start + f64::from(k) / 100.0;
            for (axis, joint) in [(0, 1.0), (1, 2.0), (2, 0.0)] {
                let k = k as usize;
                let position = (2.0 * t + joint).sin() - measurement.signals.position_rad[axis][k];
                let torque = -(3.0 * t + joint).cos() - measurement.signals.torque_nm[axis][k];
                worst = worst.max(position.abs()).max(torque.abs());
            }
        }
        // A cubic over four points of 10 ms: 9/384 · 3⁴ · 0.01⁴ and the 1e-7 of the start.
        assert!(worst < 1e-6, "{worst}");
    }
    // When they were recorded is 5 ms later throughout.
    let by_log = BagSpec { time: BagTime::Log, ..spec.clone() };
    let record = read_bag(&golden("bag_none.mcap"), &by_log).unwrap();
    let start = RecordingStart::display_text(record.recording_start);
    assert!(start.starts_with("2023-11-14 22:13:20.00"), "{start}");
    assert_eq!(record.segments[0].measurement.samples(), 150);
    let rows = BagSpec { time: BagTime::Rows, ..spec };
    let record = read_bag(&golden("bag_none.mcap"), &rows).unwrap();
    assert_eq!(record.recording_start, None);
    let all_recorded = &record.segments[0].measurement;
    assert_eq!((all_recorded.samples(), all_recorded.rate_unchecked), (196, true));
}

#[test]
fn what_is_wrong_with_a_bag_is_said() {
    let said = |path: &Path, spec: &BagSpec| read_bag(path, spec).unwrap_err().to_string();
    let bag = golden("bag_none.mcap");
    let abc = spec(&["a", "b", "c"]);
    assert!(said(&bag, &spec(&["a", "d"])).contains(
        "no topic has all of the joints a d in its messages; found /joint_states (a b c finger)"
    ));
    let text = said(&bag, &spec(&["finger"]));
    assert!(
        text.contains(
            "none of 19 messages on /joint_states has positions and efforts of all \
            joints, and the first has no effort of joint finger. Simulated drives"
        ),
        "{text}"
    );
    let other = BagSpec { topic: Some("/other".into()), ..abc.clone() };
    assert!(said(&bag, &other).contains("no topic has all"));
    let slow = BagSpec { rate_hz: 50.0, ..abc.clone() };
    let text = said(&bag, &slow);
    assert!(text.contains("samples a second, and 50 are stated"), "{text}");
    let folder = tempfile::tempdir().unwrap();
    let path_of = |name: &str| folder.path().join(name);
    assert!(said(folder.path(), &abc).contains("there is no .mcap or .db3 file in it"));
    // A split bag is read whole, and not without one of its files.
    fs::copy(&bag, path_of("drive_0.mcap")).unwrap();
    assert_eq!(read_bag(folder.path(), &abc).unwrap().segments[0].measurement.samples(), 150);
    fs::copy(&bag, path_of("drive_2.mcap")).unwrap();
    assert!(said(folder.path(), &abc).contains("file number 1 of the split bag is missing"));
    fs::rename(path_of("drive_2.mcap"), path_of("drive_1.mcap")).unwrap();
    // The same again is a clock that goes back.
    assert!(
        said(folder.path(), &abc).contains("time goes back at "),
        "{}",
        said(folder.path(), &abc)
    );
    // A recorder that was killed writes no end. Its chunks are read.
    let contents = fs::read(&bag).unwrap();
    let killed = path_of("killed.mcap");
    fs::write(&killed, &contents[..contents.len() - 20]).unwrap();
    let record = read_bag(&killed, &abc).unwrap();
    let complete = read_bag(&bag, &abc).unwrap();
    assert_eq!((&record.segments, record.truncated_file), (&complete.segments, Some(killed)));
    assert_eq!(complete.truncated_file, None);
    fs::remove_file(path_of("killed.mcap")).unwrap();
    fs::write(path_of("drive_1.mcap"), b"SQLite format 3\0").unwrap();
    assert!(said(folder.path(), &abc).contains("`ros2 bag convert`"));
    assert!(said(&path_of("drive.mcap"), &abc).contains("check the path"));
    // Whatever is cut off or damaged is read or refused in words, compressed or not. A recorder
    // that was killed leaves no footer.
    let mut refused = 0;
    for name in ["bag_none.mcap", "bag_lz4.mcap", "bag_zstd.mcap"] {
        let contents = fs::read(golden(name)).unwrap();
        for at_byte in (0..contents.len()).step_by(97) {
            let mut damaged = contents.clone();
            damaged[at_byte] ^= 0x55;
            for bytes in [&contents[..at_byte], &damaged] {
                fs::write(path_of("spoiled.mcap"), bytes).unwrap();
                refused += usize::from(read_bag(&path_of("spoiled.mcap"), &abc).is_err());
            }
        }
    }
    assert!(refused > 500, "{refused}");
}

/// 4 s of two joints at 100 Hz, and what each publisher says at an instant: when it says it \[ns
/// later\], positions, efforts.
fn published(path: &Path, says: impl Fn(u64, f64) -> Vec<(u64, [f64; 2], Vec<f64>)>) {
    let mut bag = Bag::create(path);
    for k in 0..400_u32 {
        let t = f64::from(k) / 100.0;
        for (later_ns, positions, efforts) in says(k.into(), t) {
            let stamp_ns = 1_700_000_000_000_000_000 + u64::from(k) * 10_000_000 + later_ns;
            let joints = &["a", "b"];
            bag.state(
                "/joint_states",
                &State { stamp_ns, joints, positions: &positions, efforts: &efforts },
            );
        }
    }
    bag.finish();
}

#[test]
fn efforts_that_lack_in_all_messages_are_an_error_and_in_some_a_loss() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mcap");
    let state = |t: f64| [(2.0 * t).sin(), (2.0 * t).cos()];
    let read = |time: BagTime| read_bag(&path, &BagSpec { time, ..spec(&["a", "b"]) });
    for efforts in [vec![], vec![f64::NAN; 2], vec![1.0]] {
        published(&path, |_, t| vec![(0, state(t), efforts.clone())]);
        let said = read(BagTime::Header).unwrap_err().to_string();
        let joint = if efforts.len() == 1 { "b" } else { "a" };
        let expected = format!(
            "none of 400 messages on /joint_states has positions and efforts of all joints, and \
            the first has no effort of joint {joint}. Simulated drives"
        );
        assert!(
            said.contains(&expected) && said.contains("Record what the drives themselves tell"),
            "{said}"
        );
        let missing = &list_bag(&path).unwrap().topics[0].without_effort;
        assert_eq!(missing.last().map(String::as_str), Some("b"), "{efforts:?}");
    }
    // Before the drives are on, and while one does not answer.
    let lacks = |k| k < 10 || (200..205).contains(&k);
    published(&path, |k, t| vec![(0, state(t), if lacks(k) { vec![] } else { vec![1.0, 2.0] })]);
    for time in [BagTime::Header, BagTime::Rows] {
        let record: Record = read(time).unwrap();
        let lengths: Vec<usize> =
            record.segments.iter().map(|piece| piece.measurement.samples()).collect();
        assert_eq!(lengths, [190, 195]);
        let said = record.notes().join("; ");
        assert!(
            said.starts_with(
                "15 of 400 messages lack a value, the first message 1, effort of \
            joint a; they are no samples"
            ),
            "{said}"
        );
    }
    assert!(list_bag(&path).unwrap().topics[0].without_effort.is_empty());
}

#[test]
fn two_publishers_of_the_same_joints_are_reported_and_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mcap");
    let state = |t: f64| [(2.0 * t).sin(), (2.0 * t).cos()];
    let said = |rate_hz: f64| {
        read_bag(&path, &BagSpec { rate_hz, ..spec(&["a", "b"]) }).unwrap_err().to_string()
    };
    // A joint_state_publisher tells zeros between, as often or every third time.
    for every in [1, 3] {
        published(&path, |k, t| {
            let mut messages = vec![(0, state(t), vec![1.0, 2.0])];
            messages.extend((k % every == 0).then(|| (5_000_000, [0.0; 2], vec![0.0; 2])));
            messages
        });
        let said = said(200.0);
        assert!(said.contains("joint a on /joint_states jumps to and fro in "), "{said}");
        assert!(said.contains("Record with one of them alone, or name the `topic`"), "{said}");
    }
    // One of them sends no efforts. Its messages are the cause, whatever the rate.
    published(&path, |_, t| vec![(0, state(t), vec![1.0; 2]), (1_000_000, [0.0; 2], vec![])]);
    for rate_hz in [100.0, 1.0] {
        let spec = BagSpec { rate_hz, ..spec(&["a", "b"]) };
        match read_bag(&path, &spec) {
            Err(BagError::AlternatingEfforts { without_effort: 400, messages: 800, .. }) => {}
            other => panic!("{other:?}"),
        }
    }
    // The same state by two, whose stamps do not keep their order.
    published(&path, |_, t| {
        vec![(5_000_000, state(t + 0.005), vec![1.0; 2]), (0, state(t), vec![1.0; 2])]
    });
    let said = said(200.0);
    assert!(
        said.contains(
            "time goes back at 0.000 s after the first (row 2): two publishers of the same joints"
        ) || said.contains("two publishers of the same joints"),
        "{said}"
    );
    // One at rest that flickers is none.
    published(&path, |k, _| vec![(0, [1e-5 * f64::from(u8::from(k % 2 == 0)), 1.0], vec![1.0; 2])]);
    assert!(read_bag(&path, &spec(&["a", "b"])).is_ok());
}

fn largest_step(of: &[f64]) -> f64 {
    of.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
}

/// A joint without end is unwrapped before its samples are interpolated.
#[test]
fn angles_that_wrap_at_a_turn_are_unwrapped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turning.mcap");
    let mut bag = Bag::create(&path);
    let angle = |t: f64| 4.0 * t;
    for k in 0..400_u32 {
        let t = f64::from(k) / 100.0;
        let wrapped = angle(t).sin().atan2(angle(t).cos());
        let state = State {
            stamp_ns: u64::from(k) * 10_000_000 + u64::from(k % 3) * 1_000_000,
            joints: &["a"],
            positions: &[wrapped],
            efforts: &[1.0],
        };
        bag.state("/joint_states", &state);
    }
    bag.finish();
    let [unwrapped, raw] = [vec![true], Vec::new()].map(|wraps| {
        let record = read_bag(&path, &BagSpec { wraps, ..spec(&["a"]) }).unwrap();
        record.segments[0].measurement.signals.position_rad[0].clone()
    });
    assert!(largest_step(&unwrapped) < 0.08 && largest_step(&raw) > 3.0);
    assert!((unwrapped.last().unwrap() - angle(3.99)).abs() < 0.1, "{unwrapped:?}");
}

#[test]
fn a_compressed_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let compressed = folder.path().join("run_0.db3.zstd");
    fs::write(&compressed, b"\x28\xb5\x2f\xfd rest").unwrap();
    for path in [compressed.as_path(), folder.path()] {
        match read_bag(path, &spec(&["a"])) {
            Err(BagError::Container { file, .. }) => assert_eq!(file, compressed),
            other => panic!("{other:?}"),
        }
    }
}
