//! The load on the flange in status and history.

use didim_identification::identification::{
    CentreOfMass, Comparison, Load, Presence, UncertainValue,
};
use serde::{Deserialize, Serialize};

use crate::text::{significant_digits, to_uncertainty};

/// Maximum number of digits of a mass.
const MAX_DIGITS: usize = 4;

/// Payload of the arm, relative to the payload at the identification of the baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundLoad {
    /// Number of the baseline's result.
    pub baseline: u64,
    /// Presence of the load.
    pub presence: Presence,
    /// Identified load.
    #[serde(flatten)]
    pub load: Load,
    /// Its centre and inertia in the frame of a link. `None` in results of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_of_mass: Option<CentreOfMass>,
    /// Noted payload minus noted payload of the baseline \[kg\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declared_kg: Option<f64>,
    /// Comparison of the identified load with the noted one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declared: Option<Comparison>,
    /// Load change within the window. If there is one, the other values describe no real load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub changed: Option<LoadChange>,
}

/// Change from one mass to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadChange {
    /// Time after the first counted sample \[s\]. The change happened before this time.
    pub after_s: f64,
    /// Mass before the change \[kg\]. `None` if it is not identifiable.
    pub from_kg: Option<UncertainValue>,
    /// Mass after the change \[kg\]. `None` if it is not identifiable.
    pub to_kg: Option<UncertainValue>,
}

/// Formats a mass with its standard deviation.
pub fn mass_text(mass: Option<UncertainValue>) -> String {
    mass.map_or("unknown mass".to_owned(), |mass| {
        let digits = to_uncertainty(mass.value, mass.standard_deviation, MAX_DIGITS);
        format!("{digits} ± {} kg", significant_digits(mass.standard_deviation, 2))
    })
}

impl FoundLoad {
    /// Formats the load as a line: `2.03 ± 0.05 kg, 2 kg noted`.
    pub fn line(&self) -> String {
        let Presence { seen, mass_limit_kg, .. } = self.presence;
        let mut text = match (seen, mass_limit_kg) {
            (false, Some(limit)) => {
                format!("none, below {} kg (95 %)", significant_digits(limit, 2))
            }
            _ => mass_text(self.load.mass_kg),
        };
        if let Some(LoadChange { after_s, from_kg, to_kg }) = self.changed {
            let [from, to] = [from_kg, to_kg].map(mass_text);
            text = format!("changed within {after_s:.0} s from {from} to {to}");
        }
        if let (Some(kg), Some(declared)) = (self.declared_kg, &self.declared) {
            let agrees = if declared.within { "which agrees" } else { "which does not agree" };
            text += &format!(", {} kg noted, {agrees}", significant_digits(kg, MAX_DIGITS));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load as an earlier version stored it, without the frame of its centre.
    const EARLIER: &str = r#"{"baseline":0,"presence":{"seen":true,"mass_deviations":60.0,
        "mass_limit_kg":null,"from_none":{"chi_squared":9.0,"degrees_of_freedom":4,
        "probability":0.1}},"mass_kg":{"value":2.0,"standard_deviation":0.05},"centre_m":
        [{"value":0.01,"standard_deviation":0.002},null,null],"inertia_kg_m2":
        [null,null,null,null,null,null]}"#;

    #[test]
    fn a_load_of_an_earlier_version_is_read_as_it_was() {
        let load: FoundLoad = serde_json::from_str(EARLIER).unwrap();
        assert_eq!(
            (load.centre_of_mass.as_ref(), load.line().as_str()),
            (None, "2.000 ± 0.050 kg")
        );
        assert_eq!(load.load.centre_m[0].map(|of| of.value), Some(0.01));
        let same: serde_json::Value = serde_json::from_str(EARLIER).unwrap();
        assert_eq!(serde_json::to_value(&load).unwrap(), same);
    }
}
