//! Changes of configured values that findings ask for.

use didim_dynamics::robot::{JointIndex, JointKind, TorqueTerm};

use super::alternatives::{Alternative, Signal};
use super::nuisance_parameters::{NuisanceEstimate, NuisanceParameter};
use super::reasons::Reason;
use super::setting::Setting;

/// Change of a configured quantity that the data ask for. Joints count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Multiply the torque of a joint, or of every joint, by a factor.
    TorqueScale {
        /// The joint; `None` for every joint.
        joint: Option<JointIndex>,
        /// The factor \[1\].
        factor: f64,
        /// Its standard deviation \[1\].
        standard_deviation: f64,
    },
    /// Add an offset to the position of a joint.
    Position {
        /// The joint.
        joint: JointIndex,
        /// The offset \[rad or m\].
        offset: f64,
        /// Its standard deviation \[rad or m\].
        standard_deviation: f64,
    },
    /// Replace the gravity in the base frame.
    Gravity {
        /// The gravity \[m/s²\].
        gravity_m_s2: [f64; 3],
    },
    /// Exclude a term from the model, because the recorded torques do not contain it.
    Exclude {
        /// The term.
        term: TorqueTerm,
    },
    /// Invert the sign of the torque or of the position of a joint.
    Sign {
        /// The joint.
        joint: JointIndex,
        /// The signal.
        signal: Signal,
    },
}

impl Reason {
    /// Returns the change that would remove the reason, if a configured value is its cause.
    pub fn change(&self) -> Option<Change> {
        match self {
            Self::Contradicted { nuisance, .. } => of_nuisance(nuisance),
            Self::WrongSignsOfJoint { joint, signal, .. } => {
                signal.map(|signal| Change::Sign { joint: *joint, signal })
            }
            Self::Alternative { found: Alternative::NoGravity, .. } => {
                Some(Change::Exclude { term: TorqueTerm::Gravity })
            }
            Self::Alternative { found: Alternative::TorqueScale { motor, factor }, .. } => {
                Some(Change::TorqueScale {
                    joint: Some(JointIndex::new(motor.position())),
                    factor: factor.value,
                    standard_deviation: factor.standard_deviation,
                })
            }
            Self::Alternative { found: Alternative::Gravity { gravity_m_s2 }, .. } => {
                Some(Change::Gravity { gravity_m_s2: *gravity_m_s2 })
            }
            Self::Alternative { found: Alternative::OppositeSign { motor, signal }, .. } => {
                let joint = JointIndex::new(motor.position());
                Some(Change::Sign { joint, signal: *signal })
            }
            _ => None,
        }
    }

    /// Returns the key to change, if it is known.
    pub fn setting(&self) -> Option<&Setting> {
        match self {
            Self::Contradicted { setting, .. }
            | Self::Alternative { setting, .. }
            | Self::WrongSignsOfJoint { setting, .. } => setting.as_ref(),
            _ => None,
        }
    }

    /// Sets the key to change, if the reason has a change and `find` knows its key.
    pub(super) fn find_setting(&mut self, find: &dyn Fn(&Change) -> Option<Setting>) {
        let found = self.change().and_then(|change| find(&change));
        match self {
            Self::Contradicted { setting, .. }
            | Self::Alternative { setting, .. }
            | Self::WrongSignsOfJoint { setting, .. } => *setting = found,
            _ => {}
        }
    }
}

/// Returns the change of a contradicted value.
fn of_nuisance(found: &NuisanceEstimate) -> Option<Change> {
    let quantity = found.quantity?;
    let of_scale = |joint| {
        let [factor, standard_deviation] = found.correction_factor()?;
        Some(Change::TorqueScale { joint, factor, standard_deviation })
    };
    match found.nuisance {
        NuisanceParameter::TorqueGain(joint) => of_scale(Some(joint)),
        NuisanceParameter::CommonGain => of_scale(None),
        NuisanceParameter::Zero(joint) => {
            let in_si = |value: f64| match quantity.unit == JointKind::Prismatic.position_unit() {
                true => value,
                false => value.to_radians(),
            };
            Some(Change::Position {
                joint,
                offset: in_si(quantity.value),
                standard_deviation: in_si(quantity.standard_deviation),
            })
        }
        _ => None,
    }
}
