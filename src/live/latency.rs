//! Durations as a histogram, which one thread fills while others read it.
//!
//! Adding a duration increments one counter of a fixed array, without an allocation, a lock or a
//! system call. The buckets are those of an HDR histogram: one nanosecond wide up to 64 ns, then 32
//! buckets per power of two. The width of a bucket is therefore at most 1/32 of its values.

use core::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

/// Number of buckets per power of two, as a binary logarithm.
const PARTS_BITS: u32 = 5;
const PARTS_PER_OCTAVE: usize = 1 << PARTS_BITS;
const LONGEST_BITS: u32 = 36;
/// End of the last bucket, 69 s \[ns\]. Longer times count in this bucket.
pub const LONGEST_NS: u64 = (1 << LONGEST_BITS) - 1;
const BUCKET_COUNT: usize = PARTS_PER_OCTAVE * (LONGEST_BITS - PARTS_BITS + 1) as usize;

/// Histogram of times. It takes 8 KiB.
pub struct Latencies {
    counts: [AtomicU64; BUCKET_COUNT],
    max_ns: AtomicU64,
}

/// Summary of the times counted since the start.
///
/// A quantile is the smallest time that is not exceeded by this share of the times. It is rounded
/// up to the end of its bucket, but not above the longest time. It is therefore too long by less
/// than 1/32, and never too short. The only exception are times beyond [`LONGEST_NS`], for which
/// the quantile is that limit. The longest time is always exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LatencySummary {
    /// Number of counted times.
    pub count: u64,
    /// Median \[ns\].
    pub p50_ns: u64,
    /// 99 % quantile \[ns\].
    pub p99_ns: u64,
    /// 99.9 % quantile \[ns\].
    pub p999_ns: u64,
    /// Longest time, exact \[ns\].
    pub max_ns: u64,
}

impl Default for Latencies {
    fn default() -> Self {
        Self { counts: [const { AtomicU64::new(0) }; BUCKET_COUNT], max_ns: AtomicU64::new(0) }
    }
}

impl fmt::Debug for Latencies {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Latencies").field(&self.summary()).finish()
    }
}

impl Latencies {
    /// Counts one time \[ns\].
    pub fn count_time(&self, ns: u64) {
        // The longest time is updated before the count, so that a reader never sees a counted time
        // above the longest one.
        if ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.fetch_max(ns, Ordering::Relaxed);
        }
        if let Some(count) = self.counts.get(bucket_of_time(ns)) {
            count.fetch_add(1, Ordering::Release);
        }
    }

    /// Returns the summary. `None` if no time was counted.
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
            bucket.map_or(max_ns, longest_in_bucket).min(max_ns)
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

/// Returns the bucket of a time.
fn bucket_of_time(ns: u64) -> usize {
    let ns = ns.min(LONGEST_NS);
    // Number of ignored low bits. Only the highest set bit and the five bits below it select the
    // bucket.
    let shift = (u64::BITS - ns.leading_zeros()).saturating_sub(PARTS_BITS + 1);
    let part = (ns >> shift) as usize;
    PARTS_PER_OCTAVE * shift as usize + part
}

/// Returns the longest time that counts in a bucket \[ns\].
fn longest_in_bucket(bucket: usize) -> u64 {
    let shift = (bucket / PARTS_PER_OCTAVE).saturating_sub(1);
    let part = bucket - PARTS_PER_OCTAVE * shift;
    ((part as u64 + 1) << shift) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the smallest of the sorted times that this share of them does not exceed.
    fn exact(sorted: &[u64], permille: usize) -> u64 {
        sorted[(sorted.len() * permille).div_ceil(1000) - 1]
    }

    #[test]
    fn buckets_follow_each_other_without_a_gap() {
        for index in 0..BUCKET_COUNT - 1 {
            assert_eq!(bucket_of_time(longest_in_bucket(index)), index);
            assert_eq!(bucket_of_time(longest_in_bucket(index) + 1), index + 1);
        }
        assert_eq!(longest_in_bucket(BUCKET_COUNT - 1), LONGEST_NS);
        assert_eq!(bucket_of_time(u64::MAX), BUCKET_COUNT - 1);
    }

    #[test]
    fn nothing_counted_is_no_summary() {
        assert_eq!(Latencies::default().summary(), None);
    }

    #[test]
    fn a_time_beyond_the_last_bucket_is_counted_and_the_longest_is_exact() {
        let latencies = Latencies::default();
        latencies.count_time(7);
        latencies.count_time(u64::MAX);
        let summary = latencies.summary().unwrap();
        assert_eq!((summary.count, summary.p50_ns, summary.max_ns), (2, 7, u64::MAX));
        assert_eq!(summary.p999_ns, LONGEST_NS);
    }

    proptest! {
        /// Times of every magnitude, compared with their sorted list.
        #[test]
        fn quantiles_are_those_of_the_sorted_times(
            times in prop::collection::vec((0u32..36, any::<u64>()), 1..3000)
        ) {
            let mut times: Vec<u64> =
                times.into_iter().map(|(bits, any)| any & ((1 << bits) - 1)).collect();
            let latencies = Latencies::default();
            times.iter().for_each(|ns| latencies.count_time(*ns));
            times.sort_unstable();
            let summary = latencies.summary().unwrap();
            prop_assert_eq!(summary.count, times.len() as u64);
            prop_assert_eq!(summary.max_ns, *times.last().unwrap());
            let quantiles = [summary.p50_ns, summary.p99_ns, summary.p999_ns];
            for (found, permille) in quantiles.into_iter().zip([500, 990, 999]) {
                let exact = exact(&times, permille);
                prop_assert!(exact <= found && found <= exact + exact / 32, "{} {}", exact, found);
            }
        }
    }
}
