//! The simulated loop and its creation.

use crate::MAX_JOINTS;
use crate::control::{
    CommandVariation, ContinuousController, ControlTiming, ControllerConfig, SampledController,
};
use crate::dynamics::{Model, Workspace};
use crate::robot::{Hysteresis, Robot, SignModel, Transmission};
use crate::trajectory::Reference;

use super::checked::check_length;
use super::disturbance::DisturbanceTorque;
use super::error::{SetupError, SimulationError};
use super::hold::CommandHold;
use super::hysteresis::SlipElements;
use super::integrator::RungeKuttaStages;
use super::measurement::Encoders;
use super::noise::Noises;
use super::plant::Plant;
use super::reference_point::ReferencePoint;
use super::white_noise::WhiteNoise;
use super::{InitialState, SimulationConfig, StepOutput, Unmodelled};

/// An arm under control, simulated.
pub struct ClosedLoop<R> {
    pub(super) plant: Plant<R>,
    pub(super) sampled_control: Option<(SampledController, CommandHold<[f64; MAX_JOINTS]>)>,
    /// The same for the derivatives of the commands, if they are requested.
    pub(super) command_variation: Option<(CommandVariation, CommandHold<Vec<f64>>)>,
    pub(super) encoders: Encoders,
    pub(super) disturbance: DisturbanceTorque,
    pub(super) torque_measurement: WhiteNoise,
    /// Ratio of logged to commanded torque of each motor.
    pub(super) torque_gain: Option<Vec<f64>>,
    pub(super) period_s: f64,
    pub(super) controller: ControllerConfig,
    pub(super) config: SimulationConfig,
    initial_state: InitialState,
    /// Memory of the integration; it contains the rate of the state just after the sample of
    /// `output`.
    pub(super) stages: RungeKuttaStages,
    /// The state at the sample of `output`.
    pub(super) state: Vec<f64>,
    pub(super) output: StepOutput,
    pub(super) is_started: bool,
    /// The error that ended the simulation.
    pub(super) failure: Option<SimulationError>,
    /// Derivatives of the command of the newest sample.
    pub(super) command_derivatives: Vec<f64>,
}

impl<R: Reference> ClosedLoop<R> {
    /// Creates a loop of `robot` with these standard parameters (in the order of
    /// [`Model::parameter_names`]) under `controller`, following `reference`, at time 0.
    ///
    /// # Errors
    /// [`SetupError`] names what does not fit the arm or makes no sense.
    pub fn new(
        robot: &Robot,
        parameters: &[f64],
        controller: &ControllerConfig,
        reference: R,
        config: &SimulationConfig,
        initial: InitialState,
    ) -> Result<Self, SetupError> {
        let joints = robot.joints();
        check_lengths(controller, &reference, config, &initial, joints)?;
        let model = Model::new(robot);
        let (sampled, continuous) = create_controllers(controller)?;
        let period_s = controller.timing.sample_period_s();
        let noises = Noises::new(config.noise.as_ref(), period_s);
        let Unmodelled {
            stribeck,
            coulomb_width_rad_s,
            load_friction,
            hysteresis,
            flexible,
            cogging,
            torque_gain,
        } = config.unmodelled.clone().unwrap_or_default();
        let sign = coulomb_width_rad_s.map(|width_rad_s| SignModel::Tanh { width_rad_s });
        let signs = (0..joints).map(|joint| sign.unwrap_or_else(|| robot.sign_model(joint)));
        let load_friction = load_friction.unwrap_or_default().into_iter().zip(signs).collect();
        let model = match sign {
            Some(sign) => model.with_sign_model(sign),
            None => model,
        };
        let flexible = flexible.unwrap_or_default();
        let plant = Plant {
            workspace: Workspace::new(),
            parameters: vec![0.0; model.parameter_names().len()],
            model,
            reference,
            continuous,
            command: [0.0; MAX_JOINTS],
            disturbance: [0.0; MAX_JOINTS],
            unmodelled_stribeck: stribeck.unwrap_or_default(),
            load_friction,
            unmodelled_hysteresis: SlipElements::new(&hysteresis.unwrap_or_default()),
            hysteresis: Hysteresis::from_robot(robot),
            cogging: cogging.unwrap_or_default(),
            transmission: robot.transmission().clone(),
            flexible_inertia: flexible.iter().map(|mode| mode.inertia_kg_m2).collect(),
            flexible,
            torque: [0.0; MAX_JOINTS],
            divergence: config.divergence,
            joints,
            variation: None,
        };
        let states = plant.state_count();
        let mut closed_loop = Self {
            plant,
            sampled_control: sampled,
            command_variation: None,
            encoders: Encoders::new(
                robot.transmission().clone(),
                config.encoder_counts_per_turn.as_deref(),
                noises.motor_position,
            ),
            disturbance: noises.disturbance_torque,
            torque_measurement: noises.torque_measurement,
            torque_gain,
            period_s,
            controller: controller.clone(),
            config: config.clone(),
            initial_state: initial,
            stages: RungeKuttaStages::new(states),
            state: vec![0.0; states],
            output: StepOutput::default(),
            is_started: false,
            failure: None,
            command_derivatives: Vec::new(),
        };
        closed_loop.restart(parameters)?;
        Ok(closed_loop)
    }

    /// Returns to time 0 with other parameters and the same noise.
    ///
    /// # Errors
    /// [`SetupError::Length`] when there is not one value per standard parameter, and
    /// [`SetupError::BadValue`] when one is not finite; the loop is unchanged then. And
    /// [`SetupError::FlexibleInertia`].
    pub fn restart(&mut self, parameters: &[f64]) -> Result<(), SetupError> {
        check_length("parameters", self.plant.parameters.len(), parameters.len())?;
        if let Some(value) = parameters.iter().find(|value| !value.is_finite()) {
            let (what, expected) = ("parameters", "finite");
            return Err(SetupError::BadValue { what, value: *value, expected });
        }
        self.plant.parameters.copy_from_slice(parameters);
        if let Some(variation) = &mut self.plant.variation {
            variation.restart();
        }
        if let Some((controller, hold)) = &mut self.command_variation {
            controller.reset();
            hold.clear();
        }
        self.plant.command = [0.0; MAX_JOINTS];
        self.plant.disturbance = [0.0; MAX_JOINTS];
        if let Some((controller, hold)) = &mut self.sampled_control {
            controller.reset();
            hold.clear();
        }
        self.encoders.restart();
        self.disturbance.restart();
        self.torque_measurement.restart();
        let n = self.plant.joints;
        let (q, rest) = self.state.split_at_mut(n);
        let (dq, rest) = rest.split_at_mut(n);
        let (integrals, rest) = rest.split_at_mut(self.plant.integral_count());
        let modes = self.plant.flexible.len();
        let (flexible, derivatives) = rest.split_at_mut(2 * modes);
        match &self.initial_state {
            InitialState::OnReference => {
                let point = ReferencePoint::from_reference(&self.plant.reference, 0.0);
                q.copy_from_slice(&point.position[..n]);
                dq.copy_from_slice(&point.velocity()[..n]);
            }
            InitialState::At { position_rad, velocity_rad_s } => {
                q.copy_from_slice(position_rad);
                dq.copy_from_slice(velocity_rad_s);
            }
        }
        integrals.fill(0.0);
        self.plant.unmodelled_hysteresis.state.restart_at(q);
        if let Some(own) = &mut self.plant.hysteresis {
            own.restart_at(q);
        }
        // The springs of flexible joints start without load.
        let (q_f, dq_f) = flexible.split_at_mut(modes);
        q_f.copy_from_slice(&q[..modes]);
        dq_f.copy_from_slice(&dq[..modes]);
        // The start does not depend on the parameters.
        derivatives.fill(0.0);
        self.check_flexible()?;
        self.output = StepOutput::default();
        self.is_started = false;
        self.failure = None;
        Ok(())
    }

    /// Checks that the mass matrix less the inertias of the flexible parts is positive definite at
    /// the start.
    fn check_flexible(&mut self) -> Result<(), SetupError> {
        let plant = &mut self.plant;
        if plant.flexible.is_empty() {
            return Ok(());
        }
        let (q, [still, mut unused]) = (&self.state[..plant.joints], [[0.0; MAX_JOINTS]; 2]);
        let still = &still[..plant.joints];
        let (parameters, less) = (&plant.parameters, &plant.flexible_inertia);
        let (workspace, unused) = (&mut plant.workspace, &mut unused[..plant.joints]);
        plant
            .model
            .direct_dynamics_without(workspace, parameters, less, q, still, still, unused)
            .map_err(|error| SetupError::FlexibleInertia { joint: error.joint })
    }

    /// Returns the period of the samples \[s\].
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Returns the simulated model.
    pub fn model(&self) -> &Model {
        &self.plant.model
    }

    /// Gear ratios and couplings of the arm.
    pub fn transmission(&self) -> &Transmission {
        self.encoders.transmission()
    }
}

/// Checks that controller, reference, configuration and start fit the joints.
fn check_lengths<R: Reference>(
    controller: &ControllerConfig,
    reference: &R,
    config: &SimulationConfig,
    initial: &InitialState,
    joints: usize,
) -> Result<(), SetupError> {
    config.validate(joints)?;
    check_length("controller.joints", joints, controller.joints.len())?;
    check_length("reference", joints, reference.joints())?;
    if let InitialState::At { position_rad, velocity_rad_s } = initial {
        check_length("initial position", joints, position_rad.len())?;
        check_length("initial velocity", joints, velocity_rad_s.len())?;
    }
    Ok(())
}

/// A sampled controller with the hold of its commands.
type SampledWithHold = (SampledController, CommandHold<[f64; MAX_JOINTS]>);

/// Creates the sampled controller with its hold, or the continuous one.
fn create_controllers(
    controller: &ControllerConfig,
) -> Result<(Option<SampledWithHold>, Option<ContinuousController>), SetupError> {
    Ok(match controller.timing {
        ControlTiming::Sampled { .. } => {
            let controller = SampledController::new(controller)?;
            let (delay_s, period_s) = (controller.delay_s(), controller.period_s());
            let hold = CommandHold::new(delay_s, period_s, [0.0; MAX_JOINTS]);
            (Some((controller, hold)), None)
        }
        ControlTiming::Continuous { .. } => (None, Some(ContinuousController::new(controller)?)),
    })
}
