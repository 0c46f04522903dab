//! How far what is said of standard parameters is from the truth, on arms whose bodies can be.

use didim_dynamics::robot::{JointIndex, ParameterKind};
use didim_identification::feasibility::{Prior, ValueSource};

use super::estimates::{Example, states, torques};
use crate::arms::{physical_parameters, random_robots};

/// Errors in standard deviations.
#[derive(Default)]
struct Errors(Vec<f64>);

impl Errors {
    fn within(&self, deviations: f64) -> f64 {
        let within = self.0.iter().filter(|z| z.abs() < deviations).count();
        100.0 * within as f64 / self.0.len() as f64
    }

    fn rms(&self) -> f64 {
        (self.0.iter().map(|z| z * z).sum::<f64>() / self.0.len() as f64).sqrt()
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Random arms, an estimate of each by least squares on random states with noise that is a share of
/// the torques, bodies near cylinders of the true mass, half of it and twice as much. By hand, see
/// docs/evidence/models.md.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn coverage_study() {
    println!(
        "| states | noise | total mass stated | data: rms z, within 2 σ | combinations: within 2 σ \
        | prior: within 2 σ | error outside the motion, median | of least squares |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (count, noise) in [(60, 0.05), (200, 0.05), (200, 0.01)] {
        for configured in [0.5, 1.0, 2.0] {
            let mut errors: [Errors; 3] = Default::default();
            let (mut of_bodies, mut plain) = (Vec::new(), Vec::new());
            for (mut random, robot) in random_robots(100) {
                let n = robot.joints();
                let truth = physical_parameters(&mut random, &robot);
                let table = robot.parameters().clone();
                let masses = (0..n).map(|link| {
                    truth[table.column(ParameterKind::M, JointIndex::new(link)).unwrap()]
                });
                let mass: f64 = masses.sum();
                let seen = states(&mut random, n, count);
                let mut measured = torques(&robot, &truth, &seen);
                let level = noise * measured.norm() / (measured.len() as f64).sqrt();
                measured
                    .iter_mut()
                    .for_each(|torque| *torque += level * 3_f64.sqrt() * random.uniform(-1.0, 1.0));
                let case = Example::fit(robot, &seen, &measured, level);
                let prior = Prior::geometric(&case.robot, configured * mass).unwrap();
                let consistent = case.consistent(&prior, prior.default_weight()).unwrap();
                for (parameter, truth) in consistent.parameters.iter().zip(&truth) {
                    let class = match parameter.class {
                        ValueSource::Data => 0,
                        ValueSource::Combination => 1,
                        ValueSource::Prior => 2,
                        ValueSource::Absent => continue,
                    };
                    errors[class].0.push((parameter.value - truth) / parameter.deviation);
                }
                let others = states(&mut random, n, 50);
                let expected = torques(&case.robot, &truth, &others);
                let mut of_base = vec![0.0; truth.len()];
                let columns = case.base.columns();
                columns.iter().zip(&case.values).for_each(|(&at, value)| of_base[at] = *value);
                fn off(
                    standard: &[f64],
                    others: &[[Vec<f64>; 3]],
                    expected: &nalgebra::DVector<f64>,
                    case_robot: &didim_dynamics::robot::Robot,
                ) -> f64 {
                    let off = torques(case_robot, standard, others) - expected;
                    100.0 * off.norm() / expected.norm()
                }
                of_bodies.push(off(&consistent.standard_values(), &others, &expected, &case.robot));
                plain.push(off(&of_base, &others, &expected, &case.robot));
            }
            let [data, sums, prior] = &errors;
            assert!(!data.0.is_empty() && !sums.0.is_empty() && !prior.0.is_empty());
            println!(
                "| {count} | {:.0} % | × {configured} | {:.2}, {:.1} % | {:.1} % | {:.1} % | {:.2} \
                % | {:.2} % |",
                100.0 * noise,
                data.rms(),
                data.within(2.0),
                sums.within(2.0),
                prior.within(2.0),
                median(&mut of_bodies),
                median(&mut plain)
            );
        }
    }
}
