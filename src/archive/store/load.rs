//! The load on the flange, as status and history have it.

use didim_core::identification::{Comparison, Load, Presence, Uncertain};
use serde::{Deserialize, Serialize};

use crate::text::{significant, to_uncertainty};

/// Most digits of a mass.
const DIGITS: usize = 4;

/// What the arm carries beyond what it did when its baseline was identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundLoad {
    /// Number of the baseline's result.
    pub baseline: u64,
    /// Whether it is there.
    pub presence: Presence,
    /// What is told of it.
    #[serde(flatten)]
    pub load: Load,
    /// The payload that was noted, less that of the baseline \[kg\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declared_kg: Option<f64>,
    /// What is found against that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declared: Option<Comparison>,
    /// How it changed within the window, so that the values are of no load that was there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub changed: Option<LoadChange>,
}

/// From one mass to another; none where the mass is not told.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadChange {
    /// When, after the first sample that counts \[s\]: it was so from there on at the latest.
    pub after_s: f64,
    /// Before \[kg\].
    pub from_kg: Option<Uncertain>,
    /// After \[kg\].
    pub to_kg: Option<Uncertain>,
}

/// A mass with its standard deviation, as text.
pub fn mass_text(mass: Option<Uncertain>) -> String {
    mass.map_or("unknown mass".to_owned(), |mass| {
        let digits = to_uncertainty(mass.value, mass.standard_deviation, DIGITS);
        format!("{digits} ± {} kg", significant(mass.standard_deviation, 2))
    })
}

impl FoundLoad {
    /// In a line: `2.03 ± 0.05 kg, 2 kg noted`.
    pub fn line(&self) -> String {
        let Presence { seen, mass_limit_kg, .. } = self.presence;
        let mut text = match (seen, mass_limit_kg) {
            (false, Some(limit)) => format!("none, below {} kg (95 %)", significant(limit, 2)),
            _ => mass_text(self.load.mass_kg),
        };
        if let Some(LoadChange { after_s, from_kg, to_kg }) = self.changed {
            let [from, to] = [from_kg, to_kg].map(mass_text);
            text = format!("changed within {after_s:.0} s from {from} to {to}");
        }
        if let (Some(kg), Some(declared)) = (self.declared_kg, &self.declared) {
            let agrees = if declared.within { "which agrees" } else { "which does not agree" };
            text += &format!(", {} kg noted, {agrees}", significant(kg, DIGITS));
        }
        text
    }
}
