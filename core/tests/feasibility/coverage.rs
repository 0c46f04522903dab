//! How far what is said of standard parameters is from the truth, on arms whose bodies can be.

use didim_core::feasibility::{Class, Prior};
use didim_core::robot::ParameterKind;

use super::estimates::{Known, states, torques};
use crate::dynamics::arms::{physical_parameters, random_robots};

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

/// Random arms, an estimate of each by least squares on random states with noise that is a share of the torques, bodies near
/// cylinders of the true mass, half of it and twice as much. By hand, see docs/models.md.
#[test]
#[ignore = "a study of 100 arms"]
fn coverage_study() {
    println!(
        "| states | noise | total mass stated | data: rms z, within 2 σ | combinations: within 2 σ | prior: within 2 σ | error elsewhere, median | of least squares |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (count, noise) in [(60, 0.05), (200, 0.05), (200, 0.01)] {
        for stated in [0.5, 1.0, 2.0] {
            let mut errors: [Errors; 3] = Default::default();
            let (mut elsewhere, mut plain) = (Vec::new(), Vec::new());
            for (mut random, robot) in random_robots(100) {
                let n = robot.joints();
                let truth = physical_parameters(&mut random, &robot);
                let table = robot.parameters().clone();
                let masses =
                    (0..n).map(|link| truth[table.column(ParameterKind::M, link).unwrap()]);
                let mass: f64 = masses.sum();
                let seen = states(&mut random, n, count);
                let mut measured = torques(&robot, &truth, &seen);
                let level = noise * measured.norm() / (measured.len() as f64).sqrt();
                measured
                    .iter_mut()
                    .for_each(|torque| *torque += level * 3_f64.sqrt() * random.uniform(-1.0, 1.0));
                let known = Known::fit(robot, &seen, &measured, level);
                let prior = Prior::geometric(&known.robot, stated * mass).unwrap();
                let found = known.consistent(&prior, prior.default_weight()).unwrap();
                for (parameter, truth) in found.parameters.iter().zip(&truth) {
                    let class = match parameter.class {
                        Class::Data => 0,
                        Class::Combination => 1,
                        Class::Prior => 2,
                        Class::Absent => continue,
                    };
                    errors[class].0.push((parameter.value - truth) / parameter.deviation);
                }
                let others = states(&mut random, n, 50);
                let expected = torques(&known.robot, &truth, &others);
                let mut of_base = vec![0.0; truth.len()];
                let columns = known.base.columns();
                columns.iter().zip(&known.values).for_each(|(&at, value)| of_base[at] = *value);
                let off = |standard: &[f64]| {
                    let off = torques(&known.robot, standard, &others) - &expected;
                    100.0 * off.norm() / expected.norm()
                };
                elsewhere.push(off(&found.standard()));
                plain.push(off(&of_base));
            }
            let [data, sums, prior] = &errors;
            assert!(!data.0.is_empty() && !sums.0.is_empty() && !prior.0.is_empty());
            println!(
                "| {count} | {:.0} % | × {stated} | {:.2}, {:.1} % | {:.1} % | {:.1} % | {:.2} % | {:.2} % |",
                100.0 * noise,
                data.rms(),
                data.within(2.0),
                sums.within(2.0),
                prior.within(2.0),
                median(&mut elsewhere),
                median(&mut plain)
            );
        }
    }
}
