//! Readings of the system's clocks.

#![allow(unsafe_code, reason = "clock_gettime: std does not show CLOCK_MONOTONIC as a number")]

use crate::clock::ClockPair;

/// Number of attempts to read both clocks together. The attempt with the shortest time between its
/// two outer readings is used.
const READINGS_PER_PAIR: usize = 3;

/// Returns readings of both clocks at almost the same instant. Each attempt reads CLOCK_MONOTONIC,
/// CLOCK_REALTIME and CLOCK_MONOTONIC again; the fastest attempt is used. On ordinary machines no
/// call enters the kernel.
pub fn clock_pair() -> ClockPair {
    let once = || {
        let before = read(libc::CLOCK_MONOTONIC);
        let realtime_ns = read(libc::CLOCK_REALTIME);
        let uncertainty_ns = read(libc::CLOCK_MONOTONIC).saturating_sub(before).div_ceil(2);
        ClockPair { realtime_ns, monotonic_ns: before + uncertainty_ns, uncertainty_ns }
    };
    let mut best = once();
    for _ in 1..READINGS_PER_PAIR {
        let pair = once();
        if pair.uncertainty_ns < best.uncertainty_ns {
            best = pair;
        }
    }
    best
}

/// Returns the time of CLOCK_MONOTONIC \[ns\]. [`crate::clock::ClockMap`] maps stamps to this
/// clock, which is the same for all processes of the machine.
pub fn monotonic_ns() -> u64 {
    read(libc::CLOCK_MONOTONIC)
}

fn read(clock: libc::clockid_t) -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a timespec that lives through the call. The call fails only for a clock
    // that does not exist. Both clocks used here exist on every Linux; on failure `time` would stay
    // zero.
    unsafe { libc::clock_gettime(clock, &raw mut time) };
    let seconds = u64::try_from(time.tv_sec).unwrap_or(0);
    let nanoseconds = u64::try_from(time.tv_nsec).unwrap_or(0);
    seconds.saturating_mul(1_000_000_000).saturating_add(nanoseconds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, SystemTime, UNIX_EPOCH};

    #[test]
    fn a_pair_is_now_on_both_clocks() {
        let first = clock_pair();
        let wall = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        std::thread::sleep(Duration::from_millis(5));
        let second = clock_pair();
        assert!(wall.abs_diff(Duration::from_nanos(first.realtime_ns)) < Duration::from_secs(1));
        assert!(second.monotonic_ns - first.monotonic_ns >= 5_000_000);
        assert!(first.uncertainty_ns < 1_000_000_000);
    }

    #[test]
    fn one_reading_lies_between_two_pairs() {
        let (before, now, after) = (clock_pair(), monotonic_ns(), clock_pair());
        assert!(before.monotonic_ns <= now + before.uncertainty_ns, "{before:?}, {now}");
        assert!(now <= after.monotonic_ns + after.uncertainty_ns, "{now}, {after:?}");
    }
}
