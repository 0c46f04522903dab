//! A record from arrays of signals in memory.

use std::path::Path;

use super::error::TableError;
use super::place::RowPlace;
use super::rows::Table;
use super::uniform_record::to_record;
use crate::measurement::Side;
use crate::record::Record;
use crate::row_times::mean_rate_hz;
use crate::start::RecordingStart;

/// Name of the arrays in errors, in place of a file.
const ARRAYS: &str = "time";

/// Signals in SI units: one vector per axis, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalArrays {
    /// The side of the transmission.
    pub side: Side,
    /// Time of each row \[s\]: since the first row, or since 1970-01-01T00:00:00Z.
    pub time_s: Vec<f64>,
    /// Positions \[rad or m\].
    pub position: Vec<Vec<f64>>,
    /// Torques \[N·m or N\].
    pub torque: Vec<Vec<f64>>,
    /// Commanded positions \[rad or m\]; empty if unknown.
    pub reference: Vec<Vec<f64>>,
}

impl Record {
    /// Creates a record from arrays. Rows with jittering times are resampled to a uniform grid, and
    /// missing rows cut the record into pieces, as with a table.
    ///
    /// # Errors
    /// [`TableError`], if the times form no record. It names `time` in place of a file.
    pub fn from_arrays(arrays: SignalArrays) -> Result<Self, TableError> {
        let SignalArrays { side, mut time_s, position, torque, reference } = arrays;
        let file = Path::new(ARRAYS);
        if time_s.len() < 2 {
            return Err(TableError::TooShort { file: file.to_path_buf() });
        }
        if let Some(row) = time_s.iter().position(|time| !time.is_finite()) {
            return Err(TableError::NotANumber {
                file: file.to_path_buf(),
                place: RowPlace::Row(1).rows_later(row),
                column: "time".to_owned(),
                text: time_s[row].to_string(),
            });
        }
        let first_s = time_s[0];
        // The last digit of a time that counts from 1970 is a fraction of a microsecond.
        let largest_s = time_s.iter().fold(0.0, |largest: f64, time| largest.max(time.abs()));
        let resolution_s = largest_s.next_up() - largest_s;
        time_s.iter_mut().for_each(|time| *time -= first_s);
        let rate_hz = mean_rate_hz(&time_s).unwrap_or(f64::NAN);
        #[expect(clippy::cast_possible_truncation, reason = "saturates, and is no date then")]
        let first_ns = (1e9 * first_s).round() as i128;
        let table = Table {
            side,
            axes: position.len(),
            first_row: RowPlace::Row(1),
            time: Some(time_s),
            resolution_s,
            second: 1.0,
            first_ns: Some(first_ns),
            signals: [position, torque, reference],
            begins: Vec::new(),
            incomplete_rows: None,
        };
        let start = RecordingStart::of_unix_ns(first_ns);
        to_record(table, file, None, rate_hz).map(|record| record.with_start(start))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrays(time_s: Vec<f64>) -> SignalArrays {
        let wave = |of: f64| time_s.iter().map(|t| (of * t).sin()).collect::<Vec<f64>>();
        let (position, torque) = (vec![wave(3.0), wave(5.0)], vec![wave(7.0), wave(2.0)]);
        SignalArrays { side: Side::Joint, time_s, position, torque, reference: Vec::new() }
    }

    fn rows(range: core::ops::Range<u32>) -> impl DoubleEndedIterator<Item = f64> {
        range.map(|row| f64::from(row) * 0.002)
    }

    #[test]
    fn uniform_arrays_stay_as_they_are_and_have_the_date_of_1970() {
        let arrays_in = arrays(rows(0..500).collect());
        let record = Record::from_arrays(arrays_in.clone()).unwrap();
        let [piece] = &record.segments[..] else { panic!("{}", record.segments.len()) };
        assert_eq!(piece.measurement.signals.position_rad, arrays_in.position);
        assert_eq!(piece.measurement.signals.torque_nm, arrays_in.torque);
        assert!((piece.measurement.signals.sample_rate_hz - 500.0).abs() < 1e-6);
        assert_eq!(record.recording_start, None);
        let since_1970 = rows(0..500).map(|time| 1_795_331_849.0 + time).collect();
        let dated = SignalArrays { time_s: since_1970, ..arrays_in };
        let record = Record::from_arrays(dated).unwrap();
        assert_eq!(record.segments.len(), 1);
        assert!(record.resampled.is_nothing(), "{}", record.resampled);
        let start = record.recording_start.unwrap();
        assert_eq!(start.to_string(), "2026-11-22T07:17:29.000Z");
    }

    #[test]
    fn a_gap_makes_two_pieces_and_times_without_order_are_refused() {
        let gap = arrays(rows(0..300).chain(rows(400..900)).collect());
        assert_eq!(Record::from_arrays(gap).unwrap().segments.len(), 2);
        assert!(Record::from_arrays(arrays(vec![0.0; 100])).is_err());
        assert!(Record::from_arrays(arrays(rows(0..300).rev().collect())).is_err());
        assert!(Record::from_arrays(arrays(vec![f64::NAN; 100])).is_err());
        assert!(Record::from_arrays(arrays(vec![0.0])).is_err());
    }
}
