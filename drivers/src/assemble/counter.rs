//! Evaluation of the counter of a packed frame.
//!
//! The counter counts the cycles. The stamps only show how often the counter has wrapped, so a
//! frame that is late on a busy machine is not a loss. If the counter is far ahead of the time, or
//! behind the counter of the previous frame, the device has restarted.

use super::limits::AssemblyLimits;

/// Relation of a frame to the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Number of cycles after the previous frame: 1 is the next cycle.
    Forward(u64),
    /// The same frame again.
    Repeated,
    /// A frame older than the previous one.
    Older,
    /// The device has restarted.
    Restart,
}

/// Returns the step from the counter value `from` to `to`. The counter has `width` bits. According
/// to the stamps, `periods` periods of the nominal length `period_ns` \[ns\] have passed.
/// `backwards` is true if the later frame has the earlier stamp.
pub(super) fn step(
    from: u64,
    to: u64,
    width: u8,
    (periods, period_ns): (f64, f64),
    backwards: bool,
    limits: &AssemblyLimits,
) -> Step {
    let modulus = f64::from(width).exp2();
    let behind = to.wrapping_sub(from) & (u64::MAX >> (64 - width.clamp(1, 64)));
    if behind == 0 && periods < 0.5 * modulus {
        return Step::Repeated;
    }
    // Several numbers of cycles fit the counter. Take the one nearest to the time.
    let ahead = behind as f64;
    let cycles = ahead + modulus * ((periods - ahead) / modulus).round();
    let slack = (limits.counter_slack_ns / period_ns).max(2.0);
    let slack = if width < limits.wide_counter_bits { slack.min(0.25 * modulus) } else { slack };
    let too_far = (cycles - periods).abs() > slack;
    if cycles < 1.0 && backwards && !too_far {
        Step::Older
    } else if cycles < 1.0 || too_far {
        Step::Restart
    } else {
        #[allow(clippy::cast_possible_truncation, reason = "positive, and bounded by the time")]
        Step::Forward(cycles as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(from: u64, to: u64, width: u8, periods: f64) -> Step {
        let limits = AssemblyLimits::DEFAULT;
        super::step(from, to, width, (periods, 200_000.0), periods < 0.0, &limits)
    }

    #[test]
    fn a_counter_steps() {
        assert_eq!(step(7, 8, 32, 1.0), Step::Forward(1));
        assert_eq!(step(u64::from(u32::MAX), 0, 32, 1.1), Step::Forward(1));
        assert_eq!(step(7, 12, 32, 5.0), Step::Forward(5));
        // A sender or a kernel that was busy for a while has lost nothing and catches up.
        assert_eq!(step(7, 8, 32, 4000.0), Step::Forward(1));
        assert_eq!(step(7, 8, 32, -20.0), Step::Forward(1));
        assert_eq!(step(7, 8, 32, 5002.0), Step::Restart);
        assert_eq!(step(7, 7, 32, 1.0), Step::Repeated);
        assert_eq!(step(7, 7, 32, 900.0), Step::Repeated);
        assert_eq!(step(7, 6, 32, -1.0), Step::Older);
        assert_eq!(step(7, 6, 32, 1.0), Step::Restart);
        assert_eq!(step(7_000_000, 0, 32, 40.0), Step::Restart);
        assert_eq!(step(7, 7_000_000, 32, 40.0), Step::Restart);
        // Eight bits wrap every 256 cycles: the time shows how often.
        assert_eq!(step(250, 4, 8, 10.0), Step::Forward(10));
        assert_eq!(step(250, 4, 8, 522.4), Step::Forward(522));
        assert_eq!(step(9, 9, 8, 256.1), Step::Forward(256));
        assert_eq!(step(100, 0, 8, 1.0), Step::Restart);
    }
}
