//! Recordings: everything written is read back to the bit, damage of the file is reported, and
//! nothing in a file makes the reader panic.

use std::io::Cursor;
use std::path::Path;
use std::time::Duration;

use didim_drivers::frame::{Direction, Frame, FrameId, FrameKind, is_fd_length};
use didim_drivers::source::mcap::{
    Corruption, FileEnd, JointState, McapError, McapInfo, McapScan, McapSource, McapWriter,
    repair_recording,
};
use didim_drivers::source::{CandumpWriter, InterfaceName, Received, Source, StampDigits};
use proptest::prelude::*;

fn info(offset_ns: i64) -> McapInfo {
    let name = |name| InterfaceName::new(name).unwrap();
    McapInfo {
        version: "0.1".into(),
        cell: "a cell".into(),
        configuration: "c0ffee".into(),
        recorder_run: "1-2".into(),
        offset_ns,
        interfaces: vec![name("can0"), name("vcan1")],
        additional_entries: [("window".to_owned(), "3".to_owned())].into(),
    }
}

/// A file of chunks that end where `flush` says.
fn written(frames: &[Frame], info: &McapInfo, flush: impl Fn(usize) -> bool) -> Vec<u8> {
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), info).unwrap();
    for (n, frame) in frames.iter().enumerate() {
        writer.write(frame, u32::try_from(n).unwrap()).unwrap();
        if flush(n) {
            writer.flush().unwrap();
        }
    }
    let most = writer.bytes();
    let file = writer.finish().unwrap().into_inner();
    assert!(file.len() as u64 <= most, "{} bytes, expected at most {most}", file.len());
    file
}

type Found<'a> = (Vec<Frame>, Vec<McapError>, McapSource<&'a [u8]>);

/// Frames and errors in order, to the end; at most one call for each byte of the file.
fn read(file: &[u8]) -> Result<Found<'_>, McapError> {
    let mut source = McapSource::new(file, Path::new("a.mcap"), &[])?;
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    for _ in 0..=file.len() {
        match source.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return Ok((frames, errors, source)),
            Err(error) => errors.push(error),
        }
    }
    panic!("no end after {} frames and {errors:?}", frames.len());
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let id = prop_oneof![
        (0u16..0x800).prop_map(FrameId::Standard),
        (0u32..0x2000_0000).prop_map(FrameId::Extended)
    ];
    let data = prop::collection::vec(any::<u8>(), 0..=64);
    (id, data, any::<[bool; 4]>(), 0..4, any::<u64>()).prop_map(|(id, data, flags, kind, stamp)| {
        let short = &data[..data.len().min(8)];
        let longest = (0..=data.len()).rev().find(|&n| is_fd_length(n));
        let fd = FrameKind::Fd { bit_rate_switch: flags[0], error_state_indicator: flags[1] };
        let frame = match kind {
            0 => Frame::classic(id, short),
            1 => Frame::remote(id, u8::try_from(short.len()).unwrap()),
            2 => Frame::error(id.number(), short),
            _ => Frame::new(id, fd, &data[..longest.unwrap_or(0)]),
        };
        let direction = if flags[2] { Direction::Transmitted } else { Direction::Received };
        frame.unwrap().with_stamp(stamp).with_direction(direction).on_interface(u8::from(flags[3]))
    })
}

fn some_frames(count: u8) -> Vec<Frame> {
    (0..count)
        .map(|n| {
            let id = FrameId::Standard(0x100 + u16::from(n));
            Frame::fd(id, true, &[n; 12])
                .unwrap()
                .with_stamp(5_000_000_000 + u64::from(n) * 1_000_001)
        })
        .collect()
}

/// Joint states are for viewers: a reader of frames meets none of them.
#[test]
fn joint_states_stand_next_to_the_frames() {
    let frames = some_frames(200);
    let names = ["elbow", "wrist"].map(str::to_owned);
    let writer = McapWriter::new(Cursor::new(Vec::new()), &info(7)).unwrap();
    let mut writer = writer.with_joints(&names).unwrap();
    for (n, frame) in (0..).zip(&frames) {
        writer.write(frame, n).unwrap();
        let (position, effort) = ([f64::from(n), 0.5], [-1.0, f64::NAN]);
        let (stamp_ns, sequence) = (frame.stamp_ns, n.into());
        let state = JointState { stamp_ns, sequence, position: &position, effort: &effort };
        writer.write_joints(&state).unwrap();
        if n % 50 == 0 {
            writer.flush().unwrap();
        }
    }
    let most = writer.bytes();
    assert_eq!(writer.frames(), 200);
    let file = writer.finish().unwrap().into_inner();
    assert!(file.len() as u64 <= most, "{} bytes, expected at most {most}", file.len());
    let (found, errors, source) = read(&file).unwrap();
    assert_eq!((found, errors.len()), (frames, 0));
    assert_eq!((source.counters().passed_over, source.counters().queue_drops), (0, 0));
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(
        frames in prop::collection::vec(any_frame(), 0..40),
        offset_ns in any::<i64>(),
        every in 1usize..20,
    ) {
        let info = info(offset_ns);
        let file = written(&frames, &info, |n| n % every == 0);
        let (found, errors, source) = read(&file).unwrap();
        prop_assert_eq!(found, frames);
        prop_assert!(errors.is_empty(), "{:?}", errors);
        prop_assert_eq!(source.info(), Some(&info));
        prop_assert_eq!(source.file_end(), Some(FileEnd::Finished));
        prop_assert_eq!(source.counters().queue_drops, 0);
    }

    /// Random damage, with and without the CRC that would notice it.
    #[test]
    fn nothing_in_a_file_makes_it_panic_or_invent_frames(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        without_crc in any::<bool>(),
    ) {
        let frames = some_frames(30);
        let mut file = written(&frames, &info(7), |n| n % 10 == 9);
        if without_crc {
            blank_crcs(&mut file);
        }
        for (place, value) in &flips {
            let place = place.index(file.len());
            file[place] = *value;
        }
        let Ok((found, _, _)) = read(&file) else { return Ok(()) };
        prop_assert!(found.len() <= frames.len());
        if !without_crc {
            // A flipped opcode of a chunk hides it; what is delivered is as it was written, but for
            // its time, which hangs on metadata that has no CRC of its own, and for its interface.
            for frame in found {
                let same = |of: &Frame| of.id == frame.id && of.payload == frame.payload;
                prop_assert!(frames.iter().any(same), "{:?}", frame);
            }
        }
    }

    #[test]
    fn random_bytes_do_not_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut file = b"\x89MCAP0\r\n".to_vec();
        file.extend(&bytes);
        if let Ok((frames, _, _)) = read(&file) {
            prop_assert!(frames.is_empty());
        }
        prop_assert!(read(&bytes).is_err());
    }
}

/// Offsets of the chunks' records.
fn chunks(file: &[u8]) -> Vec<usize> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    std::fs::write(&path, file).unwrap();
    let scan = McapScan::read(&path).unwrap();
    scan.chunks.iter().map(|chunk| usize::try_from(chunk.offset).unwrap()).collect()
}

/// Takes the CRCs of the chunks away, as the specification allows.
fn blank_crcs(file: &mut [u8]) {
    for at in chunks(file) {
        file[at + 9 + 24..][..4].fill(0);
    }
}

#[test]
fn a_file_cut_at_any_byte_gives_its_whole_chunks_and_says_how_it_ends() {
    let frames = some_frames(12);
    let file = written(&frames, &info(7), |n| n % 4 == 3);
    let starts = chunks(&file);
    assert_eq!(starts.len(), 3);
    let ends: Vec<usize> = starts
        .iter()
        .map(|at| {
            at + 9
                + usize::try_from(u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()))
                    .unwrap()
        })
        .collect();
    let directory = tempfile::tempdir().unwrap();
    let (path, original) = (directory.path().join("a.mcap"), directory.path().join("b.mcap"));
    for cut in 0..file.len() {
        let part = &file[..cut];
        let expected = 4 * ends.iter().filter(|end| **end <= cut).count();
        match read(part) {
            Err(McapError::NotMcap { .. }) => assert!(cut < 8, "cut at {cut}"),
            Err(error) => panic!("cut at {cut}: {error}"),
            Ok((found, errors, source)) => {
                assert!(errors.is_empty(), "cut at {cut}: {errors:?}");
                assert_eq!(found, frames[..expected], "cut at {cut}");
                let ending = source.file_end().unwrap();
                // With the record that ends the data nothing of it is missing.
                std::fs::write(&path, part).unwrap();
                let scan = McapScan::read(&path).unwrap();
                assert_eq!(ending, scan.file_end, "cut at {cut}");
                assert_eq!(scan.chunks.len(), expected / 4, "cut at {cut}");
                if ending == FileEnd::Finished {
                    assert_eq!(expected, 12);
                }
                if source.info().is_some() && cut % 7 == 0 {
                    let repaired = repair_recording(&path, &original).unwrap();
                    assert_eq!((repaired.frames, repaired.is_corrupt), (expected as u64, false));
                    let (again, _, repaired) = read(&std::fs::read(&original).unwrap())
                        .map(|(f, e, s)| {
                            assert!(e.is_empty());
                            (f, e, (s.file_end(), s.info().cloned()))
                        })
                        .unwrap();
                    assert_eq!(again, found);
                    assert_eq!(repaired, (Some(FileEnd::Finished), Some(info(7))));
                }
            }
        }
    }
}

#[test]
fn a_damaged_chunk_is_named_and_the_others_are_read() {
    let frames = some_frames(12);
    let mut file = written(&frames, &info(7), |n| n % 4 == 3);
    let second = chunks(&file)[1];
    file[second + 200] ^= 1;
    let (found, errors, _) = read(&file).unwrap();
    assert_eq!(found, [&frames[..4], &frames[8..]].concat());
    let [McapError::Damaged { offset, what: Corruption::Crc, .. }] = &errors[..] else {
        panic!("{errors:?}")
    };
    assert_eq!(*offset, second as u64);
    assert!(errors[0].is_recoverable());
}

#[test]
fn a_record_longer_than_its_chunk_is_corruption_even_without_a_crc() {
    let mut file = written(&some_frames(4), &info(7), |_| false);
    blank_crcs(&mut file);
    let records = chunks(&file)[0] + 9 + 40;
    // The first record of the chunk is the schema.
    assert_eq!(file[records], 3);
    file[records + 1..records + 9].copy_from_slice(&u64::MAX.to_le_bytes());
    let (found, errors, _) = read(&file).unwrap();
    assert!(found.is_empty());
    assert!(matches!(
        &errors[..],
        [McapError::Damaged { what: Corruption::Malformed("chunk"), .. }]
    ));
}

#[test]
fn frames_that_are_missing_are_counted() {
    let frames = some_frames(6);
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &info(7)).unwrap();
    for (frame, sequence) in frames.iter().zip([u32::MAX - 1, u32::MAX, 0, 5, 6, 9]) {
        writer.write(frame, sequence).unwrap();
    }
    let file = writer.finish().unwrap().into_inner();
    let (found, _, source) = read(&file).unwrap();
    assert_eq!(found, frames);
    assert_eq!(source.counters().queue_drops, 6);
    // A batch ends before the frames that are missing: who reads the count after it does not take
    // them for missing before.
    let mut source = McapSource::new(&file[..], Path::new("a.mcap"), &[]).unwrap();
    let mut batch = Vec::with_capacity(100);
    let mut batches = Vec::new();
    while source.receive(&mut batch, Duration::ZERO).unwrap() == Received::Frames {
        batches.push((batch.len(), source.counters().queue_drops));
        batch.clear();
    }
    assert_eq!(batches, [(3, 0), (2, 4), (1, 6)]);
    // The file after one that ended with 9 and lost two frames in between.
    let mut next = McapSource::new(&file[..], Path::new("a.mcap"), &[]).unwrap();
    next.continue_from(Some(u32::MAX - 4));
    while next.next_frame().unwrap().is_some() {}
    assert_eq!(next.counters().queue_drops, 8);
}

#[test]
fn a_scan_shows_the_stamps() {
    let frames = some_frames(12);
    let file = written(&frames, &info(-3_000_000_000), |n| n % 4 == 3);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.mcap");
    std::fs::write(&path, &file).unwrap();
    let scan = McapScan::read(&path).unwrap();
    assert_eq!(scan.stamps_ns(), Some((frames[0].stamp_ns, frames[11].stamp_ns)));
    assert_eq!((scan.file_end, scan.bytes), (FileEnd::Finished, file.len() as u64));
}

#[test]
fn what_is_no_recording_is_named() {
    for bytes in [&b""[..], b"(1.0) can0 123#11\n", b"\x89MCAP1\r\n"] {
        let error = McapSource::new(bytes, Path::new("a.log"), &[]).unwrap_err();
        assert!(error.to_string().contains("a.log is not an MCAP file"), "{error}");
    }
}

/// What an independent reader is given: see `tests/independent/recordings.py`.
#[test]
#[ignore = "the other process of a test: tests/independent"]
fn child_writes_files_for_an_independent_reader() {
    let folder = std::env::var_os("DIDIM_RECORDINGS").unwrap();
    let folder = Path::new(&folder);
    let mut frames = some_frames(200);
    let kinds = [
        Frame::classic(FrameId::Extended(0x1234_5678), &[1, 2, 3]),
        Frame::remote(FrameId::Standard(0x77), 4),
        Frame::error(0x4, &[0, 0xC, 0, 0, 0, 0, 0, 0]),
        Frame::fd(FrameId::Standard(0x7FF), false, &[0xAA; 64]),
    ];
    for (n, kind) in kinds.into_iter().cycle().take(40).enumerate() {
        frames.push(kind.unwrap().with_stamp(6_000_000_000 + n as u64).on_interface(1));
    }
    // A candump log has stamps from 0 on; with an offset the recording has those of the log,
    // shifted.
    let info = info(1_700_000_000_000_000_000);
    let file = written(&frames, &info, |n| n % 50 == 49);
    std::fs::write(folder.join("whole.mcap"), &file).unwrap();
    std::fs::write(folder.join("cut.mcap.part"), &file[..file.len() / 2]).unwrap();
    repair_recording(&folder.join("cut.mcap.part"), &folder.join("repaired.mcap")).unwrap();
    for (name, frames) in
        [("whole", frames.clone()), ("repaired", read(&file[..file.len() / 2]).unwrap().0)]
    {
        let log = std::fs::File::create(folder.join(format!("{name}.log"))).unwrap();
        let mut log = CandumpWriter::new(log, &info.interfaces, StampDigits::Nanoseconds);
        for frame in frames {
            log.write(&frame.with_stamp(info.log_time(frame.stamp_ns))).unwrap();
        }
        log.finish().unwrap();
    }
}
