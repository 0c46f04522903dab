//! Results by day: the input of a trend.

use std::collections::BTreeMap;

use super::{Trend, trend};
use crate::archive::store::{HistoryLine, Timestamp};

const DAY_S: u64 = 86_400;

/// Weighted sums over a parameter's results of one day.
#[derive(Clone, Copy, Debug, Default)]
struct DailySums {
    /// Σ w with w = 1/σ².
    weight: f64,
    /// Σ w·t.
    time: f64,
    /// Σ w·v.
    value: f64,
}

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
    /// Sums by day since 1970-01-01 in UTC. The order of the results does not matter. The sums of a
    /// day are in the order of the parameters.
    sums_by_day: BTreeMap<u64, Vec<DailySums>>,
    /// Days to keep.
    max_days: usize,
}

impl DailyMeans {
    /// Creates the means from a first result. Days are counted from its time, and the trends are
    /// those of its parameters.
    pub(super) fn new(first: &HistoryLine, keep: usize) -> Self {
        let parameters = first.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let mut days =
            Self { origin: first.time, parameters, sums_by_day: BTreeMap::new(), max_days: keep };
        days.add(first);
        days
    }

    /// Adds a result. A result stored while the clock was not set has no day and is left out. A
    /// parameter without a finite value and a positive standard deviation is left out as well.
    pub(super) fn add(&mut self, line: &HistoryLine) {
        if !line.time.is_set() {
            return;
        }
        let sums = self
            .sums_by_day
            .entry(line.time.unix_s() / DAY_S)
            .or_insert_with(|| vec![DailySums::default(); self.parameters.len()]);
        let time = line.time.days_after(self.origin);
        for (name, sums) in self.parameters.iter().zip(sums) {
            let Some(found) = line.parameter(name) else { continue };
            let weight = found.standard_deviation.powi(-2);
            if found.value.is_finite() && weight.is_finite() && weight > 0.0 {
                sums.weight += weight;
                sums.time += weight * time;
                sums.value += weight * found.value;
            }
        }
        if self.sums_by_day.len() > self.max_days {
            self.sums_by_day.pop_first();
        }
    }

    /// Fits a straight line through the daily means of a parameter. Each day is a point at the
    /// weighted mean of its times, with σ = 1/√(Σ 1/σ²). The fit needs three days, which span more
    /// than 24 hours.
    pub(super) fn trend(&self, parameter: &str) -> Option<Trend> {
        let index = self.parameters.iter().position(|name| name == parameter)?;
        let sums = self
            .sums_by_day
            .values()
            .filter_map(|day| day.get(index))
            .filter(|sums| sums.weight > 0.0);
        let point = |sums: &DailySums| {
            (sums.time / sums.weight, sums.value / sums.weight, sums.weight.sqrt().recip())
        };
        trend(&sums.map(point).collect::<Vec<_>>())
    }
}
