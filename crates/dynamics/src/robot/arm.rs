//! An arm, as read from its file.

use super::capsule::Capsule;
use super::friction::{FrictionTerms, JointFriction, SignModel};
use super::index::JointIndex;
use super::joint::{Joint, Limits};
use super::known_torque::KnownTorque;
use super::link_frame::{NamedFrame, NoSuchFrame};
use super::nominal::NominalParameters;
use super::parameter_kind::ParameterKind;
use super::parameters::{Parameter, ParameterTable};
use super::recorded_torque::{RecordedTorque, TorqueTerm};
use super::transmission::Transmission;

/// A serial arm of 1 to [`MAX_JOINTS`](crate::MAX_JOINTS) revolute and prismatic joints, as read
/// from its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    pub(super) name: String,
    pub(super) gravity_m_s2: [f64; 3],
    pub(super) joints: Vec<Joint>,
    /// One entry per joint; `None` without a name.
    pub(super) joint_names: Vec<Option<String>>,
    /// Names of the links, one entry per joint; empty without names.
    pub(super) link_names: Vec<String>,
    /// Named frames on the last link, that of the link itself first; empty for a robot file.
    pub(super) frames: Vec<NamedFrame>,
    pub(super) transmission: Transmission,
    pub(super) friction: FrictionTerms,
    /// Friction of each joint.
    pub(super) own_friction: Vec<JointFriction>,
    /// One entry per joint; `None` without a known torque.
    pub(super) known_torques: Vec<Option<KnownTorque>>,
    /// Capsules of the base and each link; all are empty if the file has none.
    pub(super) capsules: Vec<Vec<Capsule>>,
    pub(super) parameters: ParameterTable,
    pub(super) nominal: Option<NominalParameters>,
    /// Content of the torques that are recorded of this robot.
    pub(super) recorded_torque: RecordedTorque,
}

impl Robot {
    /// Returns the same robot with another law for the sign of Coulomb friction in every joint.
    #[must_use]
    pub fn with_sign_model(mut self, sign_model: SignModel) -> Self {
        for joint in &mut self.own_friction {
            joint.sign = sign_model;
        }
        self
    }

    /// Returns the same robot with other friction in its joints, one entry each. Nominal values
    /// stay. Those of new terms are 0, and those of removed terms are gone.
    #[must_use]
    pub fn with_friction(mut self, friction: Vec<JointFriction>) -> Self {
        assert_eq!(friction.len(), self.joints(), "one entry per joint");
        self.own_friction = friction;
        self.with_new_parameter_table()
    }

    /// Returns the same robot with another transmission. Nominal values stay. Those of new
    /// parameters are 0, and those of removed parameters are gone.
    #[must_use]
    pub fn with_transmission(mut self, transmission: Transmission) -> Self {
        self.transmission = transmission;
        self.with_new_parameter_table()
    }

    /// Returns the same robot with the inertia of a joint's drive as a parameter of the model. Its
    /// nominal value, if there are any, is 0.
    #[must_use]
    pub fn with_drive_inertia(mut self, joint: JointIndex) -> Self {
        self.joints[joint].drive_inertia = true;
        self.with_new_parameter_table()
    }

    fn with_new_parameter_table(mut self) -> Self {
        self.parameters = ParameterTable::new(
            &self.joints,
            self.friction,
            &self.own_friction,
            &self.transmission,
        );
        self.nominal = self.nominal.map(|nominal| nominal.for_table(&self.parameters));
        self
    }

    /// Returns the same robot with recorded torques of these joints alone. The equations of the
    /// other joints cannot be used, but their motion still acts on these joints.
    #[must_use]
    pub fn with_torque_joints(mut self, joints: &[JointIndex]) -> Self {
        let all = (0..self.joints()).map(JointIndex::new);
        self.recorded_torque.missing_joints = all.filter(|joint| !joints.contains(joint)).collect();
        self
    }

    /// Returns the same robot with recorded torques that lack these terms. The model of such
    /// torques has no gravity or no friction; offsets stay.
    #[must_use]
    pub fn without_torque_terms(mut self, terms: &[TorqueTerm]) -> Self {
        let excluded = &mut self.recorded_torque.excluded_terms;
        excluded.extend(terms);
        excluded.sort_unstable();
        excluded.dedup();
        if terms.contains(&TorqueTerm::Gravity) {
            let configured = core::mem::take(&mut self.gravity_m_s2);
            self.recorded_torque.configured_gravity_m_s2.get_or_insert(configured);
        }
        if terms.contains(&TorqueTerm::Friction) {
            self.friction = FrictionTerms { viscous: false, coulomb: false, ..self.friction };
            let friction = self.own_friction.clone().into_iter();
            let plain = friction.map(|own| JointFriction { laws: Vec::new(), ..own }).collect();
            return self.with_friction(plain);
        }
        self
    }

    /// Returns the same robot with a recorded torque of every joint, which contains gravity.
    /// Friction terms that were removed do not come back.
    #[must_use]
    pub fn with_complete_torque(mut self) -> Self {
        let recorded = core::mem::take(&mut self.recorded_torque);
        self.gravity_m_s2 = recorded.configured_gravity_m_s2.unwrap_or(self.gravity_m_s2);
        self
    }

    /// Returns the content of the recorded torques.
    pub fn recorded_torque(&self) -> &RecordedTorque {
        &self.recorded_torque
    }

    /// Returns the same robot with each nominal parameter, if it has any, multiplied by
    /// `factor(name)`. The names are passed in the order of [`NominalParameters::given_values`].
    #[must_use]
    pub fn with_scaled_nominal(mut self, factor: impl FnMut(&str) -> f64) -> Self {
        let table = &self.parameters;
        self.nominal = self.nominal.map(|n| n.scaled(|name| table.find(name), factor));
        self
    }

    /// The name that results carry.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of joints, which is also the number of motors.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// The joints from base to tip.
    pub fn chain(&self) -> &[Joint] {
        &self.joints
    }

    /// Returns the name of a joint, if the file has one.
    pub fn joint_name(&self, joint: JointIndex) -> Option<&str> {
        self.joint_names.get(joint.position())?.as_deref()
    }

    /// Returns the number of a joint, counted from 1, and its name if it has one:
    /// `3 (elbow_joint)`.
    pub fn joint_label(&self, joint: JointIndex) -> String {
        match self.joint_name(joint) {
            Some(name) => format!("{joint} ({name})"),
            None => joint.to_string(),
        }
    }

    /// Returns the same robot with these frames on its last link. The first is that of the link
    /// which the last joint moves.
    #[must_use]
    pub fn with_frames(mut self, frames: Vec<NamedFrame>) -> Self {
        self.frames = frames;
        self
    }

    /// Returns the same robot with names of its links, one entry per joint.
    #[must_use]
    pub fn with_link_names(mut self, names: Vec<String>) -> Self {
        self.link_names = names;
        self
    }

    /// Returns the name of the link that a joint moves, if its file has one.
    pub fn link_name(&self, joint: JointIndex) -> Option<&str> {
        self.link_names.get(joint.position()).map(String::as_str)
    }

    /// Returns the frame of the last link, with which the model computes. For a robot file it is
    /// the frame of the file.
    pub fn model_frame(&self) -> NamedFrame {
        NamedFrame::identity(format!("link_{}", self.joints()))
    }

    /// Returns the frame of this name on the last link. Without a name, it is that of the URDF's
    /// link which the last joint moves, or the model's frame for a robot file.
    ///
    /// # Errors
    /// [`NoSuchFrame`].
    pub fn load_frame(&self, name: Option<&str>) -> Result<NamedFrame, NoSuchFrame> {
        let own = [self.model_frame()];
        let frames = if self.frames.is_empty() { &own } else { &self.frames[..] };
        let is_named = |frame: &&NamedFrame| name.is_none_or(|name| frame.name == name);
        frames.iter().find(is_named).cloned().ok_or_else(|| NoSuchFrame {
            name: name.unwrap_or_default().to_owned(),
            available: frames.iter().map(|frame| frame.name.clone()).collect(),
        })
    }

    /// Describes a parameter with the name of its joint or link:
    /// ``Coulomb friction of joint 3, `elbow_joint` ``. `None` without such a parameter or name.
    pub fn parameter_description(&self, parameter: &str) -> Option<String> {
        let column = self.parameters.find(parameter)?;
        let Parameter { kind, joint } = *self.parameters.parameters().get(column)?;
        let quantity = kind.quantity();
        if ParameterKind::LINK.contains(&kind) {
            let axes = if kind == ParameterKind::M { "" } else { kind.symbol() };
            let axes = axes.trim_start_matches('m');
            let space = if axes.is_empty() { "" } else { " " };
            let name = self.link_name(joint)?;
            return Some(format!("{quantity}{space}{axes} of link {joint}, `{name}`"));
        }
        let name = self.joint_name(joint)?;
        let owner = match kind {
            ParameterKind::FvMotor | ParameterKind::FcMotor => "motor",
            _ => "joint",
        };
        Some(format!("{quantity} of {owner} {joint}, `{name}`"))
    }

    /// Returns the name of the joint of a parameter, if there is one.
    pub fn parameter_joint_name(&self, parameter: &str) -> Option<&str> {
        let column = self.parameters.find(parameter)?;
        self.joint_name(self.parameters.parameters().get(column)?.joint)
    }

    /// Acceleration of gravity in the base frame \[m/s²\]; (0, 0, −9.81) for an arm on the floor.
    pub fn gravity_m_s2(&self) -> [f64; 3] {
        self.gravity_m_s2
    }

    /// Gear ratios and couplings.
    pub fn transmission(&self) -> &Transmission {
        &self.transmission
    }

    /// Returns the limits of each joint, from base to tip.
    pub fn limits(&self) -> impl ExactSizeIterator<Item = &Limits> {
        self.joints.iter().map(|joint| &joint.limits)
    }

    /// Returns which of the usual friction terms the joints have.
    pub fn friction(&self) -> FrictionTerms {
        self.friction
    }

    /// Returns the further friction of each joint.
    pub fn own_friction(&self) -> &[JointFriction] {
        &self.own_friction
    }

    /// Returns the friction of a joint, counted from 0, as a line of its `[[joint]]`. It assumes
    /// that `[friction]` of the file has no further law for all joints.
    pub fn own_friction_toml(&self, joint: usize) -> String {
        let JointFriction { sign, laws } = &self.own_friction[joint];
        let mut parts: Vec<String> = laws.iter().map(ToString::to_string).collect();
        if self.friction.coulomb {
            parts.push(format!("sign = {sign}"));
        }
        format!("friction = {{ {} }}", parts.join(", "))
    }

    /// The law for the sign of Coulomb friction of a joint, counted from 0, and of its motor.
    pub fn sign_model(&self, joint: usize) -> SignModel {
        self.own_friction[joint].sign
    }

    /// Returns the known torque on each joint in addition to gravity and drive, if one is
    /// configured.
    pub fn known_torques(&self) -> &[Option<KnownTorque>] {
        &self.known_torques
    }

    /// The shapes that the file states: of the base, and of each link.
    pub fn capsules(&self) -> &[Vec<Capsule>] {
        &self.capsules
    }

    /// The standard parameters of the model.
    pub fn parameters(&self) -> &ParameterTable {
        &self.parameters
    }

    /// The parameter values that the file states, if any.
    pub fn nominal(&self) -> Option<&NominalParameters> {
        self.nominal.as_ref()
    }
}
