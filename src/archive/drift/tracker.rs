//! Evaluation of the history, from a baseline onwards.

use super::{
    Alarm, AlarmEvent, AlarmStatus, Baseline, Change, DriftOptions, DriftStatus, NotComparable,
    ParameterDrift, Trend, change_sentence, check_comparable, days::DailyMeans,
};
use crate::archive::store::{AlarmCheckpoint, HistoryLine, Timestamp};

/// A baseline, and the evaluation of the results after it.
#[derive(Clone, Debug)]
pub struct Tracker {
    baseline: Baseline,
    options: DriftOptions,
    /// Alarms, one per parameter of the baseline.
    alarms: Vec<Alarm>,
    /// Means of the last `trend_results` days, from the baseline and the compared results.
    days: DailyMeans,
    /// Last compared result.
    last_compared: Option<Comparison>,
    last_comparison: Option<Result<Comparison, NotComparable>>,
}

/// A result compared with the baseline.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Number of the result.
    pub result: u64,
    /// Parameter changes, in the model's order.
    pub changes: Vec<Change>,
    /// True if the configuration differs from the baseline's in a way that still allows a
    /// comparison.
    pub has_other_configuration: bool,
}

impl Tracker {
    /// Creates a tracker that has not compared anything yet.
    pub fn new(baseline: Baseline, options: DriftOptions) -> Self {
        let alarms = vec![Alarm::default(); baseline.result.parameters.len()];
        let days = DailyMeans::new(&baseline.result, options.trend_results);
        Self { baseline, options, alarms, days, last_compared: None, last_comparison: None }
    }

    /// The baseline.
    pub fn baseline(&self) -> &Baseline {
        &self.baseline
    }

    /// Returns true if a result came after the baseline. Results before the baseline are no
    /// evidence of a later change.
    pub fn is_after_baseline(&self, line: &HistoryLine) -> bool {
        let baseline = &self.baseline.result;
        // An emptied folder counts from 0 again.
        let later = line.result > baseline.result || line.time > baseline.time;
        later && (line.result, line.time) != (baseline.result, baseline.time)
    }

    /// Processes the next line of the history and returns the alarms that changed.
    pub fn handle_line(&mut self, line: &HistoryLine) -> Vec<(String, AlarmEvent)> {
        if !self.is_after_baseline(line) {
            return Vec::new();
        }
        let compared = self.compare(line);
        let events = match &compared {
            Ok(comparison) => {
                let judged = comparison.changes.iter().zip(&mut self.alarms);
                let results = self.options.results;
                // The row of a day counts as the mean of each of its results.
                let day = line.day.as_ref();
                let (time, count) =
                    day.map_or((line.time, 1), |day| (day.first, day.results.min(results.into())));
                judged
                    .filter_map(|(change, alarm)| {
                        let changed =
                            (0..count).filter_map(|_| alarm.handle_change(change, time, results));
                        Some((change.parameter.clone(), changed.last()?))
                    })
                    .collect()
            }
            Err(_) => Vec::new(),
        };
        if let Ok(comparison) = &compared {
            self.days.add(line);
            self.last_compared = Some(comparison.clone());
        }
        self.last_comparison = Some(compared);
        self.restore_alarms(line);
        events
    }

    /// Takes the alarms over that a row of a day stores, if they are for this baseline and these
    /// limits. They are those of the single results.
    fn restore_alarms(&mut self, line: &HistoryLine) {
        let stored = line.day.as_ref().and_then(|day| day.alarms.clone());
        let Some(stored) = stored.filter(|stored| {
            let alarms = stored.alarms.clone();
            *stored == AlarmCheckpoint { alarms, ..self.checkpoint() }
        }) else {
            return;
        };
        for (parameter, alarm) in self.baseline.result.parameters.iter().zip(&mut self.alarms) {
            let state = stored.alarms.get(&parameter.name).cloned();
            *alarm = Alarm::from_state(state.unwrap_or_default());
        }
    }

    /// Returns the state of the alarms, to be stored with the row of a day.
    pub fn checkpoint(&self) -> AlarmCheckpoint {
        let named = self.baseline.result.parameters.iter().zip(&self.alarms);
        let DriftOptions { standard_deviations, relative, results, .. } = self.options;
        AlarmCheckpoint {
            baseline: self.baseline.result.result,
            baseline_time: self.baseline.result.time,
            standard_deviations,
            relative,
            results,
            alarms: named
                .filter_map(|(of, alarm)| Some((of.name.clone(), alarm.state()?)))
                .collect(),
        }
    }

    /// Compares one result with the baseline. Earlier results do not affect the comparison.
    ///
    /// # Errors
    /// [`NotComparable`].
    pub fn compare(&self, line: &HistoryLine) -> Result<Comparison, NotComparable> {
        let baseline = &self.baseline.result;
        check_comparable(baseline, line)?;
        Ok(Comparison {
            result: line.result,
            changes: Change::between_results(baseline, line, &self.options),
            has_other_configuration: line.configuration != baseline.configuration,
        })
    }

    /// Returns the trend line through the last days with compared results, including the baseline,
    /// in SI units over days since the baseline. `None` for fewer than three days, because the
    /// friction decrease during a warm-up is no trend over days.
    pub fn trend(&self, parameter: &str) -> Option<Trend> {
        self.days.trend(parameter)
    }

    /// Returns each parameter with a raised alarm, and the time since which it has been outside its
    /// band.
    pub fn alarms(&self) -> impl Iterator<Item = (&str, Timestamp)> {
        let named = self.baseline.result.parameters.iter().zip(&self.alarms);
        named.filter_map(|(parameter, alarm)| {
            Some((parameter.name.as_str(), alarm.outside_since()?))
        })
    }

    /// Returns the change of a parameter in the last compared result.
    pub fn last_change(&self, parameter: &str) -> Option<Change> {
        let changes = &self.last_compared.as_ref()?.changes;
        changes.iter().find(|change| change.parameter == parameter).cloned()
    }

    /// Returns a sentence about a parameter of the last compared result.
    pub fn sentence(&self, parameter: &str) -> Option<String> {
        let change = self.last_change(parameter)?;
        let since = self.alarms().find(|(name, _)| *name == parameter).map(|(_, since)| since);
        Some(change_sentence(
            &change,
            self.baseline.result.time,
            self.trend(parameter).as_ref(),
            since,
        ))
    }

    /// Returns the drift for the status.
    pub fn status(&self) -> DriftStatus {
        let baseline = &self.baseline.result;
        let description_of =
            |name: &str| baseline.parameter(name).and_then(|of| of.description.clone());
        let changes = match &self.last_comparison {
            Some(Ok(comparison)) => (comparison.changes.iter())
                .map(|of| ParameterDrift::from_change(of, description_of(&of.parameter)))
                .collect(),
            _ => Vec::new(),
        };
        let alarms = self.alarms().filter_map(|(name, since)| {
            let change = self.last_change(name)?;
            let (text, described) = (self.sentence(name)?, description_of(name));
            Some(AlarmStatus::new(&change, described, self.trend(name).as_ref(), since, text))
        });
        DriftStatus {
            baseline: baseline.result,
            time: baseline.time,
            compared: matches!(self.last_comparison, Some(Ok(_))),
            why_not: match &self.last_comparison {
                None => Some("no result has come since the baseline was set".to_owned()),
                Some(Err(why)) if why.is_lasting() => Some(format!("{why}; set a new baseline")),
                Some(Err(why)) => Some(why.to_string()),
                Some(Ok(_)) => None,
            },
            reconfigured: self.last_comparison.as_ref().is_some_and(|last| {
                last.as_ref().is_ok_and(|comparison| comparison.has_other_configuration)
            }),
            parameters: changes,
            alarms: alarms.collect(),
        }
    }
}
