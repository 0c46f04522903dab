//! The memory that a long table takes while it is identified.

use std::borrow::Cow;
use std::path::Path;

use didim::analysis::identify::identify_measurements;
use didim::cell::Cell;
use didim_formats::{Measurement, read_table};
use didim_identification::identification::Method;

/// Bytes for each sample of six axes, the measurement itself included. Where the rows double and
/// just do not fit a transform, as here, it is the most.
const LIMIT: f64 = 400.0;

/// The recording, over and over, so many samples of it: forwards and backwards from rest to rest.
fn repeated(of: &Measurement, samples: usize) -> Measurement {
    let (first, count) = (450, 1600);
    let mut repeated = of.clone();
    for signals in [&mut repeated.signals.position_rad, &mut repeated.signals.torque_nm] {
        *signals = signals
            .iter()
            .map(|signal: &Vec<f64>| -> Vec<f64> {
                let index = |k: usize| match k % (2 * count) {
                    k if k < count => signal[first + k],
                    k => signal[first + 2 * count - 1 - k],
                };
                (0..samples).map(index).collect()
            })
            .collect();
    }
    repeated
}

#[test]
fn a_long_table_takes_little_memory_for_each_row() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/kr300");
    let cell = Cell::read(&folder.join("cell.toml")).unwrap();
    let record = read_table(&folder.join("a.csv"), None, cell.sample_rate_hz(), None).unwrap();
    let recording = record.into_whole().unwrap();
    fn peak(recordings: usize, samples: usize, recording: &Measurement, cell: &Cell) -> f64 {
        let of_each = samples / recordings;
        let cost = allocation_counter::measure(|| {
            let part = || (Cow::Owned(repeated(recording, of_each)), 100..of_each - 100);
            let measurements = (0..recordings).map(|_| part()).collect();
            let identified = identify_measurements(cell, Method::IdimLs, measurements).unwrap();
            assert_eq!(identified.estimate.samples, samples);
        });
        cost.bytes_max as f64
    }
    // The constant part is the same from 4097 rows on.
    let lengths = [41_200_usize, 82_400];
    let peaks = lengths.map(|samples| peak(1, samples, &recording, &cell));
    let per_sample = (peaks[1] - peaks[0]) / (lengths[1] - lengths[0]) as f64;
    println!("{per_sample:.0} bytes for each sample, {peaks:?}");
    assert!(per_sample < LIMIT, "{per_sample} bytes for each sample");
    // Of several recordings as of one that is as long.
    let of_four = peak(4, lengths[1], &recording, &cell);
    assert!(of_four < 1.02 * peaks[1], "{of_four} bytes of four, {} of one", peaks[1]);
}
