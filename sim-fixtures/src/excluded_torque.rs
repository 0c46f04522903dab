//! Terms that a controller subtracts from the torques that it reports.

use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{Robot, TorqueTerm, Transmission};
use didim_dynamics::simulation::{Record, StepOutput};

/// Torque of the terms that the reported torques lack: the difference of two models of the arm.
/// Friction that depends on earlier motion (hysteresis) stays in the reported torques.
pub struct ExcludedTorque {
    complete: (Model, Vec<f64>),
    reported: (Model, Vec<f64>),
    workspace: Workspace<f64>,
    transmission: Transmission,
}

impl ExcludedTorque {
    /// Creates the torque of these terms, for an arm with these standard parameters. `None` without
    /// a term.
    pub fn new(robot: &Robot, parameters: &[f64], terms: &[TorqueTerm]) -> Option<Self> {
        if terms.is_empty() {
            return None;
        }
        let reporting = robot.clone().without_torque_terms(terms);
        let column = |name: &String| robot.parameters().find(name);
        let names = reporting.parameters().names().iter();
        let of_reported = names.filter_map(|name| parameters.get(column(name)?).copied());
        Some(Self {
            complete: (Model::new(robot), parameters.to_vec()),
            reported: (Model::new(&reporting), of_reported.collect()),
            workspace: Workspace::new(),
            transmission: robot.transmission().clone(),
        })
    }

    /// Returns the excluded torque of each motor in a state of the joints \[N·m or N\].
    pub fn motor_torque(&mut self, position: &[f64], velocity: &[f64]) -> [f64; MAX_JOINTS] {
        let (n, rest) = (position.len(), [0.0; MAX_JOINTS]);
        let [complete, reported] = [&self.complete, &self.reported].map(|(model, parameters)| {
            let (mut torque, workspace) = (rest, &mut self.workspace);
            let at = (position, velocity, &rest[..n]);
            model.inverse_dynamics(workspace, parameters, at.0, at.1, at.2, &mut torque[..n]);
            torque
        });
        let joint: [f64; MAX_JOINTS] = core::array::from_fn(|j| complete[j] - reported[j]);
        let mut motor = rest;
        self.transmission.motor_torque(&joint[..n], &mut motor[..n]);
        motor
    }

    /// Subtracts the excluded torque from the motor torques of a sample.
    pub fn subtract_from_sample(&mut self, sample: &mut StepOutput) {
        let n = self.complete.0.joints();
        let state = (&sample.true_position_rad[..n], &sample.true_velocity_rad_s[..n]);
        let excluded = self.motor_torque(state.0, state.1);
        for (torque, excluded) in sample.motor_torque_nm.iter_mut().zip(excluded) {
            *torque -= excluded;
        }
    }

    /// Subtracts the excluded torque from the motor torques of a record.
    pub fn subtract_from_record(&mut self, record: &mut Record) {
        for row in 0..record.samples() {
            let state = [&record.true_position_rad, &record.true_velocity_rad_s]
                .map(|of| of.row(row).iter().copied().collect::<Vec<f64>>());
            let excluded = self.motor_torque(&state[0], &state[1]);
            for (torque, excluded) in record.motor_torque_nm.row_mut(row).iter_mut().zip(excluded) {
                *torque -= excluded;
            }
        }
    }
}
