//! Logs of several tools with the same frames, written by an independent library (golden/logs.py).

use core::time::Duration;
use std::path::{Path, PathBuf};

use didim_drivers::frame::{Direction, Frame, FrameKind};
use didim_drivers::source::{BlfSource, InterfaceName, Received, Source, SourceError, TextLog};

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

fn drain(source: &mut impl Source) -> Result<Vec<Frame>, SourceError> {
    let (mut frames, mut batch) = (Vec::new(), Vec::with_capacity(16));
    while source.receive(&mut batch, Duration::ZERO)? != Received::End {
        frames.append(&mut batch);
    }
    Ok(frames)
}

fn read(name: &str) -> Vec<Frame> {
    match name.ends_with(".blf") {
        true => drain(&mut BlfSource::open(&golden(name), &[]).unwrap()).unwrap(),
        false => drain(&mut TextLog::open(&golden(name), &[]).unwrap()).unwrap(),
    }
}

/// A binary log from memory.
fn binary(bytes: &[u8], length: usize) -> Result<Vec<Frame>, String> {
    let log = BlfSource::new(bytes, length as u64, Path::new("a.blf"), &[]);
    let mut log = log.map_err(|error| error.to_string())?;
    drain(&mut log).map_err(|error| error.to_string())
}

#[test]
fn logs_of_vector_and_peak_hold_the_frames_of_candump() {
    for (log, of, count, directions) in [
        ("classic.asc", "classic.log", 18, true),
        ("classic_v1_0.trc", "classic.log", 18, false),
        ("classic_v2_1.trc", "classic.log", 18, true),
        ("all.asc", "all.log", 29, true),
        ("all.blf", "all.log", 29, true),
        // That library drops what remains of the last container.
        ("small.blf", "all.log", 27, true),
    ] {
        let (found, expected) = (read(log), read(of));
        let start_ns = expected[0].stamp_ns;
        assert!(found.len() == count && expected.len() >= count, "{log}: {}", found.len());
        for (found, expected) in found.iter().zip(&expected) {
            // That library rounds the stamps of a binary log towards zero.
            let is_binary = log.ends_with(".blf");
            let difference_ns = found.stamp_ns.abs_diff(expected.stamp_ns - start_ns);
            assert!(difference_ns <= u64::from(is_binary) * 1_000, "{log}: {difference_ns} ns");
            assert_eq!(found.is_error(), expected.is_error(), "{log}");
            if found.is_error() {
                continue;
            }
            assert_eq!((found.id, found.kind), (expected.id, expected.kind), "{log}");
            // The candump log of that library does not tell the length of a request.
            if found.kind != FrameKind::Remote {
                assert_eq!(found.data(), expected.data(), "{log}");
            }
            let direction = if directions { expected.direction } else { Direction::Received };
            assert_eq!(found.direction, direction, "{log}");
        }
    }
}

fn of_text(text: &str) -> Result<Vec<Frame>, String> {
    let mut log = TextLog::new(text.as_bytes(), Path::new("drive.asc"), &[]);
    drain(&mut log).map_err(|error| error.to_string())
}

#[test]
fn what_a_header_says_counts() {
    let decimal = "base dec  timestamps relative\n 0.5 1 291 Rx d 2 17 255\n 0.25 1 Statistic: D 0 \
        R 1\n 0.25 1 100x Tx r\n";
    let frames = of_text(decimal).unwrap();
    assert_eq!(
        frames.iter().map(|frame| frame.stamp_ns).collect::<Vec<_>>(),
        [500_000_000, 1_000_000_000]
    );
    assert_eq!((frames[0].id.number(), frames[0].data()), (0x123, &[17, 255][..]));
    assert_eq!(
        (frames[1].id.number(), frames[1].kind, frames[1].length),
        (100, FrameKind::Remote, 0)
    );
    // The last line needs no end.
    let columns = ";$FILEVERSION=2.0\n;$COLUMNS=N,O,T,I,d,l,D\n 1 1.5 ST Rx 00 00\n 2 1059.900 FB \
        0300 Rx 12 00 01 02 03 04 05 06 07 08 09 0A 0B";
    let frames = of_text(columns).unwrap();
    assert_eq!((frames.len(), frames[0].stamp_ns, frames[0].length), (1, 1_059_900_000, 12));
    let kind = FrameKind::Fd { bit_rate_switch: true, error_state_indicator: false };
    assert_eq!(frames[0].kind, kind);
}

#[test]
fn what_is_damaged_is_named_by_its_line() {
    for (text, says) in [
        ("base hex\n 0.5 1 123 Rx d 8 11 22", "drive.asc:2: the line has not as many bytes"),
        ("base hex\n 0.5 1 12G Rx d 1 11", "drive.asc:2: the identifier is no number"),
        ("base hex\n 0.5 1 123 Rx q 1 11", "drive.asc:2: kind or length"),
        ("base hex\n 0.5. 1 123 Rx d 1 11", "drive.asc:2: the line has no time"),
        ("base hex\n 0.5 CANFD 1 Rx 123 0 0 f 65 11", "drive.asc:2: kind or length"),
        (";$FILEVERSION=3.0\n", "drive.asc:1: this version of TRC is not read"),
        (";$FILEVERSION=1.1\n 1) 5.0 Rx 0123 2 11", "drive.asc:2: the line has not as many bytes"),
        (";$FILEVERSION=1.1\n 1) 5.0 Rx", "drive.asc:2: kind or length"),
        (";$FILEVERSION=1.1\n 1) -5.0 Rx 0123 1 11", "drive.asc:2: the line has no time"),
    ] {
        let said = of_text(text).unwrap_err();
        assert!(said.starts_with(says), "{text}\n{said}");
    }
    // Whatever is cut off or damaged is read or refused in words.
    for name in ["all.asc", "classic_v2_1.trc", "classic_v1_0.trc"] {
        let full_log = std::fs::read(golden(name)).unwrap();
        let mut refused = 0;
        for at in (0..full_log.len()).step_by(7) {
            let mut damaged = full_log.clone();
            damaged[at] ^= 0x15;
            for bytes in [&full_log[..at], &damaged] {
                let mut log = TextLog::new(bytes, Path::new("spoiled"), &[]);
                refused += usize::from(drain(&mut log).is_err());
            }
        }
        assert!(refused > 20, "{name}: {refused}");
    }
}

#[test]
fn a_binary_log_is_read_up_to_its_last_complete_object() {
    let complete = std::fs::read(golden("small.blf")).unwrap();
    let all = binary(&complete, complete.len()).unwrap();
    let open = |bytes: &[u8]| {
        BlfSource::new(bytes, bytes.len() as u64, Path::new("a.blf"), &[]).unwrap().is_unfinished()
    };
    assert!(!open(&complete) && open(&complete[..complete.len() - 1]));
    let mut counts = Vec::new();
    for cut in (144..complete.len()).step_by(5) {
        let frames = binary(&complete[..cut], cut).unwrap();
        assert_eq!(frames, all[..frames.len()]);
        counts.push(frames.len());
    }
    assert!(counts.is_sorted() && counts[0] == 0 && counts.last() > Some(&20), "{counts:?}");
    // Only the interface that is asked for.
    let other = [InterfaceName::new("can7").unwrap()];
    let mut log = BlfSource::open(&golden("all.blf"), &other).unwrap();
    assert_eq!((drain(&mut log).unwrap().len(), log.counters().passed_over), (0, 29));
}

#[test]
fn a_damaged_binary_log_is_refused_or_read() {
    let intact = std::fs::read(golden("all.blf")).unwrap();
    let refusal = |bytes: &[u8]| binary(bytes, bytes.len()).unwrap_err();
    assert!(refusal(b"LOGG").starts_with("a.blf, byte 0: no header"));
    let mut no_object = intact.clone();
    no_object[144] = b'X';
    assert!(refusal(&no_object).starts_with("a.blf, byte 144: no object begins there"));
    let mut long = intact.clone();
    long[152..156].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refusal(&long).contains("length of an object is impossible"));
    let mut bomb = intact.clone();
    bomb[168..172].copy_from_slice(&7_u32.to_le_bytes());
    assert!(refusal(&bomb).contains("cannot be decompressed"));
    let mut refused = 0;
    for at in 0..intact.len() {
        let mut damaged = intact.clone();
        damaged[at] ^= 0x15;
        refused += usize::from(binary(&damaged, damaged.len()).is_err());
    }
    assert!(refused > 100, "{refused}");
}
