//! Rows that robust weights removed. Isolated groups of rows are outliers. If such rows occur all
//! over the record, the model does not describe them.

use core::ops::Range;
use didim_dynamics::robot::JointIndex;

use super::reasons::Note;
use crate::regression::{RobustLoss, RobustSolution};

/// Number of rows that a single sample affects after the decimation filter.
const SPIKE_ROWS: usize = 8;

/// Largest distance of rows that may have the same cause: half of the filter's reach, because the
/// filter response crosses zero.
const ONE_CAUSE: usize = SPIKE_ROWS / 2;

/// Normalised residual above which an error is not normally distributed. Normal errors exceed it in
/// one of a hundred thousand rows.
const NOT_NORMAL: f64 = 4.5;

/// Largest share of a joint's rows that isolated outliers may affect.
const RARE: f64 = 0.25;

/// Largest excess of rows outside the groups over the number that normal errors have, in standard
/// deviations of that number.
const TOO_MANY: f64 = 4.0;

/// Number of groups whose times a note lists.
const NAMED: usize = 6;

/// Rows whose residual has a weight below one half.
#[derive(Clone, Debug)]
pub(crate) struct DownweightedRows {
    /// Number of rows N of each joint.
    rows: usize,
    /// Row numbers in rising order, joint by joint.
    per_joint: Vec<Vec<usize>>,
    /// Subset of `per_joint` with residuals that are too large for normal errors.
    not_normal: Vec<Vec<usize>>,
    /// Share of downweighted rows that is expected for normal errors.
    normal_share: f64,
}

impl DownweightedRows {
    pub(crate) fn new(found: &RobustSolution, loss: RobustLoss) -> Self {
        let scaled = &found.scaled_residuals;
        let rows_of = |counts: &dyn Fn(f64) -> bool| -> Vec<Vec<usize>> {
            let joints = 0..found.pseudo_equation.joints();
            let rows = joints.map(|joint| {
                let rows = found.pseudo_equation.joint_rows(joint).enumerate();
                rows.filter(|(_, row)| counts(scaled[*row])).map(|(k, _)| k).collect()
            });
            rows.collect()
        };
        Self {
            rows: found.pseudo_equation.rows_per_joint(),
            per_joint: rows_of(&|u| loss.weighs_down(u)),
            not_normal: rows_of(&|u| loss.weighs_down(u) && u.abs() > NOT_NORMAL),
            normal_share: loss.normal_share_weighed_down(),
        }
    }

    /// Returns the downweighted row numbers of each joint, in ascending order.
    pub(crate) fn per_joint(&self) -> &[Vec<usize>] {
        &self.per_joint
    }

    /// Returns groups of rows of one joint that may have the same cause. Each group contains a
    /// residual that is too large for normal errors.
    fn groups(&self, joint: usize) -> Vec<Range<usize>> {
        let mut groups = together(self.per_joint[joint].iter().map(|&row| row..row + 1));
        groups.retain(|group| self.not_normal[joint].iter().any(|row| group.contains(row)));
        groups
    }

    /// Returns the joints whose rows are downweighted all over the record. Their groups are not
    /// rare, or more rows outside the groups are downweighted than normal errors explain.
    fn spread(&self) -> Vec<usize> {
        let joints = 0..self.per_joint.len();
        let spread = joints.filter(|&joint| {
            let groups = self.groups(joint);
            let reached: usize = groups.iter().map(|group| group.len().max(SPIKE_ROWS)).sum();
            let others = self.per_joint[joint].iter();
            let others = others.filter(|row| !groups.iter().any(|group| group.contains(row)));
            let expected = self.rows as f64 * self.normal_share;
            let most = expected + TOO_MANY * expected.sqrt().max(1.0);
            reached as f64 > RARE * self.rows as f64 || others.count() as f64 > most
        });
        spread.collect()
    }

    /// Returns the samples that outliers affect: the groups of all joints, with one more row on
    /// either side. `samples` are the samples of the rows. Returns an empty list if rows are
    /// downweighted all over the record, because they are not outliers.
    pub(crate) fn outlier_samples(&self, samples: &[usize]) -> Vec<Range<usize>> {
        let Some(last) = samples.len().checked_sub(1).filter(|_| self.spread().is_empty()) else {
            return Vec::new();
        };
        let reached = self.all_groups().into_iter().map(|group| {
            samples[group.start.saturating_sub(1).min(last)]..samples[group.end.min(last)] + 1
        });
        reached.collect()
    }

    fn all_groups(&self) -> Vec<Range<usize>> {
        let joints = 0..self.per_joint.len();
        let mut groups: Vec<_> = joints.flat_map(|joint| self.groups(joint)).collect();
        groups.sort_by_key(|group| (group.start, group.end));
        together(groups.into_iter())
    }

    /// Returns notes for the user. `time_s` is the time of one joint's rows.
    pub(super) fn notes(&self, time_s: &[f64]) -> Vec<Note> {
        let groups = self.all_groups();
        let mut notes = Vec::new();
        let times_s: Vec<Range<f64>> = (groups.iter().take(NAMED))
            .filter_map(|group| Some(*time_s.get(group.start)?..*time_s.get(group.end - 1)?))
            .collect();
        if !times_s.is_empty() {
            let rows = self.per_joint.iter().map(Vec::len).sum();
            let (of, more) = (self.rows * self.per_joint.len(), groups.len() - times_s.len());
            notes.push(Note::Outliers { rows, of, times_s, more });
        }
        let joints = self
            .spread()
            .into_iter()
            .map(|joint| (JointIndex::new(joint), self.per_joint[joint].len()));
        let joints: Vec<(JointIndex, usize)> = joints.collect();
        if !joints.is_empty() {
            notes.push(Note::DownweightedThroughout { joints, of: self.rows });
        }
        notes
    }
}

/// Merges ranges, sorted by their starts, that may have the same cause.
fn together(ranges: impl Iterator<Item = Range<usize>>) -> Vec<Range<usize>> {
    let mut groups: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match groups.last_mut() {
            Some(group) if range.start < group.end + ONE_CAUSE => {
                group.end = group.end.max(range.end);
            }
            _ => groups.push(range),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(per_joint: &[&[usize]], not_normal: &[&[usize]]) -> DownweightedRows {
        let to_rows = |of: &[&[usize]]| of.iter().map(|rows| rows.to_vec()).collect();
        DownweightedRows {
            rows: 300,
            per_joint: to_rows(per_joint),
            not_normal: to_rows(not_normal),
            normal_share: 0.01,
        }
    }

    fn seconds() -> Vec<f64> {
        (0..300).map(|k| 0.025 * f64::from(k)).collect()
    }

    #[test]
    fn outliers_are_named_with_their_times() {
        let downweighted = rows(&[&[3, 100, 101, 105, 107], &[104, 200, 201]], &[&[101], &[200]]);
        let notes = downweighted.notes(&seconds());
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].to_string().starts_with("8 of 600 rows"), "{notes:?}");
        assert!(notes[0].to_string().contains("2.50 to 2.68 s, 5.00 to 5.03 s:"), "{notes:?}");
        let samples: Vec<usize> = (0..300).map(|k| 1000 + 10 * k).collect();
        assert_eq!(downweighted.outlier_samples(&samples), [1990..2081, 2990..3021]);
    }

    #[test]
    fn what_normal_errors_have_is_not_worth_a_note() {
        let downweighted = rows(&[&[3, 100, 160, 221]], &[&[]]);
        assert!(downweighted.notes(&seconds()).is_empty());
        assert!(downweighted.outlier_samples(&(0..300).collect::<Vec<_>>()).is_empty());
    }

    #[test]
    fn rows_all_over_are_no_outliers() {
        let often: Vec<usize> = (5..295).step_by(20).collect();
        for not_normal in [&[][..], &often] {
            let downweighted = rows(&[&[7], &often], &[&[], not_normal]);
            let notes = downweighted.notes(&seconds());
            let last = notes.last().unwrap().to_string();
            assert!(last.starts_with("5 % of the rows of joint 2"), "{notes:?}");
            assert!(downweighted.outlier_samples(&(0..300).collect::<Vec<_>>()).is_empty());
        }
    }
}
