//! Readings of the clocks of a system without SocketCAN, in place of those of `socket`. Only logs
//! are read there, whose stamps need no clock of the machine.

use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::clock::ClockPair;

/// Returns readings of both clocks, one after the other.
pub fn clock_pair() -> ClockPair {
    let realtime = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let (realtime_ns, monotonic_ns) = (nanoseconds(realtime), monotonic_ns());
    ClockPair { realtime_ns, monotonic_ns, uncertainty_ns: 0 }
}

/// Returns the time since the first call in this process \[ns\].
pub fn monotonic_ns() -> u64 {
    static FIRST_CALL: OnceLock<Instant> = OnceLock::new();
    nanoseconds(FIRST_CALL.get_or_init(Instant::now).elapsed())
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
