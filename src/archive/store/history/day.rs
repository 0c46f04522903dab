//! A row of the history that stands for the results of a day.

use didim_dynamics::numeric::median;

use super::line::{HistoryLine, ParameterValue, round};
use super::summary::DaySummary;

/// Weighted mean and scatter of a value, one result at a time (West, Comm. ACM 22, 1979).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WeightedMean {
    /// Number of results.
    pub count: u64,
    /// Σ w with w = 1/σ².
    pub weight: f64,
    /// Weighted mean of the values.
    pub mean: f64,
    /// Weighted mean of the times \[d\].
    pub time_d: f64,
    /// Σ w (v − mean)².
    squares: f64,
    /// Σ u², with the combined standard uncertainty u of each result.
    combined: f64,
}

/// A value with its uncertainties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanPart {
    /// Number of results that the value is the mean of.
    pub count: u64,
    /// The value.
    pub value: f64,
    /// Statistical standard deviation of one result.
    pub deviation: f64,
    /// Combined standard uncertainty of one result.
    pub combined: f64,
    /// Standard deviation between the results; 0 for one.
    pub scatter: f64,
    /// Time \[d\].
    pub time_d: f64,
}

#[expect(clippy::cast_precision_loss, reason = "numbers of results")]
impl WeightedMean {
    /// Adds a value, or the mean of several.
    pub fn add(&mut self, part: MeanPart) {
        let weight = part.count as f64 * part.deviation.powi(-2);
        if !(part.value.is_finite() && weight.is_finite() && weight > 0.0) {
            return;
        }
        let total = self.weight + weight;
        let difference = part.value - self.mean;
        let within = match part.count {
            0 | 1 => 0.0,
            count => part.scatter.powi(2) * weight * (count as f64 - 1.0) / count as f64,
        };
        self.squares += within + self.weight * weight / total * difference.powi(2);
        self.mean += difference * weight / total;
        self.time_d += (part.time_d - self.time_d) * weight / total;
        self.combined += part.count as f64 * part.combined.powi(2);
        (self.count, self.weight) = (self.count + part.count, total);
    }

    /// Returns the statistical standard deviation of one result, as a mean over the results.
    pub fn deviation(&self) -> f64 {
        (self.count as f64 / self.weight).sqrt()
    }

    /// Returns the combined standard uncertainty of one result, as a mean over the results.
    pub fn combined(&self) -> f64 {
        (self.combined / self.count as f64).sqrt()
    }

    /// Returns the standard deviation between the results. `None` for fewer than two.
    pub fn scatter(&self) -> Option<f64> {
        let count = self.count as f64;
        (self.count > 1).then(|| (self.squares / self.weight * count / (count - 1.0)).sqrt())
    }
}

impl HistoryLine {
    /// Returns a parameter as a part of a mean. The time is that of the line in days after another
    /// one.
    pub fn mean_part(&self, index: usize, time_d: f64) -> Option<MeanPart> {
        let ParameterValue { value, standard_deviation, combined_standard_deviation, .. } =
            *self.parameters.get(index)?;
        let day = self.day.as_ref();
        let scatter = day.and_then(|day| day.scatter.get(index).copied().flatten());
        Some(MeanPart {
            count: day.map_or(1, |day| day.results),
            value,
            deviation: standard_deviation,
            combined: combined_standard_deviation.unwrap_or(standard_deviation),
            scatter: scatter.unwrap_or(0.0),
            time_d,
        })
    }

    /// Returns true if the results of two lines may be averaged.
    fn is_alike(&self, other: &Self) -> bool {
        let names = |of: &Self| of.parameters.iter().map(|p| p.name.clone()).collect::<Vec<_>>();
        let verdict = |of: &Self| (of.applicable, of.is_good_for_monitoring());
        self.time.day() == other.time.day()
            && (&self.robot, &self.cell) == (&other.robot, &other.cell)
            && (&self.method, &self.regrouping) == (&other.method, &other.regrouping)
            && self.configuration == other.configuration
            && verdict(self) == verdict(other)
            && self.payload_kg() == other.payload_kg()
            && names(self) == names(other)
    }
}

/// Returns the rows that stand for the lines of a segment: one for each day, configuration, verdict
/// and noted payload, in the order of their first results.
pub(crate) fn day_rows(lines: &[HistoryLine], segment: u64) -> Vec<HistoryLine> {
    let mut groups: Vec<Vec<&HistoryLine>> = Vec::new();
    for line in lines {
        match groups.iter_mut().rev().find(|group| group[0].is_alike(line)) {
            Some(group) => group.push(line),
            None => groups.push(vec![line]),
        }
    }
    groups.iter().filter_map(|group| day_row(group, segment)).collect()
}

/// Returns the mean of a parameter over lines. Its times are days after the first of them.
fn mean_of(lines: &[&HistoryLine], index: usize) -> WeightedMean {
    let mut mean = WeightedMean::default();
    for line in lines {
        let time_d = line.time.days_after(lines[0].time);
        line.mean_part(index, time_d).into_iter().for_each(|part| mean.add(part));
    }
    mean
}

fn day_row(lines: &[&HistoryLine], segment: u64) -> Option<HistoryLine> {
    let (first, last) = (*lines.first()?, *lines.last()?);
    let mut scatter = Vec::new();
    let indices = 0..last.parameters.len();
    let means: Vec<WeightedMean> = indices.map(|index| mean_of(lines, index)).collect();
    let parameters = last.parameters.iter().zip(&means).map(|(of, mean)| {
        scatter.push(mean.scatter().map(|of| round(of, 5)));
        ParameterValue {
            value: if mean.count > 0 { mean.mean } else { f64::NAN },
            standard_deviation: mean.deviation(),
            combined_standard_deviation: Some(mean.combined()).filter(|value| value.is_finite()),
            ..of.clone()
        }
    });
    let parameters: Vec<_> = parameters.map(ParameterValue::rounded).collect();
    let time_d = means.iter().find(|mean| mean.count > 0).map_or(0.0, |mean| mean.time_d);
    let median_of = |value: &dyn Fn(&HistoryLine) -> Option<f64>| {
        median(lines.iter().filter_map(|line| value(line)).collect())
    };
    let (first_of, last_of) = (|day: &DaySummary| day.first, |day: &DaySummary| day.last);
    let load = |line: &HistoryLine| Some(line.load.as_ref()?.load.mass_kg?.value);
    let errors = median_of(&|line| line.relative_error);
    Some(HistoryLine {
        time: first.time.plus_days(time_d).unwrap_or(last.time),
        relative_error: errors,
        note: last.note.clone().filter(|note| note.payload_kg.is_some()),
        parameters,
        against: None,
        load: None,
        readings: Default::default(),
        day: Some(DaySummary {
            results: lines.iter().map(|line| line.day.as_ref().map_or(1, |of| of.results)).sum(),
            first: lines.iter().map(|line| line.day.as_ref().map_or(line.time, first_of)).min()?,
            last: lines.iter().map(|line| line.day.as_ref().map_or(line.time, last_of)).max()?,
            scatter,
            temperature_c: median_of(&|line| line.readings.mean_temperature_c()),
            load_kg: median_of(&load),
            segment,
            alarms: None,
        }),
        ..last.clone()
    })
}
