//! Coulomb friction that grows with the load on a joint's gear.
//!
//! The load is static. It is the torque that a drive holds while the arm rests: gravity's torque
//! less those of springs and counterbalances. It was measured in this way (Bittencourt, Wernholt,
//! Sander-Tavallaey and Brogårdh, *An extended friction model to capture load and temperature
//! effects in robot joints*, 2010). It depends on positions alone. With the torque of the
//! acceleration in it, direct dynamics would have an algebraic loop.

use super::inertia::Wrench;
use super::model::{FrictionLoad, Model};
use super::pose::Pose;
use super::regressor_columns::RegressorColumns;
use super::vector::Vector3;
use super::workspace::Workspace;
use crate::MAX_JOINTS;
use crate::numeric::Scalar;

impl Model {
    /// Returns true if any friction grows with the load.
    pub fn feels_loads(&self) -> bool {
        self.load.is_some()
    }

    /// Returns the same model with the loads of an arm with these p standard parameters. The loads
    /// then do not depend on the parameters that a torque is computed with. So torques are linear
    /// in the parameters, as a regressor requires. Without these loads, the regressor's columns of
    /// friction that grows with the load are 0.
    #[must_use]
    pub fn with_load(mut self, parameters: Vec<f64>) -> Self {
        self.assert_parameter_count(&parameters);
        self.load = self.load.map(|_| FrictionLoad::Of(parameters));
        self
    }

    /// Returns the load on each joint in these poses \[N·m or N\] if friction grows with it. The
    /// load is computed from `parameters`, unless the model has a fixed arm.
    #[inline(always)]
    pub(super) fn loads<T: Scalar>(
        &self,
        poses: &[Pose<T>; MAX_JOINTS],
        parameters: Option<&[T]>,
        q: &[T],
    ) -> Option<[T; MAX_JOINTS]> {
        match (self.load.as_ref()?, parameters) {
            (FrictionLoad::Of(own), _) => Some(self.loads_of(poses, |k| T::constant(own[k]), q)),
            (FrictionLoad::OfParameters, Some(own)) => Some(self.loads_of(poses, |k| own[k], q)),
            (FrictionLoad::OfParameters, None) => None,
        }
    }

    #[inline(always)]
    fn loads_of<T: Scalar>(
        &self,
        poses: &[Pose<T>; MAX_JOINTS],
        parameter: impl Fn(usize) -> T,
        q: &[T],
    ) -> [T; MAX_JOINTS] {
        let mut loads = [T::zero(); MAX_JOINTS];
        let mut lifted = [Vector3::constant(self.gravity_m_s2.map(|g| -g)); MAX_JOINTS];
        let mut before = lifted[0];
        for (lifted, pose) in lifted.iter_mut().zip(poses).take(self.joints()) {
            before = pose.to_link(before);
            *lifted = before;
        }
        let mut transferred = Wrench::zero();
        for (j, joint) in self.chain.iter().enumerate().rev() {
            let [mx, my, mz, mass] = [6, 7, 8, 9].map(|k| parameter(self.first_columns[j] + k));
            let weight = Wrench {
                force: lifted[j].scale(mass),
                moment: Vector3::new(mx, my, mz).cross(lifted[j]),
            };
            let total = weight.combined(transferred);
            loads[j] = total.generalised_force(joint.kind);
            transferred = total.to_previous(&poses[j]);
        }
        self.take_off_known(q, &mut loads);
        loads
    }

    /// Adds friction that grows with the load. The poses are in the workspace.
    #[inline(always)]
    pub(super) fn add_load_friction<T: Scalar>(
        &self,
        ws: &Workspace<T>,
        parameters: &[T],
        [q, dq]: [&[T]; 2],
        torques: &mut [T],
    ) {
        let Some(loads) = self.loads(&ws.poses, Some(parameters), q) else { return };
        self.drives.for_each_load_friction(dq, &loads, |row, column, c| {
            torques[row] += parameters[column] * c;
        });
    }

    /// Adds the derivatives of this friction by positions and speeds (n × n each, row-major).
    pub(super) fn add_load_partials(
        &self,
        ws: &Workspace<f64>,
        parameters: &[f64],
        [q, dq]: [&[f64]; 2],
        by_position: &mut [f64],
        by_velocity: &mut [f64],
    ) {
        let Some(loads) = self.loads(&ws.poses, Some(parameters), q) else { return };
        let n = self.joints();
        let (still, mut unused) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS * MAX_JOINTS]);
        let (mut slopes, unused) = ([0.0; MAX_JOINTS * MAX_JOINTS], &mut unused[..n * n]);
        let load_parameters = match &self.load {
            Some(FrictionLoad::Of(own)) => own,
            _ => parameters,
        };
        let at_rest = [q, &still[..n], &still[..n]];
        self.rigid_partials(ws, load_parameters, at_rest, &mut slopes[..n * n], unused);
        self.drives.for_each_load_partial(parameters, dq, &loads, |joint, by_load, by_speed| {
            by_velocity[joint * n + joint] += by_speed;
            let row = joint * n..(joint + 1) * n;
            for (entry, slope) in by_position[row.clone()].iter_mut().zip(&slopes[row]) {
                *entry += by_load * slope;
            }
        });
    }

    /// Adds to a regressor of these columns (a matrix) the effect of the parameters on their own
    /// load.
    pub(super) fn add_load_sensitivities(
        &self,
        ws: &mut Workspace<f64>,
        columns: &RegressorColumns,
        parameters: &[f64],
        [q, dq]: [&[f64]; 2],
        regressor: &mut [f64],
    ) {
        let Some(FrictionLoad::OfParameters) = self.load else { return };
        let Some(loads) = self.loads(&ws.poses, Some(parameters), q) else { return };
        let (n, width, still) = (self.joints(), columns.width(), [0.0; MAX_JOINTS]);
        let mut at_rest = vec![0.0; n * width];
        self.regressor_of_poses(ws, columns, None, &still[..n], &still[..n], &mut at_rest);
        // Offsets are not part of the load.
        columns.drives.for_each_entry(|row, column| at_rest[row * width + column] = 0.0);
        self.drives.for_each_load_partial(parameters, dq, &loads, |joint, by_load, _| {
            let row = joint * width..(joint + 1) * width;
            for (entry, rate) in regressor[row.clone()].iter_mut().zip(&at_rest[row]) {
                *entry += by_load * rate;
            }
        });
    }
}
