//! How long something took, as a histogram: one thread records, others read meanwhile.
//!
//! Recording adds to one counter of a fixed array: no allocation, no lock, no system call. The
//! buckets are those of an HDR histogram: as wide as a nanosecond up to 64 ns, then 32 to each power
//! of two, so that a bucket is at most 1/32 of its values wide.

use core::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

/// Buckets of each power of two, as a power of two.
const PARTS_BITS: u32 = 5;
const PARTS: usize = 1 << PARTS_BITS;
const LONGEST_BITS: u32 = 36;
/// End of the last bucket, 69 s: longer times are counted there too \[ns\].
pub const LONGEST_NS: u64 = (1 << LONGEST_BITS) - 1;
const BUCKETS: usize = PARTS * (LONGEST_BITS - PARTS_BITS + 1) as usize;

/// Counts times, in 8 KiB.
pub struct Latencies {
    counts: [AtomicU64; BUCKETS],
    max_ns: AtomicU64,
}

/// What was counted since the start.
///
/// A quantile is the smallest time that so many of the times do not exceed, rounded up to the end of
/// its bucket, but not above the longest: too long by less than 1/32, never too short. Only of times
/// beyond [`LONGEST_NS`] it is too short: it is that limit. The longest is exact there as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LatencySummary {
    /// Times counted.
    pub count: u64,
    /// The median \[ns\].
    pub p50_ns: u64,
    /// Of 99 % \[ns\].
    pub p99_ns: u64,
    /// Of 99.9 % \[ns\].
    pub p999_ns: u64,
    /// The longest, exactly \[ns\].
    pub max_ns: u64,
}

impl Default for Latencies {
    fn default() -> Self {
        Self { counts: [const { AtomicU64::new(0) }; BUCKETS], max_ns: AtomicU64::new(0) }
    }
}

impl fmt::Debug for Latencies {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Latencies").field(&self.summary()).finish()
    }
}

impl Latencies {
    /// Counts one time \[ns\].
    pub fn record(&self, ns: u64) {
        // The longest before the count: who sees a time counted sees no longest below it.
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.fetch_max(ns, Ordering::Relaxed);
        }
        if let Some(count) = self.counts.get(bucket(ns)) {
            count.fetch_add(1, Ordering::Release);
        }
    }

    /// What was counted; nothing when nothing was.
    pub fn summary(&self) -> Option<LatencySummary> {
        let counts = self.counts.each_ref().map(|count| count.load(Ordering::Acquire));
        let max_ns = self.max_ns.load(Ordering::Relaxed);
        let count: u64 = counts.iter().sum();
        let quantile = |permille: u64| {
            let wanted = (count * permille).div_ceil(1000);
            let mut seen = 0;
            let bucket = counts.iter().position(|count| {
                seen += count;
                seen >= wanted
            });
            bucket.map_or(max_ns, longest).min(max_ns)
        };
        (count > 0).then(|| LatencySummary {
            count,
            p50_ns: quantile(500),
            p99_ns: quantile(990),
            p999_ns: quantile(999),
            max_ns,
        })
    }
}

/// Where a time is counted.
fn bucket(ns: u64) -> usize {
    let ns = ns.min(LONGEST_NS);
    // Bits that do not count: the highest one and the five below it do.
    let shift = (u64::BITS - ns.leading_zeros()).saturating_sub(PARTS_BITS + 1);
    let part = (ns >> shift) as usize;
    PARTS * shift as usize + part
}

/// The longest time that is counted in a bucket \[ns\].
fn longest(bucket: usize) -> u64 {
    let shift = (bucket / PARTS).saturating_sub(1);
    let part = bucket - PARTS * shift;
    ((part as u64 + 1) << shift) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The smallest of the sorted times that so many of them do not exceed.
    fn exact(sorted: &[u64], permille: usize) -> u64 {
        sorted[(sorted.len() * permille).div_ceil(1000) - 1]
    }

    #[test]
    fn buckets_follow_each_other_without_a_gap() {
        for index in 0..BUCKETS - 1 {
            assert_eq!(bucket(longest(index)), index);
            assert_eq!(bucket(longest(index) + 1), index + 1);
        }
        assert_eq!(longest(BUCKETS - 1), LONGEST_NS);
        assert_eq!(bucket(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn nothing_counted_is_no_summary() {
        assert_eq!(Latencies::default().summary(), None);
    }

    #[test]
    fn a_time_beyond_the_last_bucket_is_counted_and_the_longest_is_exact() {
        let latencies = Latencies::default();
        latencies.record(7);
        latencies.record(u64::MAX);
        let summary = latencies.summary().unwrap();
        assert_eq!((summary.count, summary.p50_ns, summary.max_ns), (2, 7, u64::MAX));
        assert_eq!(summary.p999_ns, LONGEST_NS);
    }

    proptest! {
        /// Times of every magnitude, against their sorted list.
        #[test]
        fn quantiles_are_those_of_the_sorted_times(
            times in prop::collection::vec((0u32..36, any::<u64>()), 1..3000)
        ) {
            let mut times: Vec<u64> =
                times.into_iter().map(|(bits, any)| any & ((1 << bits) - 1)).collect();
            let latencies = Latencies::default();
            times.iter().for_each(|ns| latencies.record(*ns));
            times.sort_unstable();
            let summary = latencies.summary().unwrap();
            prop_assert_eq!(summary.count, times.len() as u64);
            prop_assert_eq!(summary.max_ns, *times.last().unwrap());
            let found = [summary.p50_ns, summary.p99_ns, summary.p999_ns];
            for (found, permille) in found.into_iter().zip([500, 990, 999]) {
                let exact = exact(&times, permille);
                prop_assert!(exact <= found && found <= exact + exact / 32, "{} {}", exact, found);
            }
        }
    }
}
