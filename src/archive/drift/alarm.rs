//! The alarm of one parameter. It is raised when the parameter stays outside its band, and cleared
//! when the parameter is back inside.

use super::Change;
use super::limits::DriftLimits;
use crate::archive::store::Timestamp;

/// Alarm state of one parameter.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Alarm {
    /// Number of consecutive results that support a state change: outside the band while the alarm
    /// is clear, well inside it while the alarm is raised.
    agreeing_results: u32,
    /// Time of the first of the consecutive results outside the band.
    left_band_at: Option<Timestamp>,
    is_raised: bool,
}

/// The state changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmEvent {
    /// The alarm was raised.
    Raised,
    /// The alarm was cleared.
    Cleared,
}

impl Alarm {
    /// Processes the next result. The state changes after `results` consecutive results that
    /// support the change. A change that is NaN is ignored.
    pub fn handle_change(
        &mut self,
        change: &Change,
        time: Timestamp,
        results: u32,
    ) -> Option<AlarmEvent> {
        let share = change.band_share();
        if share.is_nan() {
            return None;
        }
        let changes =
            if self.is_raised { share <= DriftLimits::DEFAULT.clearing_share } else { share > 1.0 };
        if !changes {
            self.agreeing_results = 0;
            if !self.is_raised {
                self.left_band_at = None;
            }
            return None;
        }
        if !self.is_raised && self.agreeing_results == 0 {
            self.left_band_at = Some(time);
        }
        self.agreeing_results += 1;
        if self.agreeing_results < results {
            return None;
        }
        self.agreeing_results = 0;
        self.is_raised = !self.is_raised;
        if self.is_raised {
            return Some(AlarmEvent::Raised);
        }
        self.left_band_at = None;
        Some(AlarmEvent::Cleared)
    }

    /// Returns the time since which the parameter has been outside its band. `None` unless the
    /// alarm is raised.
    pub fn outside_since(&self) -> Option<Timestamp> {
        self.left_band_at.filter(|_| self.is_raised)
    }
}
