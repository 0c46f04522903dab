//! The alarm of one parameter. It is raised when the parameter stays outside its band, and cleared
//! when the parameter is back inside.

use super::Change;
use super::limits::DriftLimits;
use crate::archive::store::{AlarmState, Timestamp};

/// Alarm state of one parameter.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Alarm(AlarmState);

/// The state changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmEvent {
    /// The alarm was raised.
    Raised,
    /// The alarm was cleared.
    Cleared,
}

impl Alarm {
    /// Continues from a stored state.
    pub(super) fn from_state(state: AlarmState) -> Self {
        Self(state)
    }

    /// Returns the state to store. `None` for an alarm that is clear and stays so.
    pub(super) fn state(&self) -> Option<AlarmState> {
        (self.0 != AlarmState::default()).then(|| self.0.clone())
    }

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
        let changes = if self.0.is_raised {
            share <= DriftLimits::DEFAULT.clearing_share
        } else {
            share > 1.0
        };
        if !changes {
            self.0.agreeing_results = 0;
            if !self.0.is_raised {
                self.0.left_band_at = None;
            }
            return None;
        }
        if !self.0.is_raised && self.0.agreeing_results == 0 {
            self.0.left_band_at = Some(time);
        }
        self.0.agreeing_results += 1;
        if self.0.agreeing_results < results {
            return None;
        }
        self.0.agreeing_results = 0;
        self.0.is_raised = !self.0.is_raised;
        if self.0.is_raised {
            return Some(AlarmEvent::Raised);
        }
        self.0.left_band_at = None;
        Some(AlarmEvent::Cleared)
    }

    /// Returns the time since which the parameter has been outside its band. `None` unless the
    /// alarm is raised.
    pub fn outside_since(&self) -> Option<Timestamp> {
        self.0.left_band_at.filter(|_| self.0.is_raised)
    }
}
