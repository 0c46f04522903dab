//! What the counter of a packed frame says about the frames before it.

/// How far a counter and the time may disagree about the number of cycles: stamps jitter by less
/// than a period, and the period is known to this share.
const SLACK_CYCLES: f64 = 2.0;
const SLACK_SHARE: f64 = 0.01;

/// What a frame is to the one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// This many cycles later: 1 is the next one.
    Forward(u64),
    /// The same frame again.
    Repeated,
    /// A frame from before it.
    Older,
    /// The counter does not go with the time: the device has started again.
    Restart,
}

/// The step from the counter value `from` to `to`, of `width` bits, when `periods` have passed by
/// the stamps. The counter gives the cycles modulo 2^width, the time the number of times it has
/// started again.
pub(super) fn step(from: u64, to: u64, width: u8, periods: f64) -> Step {
    let modulus = f64::from(width).exp2();
    let behind = to.wrapping_sub(from) & (u64::MAX >> (64 - width.clamp(1, 64)));
    let ahead = behind as f64;
    let cycles = ahead + modulus * ((periods - ahead) / modulus).round();
    // Within half a range of the time, so that 0 is the frame itself, however late it comes again.
    if cycles == 0.0 || (behind == 0 && periods < 0.5 * modulus) {
        return Step::Repeated;
    }
    if (cycles - periods).abs() > SLACK_CYCLES + SLACK_SHARE * periods.abs() {
        return Step::Restart;
    }
    if cycles < 0.0 {
        return Step::Older;
    }
    #[allow(clippy::cast_possible_truncation, reason = "positive, and bounded by the time")]
    Step::Forward(cycles as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_steps() {
        assert_eq!(step(7, 8, 32, 1.0), Step::Forward(1));
        assert_eq!(step(u64::from(u32::MAX), 0, 32, 1.1), Step::Forward(1));
        assert_eq!(step(7, 12, 32, 5.0), Step::Forward(5));
        assert_eq!(step(7, 7, 32, 1.0), Step::Repeated);
        assert_eq!(step(7, 7, 32, 900.0), Step::Repeated);
        assert_eq!(step(7, 6, 32, -1.0), Step::Older);
        assert_eq!(step(7_000_000, 0, 32, 40.0), Step::Restart);
        assert_eq!(step(7, 7_000_000, 32, 40.0), Step::Restart);
        // Eight bits start again every 256 cycles: the time says how often.
        assert_eq!(step(250, 4, 8, 10.0), Step::Forward(10));
        assert_eq!(step(250, 4, 8, 522.4), Step::Forward(522));
        assert_eq!(step(9, 9, 8, 256.1), Step::Forward(256));
        assert_eq!(step(100, 0, 8, 1.0), Step::Restart);
    }
}
