//! Stamps of cycles: by the distributed clock where the frames carry it.

/// How far the distributed clock and the capture may have moved apart between two cycles \[ns\]: beyond it
/// one of them was set.
const APART_NS: u64 = 500_000_000;

/// Carries the first stamp of the capture on by the distributed clock, whose ticks are those of the
/// drives, and by the capture where that clock is missing or was set.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CycleClock {
    latest: Option<Latest>,
}

#[derive(Clone, Copy, Debug)]
struct Latest {
    stamp_ns: u64,
    captured_ns: u64,
    /// The distributed clock, with its bits.
    system: Option<(u64, u8)>,
}

impl CycleClock {
    /// The stamp of a cycle \[ns since 1970\] from when its frame was captured and what the distributed clock
    /// said.
    pub(super) fn stamp_ns(&mut self, captured_ns: u64, system: Option<(u64, u8)>) -> u64 {
        let stamp_ns = self.latest.map_or(captured_ns, |latest| {
            let captured = captured_ns.saturating_sub(latest.captured_ns);
            let passed = match (latest.system, system) {
                (Some((before, bits)), Some((now, also))) if bits == also => {
                    // 32 bits begin anew every 4.3 s: what is ahead by half of that is behind.
                    let mask = u64::MAX >> (64 - bits);
                    let passed = now.wrapping_sub(before) & mask;
                    (passed <= mask / 2 && passed.abs_diff(captured) < APART_NS).then_some(passed)
                }
                _ => None,
            };
            latest.stamp_ns.saturating_add(passed.unwrap_or(captured))
        });
        self.latest = Some(Latest { stamp_ns, captured_ns, system });
        stamp_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distributed_clock_counts_where_it_is_there() {
        let mut clock = CycleClock::default();
        // The capture jitters, the distributed clock does not; its zero is its own.
        assert_eq!(clock.stamp_ns(1_000_000, Some((70, 64))), 1_000_000);
        assert_eq!(clock.stamp_ns(2_003_000, Some((1_000_070, 64))), 2_000_000);
        // A frame without it, and one after it was set.
        assert_eq!(clock.stamp_ns(3_003_000, None), 3_000_000);
        assert_eq!(clock.stamp_ns(4_003_000, Some((9_000_000_000_000, 64))), 4_000_000);
        assert_eq!(clock.stamp_ns(5_001_000, Some((9_000_001_000_000, 64))), 5_000_000);
        // The same frame again.
        assert_eq!(clock.stamp_ns(5_001_050, Some((9_000_001_000_000, 64))), 5_000_000);
    }

    #[test]
    fn thirty_two_bits_begin_anew() {
        let mut clock = CycleClock::default();
        clock.stamp_ns(0, Some((u64::from(u32::MAX) - 99, 32)));
        assert_eq!(clock.stamp_ns(1_100, Some((900, 32))), 1_000);
    }
}
