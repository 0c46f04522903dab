//! Bytes written to disk within a day, and the budget for them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::archive::store::Timestamp;
use crate::files::{read_bytes, replace};

/// Hours that count as the last day \[1\]: the present one and the 24 before it. No 24 hours then
/// exceed the budget.
const HOURS: u64 = 25;
/// Seconds of an hour.
const HOUR_S: u64 = 3600;
/// Interval at which the counts are saved \[s\]. A killed process forgets this part.
const SAVE_INTERVAL_S: u64 = 600;
/// Number of bytes of a megabyte.
const MEGABYTE: u64 = 1_000_000;

/// Kind of written data. The first kind gives way first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WriteKind {
    /// Kept recordings of results.
    ResultRecordings,
    /// Kept recordings of faults and captures.
    OtherRecordings,
    /// Ring of raw frames.
    Ring,
    /// Results with their history. They never give way.
    Results,
}

impl WriteKind {
    /// All kinds, in the order in which they give way.
    pub const ALL: [Self; 4] =
        [Self::ResultRecordings, Self::OtherRecordings, Self::Ring, Self::Results];

    /// Returns the name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::ResultRecordings => "recordings of results",
            Self::OtherRecordings => "recordings of faults and captures",
            Self::Ring => "ring",
            Self::Results => "results",
        }
    }
}

/// Largest shares of the budget \[1\]. The rest is for results. If these need more, the other kinds
/// get less, the first one first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WriteShares {
    /// Kept recordings of results. Convention.
    pub result_recordings: f64,
    /// Kept recordings of faults and captures. Convention.
    pub other_recordings: f64,
    /// Ring of raw frames. Convention: the largest part, because recordings are taken from it.
    pub ring: f64,
}

impl WriteShares {
    /// The shares that the program uses.
    pub const DEFAULT: Self = Self { result_recordings: 0.2, other_recordings: 0.1, ring: 0.6 };

    /// Returns the share of a kind. Results have what the others leave.
    pub fn of_kind(self, kind: WriteKind) -> f64 {
        match kind {
            WriteKind::ResultRecordings => self.result_recordings,
            WriteKind::OtherRecordings => self.other_recordings,
            WriteKind::Ring => self.ring,
            WriteKind::Results => 1.0 - self.result_recordings - self.other_recordings - self.ring,
        }
    }
}

/// The budget of a day is used up. Raise it, record less, or record to another disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the budget of a day is used up: {} may write {:.1} MB of service.write_mb_per_day; raise it, \
     or put service.recordings.directory into memory",
    kind.label(), megabytes(*limit_bytes)
)]
pub struct OverBudget {
    /// Kind of the data.
    pub kind: WriteKind,
    /// Bytes that the kind may write within a day.
    pub limit_bytes: u64,
}

/// Written bytes, for the status.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct WriteStatus {
    /// Budget of a day \[bytes\]. `None` without a budget.
    pub budget_bytes: Option<u64>,
    /// Bytes written within the last day, by kind.
    pub day_bytes: BTreeMap<WriteKind, u64>,
    /// Number of recordings that were not kept, and of pauses of the ring, by kind.
    pub given_way: BTreeMap<WriteKind, u64>,
}

impl WriteStatus {
    /// Returns the size of the results of a day and the budget \[MB\], if the results exceed it.
    pub fn results_over_budget(&self) -> Option<(u64, u64)> {
        let written = *self.day_bytes.get(&WriteKind::Results)?;
        let budget = self.budget_bytes.filter(|budget| written > *budget)?;
        Some((written / MEGABYTE, budget / MEGABYTE))
    }
}

/// Counts of written bytes, shared between threads. Each process counts its own kinds.
#[derive(Clone, Debug, Default)]
pub struct WriteBudget(Arc<Mutex<Counts>>);

#[derive(Debug, Default)]
struct Counts {
    budget_bytes: Option<u64>,
    file: Option<PathBuf>,
    saved_s: u64,
    given_way: BTreeMap<WriteKind, u64>,
    hours: Hours,
}

/// Bytes by hour since 1970 and by kind.
type Hours = BTreeMap<u64, BTreeMap<WriteKind, u64>>;

impl WriteBudget {
    /// Creates the counts with a budget \[MB\]. They continue those that are saved in a file. An
    /// unreadable file counts as empty.
    pub fn new(megabytes: Option<u64>, file: &Path) -> Self {
        let content = read_bytes(file).unwrap_or_default();
        Self(Arc::new(Mutex::new(Counts {
            budget_bytes: megabytes.map(|megabytes| megabytes.saturating_mul(MEGABYTE)),
            file: Some(file.to_owned()),
            hours: serde_json::from_slice(&content).unwrap_or_default(),
            ..Counts::default()
        })))
    }

    /// Counts written bytes, and saves the counts from time to time.
    pub fn count(&self, kind: WriteKind, bytes: u64, now: Timestamp) {
        let mut counts = self.lock();
        let hour = now.unix_s() / HOUR_S;
        *counts.hours.entry(hour).or_default().entry(kind).or_default() += bytes;
        // Hours after this one are from a clock that was set back.
        counts.hours.retain(|of, _| of.saturating_add(HOURS) > hour);
        if now.unix_s().abs_diff(counts.saved_s) >= SAVE_INTERVAL_S {
            counts.saved_s = now.unix_s();
            counts.save();
        }
    }

    /// Checks that bytes of a kind fit into the budget. If not, counts that they give way. Returns
    /// the number of bytes that fit.
    ///
    /// # Errors
    /// [`OverBudget`].
    pub fn check(&self, kind: WriteKind, bytes: u64, now: Timestamp) -> Result<u64, OverBudget> {
        let mut counts = self.lock();
        let Some(limit_bytes) = counts.limit_bytes(kind, now) else { return Ok(u64::MAX) };
        let fitting = limit_bytes.saturating_sub(counts.day_bytes(kind, now));
        if bytes <= fitting {
            return Ok(fitting);
        }
        *counts.given_way.entry(kind).or_default() += 1;
        Err(OverBudget { kind, limit_bytes })
    }

    /// Saves the counts, at the end of a process.
    pub fn save(&self) {
        self.lock().save();
    }

    /// Returns the counts of the last day.
    pub fn status(&self, now: Timestamp) -> WriteStatus {
        let counts = self.lock();
        let day_bytes = WriteKind::ALL.map(|kind| (kind, counts.day_bytes(kind, now)));
        WriteStatus {
            budget_bytes: counts.budget_bytes,
            day_bytes: day_bytes.into_iter().filter(|(_, bytes)| *bytes > 0).collect(),
            given_way: counts.given_way.clone(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Counts> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Counts {
    fn day_bytes(&self, kind: WriteKind, now: Timestamp) -> u64 {
        let hour = now.unix_s() / HOUR_S;
        let of_day = self.hours.iter().filter(|(of, _)| of.saturating_add(HOURS) > hour);
        of_day.filter_map(|(_, kinds)| kinds.get(&kind)).sum()
    }

    /// Returns the bytes that a kind may write within a day. Results that need more than their
    /// share take it from the other kinds in their order.
    fn limit_bytes(&self, kind: WriteKind, now: Timestamp) -> Option<u64> {
        let budget = self.budget_bytes?;
        if kind == WriteKind::Results {
            return None;
        }
        let results = self.day_bytes(WriteKind::Results, now);
        let mut missing = results.saturating_sub(share_bytes(budget, WriteKind::Results));
        for earlier in WriteKind::ALL.into_iter().take_while(|earlier| *earlier < kind) {
            missing = missing.saturating_sub(share_bytes(budget, earlier));
        }
        Some(share_bytes(budget, kind).saturating_sub(missing))
    }

    fn save(&self) {
        let Some(file) = &self.file else { return };
        let saved = serde_json::to_vec(&self.hours).map_err(std::io::Error::from);
        let saved = saved.and_then(|json| replace(file, |out| out.write_all(&json)));
        if let Err(cause) = saved {
            tracing::debug!("{}: the written bytes are not saved: {cause}", file.display());
        }
    }
}

/// Converts a number of bytes to megabytes.
#[expect(clippy::cast_precision_loss, reason = "one decimal for people")]
fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}

/// Returns the bytes of a share of the budget.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a number of bytes"
)]
pub fn share_bytes(budget_bytes: u64, kind: WriteKind) -> u64 {
    (WriteShares::DEFAULT.of_kind(kind) * budget_bytes as f64).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const START_S: u64 = 1_795_331_849;

    fn at(hours: u64) -> Timestamp {
        Timestamp::from_unix_s(START_S + HOUR_S * hours)
    }

    #[test]
    fn no_day_exceeds_the_budget_and_results_are_never_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("written.json");
        let budget = WriteBudget::new(Some(100), &file);
        let mut written = vec![0_u64; 24 * 10];
        for (hour, bytes) in written.iter_mut().enumerate() {
            let now = at(hour as u64);
            for kind in WriteKind::ALL {
                // More than all of it in six hours.
                for _ in 0..20 {
                    if kind == WriteKind::Results {
                        budget.check(kind, u64::MAX, now).unwrap();
                        continue;
                    }
                    if budget.check(kind, MEGABYTE, now).is_ok() {
                        budget.count(kind, MEGABYTE, now);
                        *bytes += MEGABYTE;
                    }
                }
            }
            budget.count(WriteKind::Results, 300_000, now);
            *bytes += 300_000;
        }
        let largest = written.windows(24).map(|day| day.iter().sum::<u64>()).max().unwrap();
        assert!(largest <= 100 * MEGABYTE, "{largest}");
        let used = written[24..48].iter().sum::<u64>();
        assert!(used > 90 * MEGABYTE, "{used}");
        let status = budget.status(at(240));
        assert!(status.given_way[&WriteKind::Ring] > 0);
        assert!(!status.given_way.contains_key(&WriteKind::Results));
        // A restart continues.
        budget.save();
        let again = WriteBudget::new(Some(100), &file).status(at(240));
        assert_eq!(again.day_bytes, status.day_bytes);
        assert_eq!(WriteBudget::new(Some(100), &file).status(at(300)).day_bytes, BTreeMap::new());
    }

    #[test]
    fn results_take_from_recordings_of_results_first_and_from_the_ring_last() {
        let budget = WriteBudget::default();
        budget.lock().budget_bytes = Some(100 * MEGABYTE);
        let limits = || {
            let counts = budget.lock();
            WriteKind::ALL.map(|kind| counts.limit_bytes(kind, at(0)).map(|of| of / MEGABYTE))
        };
        assert_eq!(limits(), [Some(20), Some(10), Some(60), None]);
        for (more, expected) in
            [(10, [20, 10, 60]), (15, [5, 10, 60]), (10, [0, 5, 60]), (25, [0, 0, 40])]
        {
            budget.count(WriteKind::Results, more * MEGABYTE, at(0));
            assert_eq!(limits()[..3], expected.map(Some));
        }
        let none = WriteBudget::default();
        none.check(WriteKind::Ring, u64::MAX, at(0)).unwrap();
    }
}
