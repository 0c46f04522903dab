//! Changes of configured values that findings ask for.

use didim_dynamics::robot::{JointIndex, JointKind, MotorIndex, TorqueTerm};

use super::alternatives::{Alternative, Chosen, Lag, Signal};
use super::nuisance_parameters::{NuisanceEstimate, NuisanceParameter, Quantity};
use super::reasons::{Note, Reason};
use super::setting::Setting;

/// Axis of a signal: a joint, or a motor, which may be coupled to several joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalAxis {
    /// A joint.
    Joint(JointIndex),
    /// A motor.
    Motor(MotorIndex),
}

/// Change of a configured quantity that the data ask for. Joints count from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Multiply the torque of an axis, or of every axis, by a factor.
    TorqueScale {
        /// The axis; `None` for every axis.
        axis: Option<SignalAxis>,
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
        /// Its standard deviation, of each coordinate \[m/s²\]; 0 for one of the main directions.
        standard_deviation_m_s2: f64,
    },
    /// Multiply the position of an axis by a factor.
    PositionScale {
        /// The axis.
        axis: SignalAxis,
        /// The factor \[1\].
        factor: f64,
        /// Its standard deviation \[1\].
        standard_deviation: f64,
    },
    /// Multiply the known torque of a joint by a factor.
    KnownTorque {
        /// The joint.
        joint: JointIndex,
        /// The factor \[1\].
        factor: f64,
        /// Its standard deviation \[1\].
        standard_deviation: f64,
    },
    /// Add to the time from the stamp of a signal to the instant at which it is valid.
    Delay {
        /// The axis; `None` for every axis.
        axis: Option<SignalAxis>,
        /// The signal: torque or position.
        signal: Signal,
        /// The time to add \[s\].
        delay_s: f64,
        /// Its standard deviation \[s\].
        standard_deviation_s: f64,
    },
    /// Add the inertia of a joint's drive to the model.
    DriveInertia {
        /// The joint.
        joint: JointIndex,
    },
    /// Replace an entry of the transmission.
    Coupling {
        /// The motor of the row.
        motor: MotorIndex,
        /// The joint of the column.
        joint: JointIndex,
        /// The entry \[motor turns per joint turn\].
        entry: f64,
        /// Its standard deviation, in the same unit.
        standard_deviation: f64,
    },
    /// Let the data choose the friction laws.
    FrictionLaws {
        /// The joint or motor whose law describes the data least, with its share of the torque
        /// \[1\].
        nuisance: NuisanceParameter,
        /// Size of the effect, relative to the torque of its joint \[1\].
        relative_torque: f64,
    },
    /// Exclude a term from the model, because the recorded torques do not contain it.
    Exclude {
        /// The term.
        term: TorqueTerm,
    },
    /// Add to a number of a joint in the robot file.
    Geometry {
        /// The joint.
        joint: JointIndex,
        /// Key of the number: `alpha_deg`, `d_m` or `r_m`.
        key: &'static str,
        /// The number to add, in the unit of the key.
        offset: f64,
        /// Its standard deviation, in the same unit.
        standard_deviation: f64,
    },
    /// Invert the sign of the torque or of the position of an axis.
    Sign {
        /// The axis.
        axis: SignalAxis,
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
                let axis = SignalAxis::Joint(*joint);
                signal.map(|signal| Change::Sign { axis, signal })
            }
            Self::Alternative { found: Alternative::NoGravity, .. } => {
                Some(Change::Exclude { term: TorqueTerm::Gravity })
            }
            Self::Alternative { found: Alternative::TorqueScale { motor, factor }, .. } => {
                Some(Change::TorqueScale {
                    axis: Some(SignalAxis::Motor(*motor)),
                    factor: factor.value,
                    standard_deviation: factor.standard_deviation,
                })
            }
            Self::Alternative { found: Alternative::PositionScale { motor, factor }, .. } => {
                Some(Change::PositionScale {
                    axis: SignalAxis::Motor(*motor),
                    factor: factor.value,
                    standard_deviation: factor.standard_deviation,
                })
            }
            Self::Alternative {
                found: Alternative::Late { motor, signal, lag: Lag::Delay, time_s },
                ..
            } => Some(Change::Delay {
                axis: motor.map(SignalAxis::Motor),
                signal: *signal,
                // A signal that is logged late was valid before its stamp.
                delay_s: -time_s.value,
                standard_deviation_s: time_s.standard_deviation,
            }),
            Self::Alternative { found: found @ Alternative::Coupling { .. }, .. } => {
                of_coupling(found)
            }
            Self::Alternative { found: Alternative::DriveInertia { joint }, .. } => {
                Some(Change::DriveInertia { joint: *joint })
            }
            Self::Alternative { found: Alternative::Gravity { gravity_m_s2 }, .. } => {
                let gravity_m_s2 = *gravity_m_s2;
                Some(Change::Gravity { gravity_m_s2, standard_deviation_m_s2: 0.0 })
            }
            Self::Alternative { found: Alternative::Leaning(lean), .. } => Some(Change::Gravity {
                gravity_m_s2: lean.gravity_m_s2(),
                standard_deviation_m_s2: lean.standard_deviation_m_s2(),
            }),
            Self::Alternative { found: Alternative::OppositeSign { motor, signal }, .. } => {
                Some(Change::Sign { axis: SignalAxis::Motor(*motor), signal: *signal })
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

impl Note {
    fn change(&self) -> Option<Change> {
        let Self::ModelError { nuisance, coupling, .. } = self else { return None };
        if let Some(coupling) = coupling {
            return of_coupling(coupling);
        }
        nuisance.nuisance.is_friction().then_some(Change::FrictionLaws {
            nuisance: nuisance.nuisance,
            relative_torque: nuisance.relative_torque,
        })
    }

    /// Returns the key to change, if it is known.
    pub(super) fn setting(&self) -> Option<&Setting> {
        match self {
            Self::Explanation(reason) => reason.setting(),
            Self::ModelError { setting, .. } => setting.as_ref(),
            _ => None,
        }
    }

    /// Sets the key to change, if the note has a change and `find` knows its key.
    pub(super) fn find_setting(&mut self, find: &dyn Fn(&Change) -> Option<Setting>) {
        let found = self.change().and_then(|change| find(&change));
        match self {
            Self::Explanation(reason) => reason.find_setting(find),
            Self::ModelError { setting, .. } => *setting = found,
            _ => {}
        }
    }
}

/// Returns the change of a contradicted value.
fn of_nuisance(found: &NuisanceEstimate) -> Option<Change> {
    let quantity = found.quantity?;
    let of_scale = |axis| {
        let [factor, standard_deviation] = found.correction_factor()?;
        Some(Change::TorqueScale { axis, factor, standard_deviation })
    };
    match found.nuisance {
        NuisanceParameter::TorqueGain(joint) => of_scale(Some(SignalAxis::Joint(joint))),
        NuisanceParameter::CommonGain => of_scale(None),
        NuisanceParameter::KnownTorque(joint) => {
            let [factor, standard_deviation] = found.correction_factor()?;
            Some(Change::KnownTorque { joint, factor, standard_deviation })
        }
        NuisanceParameter::PositionScale(joint) => {
            let [factor, standard_deviation] = found.correction_factor()?;
            Some(Change::PositionScale {
                axis: SignalAxis::Joint(joint),
                factor,
                standard_deviation,
            })
        }
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
        NuisanceParameter::TorqueDelay(joint) => Some(Change::Delay {
            axis: Some(SignalAxis::Joint(joint)),
            signal: Signal::Torque,
            delay_s: quantity.value,
            standard_deviation_s: quantity.standard_deviation,
        }),
        NuisanceParameter::Twist(joint) => of_geometry(joint, "alpha_deg", quantity),
        NuisanceParameter::Distance(joint) => of_geometry(joint, "d_m", quantity),
        NuisanceParameter::Offset(joint) => of_geometry(joint, "r_m", quantity),
        _ => None,
    }
}

fn of_geometry(joint: JointIndex, key: &'static str, quantity: Quantity) -> Option<Change> {
    let Quantity { value: offset, standard_deviation, .. } = quantity;
    Some(Change::Geometry { joint, key, offset, standard_deviation })
}

fn of_coupling(found: &Alternative) -> Option<Change> {
    let Alternative::Coupling { motor, joint, .. } = *found else { return None };
    let Chosen { value: entry, standard_deviation } = found.coupling()?;
    Some(Change::Coupling { motor, joint, entry, standard_deviation })
}
