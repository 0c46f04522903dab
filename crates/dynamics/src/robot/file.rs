//! Conversion of a robot file to a valid [`Robot`].

use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, schema_for};
use serde::Deserialize;
use toml::Spanned;

use super::capsule::RawCapsule;
use super::friction::RawJointFriction;
use super::hidden::is_hidden;
use super::known_torque::RawKnownTorque;
use super::limit::RawLimit;
use super::{
    Angle, Capsule, FrictionTerms, Joint, JointFriction, JointIndex, JointKind, Limits,
    NominalParameters, ParameterTable, RecordedTorque, Robot, RobotError, SignModel, Transmission,
};
use crate::MAX_JOINTS;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawRobot {
    /// Name of the robot, as results and scenarios have it.
    #[schemars(with = "String")]
    name: Spanned<String>,
    /// Gravity in the frame of the base, x, y and z \[m/s²\].
    #[schemars(with = "[f64; 3]")]
    gravity_m_s2: Spanned<[f64; 3]>,
    /// Shapes of the base, in its frame: as `capsules` of a joint. A capsule without ends reaches
    /// from the origin of the base to that of the first link.
    ///
    /// If left out: none.
    #[serde(default)]
    #[schemars(with = "Vec<RawCapsule>")]
    base_capsules: Vec<Spanned<RawCapsule>>,
    /// The joints, `[[joint]]`, from the base to the flange; 1 to 16.
    ///
    /// Required.
    #[serde(default)]
    #[schemars(with = "Vec<RawJoint>")]
    joint: Vec<Spanned<RawJoint>>,
    /// Gear ratios and couplings.
    transmission: RawTransmission,
    /// The friction terms of all joints.
    #[schemars(with = "RawFriction")]
    friction: Spanned<RawFriction>,
    /// Values of parameters, by their names (didim-parameters(7)) and in their units. Those that
    /// are not listed are 0. `zz1r` and `zz1` are one parameter.
    ///
    /// If left out: unknown.
    #[schemars(with = "Option<BTreeMap<String, f64>>")]
    nominal: Option<BTreeMap<Spanned<String>, Spanned<f64>>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawJoint {
    /// Name of the joint, shown next to its number.
    ///
    /// If left out: none. The joints of a URDF have their names.
    #[schemars(with = "Option<String>")]
    name: Option<Spanned<String>>,
    /// Revolute joints turn about their z axis, prismatic joints slide along it.
    r#type: JointKind,
    /// α, from the z axis of the link before to this one, about the x axis of the link before
    /// \[°\].
    #[schemars(with = "f64")]
    alpha_deg: Spanned<f64>,
    /// d, from the z axis of the link before to this one, along the x axis of the link before
    /// \[m\].
    #[schemars(with = "f64")]
    d_m: Spanned<f64>,
    /// θ, about this z axis, at position 0 \[°\].
    #[schemars(with = "f64")]
    theta_deg: Spanned<f64>,
    /// r, along this z axis, at position 0 \[m\].
    #[schemars(with = "f64")]
    r_m: Spanned<f64>,
    /// True if the inertia of the joint's drive is a parameter (`ia`).
    drive_inertia: bool,
    /// Smallest position of the joint \[°\].
    ///
    /// Required of a revolute joint.
    #[schemars(with = "Option<f64>")]
    position_min_deg: Option<Spanned<f64>>,
    /// Largest position of the joint \[°\].
    ///
    /// Required of a revolute joint.
    #[schemars(with = "Option<f64>")]
    position_max_deg: Option<Spanned<f64>>,
    /// Largest speed of the joint \[rad/s\]; greater than 0. `"unknown"` where no source gives it:
    /// recordings are then not checked against it, and no motion is designed.
    ///
    /// Required of a revolute joint.
    #[schemars(with = "Option<RawLimit>")]
    velocity_max_rad_s: Option<Spanned<RawLimit>>,
    /// Largest acceleration \[rad/s²\]; greater than 0. Motions are planned with it; no
    /// identification needs it.
    ///
    /// If left out: unknown.
    #[schemars(with = "Option<f64>")]
    acceleration_max_rad_s2: Option<Spanned<f64>>,
    /// Largest jerk \[rad/s³\]; greater than 0. Motions are planned with it; no identification
    /// needs it.
    ///
    /// If left out: unknown.
    #[schemars(with = "Option<f64>")]
    jerk_max_rad_s3: Option<Spanned<f64>>,
    /// Largest torque of the drive on the side of the joint, behind the gear \[N·m\]; greater than
    /// 0. `"unknown"` where no source gives it: recordings are then not checked against it, and a
    /// torque is judged as small by comparison with the largest recorded one. A motion can then be
    /// designed only from a result, and only without torque limits.
    ///
    /// Required of a revolute joint.
    #[schemars(with = "Option<RawLimit>")]
    torque_max_nm: Option<Spanned<RawLimit>>,
    /// Smallest position of the joint \[m\].
    ///
    /// Required of a prismatic joint.
    #[schemars(with = "Option<f64>")]
    position_min_m: Option<Spanned<f64>>,
    /// Largest position of the joint \[m\].
    ///
    /// Required of a prismatic joint.
    #[schemars(with = "Option<f64>")]
    position_max_m: Option<Spanned<f64>>,
    /// Largest speed of the joint \[m/s\]; greater than 0. `"unknown"` where no source gives it:
    /// recordings are then not checked against it, and no motion is designed.
    ///
    /// Required of a prismatic joint.
    #[schemars(with = "Option<RawLimit>")]
    velocity_max_m_s: Option<Spanned<RawLimit>>,
    /// Largest acceleration \[m/s²\]; greater than 0. Motions are planned with it; no
    /// identification needs it.
    ///
    /// If left out: unknown.
    #[schemars(with = "Option<f64>")]
    acceleration_max_m_s2: Option<Spanned<f64>>,
    /// Largest jerk \[m/s³\]; greater than 0. Motions are planned with it; no identification needs
    /// it.
    ///
    /// If left out: unknown.
    #[schemars(with = "Option<f64>")]
    jerk_max_m_s3: Option<Spanned<f64>>,
    /// Largest force of the drive along the joint, behind the gear \[N\]; greater than 0.
    /// `"unknown"` as of `torque_max_nm`.
    ///
    /// Required of a prismatic joint.
    #[schemars(with = "Option<RawLimit>")]
    force_max_n: Option<Spanned<RawLimit>>,
    /// Friction of this joint, in place of the general one.
    ///
    /// If left out: as `[friction]` says.
    #[schemars(with = "Option<RawJointFriction>")]
    friction: Option<Spanned<RawJointFriction>>,
    /// A torque or force on the joint in addition to gravity and the drive, as of a spring or a
    /// counterbalance; positive along the positive direction of the joint.
    ///
    /// If left out: none.
    #[schemars(with = "Option<RawKnownTorque>")]
    known_torque: Option<Spanned<RawKnownTorque>>,
    /// Shapes of the link. Designed motions keep them apart from those of other links and from a
    /// box. Without any, collisions of the link are not checked.
    ///
    /// If left out: none.
    #[serde(default)]
    #[schemars(with = "Vec<RawCapsule>")]
    capsules: Vec<Spanned<RawCapsule>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawTransmission {
    /// R, one row for each motor with one entry for each joint: the gear ratios, and couplings
    /// outside the diagonal. For a prismatic joint radians of the motor per metre.
    #[schemars(with = "Vec<Vec<f64>>")]
    rows: Spanned<Vec<Vec<f64>>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawFriction {
    /// The term `fv`, proportional to the speed.
    viscous: bool,
    /// The term `fc`, of constant size against the motion.
    coulomb: bool,
    /// The term `off`, a constant: unequal friction in the two directions, and the offset of the
    /// drive's current.
    offset: bool,
    /// The law for the sign of the speed: one of the forms below. Required with `coulomb = true`,
    /// and not without.
    ///
    /// Required with `coulomb = true`.
    sign: Option<SignModel>,
    /// A term `fvq` × speed × |speed|.
    ///
    /// If left out: `false`.
    quadratic: Option<bool>,
    /// A term `fvc` × speed³.
    ///
    /// If left out: `false`.
    cubic: Option<bool>,
    /// A term `fva` × |speed|: viscous friction that differs by direction.
    ///
    /// If left out: `false`.
    asymmetric: Option<bool>,
    /// A term `fcl` × |load| × sign: Coulomb friction that grows with the torque that the drive
    /// holds where the arm rests.
    ///
    /// If left out: `false`.
    load: Option<bool>,
    /// A term `fs` × exp(−(speed/vs)²) × sign, which falls as motion begins \[rad/s\]; this is vs.
    /// For a prismatic joint it is in m/s.
    ///
    /// If left out: no such term.
    stribeck_rad_s: Option<f64>,
    /// A term `fh` × z, which lags \[rad\]: after a reversal z goes from −1 to 1 over this way, and
    /// stays there (Maxwell slip); less than the joint's range. For a prismatic joint it is in m.
    ///
    /// If left out: no such term.
    hysteresis_rad: Option<f64>,
}

/// Text of the file, which converts byte offsets to line numbers.
#[derive(Clone, Copy)]
struct FileText<'a>(&'a str);

impl FileText<'_> {
    fn line(self, offset: usize) -> usize {
        1 + self.0.bytes().take(offset).filter(|byte| *byte == b'\n').count()
    }

    fn line_of<V>(self, value: &Spanned<V>) -> usize {
        self.line(value.span().start)
    }

    fn check_finite(self, key: &str, value: &Spanned<f64>) -> Result<f64, RobotError> {
        let number = *value.get_ref();
        if number.is_finite() {
            Ok(number)
        } else {
            Err(RobotError::NotFinite { key: key.into(), line: self.line_of(value) })
        }
    }
}

impl Robot {
    /// Returns the JSON Schema of a robot file.
    pub fn file_schema() -> Schema {
        schema_for!(RawRobot)
    }

    /// Reads a robot from TOML text; `config/robots/tx40.toml` shows every key.
    ///
    /// # Errors
    /// [`RobotError`]: the line, and what stands there.
    pub fn from_toml(text: &str) -> Result<Self, RobotError> {
        let raw: RawRobot = toml::from_str(text).map_err(|error| RobotError::Format {
            // An error without a place concerns the file as a whole.
            line: error.span().map_or(1, |span| FileText(text).line(span.start)),
            message: error.message().to_owned(),
        })?;
        let text = FileText(text);

        let names = raw.joint.iter().filter_map(|joint| joint.get_ref().name.as_ref());
        for name in core::iter::once(&raw.name).chain(names) {
            if name.get_ref().trim().is_empty() {
                return Err(RobotError::EmptyName { line: text.line_of(name) });
            }
            if name.get_ref().contains(is_hidden) {
                return Err(RobotError::ControlInName { line: text.line_of(name) });
            }
        }
        if raw.gravity_m_s2.get_ref().iter().any(|component| !component.is_finite()) {
            let line = text.line_of(&raw.gravity_m_s2);
            return Err(RobotError::NotFinite { key: "gravity_m_s2".into(), line });
        }
        let count = raw.joint.len();
        if !(1..=MAX_JOINTS).contains(&count) {
            return Err(RobotError::JointCount { found: count, largest: MAX_JOINTS });
        }
        let joints = raw
            .joint
            .iter()
            .enumerate()
            .map(|(i, joint)| read_joint(text, JointIndex::new(i), joint))
            .collect::<Result<Vec<_>, _>>()?;
        let transmission =
            Transmission::new(count, raw.transmission.rows.get_ref()).map_err(|source| {
                RobotError::Transmission { line: text.line_of(&raw.transmission.rows), source }
            })?;
        let (friction, own_friction) = read_friction(text, &raw.friction, &raw.joint, &joints)?;
        let known_torques = (raw.joint.iter().zip(&joints).zip(1..))
            .map(|((raw, joint), number)| {
                let Some(configured) = &raw.get_ref().known_torque else { return Ok(None) };
                let limit = configured.get_ref().of_joint(joint.kind, &joint.limits);
                let line = text.line_of(configured);
                limit.map(Some).map_err(|message| {
                    let message = format!("`known_torque` of joint {number}: {message}");
                    RobotError::Format { line, message }
                })
            })
            .collect::<Result<_, _>>()?;
        let joint_names = raw.joint.iter().map(|joint| joint.get_ref().name.as_ref());
        let joint_names = joint_names.map(|name| Some(name?.get_ref().clone())).collect();
        let of_links = raw.joint.iter().map(|joint| &joint.get_ref().capsules);
        let capsules = (core::iter::once(&raw.base_capsules).chain(of_links).enumerate())
            .map(|(link, capsules)| read_capsules(text, link, capsules, joints.get(link)))
            .collect::<Result<_, _>>()?;
        let parameters = ParameterTable::new(&joints, friction, &own_friction, &transmission);
        let nominal =
            raw.nominal.map(|values| read_nominal(text, &parameters, &values)).transpose()?;

        Ok(Self {
            name: raw.name.into_inner(),
            gravity_m_s2: raw.gravity_m_s2.into_inner(),
            joints,
            joint_names,
            link_names: Vec::new(),
            frames: Vec::new(),
            transmission,
            friction,
            own_friction,
            known_torques,
            capsules,
            parameters,
            nominal,
            recorded_torque: RecordedTorque::default(),
        })
    }
}

/// Returns the key of a limit that fits the kind of joint, with its value.
fn limit_for_kind<'a, V>(
    text: FileText<'_>,
    joint: JointIndex,
    kind: JointKind,
    revolute: (&'static str, &'a Option<Spanned<V>>),
    prismatic: (&'static str, &'a Option<Spanned<V>>),
    joint_line: usize,
) -> Result<(&'static str, &'a Spanned<V>), RobotError> {
    let ((key, value), (other, wrong)) = match kind {
        JointKind::Revolute => (revolute, prismatic),
        JointKind::Prismatic => (prismatic, revolute),
    };
    if let Some(wrong) = wrong {
        let line = text.line_of(wrong);
        return Err(RobotError::WrongUnit { joint, key: other, instead: key, line });
    }
    let missing = RobotError::MissingLimit { joint, key, line: joint_line };
    Ok((key, value.as_ref().ok_or(missing)?))
}

fn read_joint(
    text: FileText<'_>,
    joint: JointIndex,
    raw: &Spanned<RawJoint>,
) -> Result<Joint, RobotError> {
    let joint_line = text.line_of(raw);
    let raw = raw.get_ref();
    let kind = raw.r#type;
    // Returns key, value and line of the limit that fits the kind of joint. The key of the other
    // kind is an error.
    let limit = |revolute: (&'static str, &Option<Spanned<f64>>),
                 prismatic: (&'static str, &Option<Spanned<f64>>)| {
        let (key, value) = limit_for_kind(text, joint, kind, revolute, prismatic, joint_line)?;
        Ok((key, text.check_finite(key, value)?, text.line_of(value)))
    };
    let positive = |(key, value, line): (&'static str, f64, usize)| {
        if value > 0.0 { Ok(value) } else { Err(RobotError::NotPositive { joint, key, line }) }
    };

    let (min, position_min, line) = limit(
        ("position_min_deg", &raw.position_min_deg),
        ("position_min_m", &raw.position_min_m),
    )?;
    let (max_deg, max_m) = (&raw.position_max_deg, &raw.position_max_m);
    let (max, position_max, _) = limit(("position_max_deg", max_deg), ("position_max_m", max_m))?;
    if position_min >= position_max {
        return Err(RobotError::LimitOrder { joint, min, max, line });
    }
    let to_si = |position: f64| match kind {
        JointKind::Revolute => position.to_radians(),
        JointKind::Prismatic => position,
    };
    // Limits that motion planning needs and identification does not.
    let either = |revolute: (&'static str, &Option<Spanned<f64>>),
                  prismatic: (&'static str, &Option<Spanned<f64>>)| {
        let any = revolute.1.is_some() || prismatic.1.is_some();
        any.then(|| positive(limit(revolute, prismatic)?)).transpose()
    };
    // Limits that a source may omit. The file then leaves them open.
    let either_limit =
        |revolute: (&'static str, &Option<Spanned<RawLimit>>),
         prismatic: (&'static str, &Option<Spanned<RawLimit>>)| {
            let (key, value) = limit_for_kind(text, joint, kind, revolute, prismatic, joint_line)?;
            let line = text.line_of(value);
            match *value.get_ref() {
                RawLimit::Unknown => Ok(None),
                RawLimit::Number(most) if most.is_finite() => positive((key, most, line)).map(Some),
                RawLimit::Number(_) => Err(RobotError::NotFinite { key: key.into(), line }),
            }
        };
    let limits = Limits {
        position_min: to_si(position_min),
        position_max: to_si(position_max),
        velocity_max: either_limit(
            ("velocity_max_rad_s", &raw.velocity_max_rad_s),
            ("velocity_max_m_s", &raw.velocity_max_m_s),
        )?,
        acceleration_max: either(
            ("acceleration_max_rad_s2", &raw.acceleration_max_rad_s2),
            ("acceleration_max_m_s2", &raw.acceleration_max_m_s2),
        )?,
        jerk_max: either(
            ("jerk_max_rad_s3", &raw.jerk_max_rad_s3),
            ("jerk_max_m_s3", &raw.jerk_max_m_s3),
        )?,
        torque_max: either_limit(
            ("torque_max_nm", &raw.torque_max_nm),
            ("force_max_n", &raw.force_max_n),
        )?,
    };
    Ok(Joint {
        kind,
        alpha: Angle::from_degrees(text.check_finite("alpha_deg", &raw.alpha_deg)?),
        d_m: text.check_finite("d_m", &raw.d_m)?,
        theta: Angle::from_degrees(text.check_finite("theta_deg", &raw.theta_deg)?),
        r_m: text.check_finite("r_m", &raw.r_m)?,
        limits,
        drive_inertia: raw.drive_inertia,
    })
}

fn read_friction(
    text: FileText<'_>,
    raw: &Spanned<RawFriction>,
    joints: &[Spanned<RawJoint>],
    chain: &[Joint],
) -> Result<(FrictionTerms, Vec<JointFriction>), RobotError> {
    let line = text.line_of(raw);
    let &RawFriction { viscous, coulomb, offset, .. } = raw.get_ref();
    let &RawFriction { sign, quadratic, cubic, asymmetric, load, .. } = raw.get_ref();
    let &RawFriction { stribeck_rad_s, hysteresis_rad, .. } = raw.get_ref();
    let shared = RawJointFriction {
        sign,
        quadratic,
        cubic,
        asymmetric,
        load,
        stribeck_rad_s,
        hysteresis_rad,
    };
    if coulomb != sign.is_some() {
        return Err(RobotError::SignModel { line });
    }
    let merged = joints
        .iter()
        .zip(1..)
        .map(|(joint, number): (&Spanned<RawJoint>, usize)| {
            let (line, of, own) = match &joint.get_ref().friction {
                Some(own) => (
                    text.line_of(own),
                    format!("`friction` of joint {number}"),
                    own.get_ref().clone(),
                ),
                None => (line, "[friction]".to_owned(), RawJointFriction::default()),
            };
            let merged = own.with_defaults(&shared);
            let has_signs = merged.sign.is_some()
                || merged.load == Some(true)
                || merged.stribeck_rad_s.is_some()
                || merged.hysteresis_rad.is_some();
            if !coulomb && has_signs {
                return Err(RobotError::SignModel { line });
            }
            let of_joint =
                |own: JointFriction| own.check_presliding_distance(&chain[number - 1], number);
            JointFriction::try_from(merged).and_then(of_joint).map_err(|message| {
                let message = format!("{of}: {message}");
                RobotError::Format { line, message }
            })
        })
        .collect::<Result<_, _>>()?;
    Ok((FrictionTerms { viscous, coulomb, offset }, merged))
}

/// Reads the capsules of the base, link 0, or of the link of a joint. `next` is the joint on that
/// link.
fn read_capsules(
    text: FileText<'_>,
    link: usize,
    capsules: &[Spanned<RawCapsule>],
    next: Option<&Joint>,
) -> Result<Vec<Capsule>, RobotError> {
    capsules
        .iter()
        .map(|raw: &Spanned<RawCapsule>| {
            raw.get_ref().of_link(next).map_err(|message| {
                let owner = match link {
                    0 => "`base_capsules`".to_owned(),
                    joint => format!("`capsules` of joint {joint}"),
                };
                RobotError::Format {
                    line: text.line_of(raw),
                    message: format!("{owner}: {message}"),
                }
            })
        })
        .collect()
}

fn read_nominal(
    text: FileText<'_>,
    table: &ParameterTable,
    values: &BTreeMap<Spanned<String>, Spanned<f64>>,
) -> Result<NominalParameters, RobotError> {
    let mut by_column: Vec<Option<(String, f64)>> = vec![None; table.names().len()];
    // The values are read in the order of the file. If one parameter has two values, the second is
    // the error.
    let mut values: Vec<_> = values.iter().collect();
    values.sort_by_key(|(key, _)| key.span().start);
    for (key, value) in values {
        let name = key.get_ref();
        let line = text.line_of(key);
        let entry = table.find(name).and_then(|column| by_column.get_mut(column));
        let Some(entry) = entry else {
            let names = table.names().join(" ");
            return Err(RobotError::UnknownParameter {
                name: name.clone(),
                available: names,
                line,
            });
        };
        if entry.is_some() {
            return Err(RobotError::DuplicateParameter { name: name.clone(), line });
        }
        *entry = Some((name.clone(), text.check_finite(name, value)?));
    }
    let standard = by_column.iter().map(|entry| entry.as_ref().map_or(0.0, |(_, v)| *v)).collect();
    Ok(NominalParameters::new(by_column.into_iter().flatten().collect(), standard))
}
