//! The alarm of one parameter: raised when it stays outside its band, cleared when it is back.

use super::Change;
use crate::archive::store::Timestamp;

/// The alarm is cleared only within this share of the band, so that a parameter at its edge does not
/// raise and clear it all the time.
const BACK_WITHIN: f64 = 0.75;

/// The state of one parameter.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Alarm {
    /// Consecutive results that speak for a change of the state: outside while it is clear, well
    /// inside while it is raised.
    turning: u32,
    /// The first of the consecutive results outside.
    left: Option<Timestamp>,
    raised: bool,
}

/// The state changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmEvent {
    /// It was raised.
    Raised,
    /// It was cleared.
    Cleared,
}

impl Alarm {
    /// Takes the next result, of which `results` in a row change the state. A change that is no
    /// number is passed over.
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
        let changes = if self.raised { share <= BACK_WITHIN } else { share > 1.0 };
        if !changes {
            self.turning = 0;
            if !self.raised {
                self.left = None;
            }
            return None;
        }
        if !self.raised && self.turning == 0 {
            self.left = Some(time);
        }
        self.turning += 1;
        if self.turning < results {
            return None;
        }
        self.turning = 0;
        self.raised = !self.raised;
        if self.raised {
            return Some(AlarmEvent::Raised);
        }
        self.left = None;
        Some(AlarmEvent::Cleared)
    }

    /// Since when the parameter is outside, if the alarm is raised.
    pub fn since(&self) -> Option<Timestamp> {
        self.left.filter(|_| self.raised)
    }
}
