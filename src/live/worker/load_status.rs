//! What the status tells of the load.

use didim_core::identification::Uncertain;
use serde::{Deserialize, Serialize};

use crate::archive::store::{FoundLoad, Timestamp, mass_text};

/// Whether the arm carries more than it did with its baseline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoadState {
    /// It has not moved enough yet, or what is known of it tells no load.
    #[default]
    Unknown,
    /// No more and no less.
    None,
    /// More.
    Load,
    /// Less: the baseline was identified with a load that is gone.
    Less,
}

/// The load on the flange.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LoadStatus {
    /// Whether there is one.
    pub state: LoadState,
    /// When that was found; nothing while it is not known.
    pub since: Option<Timestamp>,
    /// Mass, where it is told \[kg\]: as of when it was found.
    pub mass_kg: Option<Uncertain>,
    /// What was carried before, where it has changed since the start \[kg\].
    pub before_kg: Option<Uncertain>,
    /// How often it has changed since the start.
    pub changes: u64,
    /// What the last look found by itself.
    pub last_look: Option<FoundLoad>,
    /// Why the last look found nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// Looks that were left out, because the one before took too long.
    pub looks_left_out: u64,
}

impl LoadStatus {
    /// What is known of it, and why no more.
    pub fn lines(&self) -> Vec<String> {
        let mass = || mass_text(self.mass_kg);
        let known = match self.state {
            LoadState::Unknown => None,
            LoadState::None => Some("none is seen".to_owned()),
            LoadState::Load => Some(mass()),
            LoadState::Less => Some(format!("less than with the baseline: {}", mass())),
        };
        let known = known.map(|mut text| {
            text += &self.since.map_or(String::new(), |since| format!(", since {since}"));
            if self.changes > 0 {
                text += &format!(", before that {}", mass_text(self.before_kg));
            }
            text
        });
        let look = self.last_look.as_ref().map(|found| format!("last look: {}", found.line()));
        let why_not = self.why_not.as_ref().map(|why| format!("not known: {why}"));
        known.into_iter().chain(why_not.or(look)).collect()
    }
}
