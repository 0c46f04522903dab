//! Value of a motion as a function of its coordinates, and the start of the search for a motion.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::barrier::Barrier;
use super::basis::{Basis, CoordinateUnits, Motion, column};
use super::bounds::{Bound, Bounds};
use super::error::ExcitationError;
use super::information::Information;
use super::limit_kind::LimitKind;
use super::limits::DesignLimits;
use super::objective::Objective;
use super::random::uniform;
use super::task::Task;
use didim_dynamics::robot::{JointIndex, SignModel};

/// Width of the friction sign function, as a share of the smallest speed limit. A narrower function
/// jumps between two samples and has no useful gradient.
const SIGN_WIDTH: f64 = 0.1;
/// Number of postures tried if the arm cannot rest in the middle of its ranges, and their largest
/// distance from there.
const REST_POSTURES: usize = 200;

/// Value of the motions of a task.
pub(super) struct Search<'a> {
    pub(super) basis: Basis,
    moving_joints: &'a [bool],
    has_first_posture: bool,
    bounds: &'a Bounds,
    barrier: Barrier<'a>,
    information: Information,
    objective: Objective,
}

impl<'a> Search<'a> {
    pub(super) fn new(task: &'a Task) -> Self {
        let Task { model, bounds, duration_s, first_posture, .. } = task;
        let has_first_posture = first_posture.is_some();
        let units = units(bounds, model.joints(), first_posture.as_deref());
        let slowest = units.iter().map(|unit| unit.speed_unit).fold(f64::INFINITY, f64::min);
        let basis = Basis::new(*duration_s, units, has_first_posture);
        let width_rad_s = SIGN_WIDTH * slowest;
        let smooth = model.clone().with_sign_model(SignModel::Tanh { width_rad_s });
        let rate_hz = basis.samples() as f64 / duration_s;
        let (information, objective) = task.information(smooth, rate_hz);
        let (barrier, moving) = (Barrier::new(model, bounds), task.moving_joints.as_slice());
        Self {
            basis,
            moving_joints: moving,
            has_first_posture,
            bounds,
            barrier,
            information,
            objective,
        }
    }

    /// Returns the value of the motion with these coordinates, plus `weight` times the barrier of
    /// its limits. Fills the gradient. Returns `None` outside a limit, or if the motion leaves a
    /// parameter unidentified.
    pub(super) fn evaluate(&mut self, weight: f64, x: &[f64], gradient: &mut [f64]) -> Option<f64> {
        let motion = self.basis.motion(x);
        let mut by_motion: Motion = motion.each_ref().map(|of| of * 0.0);
        let walls = self.barrier.add_share(weight, &motion, &mut by_motion)?;
        let (value, slope) =
            self.objective.evaluate(&self.information.weighted_regressor(&motion))?;
        self.information.add_gradient(&slope, &motion, &mut by_motion);
        self.basis.gradient(&by_motion, gradient);
        self.hold_resting_joints(gradient);
        Some(value + walls)
    }

    /// Sets the coordinates of joints at rest to 0, except their positions, and the positions if
    /// the first posture is given. The search does not change them.
    fn hold_resting_joints(&self, x: &mut [f64]) {
        let joints = self.moving_joints.len();
        if self.has_first_posture {
            x.iter_mut().take(joints).for_each(|x| *x = 0.0);
        }
        for (k, x) in x.iter_mut().enumerate().skip(joints) {
            if !self.moving_joints[k % joints] {
                *x = 0.0;
            }
        }
    }

    /// Returns the limit with the largest used share along a motion, and this share. The limit is
    /// `None` if it is a gap.
    pub(super) fn largest_share(&mut self, x: &[f64]) -> (Option<usize>, f64) {
        let motion = self.basis.motion(x);
        let torques = self.barrier.torques_along(&motion);
        self.barrier.largest_share(&motion, torques.as_ref())
    }

    /// Returns the coordinates of a random motion well inside the limits.
    pub(super) fn start(&mut self, seed: u64) -> Result<Vec<f64>, ExcitationError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (posture, share) = self.rest_coordinates(seed)?;
        let enough = DesignLimits::DEFAULT.start_limit_share.max(0.5 * (1.0 + share));
        let mut x = posture.clone();
        for x in &mut x {
            *x += uniform(&mut random);
        }
        self.hold_resting_joints(&mut x);
        while self.largest_share(&x).1 > enough {
            x.iter_mut().zip(&posture).for_each(|(x, rest)| *x = rest + 0.9 * (*x - rest));
        }
        Ok(x)
    }

    /// Returns a posture where the arm can rest \[rad or m\].
    pub(super) fn rest_posture(&mut self) -> Result<Vec<f64>, ExcitationError> {
        let (x, _) = self.rest_coordinates(1)?;
        Ok(self.basis.series(&x).joints.iter().map(|of| of.mean).collect())
    }

    /// Returns the coordinates of a posture where the arm can rest, and the largest used share of a
    /// limit there. The posture is the first one of the task, or else the middle of the ranges. If
    /// that is not permitted, it is the first random posture well inside the limits, or the best.
    fn rest_coordinates(&mut self, seed: u64) -> Result<(Vec<f64>, f64), ExcitationError> {
        let mut x = vec![0.0; self.basis.coordinate_count()];
        let (place, share) = self.largest_share(&x);
        if share < 1.0 {
            return Ok((x, share));
        }
        let middle = self.basis.motion(&x);
        if self.has_first_posture {
            return Err(self.rest_error(place, share, &middle));
        }
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut best = (x.clone(), f64::INFINITY);
        for _ in 0..REST_POSTURES {
            for mean in x.iter_mut().take(self.basis.joints()) {
                *mean = DesignLimits::DEFAULT.rest_range_share * uniform(&mut random);
            }
            let share = self.largest_share(&x).1;
            if share < DesignLimits::DEFAULT.start_limit_share {
                return Ok((x, share));
            }
            if share < best.1 {
                best = (x.clone(), share);
            }
        }
        if best.1 < DesignLimits::DEFAULT.max_rest_share {
            return Ok(best);
        }
        Err(self.rest_error(place, share, &middle))
    }

    /// Returns the error on a limit (`None` for a gap) of which a posture uses this share.
    fn rest_error(&self, place: Option<usize>, share: f64, posture: &Motion) -> ExcitationError {
        let is_first = self.has_first_posture;
        let Some(place) = place else {
            let q = column(&posture[0], 0);
            let shapes = self.bounds.shapes.as_ref();
            let nearest = shapes.and_then(|of| of.narrowest_gap(self.barrier.model(), q));
            return match (nearest, is_first) {
                (Some(nearest), true) => ExcitationError::FirstPostureTouches { nearest },
                (nearest, _) => ExcitationError::Touching { nearest },
            };
        };
        let Bound { joint, kind, .. } = self.bounds.limits[place];
        let joint = JointIndex::new(joint);
        match (kind, is_first) {
            (_, true) => ExcitationError::FirstPosture { joint, kind, share },
            (LimitKind::Torque, false) => ExcitationError::CannotHold { joint, share },
            (_, false) => ExcitationError::Middle { joint, kind, share },
        }
    }
}

/// Returns the units of the coordinates: half the position range for positions, and the largest
/// speed for speeds.
fn units(bounds: &Bounds, joints: usize, first: Option<&[f64]>) -> Vec<CoordinateUnits> {
    (0..joints)
        .map(|joint: usize| {
            let bound_of = |kind| bounds.joint_bound(kind, joint);
            let (position, speed) = (bound_of(LimitKind::Position), bound_of(LimitKind::Speed));
            CoordinateUnits {
                position: first
                    .and_then(|of| of.get(joint).copied())
                    .unwrap_or_else(|| position.map_or(0.0, |of| of.middle)),
                position_unit: position.map_or(1.0, |of| of.half_range),
                speed_unit: speed.map_or(1.0, |of| of.half_range),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::excitation::bounds::Margins;
    use crate::excitation::descent::descend;
    use crate::excitation::shapes::Shapes;
    use crate::excitation::solid::Wall;
    use crate::excitation::task::{DesignObjective, Noise};
    use didim_dynamics::dynamics::{BaseParameters, Model};
    use didim_dynamics::robot::Robot;

    /// Returns the task of an arm with a coupled wrist, nominal parameters and a spring.
    fn task(aim: DesignObjective) -> Task {
        let file = include_str!("../../../../config/robots/tx40.toml").replacen(
            "torque_max_nm = 131.84",
            "torque_max_nm = 131.84\nknown_torque = { position_deg = [-200, 10, 200], torque_nm = \
            [-20, 3, 28] }",
            1,
        );
        // Adds links that come near each other, and a box around them.
        let file = file.replace(
            "drive_inertia = true",
            "drive_inertia = true\ncapsules = [{ radius_m = 0.06 }]",
        );
        let robot = Robot::from_toml(&file).unwrap();
        let shapes = Shapes::new(&robot, &Wall::sides([[-0.6, -0.6, -0.1], [0.6, 0.6, 1.0]]));
        let nominal = robot.nominal().unwrap().standard_parameters().to_vec();
        let model = Model::new(&robot).with_load(nominal.clone());
        let columns = BaseParameters::compute(&model).unwrap().columns().to_vec();
        let bounds = Bounds::new(&robot, Margins::default(), None, Some(nominal)).unwrap();
        let bounds = bounds.with_shapes(shapes);
        let before = DMatrix::identity(columns.len(), columns.len());
        let levels = robot.limits().map(|limits| 0.01 * limits.torque_max.unwrap()).collect();
        let noise = Noise { deviations: levels, rows_per_s: 40.0 };
        let moving = vec![true; 6];
        Task {
            model,
            bounds,
            duration_s: 3.0,
            first_posture: None,
            moving_joints: moving,
            columns,
            prior_information: before,
            noise,
            objective: aim,
        }
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let deviations = DesignObjective::Deviations((0..60).map(|k| (k, 0.01)).collect());
        let load = DesignObjective::Deviations((60..62).map(|k| (k, 0.0)).collect());
        for (aim, twice) in
            [(deviations, false), (DesignObjective::ConditionNumber, false), (load, true)]
        {
            let mut task = task(aim);
            if twice {
                // Adds parameters with prior information and without, and joints at rest.
                task.columns.extend([task.columns[0], task.columns[20]]);
                task.prior_information = task.prior_information.resize(62, 62, 0.0);
                task.moving_joints = vec![true, false, true, true, false, true];
                task.first_posture = Some(vec![0.1, -0.2, 1.5, 0.2, 0.3, -0.1]);
            }
            let mut search = Search::new(&task);
            let x = search.start(3).unwrap();
            let (mut gradient, mut unused) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            search.evaluate(0.1, &x, &mut gradient).unwrap();
            for turn in 0..6 {
                let number = |k: usize| ((k * (turn + 1)) as f64 * 0.77 + turn as f64).sin();
                let mut along: Vec<f64> = (0..x.len()).map(number).collect();
                search.hold_resting_joints(&mut along);
                let h = 1e-6;
                let mut value_at = |h: f64| {
                    let near: Vec<f64> = x.iter().zip(&along).map(|(x, of)| x + h * of).collect();
                    search.evaluate(0.1, &near, &mut unused).unwrap()
                };
                let expected = (value_at(h) - value_at(-h)) / (2.0 * h);
                let slope: f64 = gradient.iter().zip(&along).map(|(g, of)| g * of).sum();
                assert!(
                    (slope - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                    "{slope} {expected}"
                );
            }
        }
    }

    #[test]
    fn a_motion_begins_in_its_first_posture() {
        let mut task = task(DesignObjective::Deviations((0..60).map(|k| (k, 0.0)).collect()));
        let first = [0.1, -0.2, 1.5, 0.2, 0.3, -0.1];
        task.first_posture = Some(first.to_vec());
        let motion = crate::excitation::design(&task, 1, 8, |_| ()).unwrap().series;
        for time_s in [0.0, 1e-9, 3.0] {
            let found = motion.state(time_s).position;
            let close = found.iter().zip(first).all(|(found, first)| (found - first).abs() < 1e-6);
            assert!(close, "{found:?}");
        }
        task.first_posture = Some(vec![0.1, -0.2, 1.5, 0.2, 100.0, -0.1]);
        let refused = crate::excitation::design(&task, 1, 8, |_| ()).unwrap_err();
        let (joint, kind) = (JointIndex::new(4), LimitKind::Position);
        assert!(
            matches!(refused, ExcitationError::FirstPosture { joint: j, kind: k, .. }
                if j == joint && k == kind),
            "{refused}"
        );
    }

    #[test]
    fn every_iterate_is_within_the_limits_and_better() {
        let task = task(DesignObjective::Deviations((0..60).map(|k| (k, 0.0)).collect()));
        let (mut search, mut probe) = (Search::new(&task), Search::new(&task));
        let mut x = search.start(1).unwrap();
        let mut unused = vec![0.0; x.len()];
        let mut value = |x: &[f64]| {
            assert!(probe.largest_share(x).1 < 1.0);
            probe.evaluate(0.01, x, &mut unused).unwrap()
        };
        let first = value(&x);
        let mut values = vec![first];
        let evaluate = |x: &[f64], gradient: &mut [f64]| search.evaluate(0.01, x, gradient);
        assert!(descend(&mut x, 20, evaluate, |x| values.push(value(x))));
        assert!(values.len() > 15 && values.is_sorted_by(|a, b| a >= b), "{values:?}");
        assert!(values[values.len() - 1] < first - 0.5, "{values:?}");
    }
}
