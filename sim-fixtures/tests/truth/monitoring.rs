//! Two results of one arm that has not changed: what the model lacks sets them apart where their
//! motions differ, and must not be taken for a change.

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::Robot;
use didim_identification::identification::{Estimate, Experiment, Method, identify};

use super::arms::{Arm, Length, Own};
use crate::common::experiment::regression;
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, writing};

const CELLS: [Own; 6] =
    [Own::Nothing, Own::Width, Own::Stribeck, Own::Load, Own::Coupling, Own::Hysteresis];
const RUNS: usize = 10;
/// Cut-off of the position filter \[Hz\].
const CUTOFF_HZ: f64 = 200.0;
/// Standard deviations from which on a difference counts as drift.
const LIMIT: f64 = 4.0;

/// The differences between two results over their standard deviations, without the model's part and
/// with it.
type Deviations = Vec<[f64; 2]>;

/// The first motion again with other noise, and two other motions, each against the first.
fn differences(own: Own, run: usize) -> [Deviations; 3] {
    let robot = Robot::from_toml(&own.file()).unwrap();
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let seed = own as u64 * 1000 + run as u64 + 1;
    let arm = Arm::new(own, seed);
    let listed = robot.nominal().unwrap().given_values();
    let names: Vec<String> = listed.iter().map(|(name, _)| name.clone()).collect();
    let options = regression(Some(names), CUTOFF_HZ);
    let estimate = |experiment: &Experiment| -> Estimate {
        identify(Method::IdimLs, &robot, &base, experiment, &options).unwrap().estimate
    };
    let first = estimate(&arm.experiment(&robot, 0, Length::Study));
    let again = arm.with_noise_of(seed + 500);
    let later = [0, 1, 2].map(|motion| again.experiment(&robot, motion, Length::Study));
    later.map(|experiment| {
        let later = estimate(&experiment);
        let [then, now] = [&first, &later].map(|of| of.model_uncertainty.as_ref().unwrap());
        let by_model = now.difference_deviations(then).unwrap();
        let pairs = first.parameters.iter().zip(&later.parameters).zip(by_model);
        let deviations = pairs.map(|((then, now), by_model)| {
            assert_eq!(then.name, now.name);
            let difference = now.value - then.value;
            let noise = then.standard_deviation.hypot(now.standard_deviation);
            [difference / noise, difference / noise.hypot(by_model)]
        });
        deviations.collect()
    })
}

#[test]
fn an_arm_that_has_not_changed_raises_no_alarm_on_another_motion() {
    let runs = if writing() { RUNS } else { 1 };
    let deviations_found =
        in_parallel(CELLS.len() * runs, |index| differences(CELLS[index / runs], index % runs));
    let mut rows = Vec::new();
    let mut outside = Vec::new();
    for (cell, found) in CELLS.iter().zip(deviations_found.chunks(runs)) {
        let motions: [(&str, &[usize]); 2] = [("the same", &[0]), ("another", &[1, 2])];
        for (motion, which) in motions {
            fn largest_of(found: &[[Deviations; 3]], part: usize, which: &[usize]) -> Vec<f64> {
                let all_deviations =
                    found.iter().flat_map(|run| which.iter().flat_map(|at| &run[*at]));
                all_deviations.map(|deviations| deviations[part]).collect()
            }
            let rms = |z: &[f64]| (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
            fn beyond(z: &[f64]) -> String {
                let count = z.iter().filter(|z| z.abs() > LIMIT).count();
                format!("{:.1}", 100.0 * count as f64 / z.len() as f64)
            }
            let [noise, total] = [0, 1].map(|part| largest_of(found, part, which));
            let largest = total.iter().fold(0.0, |largest: f64, z| largest.max(z.abs()));
            if largest > LIMIT {
                outside.push(format!("{}, {motion}: {largest:.1}", cell.description()));
            }
            rows.push(vec![
                cell.description().to_owned(),
                motion.to_owned(),
                format!("{:.3}", rms(&largest_of(&found[..1], 1, which))),
                format!("{:.2}", rms(&noise)),
                beyond(&noise),
                format!("{:.2}", rms(&total)),
                beyond(&total),
                format!("{largest:.1}"),
            ]);
        }
    }
    let columns = vec![
        Column::exact("the arm has"),
        Column::exact("motion"),
        // Differs by rounding between processors.
        Column::within("rms z of run 1", 0.005),
        Column::of_the_whole("rms z by noise"),
        Column::of_the_whole("beyond 4 [%]"),
        Column::of_the_whole("rms z"),
        Column::of_the_whole("beyond 4 [%]"),
        Column::of_the_whole("largest z"),
    ];
    let table = Table { document: "truth.md", name: "monitoring", columns, rows };
    println!("{}", table.markdown());
    assert!(outside.is_empty(), "outside:\n{}", outside.join("\n"));
    table.check();
}
