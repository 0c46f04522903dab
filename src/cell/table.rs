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
    pub position: TableCorrections,
    /// Torques or forces: the corrected one is `sign × factor × value`.
    ///
    /// If left out: they are right.
    #[serde(default)]
    pub torque: TableCorrections,
}

/// Corrections of one quantity.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "corrections such as { factor = 1.02 }")]
pub struct TableCorrections {
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
    /// The value at which the position of the robot file is 0 \[rad or m\]. Not for torques.
    ///
    /// If left out: 0.
    #[serde(default)]
    pub zero: Option<OneOrEach<f64>>,
}

impl TableSection {
    /// Returns the corrections of each axis, or the key of an invalid value and the problem.
    pub(super) fn read(&self, robot: &Robot) -> Result<OwnColumns, (&'static str, String)> {
        if self.torque.zero.is_some() {
            let problem = "has `zero`, which belongs to positions; identify the offset of a \
                torque as `offset` of the friction";
            return Err(("table.torque", problem.to_owned()));
        }
        let of = |key, corrections: &TableCorrections| {
            corrections.of_each(robot.joints()).map_err(|problem| (key, problem))
        };
        Ok(OwnColumns {
            position: of("table.position", &self.position)?,
            torque: of("table.torque", &self.torque)?,
        })
    }
}

impl TableCorrections {
    fn of_each(&self, axes: usize) -> Result<AxisCorrections, String> {
        let factors = axis_factors(self.factor.as_ref(), axes)?.into_iter();
        let signs = axis_signs(self.sign.as_ref(), axes)?;
        let zeros =
            self.zero.as_ref().map_or(Ok(Vec::new()), |zero| numbers(zero, "zero", axes))?;
        let scales = factors.zip(signs).map(|(factor, sign)| factor * sign).collect();
        Ok(AxisCorrections { scales, zeros })
    }
}
