//! Parameters that are not identified and keep the values of the robot's file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::IdentificationError;
use super::selection::Selection;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// Parameters that keep their nominal values if they are not identified; the others are 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "RawKeptParameters", into = "RawKeptParameters")]
pub enum KeptParameters {
    /// All with a nominal value.
    All,
    /// These.
    Named(Vec<String>),
}

/// As written in a file.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "\"all\", or a list of parameters such as [\"zz5r\", \"zz6\"]")]
enum RawKeptParameters {
    #[schemars(extend("const" = "all"))]
    Word(String),
    Names(Vec<String>),
}

impl TryFrom<RawKeptParameters> for KeptParameters {
    type Error = String;

    fn try_from(raw: RawKeptParameters) -> Result<Self, String> {
        match raw {
            RawKeptParameters::Word(word) if word == "all" => Ok(Self::All),
            RawKeptParameters::Word(word) => {
                Err(format!("\"{word}\" is neither \"all\" nor a list of parameters"))
            }
            RawKeptParameters::Names(names) => Ok(Self::Named(names)),
        }
    }
}

impl From<KeptParameters> for RawKeptParameters {
    fn from(fixed: KeptParameters) -> Self {
        match fixed {
            KeptParameters::All => Self::Word("all".to_owned()),
            KeptParameters::Named(names) => Self::Names(names),
        }
    }
}

impl KeptParameters {
    /// Makes a selection keep the nominal values of these base parameters.
    ///
    /// # Errors
    /// [`IdentificationError::NothingNominal`], [`IdentificationError::NoNominalValue`], and those
    /// of [`Selection::keep_values`].
    pub(crate) fn keep_nominal(
        &self,
        selection: &mut Selection,
        robot: &Robot,
        base: &BaseParameters,
    ) -> Result<(), IdentificationError> {
        let Some(nominal) = robot.nominal() else {
            return Err(IdentificationError::NothingNominal { robot: robot.name().to_owned() });
        };
        let nominal = base.to_base(nominal.standard_parameters());
        let value = |index: usize| nominal.get(index).copied().filter(|value| *value != 0.0);
        let (names, columns) = (base.names(), base.columns());
        match self {
            Self::All => {
                let unselected: Vec<usize> = (0..names.len())
                    .filter(|&index| !selection.columns().contains(&columns[index]))
                    .collect();
                let fixed = unselected.iter().filter_map(|&k| Some((names[k].as_str(), value(k)?)));
                selection.keep_values(base, fixed)
            }
            Self::Named(fixed_part) => {
                let with_value = |name: &String| match base.find(name) {
                    None => Ok((name.clone(), 0.0)),
                    Some(index) => value(index)
                        .map(|value| (name.clone(), value))
                        .ok_or_else(|| IdentificationError::NoNominalValue { name: name.clone() }),
                };
                let fixed = fixed_part.iter().map(with_value).collect::<Result<Vec<_>, _>>()?;
                selection
                    .keep_values(base, fixed.iter().map(|(name, value)| (name.as_str(), *value)))
            }
        }
    }
}
