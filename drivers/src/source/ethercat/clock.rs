//! Stamps of EtherCAT cycles, from the distributed clock if the frames carry it.

/// Smallest difference between the distributed clock and the capture in the time from one cycle to
/// the next \[ns\] that is not drift. A larger difference means that one of the two clocks was set.
const MIN_CLOCK_STEP_NS: u64 = 500_000_000;

/// Clock for the stamps of cycles. It begins with the first stamp of the capture and continues with
/// the distributed clock, by which the drives run. If the distributed clock is missing or was set,
/// the clock continues with the stamps of the capture.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CycleClock {
    latest_cycle: Option<LatestCycle>,
}

#[derive(Clone, Copy, Debug)]
struct LatestCycle {
    stamp_ns: u64,
    captured_ns: u64,
    /// Time of the distributed clock \[ns\], and its number of bits.
    system_time: Option<(u64, u8)>,
}

impl CycleClock {
    /// Returns the stamp of a cycle \[ns since 1970\] from the capture time of its frame and the
    /// time of the distributed clock.
    pub(super) fn stamp_ns(&mut self, captured_ns: u64, system: Option<(u64, u8)>) -> u64 {
        // The time of a capture may be that of a clock that was set back.
        let captured_ns =
            self.latest_cycle.map_or(captured_ns, |latest| captured_ns.max(latest.captured_ns));
        let stamp_ns = self.latest_cycle.map_or(captured_ns, |latest| {
            let captured = captured_ns - latest.captured_ns;
            let passed = match (latest.system_time, system) {
                (Some((before, bits)), Some((now, also))) if bits == also => {
                    // A time of 32 bits wraps every 4.3 s. An advance by more than half its range
                    // means that the clock went back.
                    let mask = u64::MAX >> (64 - bits);
                    let passed = now.wrapping_sub(before) & mask;
                    (passed <= mask / 2 && passed.abs_diff(captured) < MIN_CLOCK_STEP_NS)
                        .then_some(passed)
                }
                _ => None,
            };
            latest.stamp_ns.saturating_add(passed.unwrap_or(captured))
        });
        self.latest_cycle = Some(LatestCycle { stamp_ns, captured_ns, system_time: system });
        stamp_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distributed_clock_counts_where_it_is_there() {
        let mut clock = CycleClock::default();
        // The capture jitters, the distributed clock does not; it has its own zero.
        assert_eq!(clock.stamp_ns(1_000_000, Some((70, 64))), 1_000_000);
        assert_eq!(clock.stamp_ns(2_003_000, Some((1_000_070, 64))), 2_000_000);
        // A frame without the clock, and one after the clock was set.
        assert_eq!(clock.stamp_ns(3_003_000, None), 3_000_000);
        assert_eq!(clock.stamp_ns(4_003_000, Some((9_000_000_000_000, 64))), 4_000_000);
        assert_eq!(clock.stamp_ns(5_001_000, Some((9_000_001_000_000, 64))), 5_000_000);
        // The same frame again.
        assert_eq!(clock.stamp_ns(5_001_050, Some((9_000_001_000_000, 64))), 5_000_000);
        // A capture whose clock was behind for a cycle.
        assert_eq!(clock.stamp_ns(1, Some((9_000_002_000_000, 64))), 6_000_000);
        assert_eq!(clock.stamp_ns(7_001_000, Some((9_000_003_000_000, 64))), 7_000_000);
    }

    #[test]
    fn thirty_two_bits_begin_anew() {
        let mut clock = CycleClock::default();
        clock.stamp_ns(0, Some((u64::from(u32::MAX) - 99, 32)));
        assert_eq!(clock.stamp_ns(1_100, Some((900, 32))), 1_000);
    }
}
