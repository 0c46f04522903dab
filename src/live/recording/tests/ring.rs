//! Handling of existing files when a ring is opened.

use super::*;
use crate::expectation::Expectation;

/// Writes the file of a killed recorder: `frames` flushed in chunks of a hundred.
fn killed(path: &Path, frames: core::ops::Range<u64>) {
    let info = McapInfo { interfaces: interfaces().to_vec(), ..McapInfo::default() };
    let mut writer = McapWriter::new(File::create(path).unwrap(), &info).unwrap();
    for n in frames {
        writer.write(&frame(n), u32::try_from(n).unwrap()).unwrap();
        if n % 100 == 99 {
            writer.flush().unwrap();
        }
    }
    core::mem::forget(writer);
}

#[test]
fn what_a_killed_recorder_left_is_closed_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("segment-00000004.mcap.part");
    killed(&part, 0..250);
    // A file with an incomplete chunk at its end, and another that never had a chunk.
    File::options().append(true).open(&part).unwrap().write_all(&[6, 0, 1, 0, 0, 0]).unwrap();
    fs::write(folder.path().join("segment-00000005.mcap.part"), b"\x89MCAP").unwrap();
    fs::write(folder.path().join("notes.txt"), "not ours").unwrap();
    let ring = Ring::open(folder.path(), 10_000_000).unwrap();
    assert_eq!((ring.repaired_count(), ring.complete_files().len()), (1, 1));
    let names: Vec<_> = files(folder.path());
    let expected = ["notes.txt", "segment-00000004.mcap"].map(|name| folder.path().join(name));
    assert_eq!(names, expected);
    assert!(read(&names[1], false).into_iter().eq(0..200));
    // The next file does not reuse a number that existed.
    assert!(ring.next_path().ends_with("segment-00000006.mcap.part"));
    assert!(Ring::open(folder.path(), 10_000_000).unwrap_err().to_string().contains("in use"));
}

#[test]
fn a_part_cut_at_any_place_never_hinders_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("segment-00000000.mcap.part");
    killed(&part, 0..200);
    let contents = fs::read(&part).unwrap();
    let expected: Vec<usize> = Expectation::of("recording-half-written").get("frames");
    for cut in (0..contents.len()).step_by(97).chain([contents.len()]) {
        files(folder.path()).iter().for_each(|file| fs::remove_file(file).unwrap());
        fs::write(&part, &contents[..cut]).unwrap();
        let ring = Ring::open(folder.path(), 10_000_000).unwrap();
        let numbers: Vec<u64> =
            ring.complete_files().flat_map(|segment| read(&segment.path, false)).collect();
        assert!(expected.contains(&numbers.len()), "cut at {cut}: {}", numbers.len());
        assert_eq!(files(folder.path()).len(), usize::from(!numbers.is_empty()), "cut at {cut}");
    }
}

#[test]
fn a_part_that_is_damaged_anywhere_never_hinders_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("segment-00000000.mcap.part");
    killed(&part, 0..200);
    let contents = fs::read(&part).unwrap();
    // Simulates a file after a power failure: from some position on it contains zeros or other
    // bytes.
    for (from, with) in (8..contents.len()).step_by(97).flat_map(|from| [(from, 0), (from, 0xA5)]) {
        files(folder.path()).iter().for_each(|file| fs::remove_file(file).unwrap());
        let mut damaged = contents.clone();
        damaged[from..].fill(with);
        fs::write(&part, &damaged).unwrap();
        let ring = Ring::open(folder.path(), 10_000_000).unwrap();
        let numbers: Vec<u64> =
            ring.complete_files().flat_map(|segment| read(&segment.path, false)).collect();
        assert!([0, 100, 200].contains(&numbers.len()), "from {from}: {}", numbers.len());
        assert!(numbers.iter().copied().eq(0..numbers.len() as u64), "from {from}");
        assert_eq!(files(folder.path()).len(), usize::from(!numbers.is_empty()), "from {from}");
    }
}

#[test]
fn a_file_that_is_there_whole_and_in_part_counts_once() {
    // The recorder was killed between the two steps of a repair.
    let folder = tempfile::tempdir().unwrap();
    let complete = folder.path().join("segment-00000003.mcap");
    let part = folder.path().join("segment-00000003.mcap.part");
    killed(&part, 0..200);
    didim_drivers::source::mcap::repair_recording(&part, &complete).unwrap();
    let mut source = open_log(folder.path(), None, &[]).unwrap();
    assert!(drain(&mut *source).0.into_iter().eq(0..200), "each frame once");
    let ring = Ring::open(folder.path(), 10_000_000).unwrap();
    assert_eq!((ring.repaired_count(), ring.complete_files().len()), (0, 1));
    assert_eq!(ring.bytes(), size(folder.path()));
    assert_eq!(files(folder.path()), [complete]);
}

#[test]
fn a_file_that_cannot_be_read_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let [part, complete] = ["part", "segment-00000003.mcap"].map(|name| folder.path().join(name));
    fs::write(&complete, "damaged").unwrap();
    let mut ring = Ring::open(folder.path(), 10_000_000).unwrap();
    assert_eq!(ring.oldest_log_time(), None);
    killed(&part, 0..200);
    didim_drivers::source::mcap::repair_recording(&part, &complete).unwrap();
    assert_eq!(ring.oldest_log_time(), None, "it would be read at every turn");
    drop(ring);
    let mut ring = Ring::open(folder.path(), 10_000_000).unwrap();
    assert_eq!(ring.oldest_log_time(), Some(0));
}

#[test]
fn a_ring_that_may_be_smaller_now_shrinks_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..6 {
        killed(
            &folder.path().join(format!("segment-0000000{n}.mcap.part")),
            n * 100..n * 100 + 100,
        );
    }
    let before = size(folder.path());
    let limit = before / 2;
    let ring = Ring::open(folder.path(), limit).unwrap();
    assert!(size(folder.path()) <= limit);
    let numbers: Vec<u64> =
        ring.complete_files().flat_map(|segment| read(&segment.path, false)).collect();
    assert_eq!(numbers.last(), Some(&599), "the latest are kept: {numbers:?}");
}
