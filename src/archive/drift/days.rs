//! The results day by day: what a trend is formed of.

use std::collections::BTreeMap;

use super::{Trend, trend};
use crate::archive::store::{HistoryLine, Timestamp};

const DAY_S: u64 = 86_400;

/// Weighted sums of a parameter's results of one day.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Σ w with w = 1/σ².
    weight: f64,
    /// Σ w·t.
    time: f64,
    /// Σ w·v.
    value: f64,
}

/// The last days that have results, each with the weighted means of its results.
///
/// How friction moves while an arm warms up is common to the results of a day: days, not results, are
/// what scatters independently of each other, and an arm with a hundred results a day has a trend as
/// one with a single result a day has.
#[derive(Clone, Debug)]
pub(super) struct Days {
    /// Times are days since then.
    origin: Timestamp,
    parameters: Vec<String>,
    /// By days since 1970 in UTC, in whatever order the results came; sums as the parameters are.
    days: BTreeMap<u64, Vec<Sums>>,
    /// Days to keep.
    keep: usize,
}

impl Days {
    /// With the results of one line, from whose time days are counted, of the parameters that it has.
    pub(super) fn new(first: &HistoryLine, keep: usize) -> Self {
        let parameters = first.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        let mut days = Self { origin: first.time, parameters, days: BTreeMap::new(), keep };
        days.add(first);
        days
    }

    /// Takes a result. One that was stored while the clock was not set has no day, and is left out;
    /// so is a parameter without a finite value and a positive standard deviation.
    pub(super) fn add(&mut self, line: &HistoryLine) {
        if !line.time.is_set() {
            return;
        }
        let none = || vec![Sums::default(); self.parameters.len()];
        let sums = self.days.entry(line.time.unix_s() / DAY_S).or_insert_with(none);
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
        if self.days.len() > self.keep {
            self.days.pop_first();
        }
    }

    /// The straight line through the days of a parameter, each at the weighted mean of its times with
    /// σ = 1/√(Σ 1/σ²). Three days are more than 24 hours.
    pub(super) fn trend(&self, parameter: &str) -> Option<Trend> {
        let at = self.parameters.iter().position(|name| name == parameter)?;
        let sums =
            self.days.values().filter_map(|day| day.get(at)).filter(|sums| sums.weight > 0.0);
        let point = |sums: &Sums| {
            (sums.time / sums.weight, sums.value / sums.weight, sums.weight.sqrt().recip())
        };
        trend(&sums.map(point).collect::<Vec<_>>())
    }
}
