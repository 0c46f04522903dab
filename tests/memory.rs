//! The memory that a long table takes while it is identified.

use std::borrow::Cow;
use std::path::Path;

use didim::cell::Cell;
use didim::offline::identify::identify_measurements;
use didim_core::identification::Method;
use didim_formats::{Measurement, read_table};

/// Bytes for each sample of six axes, the measurement itself included. Where the rows double and just do not fit a transform, as
/// here, it is the most.
const LIMIT: f64 = 400.0;

/// The recording, over and over, so many samples of it: forwards and backwards from rest to rest.
fn repeated(of: &Measurement, samples: usize) -> Measurement {
    let (first, count) = (450, 1600);
    let repeat = |signal: &Vec<f64>| -> Vec<f64> {
        let at = |k: usize| match k % (2 * count) {
            k if k < count => signal[first + k],
            k => signal[first + 2 * count - 1 - k],
        };
        (0..samples).map(at).collect()
    };
    let mut repeated = of.clone();
    for signals in [&mut repeated.signals.position_rad, &mut repeated.signals.torque_nm] {
        *signals = signals.iter().map(repeat).collect();
    }
    repeated
}

#[test]
fn a_long_table_takes_little_memory_for_each_row() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/kr300");
    let cell = Cell::read(&folder.join("cell.toml")).unwrap();
    let record = read_table(&folder.join("a.csv"), None, cell.sample_rate_hz(), None).unwrap();
    let recording = record.into_whole().unwrap();
    let peak = |recordings: usize, samples: usize| {
        let of_each = samples / recordings;
        let cost = allocation_counter::measure(|| {
            let part = || (Cow::Owned(repeated(&recording, of_each)), 100..of_each - 100);
            let all = (0..recordings).map(|_| part()).collect();
            let found = identify_measurements(&cell, Method::IdimLs, all).unwrap();
            assert_eq!(found.estimate.samples, samples);
        });
        cost.bytes_max as f64
    };
    // The constant part is the same from 4097 rows on.
    let lengths = [41_200_usize, 82_400];
    let peaks = lengths.map(|samples| peak(1, samples));
    let per_sample = (peaks[1] - peaks[0]) / (lengths[1] - lengths[0]) as f64;
    println!("{per_sample:.0} bytes for each sample, {peaks:?}");
    assert!(per_sample < LIMIT, "{per_sample} bytes for each sample");
    // Of several recordings as of one that is as long.
    let of_four = peak(4, lengths[1]);
    assert!(of_four < 1.02 * peaks[1], "{of_four} bytes of four, {} of one", peaks[1]);
}
