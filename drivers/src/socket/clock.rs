//! Readings of the system's clocks.

#![allow(unsafe_code, reason = "clock_gettime: std does not show CLOCK_BOOTTIME as a number")]

use crate::clock::ClockPair;

/// Number of attempts to read both clocks together. The attempt with the shortest time between its
/// two outer readings is used.
const READINGS_PER_PAIR: usize = 3;

/// Returns readings of both clocks at almost the same instant. Each attempt reads CLOCK_BOOTTIME,
/// CLOCK_REALTIME and CLOCK_BOOTTIME again; the fastest attempt is used. On ordinary machines no
/// call enters the kernel.
pub fn clock_pair() -> ClockPair {
    let once = || {
        let before = read(libc::CLOCK_BOOTTIME);
        let realtime_ns = read(libc::CLOCK_REALTIME);
        let uncertainty_ns = read(libc::CLOCK_BOOTTIME).saturating_sub(before).div_ceil(2);
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

/// Returns the time of CLOCK_BOOTTIME \[ns\], which nobody sets. It continues while the machine is
/// suspended, so that the time without frames is a gap between the samples.
/// [`crate::clock::ClockMap`] maps stamps to this clock, which is the same for all processes of the
/// machine.
pub fn monotonic_ns() -> u64 {
    read(libc::CLOCK_BOOTTIME)
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
    use crate::expectation::Expectation;
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

    /// A time namespace in which the machine was suspended for an hour.
    #[test]
    #[ignore = "needs a time namespace of its own: tests/run"]
    fn a_suspension_is_a_gap_between_stamps() {
        const TEST: &str = "socket::clock::tests::a_suspension_is_a_gap_between_stamps";
        const INSIDE: &str = "DIDIM_TEST_INSIDE_A_TIME_OF_ITS_OWN";
        if std::env::var_os(INSIDE).is_some() {
            let suspended = monotonic_ns() - read(libc::CLOCK_MONOTONIC);
            let expected_s: u64 = Expectation::of("machine-suspended").get("suspended_s");
            let expected_ns = expected_s * 1_000_000_000;
            assert!(suspended >= expected_ns, "{suspended} ns");
            let pair = clock_pair();
            assert!(pair.monotonic_ns - read(libc::CLOCK_MONOTONIC) >= expected_ns);
            return;
        }
        let program = std::env::current_exe().unwrap();
        let mut command = std::process::Command::new("unshare");
        command.args(["-rT", "--boottime", "3600"]).arg(program);
        command.args(["--ignored", "--exact", TEST]).env(INSIDE, "1");
        let finished = command.output().unwrap();
        assert!(finished.status.success(), "{finished:?}");
        assert!(String::from_utf8_lossy(&finished.stdout).contains("1 passed"), "{finished:?}");
    }

    #[test]
    fn one_reading_lies_between_two_pairs() {
        let (before, now, after) = (clock_pair(), monotonic_ns(), clock_pair());
        assert!(before.monotonic_ns <= now + before.uncertainty_ns, "{before:?}, {now}");
        assert!(now <= after.monotonic_ns + after.uncertainty_ns, "{now}, {after:?}");
    }
}
