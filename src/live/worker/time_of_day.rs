//! The time of day of the sample stamps.

use didim_drivers::socket::clock_pair;
use didim_formats::RecordingStart;

use crate::window::Window;

/// Offset from sample stamps to nanoseconds after 1970-01-01T00:00:00Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeOfDay {
    /// Current difference between the clocks of this machine. The stamps are from the monotonic
    /// clock, which nobody sets.
    ThisMachine,
    /// Time of arrival. The stamps are from a clock of the bus, which drifts against those of this
    /// machine.
    Arrival,
    /// Offset from the log; see [`since_1970_ns`](didim_drivers::source::Source::since_1970_ns).
    Log {
        /// Offset to add \[ns\].
        since_1970_ns: i64,
    },
}

/// Arrival of a sample, which relates its stamp to the time of day.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// Offset from the stamp to the time of day \[ns\].
    since_1970_ns: i128,
}

impl Arrival {
    /// Returns the arrival of a sample that has just come.
    pub(super) fn now(stamp_ns: u64) -> Self {
        Self { since_1970_ns: i128::from(clock_pair().realtime_ns) - i128::from(stamp_ns) }
    }
}

impl TimeOfDay {
    /// Returns the time at which the first sample of a window was recorded, if known.
    pub(super) fn start(self, window: &Window, arrival: Option<Arrival>) -> Option<RecordingStart> {
        let since_1970_ns = match self {
            Self::Arrival => arrival?.since_1970_ns,
            Self::ThisMachine => {
                let now = clock_pair();
                i128::from(now.realtime_ns) - i128::from(now.monotonic_ns)
            }
            Self::Log { since_1970_ns } => since_1970_ns.into(),
        };
        RecordingStart::of_unix_ns(i128::from(window.samples.first()?.stamp_ns) + since_1970_ns)
    }
}

#[cfg(test)]
mod tests {
    use didim_dynamics::JointSample;

    use super::*;
    use crate::window::WindowEnd;

    #[test]
    fn a_stamp_gets_the_date_of_its_clock() {
        let start_of = |stamp_ns: u64, time_of_day: TimeOfDay| {
            let window = Window {
                number: 0,
                sample_rate_hz: 500.0,
                samples: vec![JointSample::zero(0, stamp_ns)],
                counted_samples: 0..1,
                end: WindowEnd::Rest,
                recording_start: None,
                note: None,
            };
            // A sample of the bus has arrived a second after that of the window.
            time_of_day.start(&window, Some(Arrival::now(stamp_ns + 1_000_000_000)))
        };
        let log = |since_1970_ns| TimeOfDay::Log { since_1970_ns };
        let date = RecordingStart::of_unix_ns(1_795_331_849_250_000_000);
        assert_eq!(start_of(1_795_331_849_250_100_000, log(0)), date);
        assert_eq!(start_of(849_250_000_000, log(1_795_331_000_000_000_000)), date);
        assert_eq!(
            start_of(849_250_000_000, log(0)),
            None,
            "a log that counts from its own beginning"
        );
        let now = clock_pair();
        let start_here = start_of(now.monotonic_ns, TimeOfDay::ThisMachine);
        assert_eq!(
            start_here.is_some(),
            RecordingStart::of_unix_ns(now.realtime_ns.into()).is_some()
        );
        // A clock of the bus, of any zero.
        let before = RecordingStart::of_unix_ns(i128::from(now.realtime_ns) - 1_000_000_000);
        let arrived = start_of(7, TimeOfDay::Arrival);
        assert!(arrived >= before && arrived <= start_here, "{before:?} {arrived:?}");
        assert_eq!(
            start_of(0, TimeOfDay::ThisMachine) < start_here,
            start_here.is_some(),
            "since the machine started"
        );
    }
}
