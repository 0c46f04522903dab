//! Several samples of a motion at once, as the dynamics takes them.

use super::filtered_positions::FilteredPositions;
use super::motion::Motion;
use crate::MAX_JOINTS;
use crate::numeric::{Lanes, WIDTH, vectorised};
use crate::signal::Group;

/// q, q̇ and q̈ of every joint at so many consecutive samples.
pub(crate) struct MotionGroup {
    joints: usize,
    quantities: [[Group; MAX_JOINTS]; 3],
}

impl MotionGroup {
    pub(crate) fn of_joints(joints: usize) -> Self {
        Self { joints, quantities: [[Lanes([0.0; WIDTH]); MAX_JOINTS]; 3] }
    }

    /// From sample `first` of a motion on; beyond the last sample they are those of the last.
    pub(crate) fn read(&mut self, motion: &Motion, first: usize) -> [&[Group]; 3] {
        for joint in 0..self.joints {
            let groups = motion.groups(joint, first);
            for (quantity, group) in self.quantities.iter_mut().zip(groups) {
                quantity[joint] = group;
            }
        }
        self.of_the_joints()
    }

    /// The same of filtered positions: [`filtered_motion`](super::motion::filtered_motion) has these numbers, to the last bit.
    pub(crate) fn differentiate(
        &mut self,
        positions: &FilteredPositions,
        first: usize,
    ) -> [&[Group]; 3] {
        let last = positions.samples() - 1;
        let [q, dq, ddq] = &mut self.quantities;
        vectorised(
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

    fn of_the_joints(&self) -> [&[Group]; 3] {
        self.quantities.each_ref().map(|quantity| &quantity[..self.joints])
    }
}

#[cfg(test)]
mod tests {
    use super::super::motion::filtered_motion;
    use super::*;
    use crate::identification::{Experiment, PositionFilter, Signals};

    #[test]
    fn velocities_and_accelerations_where_they_are_asked_for_are_those_of_the_motion() {
        for samples in [16, 17, 18, 31] {
            let signal = |joint: usize| -> Vec<f64> {
                (0..samples).map(|k| ((k * 37 + joint * 11) % 23) as f64 / 23.0).collect()
            };
            let signals = Signals {
                sample_rate_hz: 300.0,
                position_rad: vec![signal(0), signal(1)],
                torque_nm: vec![signal(2), signal(3)],
                reference_rad: None,
            };
            let experiment = Experiment::joint_side(&signals).unwrap();
            let filter = PositionFilter { order: 4, cutoff_hz: 60.0 };
            let motion = filtered_motion(&experiment, &filter).unwrap();
            let mut positions = FilteredPositions::of(&experiment);
            positions.filter(&experiment, &filter).unwrap();
            let (mut of_motion, mut of_positions) =
                (MotionGroup::of_joints(2), MotionGroup::of_joints(2));
            for first in (0..samples).chain([0]) {
                let found = of_positions.differentiate(&positions, first);
                assert_eq!(found, of_motion.read(&motion, first), "{first} of {samples}");
            }
        }
    }
}
