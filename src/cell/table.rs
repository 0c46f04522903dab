//! Section of a cell file: corrections of tables with didim's own columns.

use didim_dynamics::robot::Robot;
use didim_formats::{AxisCorrections, OwnColumns};
use schemars::JsonSchema;
use serde::Deserialize;

use super::unit::{OneOrEach, axis_factors, axis_signs, numbers};

/// Corrections of tables with didim's own columns, as `didim convert` writes them. These are in SI
/// units; a correction is for a table whose values are wrong. For the columns of another program,
/// use `[data]`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableSection {
    /// Positions, and commanded positions: the corrected one is `sign × factor × (value − zero)`.
    ///
    /// If left out: they are right.
    #[serde(default)]
    pub position: PositionCorrections,
    /// Torques or forces: the corrected one is `sign × factor × value`.
    ///
    /// If left out: they are right.
    #[serde(default)]
    pub torque: TorqueCorrections,
}

/// Corrections of torques.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "corrections such as { factor = 1.02 }")]
pub struct TorqueCorrections {
    /// Correction of the scale; one for all axes or one for each. Above 0.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub factor: Option<OneOrEach<f64>>,
    /// 1, or −1 if the values have the wrong sign.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub sign: Option<OneOrEach<f64>>,
}

/// Corrections of positions.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "corrections such as { factor = 1.02 }")]
pub struct PositionCorrections {
    /// Correction of the scale; one for all axes or one for each. Above 0.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub factor: Option<OneOrEach<f64>>,
    /// 1, or −1 if the values have the wrong sign.
    ///
    /// If left out: 1.
    #[serde(default)]
    pub sign: Option<OneOrEach<f64>>,
    /// The value at which the position of the robot file is 0 \[rad or m\].
    ///
    /// If left out: 0.
    #[serde(default)]
    pub zero: Option<OneOrEach<f64>>,
}

impl TableSection {
    /// Returns the corrections of each axis, or the key of an invalid value and the problem.
    pub(super) fn read(&self, robot: &Robot) -> Result<OwnColumns, (&'static str, String)> {
        let Self { position, torque } = self;
        let in_position = |problem| ("table.position", problem);
        let zeros = match &position.zero {
            Some(zero) => numbers(zero, "zero", robot.joints()).map_err(in_position)?,
            None => Vec::new(),
        };
        let of_position = scales([&position.factor, &position.sign], robot.joints());
        let of_torque = scales([&torque.factor, &torque.sign], robot.joints());
        Ok(OwnColumns {
            position: AxisCorrections { scales: of_position.map_err(in_position)?, zeros },
            torque: AxisCorrections {
                scales: of_torque.map_err(|problem| ("table.torque", problem))?,
                zeros: Vec::new(),
            },
        })
    }
}

/// Returns the signed factor of each axis.
fn scales([factor, sign]: [&Option<OneOrEach<f64>>; 2], axes: usize) -> Result<Vec<f64>, String> {
    let factors = axis_factors(factor.as_ref(), axes)?.into_iter();
    let signs = axis_signs(sign.as_ref(), axes)?;
    Ok(factors.zip(signs).map(|(factor, sign)| factor * sign).collect())
}
