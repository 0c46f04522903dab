//! Results by day: the input of a trend.

use std::collections::BTreeMap;

use super::{Trend, trend};
use crate::archive::store::{HistoryLine, Timestamp, WeightedMean};

/// The most recent days with results. Each day has the weighted means of its results.
///
/// Friction changes while an arm warms up, and this affects all results of a day alike. Days are
/// therefore statistically independent, and results of one day are not. An arm with a hundred
/// results a day has the same trend as one with a single result a day.
#[derive(Clone, Debug)]
pub(super) struct DailyMeans {
    /// Time zero of the trend. Times are days since this instant.
    origin: Timestamp,
    parameters: Vec<String>,
    /// Means by day since 1970-01-01 in UTC. The order of the results does not matter. The means of
    /// a day are in the order of the parameters.
    means_by_day: BTreeMap<u64, Vec<WeightedMean>>,
    /// Days to keep.
    max_days: usize,
}

impl DailyMeans {
    /// Creates the means from a first result. Days are counted from its time, and the trends are
    /// those of its parameters.
    pub(super) fn new(first: &HistoryLine, keep: usize) -> Self {
        let parameters = first.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let mut days =
            Self { origin: first.time, parameters, means_by_day: BTreeMap::new(), max_days: keep };
        days.add(first);
        days
    }

    /// Adds a result. A result stored while the clock was not set has no day and is left out. A
    /// parameter without a finite value and a positive standard deviation is left out as well.
    pub(super) fn add(&mut self, line: &HistoryLine) {
        if !line.time.is_set() {
            return;
        }
        let means = self
            .means_by_day
            .entry(line.time.day())
            .or_insert_with(|| vec![WeightedMean::default(); self.parameters.len()]);
        let time = line.time.days_after(self.origin);
        for (name, mean) in self.parameters.iter().zip(means) {
            let index = line.parameters.iter().position(|parameter| parameter.name == *name);
            if let Some(part) = index.and_then(|index| line.mean_part(index, time)) {
                mean.add(part);
            }
        }
        if self.means_by_day.len() > self.max_days {
            self.means_by_day.pop_first();
        }
    }

    /// Fits a straight line through the daily means of a parameter. Each day is a point at the
    /// weighted mean of its times. Its σ is the larger of the combined standard uncertainty of one
    /// result and the scatter between the results: errors that the results of a day have in common
    /// do not become smaller with their number. The fit needs three days, which span more than 24
    /// hours.
    pub(super) fn trend(&self, parameter: &str) -> Option<Trend> {
        let index = self.parameters.iter().position(|name| name == parameter)?;
        let means = self.means_by_day.values().filter_map(|day| day.get(index));
        let point = |mean: &WeightedMean| {
            let sigma = mean.combined().max(mean.scatter().unwrap_or(0.0));
            (mean.time_d, mean.mean, sigma)
        };
        let points = means.filter(|mean| mean.count > 0).map(point);
        trend(&points.collect::<Vec<_>>())
    }
}
