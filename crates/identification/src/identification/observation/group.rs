//! Groups of motion samples, as the dynamics evaluates them.

use super::filtered_positions::FilteredPositions;
use super::motion::Motion;
use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::numeric::{Lanes, WIDTH, with_vector_instructions};

/// States that determine the torques of every joint at some samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct States<'a> {
    pub(crate) q: &'a [Group],
    pub(crate) dq: &'a [Group],
    pub(crate) ddq: &'a [Group],
    /// Hysteresis state of friction; `None` for states without a history.
    pub(crate) hysteresis: Option<&'a [Group; MAX_JOINTS]>,
}

/// States of a group of consecutive samples.
pub(crate) struct MotionGroup {
    joints: usize,
    quantities: [[Group; MAX_JOINTS]; 3],
    hysteresis: Option<[Group; MAX_JOINTS]>,
}

impl MotionGroup {
    pub(crate) fn of_joints(joints: usize) -> Self {
        let quantities = [[Lanes([0.0; WIDTH]); MAX_JOINTS]; 3];
        Self { joints, quantities, hysteresis: None }
    }

    /// Reads the states from sample `first` of a motion on. Beyond the last sample they are those
    /// of the last.
    pub(crate) fn read(&mut self, motion: &Motion, first: usize) -> States<'_> {
        self.hysteresis = motion.hysteresis(first);
        for joint in 0..self.joints {
            let groups = motion.joint_groups(joint, first);
            for (quantity, group) in self.quantities.iter_mut().zip(groups) {
                quantity[joint] = group;
            }
        }
        self.of_the_joints()
    }

    /// Computes the same states from filtered positions. The numbers equal those of
    /// [`filtered_motion`](super::motion::filtered_motion), to the last bit.
    pub(crate) fn states_from_positions(
        &mut self,
        positions: &FilteredPositions,
        first: usize,
    ) -> States<'_> {
        self.hysteresis = positions.hysteresis(first);
        let last = positions.samples() - 1;
        let [q, dq, ddq] = &mut self.quantities;
        with_vector_instructions(
            #[inline(always)]
            || {
                for l in 0..WIDTH {
                    let k = (first + l).min(last);
                    let sample =
                        [positions.position(k), positions.velocity(k), positions.acceleration(k)];
                    for j in 0..MAX_JOINTS {
                        q[j].0[l] = sample[0][j];
                        dq[j].0[l] = sample[1][j];
                        ddq[j].0[l] = sample[2][j];
                    }
                }
            },
        );
        self.of_the_joints()
    }

    fn of_the_joints(&self) -> States<'_> {
        let [q, dq, ddq] = self.quantities.each_ref().map(|quantity| &quantity[..self.joints]);
        States { q, dq, ddq, hysteresis: self.hysteresis.as_ref() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::motion::filtered_motion;
    use super::*;
    use crate::identification::{Experiment, PositionFilter};
    use didim_dynamics::Signals;
    use didim_dynamics::robot::{FrictionLaw, Robot};

    #[test]
    fn what_is_formed_where_it_is_asked_for_is_that_of_the_motion() {
        let robot =
            Robot::from_toml(include_str!("../../../../../config/robots/tx40.toml")).unwrap();
        let law = FrictionLaw::Hysteresis { way_rad: 0.1 };
        let friction = robot.own_friction().iter().map(|own| own.with_law(law)).collect();
        let robot = robot.with_friction(friction);
        for samples in [16, 17, 18, 31] {
            let signal = |joint: usize| -> Vec<f64> {
                (0..samples).map(|k| ((k * 37 + joint * 11) % 23) as f64 / 23.0).collect()
            };
            let signals = Signals {
                sample_rate_hz: 300.0,
                position_rad: (0..6).map(signal).collect(),
                torque_nm: (6..12).map(signal).collect(),
                reference_rad: None,
            };
            let experiment = Experiment::joint_side(&signals).unwrap();
            let filter = PositionFilter { order: 4, cutoff_hz: 60.0 };
            let motion = filtered_motion(&robot, &experiment, &filter).unwrap();
            let mut positions = FilteredPositions::with_zeros(&experiment);
            positions.filter(&experiment, &filter).unwrap();
            positions.track_hysteresis(&robot);
            let (mut of_motion, mut of_positions) =
                (MotionGroup::of_joints(6), MotionGroup::of_joints(6));
            for first in (0..samples).chain([0]) {
                let group = of_positions.states_from_positions(&positions, first);
                assert_eq!(group, of_motion.read(&motion, first), "{first} of {samples}");
            }
        }
    }
}
