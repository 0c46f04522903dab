//! Published figures, for comparison.

use std::collections::BTreeMap;

use didim_identification::identification::{Method, SingularValues};
use serde::Deserialize;

use super::trial::{Framework, Trial};

/// The figures of a publication.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Citation of the publication.
    pub source: String,
    /// The figures of every method.
    pub methods: Vec<PublishedFigures>,
}

/// Published figures of one method.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedFigures {
    /// The method.
    pub method: Method,
    /// The framework of the method.
    pub framework: Framework,
    /// Value (SI) and relative standard deviation \[%\] of each parameter, by its name in this
    /// project.
    #[serde(default)]
    pub estimates: BTreeMap<String, (f64, f64)>,
    /// Extreme singular values of the observation matrix.
    pub singular_values: Option<PublishedSingularValues>,
    /// Condition number, as printed.
    pub condition_number: Option<f64>,
    /// Computing time \[min\].
    pub time_min: Option<f64>,
    /// Relative errors of the simulation, mean over the joints.
    pub errors: Option<PublishedErrors>,
}

/// Extreme singular values.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedSingularValues {
    /// Largest singular value.
    pub max: f64,
    /// Smallest singular value.
    pub min: f64,
}

impl From<PublishedSingularValues> for SingularValues {
    fn from(PublishedSingularValues { max, min }: PublishedSingularValues) -> Self {
        Self { max, min }
    }
}

/// Relative errors of the simulation, mean over the joints.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedErrors {
    /// Position error ‖q − q_s‖ / ‖q‖ \[%\].
    pub position_percent: f64,
    /// Torque error ‖τ − τ_s‖ / ‖τ‖ \[%\].
    pub torque_percent: f64,
}

impl Published {
    /// Parses published figures from TOML. Checks them against the arm's parameter names
    /// (`available`).
    ///
    /// # Errors
    /// A message that names the problem and its place in the file: an unknown parameter name, or a
    /// figure that is not a number.
    pub fn from_toml(text: &str, available: &[String]) -> Result<Self, String> {
        let published: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        for of in &published.methods {
            let trial = Trial { method: of.method, framework: of.framework };
            let estimates = of.estimates.iter();
            check_names(available, of.estimates.keys())
                .map_err(|what| format!("{trial}: {what}"))?;
            let figures = estimates.flat_map(|(name, (value, deviation))| {
                [(name.as_str(), *value), (name.as_str(), *deviation)]
            });
            let named = [
                ("singular_values.max", of.singular_values.map(|values| values.max)),
                ("singular_values.min", of.singular_values.map(|values| values.min)),
                ("condition_number", of.condition_number),
                ("time_min", of.time_min),
                ("errors.position_percent", of.errors.map(|errors| errors.position_percent)),
                ("errors.torque_percent", of.errors.map(|errors| errors.torque_percent)),
            ];
            let named = named.into_iter().filter_map(|(key, value)| Some((key, value?)));
            if let Some((key, value)) = figures.chain(named).find(|(_, v)| !v.is_finite()) {
                return Err(format!("{trial}: {key} is {value}; state a number, or leave it out"));
            }
        }
        Ok(published)
    }

    /// Returns the published figures of a method in a framework.
    pub fn figures(&self, trial: Trial) -> Option<&PublishedFigures> {
        self.methods.iter().find(|of| of.method == trial.method && of.framework == trial.framework)
    }
}

/// Checks that every name is a parameter of the arm.
///
/// # Errors
/// A message with the first unknown name and the known names.
pub(super) fn check_names<'a>(
    available: &[String],
    names: impl IntoIterator<Item = &'a String>,
) -> Result<(), String> {
    match names.into_iter().find(|name| !available.contains(name)) {
        Some(name) => {
            let names_text = available.join(" ");
            Err(format!("{name:?} is no base parameter of the robot; known are: {names_text}"))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_parameter_or_no_number_is_refused() {
        let names = ["zz1r".to_owned(), "fv1".to_owned()];
        let read = |rest: &str| {
            let head =
                "source = \"a paper\"\n[[methods]]\nmethod = \"clie\"\nframework = \"strict\"\n";
            Published::from_toml(&format!("{head}{rest}"), &names)
        };
        assert!(read("estimates = { zz1r = [1.24, 1.45] }\ncondition_number = 1172.0").is_ok());
        let refused = read("estimates = { zz1q = [1.24, 1.45] }").unwrap_err();
        assert!(refused.contains("CLIE, strict") && refused.contains("\"zz1q\""), "{refused}");
        let refused = read("estimates = { fv1 = [nan, 1.0] }").unwrap_err();
        assert!(refused.contains("fv1 is NaN"), "{refused}");
        let refused = read("condition_number = inf").unwrap_err();
        assert!(refused.contains("condition_number is inf"), "{refused}");
        let refused = read("singular_values = { max = 1.0, least = 1.0 }").unwrap_err();
        assert!(refused.contains("least") && refused.contains("line 5"), "{refused}");
    }
}
