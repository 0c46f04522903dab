//! The load in the status.

use didim_identification::identification::UncertainValue;
use serde::{Deserialize, Serialize};

use crate::archive::store::{FoundLoad, Timestamp, mass_text};

/// Load of the arm compared with its baseline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoadState {
    /// The arm has not moved enough yet, or the available data do not identify a load.
    #[default]
    Unknown,
    /// The load is equal to that of the baseline.
    None,
    /// The load is heavier than that of the baseline.
    Load,
    /// The load is lighter than that of the baseline, which was identified with a load that was
    /// removed.
    Less,
}

/// The load on the flange.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LoadStatus {
    /// Presence of a load.
    pub state: LoadState,
    /// Time at which the state was found. `None` while the state is unknown.
    pub since: Option<Timestamp>,
    /// Mass found at that time \[kg\]. `None` if it is not identifiable.
    pub mass_kg: Option<UncertainValue>,
    /// Previous mass, if the load has changed since the start of the service \[kg\].
    pub before_kg: Option<UncertainValue>,
    /// Number of load changes since the start of the service.
    pub changes: u64,
    /// Result of the last survey alone.
    pub last_look: Option<FoundLoad>,
    /// Reason why the last survey found nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// Number of surveys that were skipped because the previous one took too long.
    pub looks_left_out: u64,
}

impl LoadStatus {
    /// Returns the known properties of the load, or the reason why the load is unknown.
    pub fn lines(&self) -> Vec<String> {
        let mass = || mass_text(self.mass_kg);
        let description = match self.state {
            LoadState::Unknown => None,
            LoadState::None => Some("none is seen".to_owned()),
            LoadState::Load => Some(mass()),
            LoadState::Less => Some(format!("less than with the baseline: {}", mass())),
        };
        let description = description.map(|mut text| {
            text += &self.since.map_or(String::new(), |since| format!(", since {since}"));
            if self.changes > 0 {
                text += &format!(", before that {}", mass_text(self.before_kg));
            }
            text
        });
        let survey = self.last_look.as_ref().map(|found| format!("last look: {}", found.line()));
        let why_not = self.why_not.as_ref().map(|why| format!("not known: {why}"));
        description.into_iter().chain(why_not.or(survey)).collect()
    }
}
