//! Detection of load changes between successive load surveys.

use didim_identification::identification::UncertainValue;

use crate::archive::store::FoundLoad;
use crate::live::limits::LiveLimits;

/// Result of a load survey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Survey {
    /// Mass, if it is identifiable \[kg\].
    pub(super) mass: Option<UncertainValue>,
    /// True if there is a load.
    pub(super) has_load: bool,
}

impl Survey {
    /// State of the arm at its baseline.
    pub(super) const BASELINE_STATE: Self = Self {
        mass: Some(UncertainValue { value: 0.0, standard_deviation: 0.0 }),
        has_load: false,
    };

    pub(super) fn from_load(found: &FoundLoad) -> Self {
        Self { mass: found.load.mass_kg, has_load: found.presence.seen }
    }

    /// Compares another survey with this one. Returns true if the other load is heavier, false if
    /// it is lighter, and `None` if the two do not differ significantly.
    fn is_heavier_if_different(&self, other: &Self) -> Option<bool> {
        match (self.mass, other.mass) {
            (Some(one), Some(other)) => {
                let deviation = one.standard_deviation.hypot(other.standard_deviation);
                let off = other.value - one.value;
                (off.abs() > LiveLimits::DEFAULT.load_deviations * deviation).then_some(off > 0.0)
            }
            _ => (self.has_load != other.has_load).then_some(other.has_load),
        }
    }
}

/// Tracker of successive surveys. A single survey does not change its state: the survey may be
/// wrong by chance, or a load may have been picked up during the survey.
#[derive(Clone, Debug)]
pub(super) struct LoadTrack {
    /// Current load.
    current: Survey,
    /// Direction of the last survey relative to the current load, true for heavier. `None` if the
    /// survey did not differ.
    suspected_side: Option<bool>,
}

impl LoadTrack {
    pub(super) fn from(level: Survey) -> Self {
        Self { current: level, suspected_side: None }
    }

    /// Returns true if the last survey differed, so that the next one has to confirm it.
    pub(super) fn needs_confirmation(&self) -> bool {
        self.suspected_side.is_some()
    }

    /// Returns the current load.
    pub(super) fn current_load(&self) -> Survey {
        self.current
    }

    /// Processes the next survey, and returns the previous load if it has changed.
    pub(super) fn handle_look(&mut self, survey: Survey) -> Option<Survey> {
        let side = self.current.is_heavier_if_different(&survey);
        let again = side.is_some() && side == self.suspected_side;
        self.suspected_side = if again { None } else { side };
        again.then(|| core::mem::replace(&mut self.current, survey))
    }
}

#[cfg(test)]
mod tests {
    use didim_identification::identification::PayloadLimits;

    use super::*;

    fn survey(value: f64, standard_deviation: f64) -> Survey {
        let mass = UncertainValue { value, standard_deviation };
        Survey { mass: Some(mass), has_load: mass.is_seen(&PayloadLimits::default()) }
    }

    #[test]
    fn a_load_counts_when_two_looks_agree() {
        let mut track = LoadTrack::from(Survey::BASELINE_STATE);
        assert_eq!(track.handle_look(survey(0.1, 0.05)), None);
        // The load is picked up during one survey, and complete in the next.
        assert_eq!(track.handle_look(survey(1.0, 0.1)), None);
        assert!(track.needs_confirmation());
        assert_eq!(track.handle_look(survey(2.0, 0.05)), Some(Survey::BASELINE_STATE));
        assert_eq!(track.current_load(), survey(2.0, 0.05));
        assert_eq!(track.handle_look(survey(2.1, 0.05)), None);
        // Put down.
        assert_eq!(track.handle_look(survey(0.0, 0.05)), None);
        assert_eq!(track.handle_look(survey(0.01, 0.05)), Some(survey(2.0, 0.05)));
    }

    #[test]
    fn what_is_odd_once_or_on_either_side_is_no_change() {
        let mut track = LoadTrack::from(Survey::BASELINE_STATE);
        for value in [1.0, 0.0, 1.0, -1.0, 1.0, 0.1] {
            assert_eq!(track.handle_look(survey(value, 0.1)), None, "{value}");
        }
        assert_eq!(track.handle_look(survey(0.29, 0.1)), None);
        assert_eq!(track.handle_look(survey(0.29, 0.1)), None, "within 3 σ");
    }

    #[test]
    fn where_no_mass_is_reported_it_counts_whether_a_load_is_seen() {
        let seen = |seen| Survey { mass: None, has_load: seen };
        let mut track = LoadTrack::from(Survey::BASELINE_STATE);
        assert_eq!(track.handle_look(seen(false)), None);
        assert_eq!(track.handle_look(seen(true)), None);
        assert_eq!(track.handle_look(seen(true)), Some(Survey::BASELINE_STATE));
        assert_eq!(track.current_load(), seen(true));
    }
}
