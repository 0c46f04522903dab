//! Motions that are designed: within every limit, the same every time, and better for what is
//! wanted.

mod collisions;
mod study;
mod sweeps;

use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_identification::excitation::{
    Bounds, Design, DesignObjective, ExcitationError, Margins, Noise, Task, design, predict_result,
};
use nalgebra::DMatrix;

const TX40: &str = include_str!("../../../../config/robots/tx40.toml");
const PANDA: &str = include_str!("../../../../config/robots/panda.toml");

fn robot(file: &str) -> Robot {
    Robot::from_toml(file).unwrap()
}

fn task(robot: &Robot, duration_s: f64) -> Task {
    let nominal = robot.nominal().map(|nominal| nominal.standard_parameters().to_vec());
    task_within(robot, duration_s, Bounds::new(robot, Margins::default(), None, nominal).unwrap())
}

/// All parameters, of which nothing is known.
pub(crate) fn task_within(robot: &Robot, duration_s: f64, bounds: Bounds) -> Task {
    let model = Model::new(robot);
    let columns = BaseParameters::compute(&model).unwrap().columns().to_vec();
    let count = columns.len();
    let levels = robot.limits().map(|limits| 0.01 * limits.torque_max.unwrap()).collect();
    Task {
        model,
        bounds,
        duration_s,
        first_posture: None,
        moving_joints: vec![true; robot.joints()],
        columns,
        prior_information: DMatrix::zeros(count, count),
        noise: Noise { deviations: levels, rows_per_s: 40.0 },
        objective: DesignObjective::Deviations((0..count).map(|k| (k, 0.0)).collect()),
    }
}

fn designed(task: &Task, seed: u64, steps: u32) -> Design {
    design(task, seed, steps, |_| ()).unwrap()
}

/// Largest |value| of each joint along a motion, in units of `limit`.
fn largest(values: &[Vec<f64>], limit: impl Fn(usize) -> f64) -> f64 {
    let shares =
        values.iter().flat_map(|of| of.iter().enumerate().map(|(j, v)| v.abs() / limit(j)));
    shares.fold(0.0, f64::max)
}

/// Ten times the fastest output, all derivatives but the first by differences of what is written:
/// the limits are those of the robot's file, read here anew.
#[test]
fn no_limit_is_left_at_ten_times_the_output_rate() {
    for (file, jerk) in [(TX40, false), (PANDA, true)] {
        let robot = robot(file);
        let limits: Vec<_> = robot.limits().collect();
        let task = task(&robot, 4.0);
        let motion = designed(&task, 1, 25).series;
        let rate = 5000.0;
        let states: Vec<_> = (0..=20_000).map(|i| motion.state(f64::from(i) / rate)).collect();
        let n = robot.joints();
        let positions: Vec<Vec<f64>> = states.iter().map(|s| s.position[..n].to_vec()).collect();
        for position in &positions {
            for (q, limits) in position.iter().zip(&limits) {
                let margin = 0.05 * (limits.position_max - limits.position_min);
                assert!(*q > limits.position_min + margin && *q < limits.position_max - margin);
            }
        }
        fn slopes(of: &[Vec<f64>], rate: &f64) -> Vec<Vec<f64>> {
            let pairs = of.windows(2).map(|pair| pair[0].iter().zip(&pair[1]));
            pairs.map(|pair| pair.map(|(a, b)| *rate * (b - a)).collect()).collect()
        }
        let speeds = slopes(&positions, &rate);
        let speed = largest(&speeds, |j| 0.5 * limits[j].velocity_max.unwrap());
        // The mean over a step exceeds both of its ends by up to (ω Δt)² / 12 = 5e-7 at 2 Hz.
        assert!(speed < 1.0 + 6e-7 && speed > 0.7, "{speed}");
        let accelerations = slopes(&speeds, &rate);
        if jerk {
            let share = largest(&accelerations, |j| 0.5 * limits[j].acceleration_max.unwrap());
            assert!(share < 1.0 + 1e-6 && share > 0.7, "{share}");
            let jerks = slopes(&accelerations, &rate);
            assert!(largest(&jerks, |j| 0.5 * limits[j].jerk_max.unwrap()) < 1.0 + 1e-3);
        } else {
            // Motor 6 turns with both joints, and has the speed limit of its own.
            let motor = speeds.iter().map(|speed| (speed[4] + speed[5]).abs()).fold(0.0, f64::max);
            assert!(motor < 0.5 * limits[5].velocity_max.unwrap(), "{motor}");
            let parameters = robot.nominal().unwrap().standard_parameters();
            let mut workspace = Workspace::new();
            let torques = states.iter().map(|s| {
                let mut torque = vec![0.0; n];
                let [q, dq, ddq] = [&s.position[..n], &s.velocity[..n], &s.acceleration[..n]];
                task.model.inverse_dynamics(&mut workspace, parameters, q, dq, ddq, &mut torque);
                torque
            });
            let share =
                largest(&torques.collect::<Vec<_>>(), |j| 0.8 * limits[j].torque_max.unwrap());
            assert!(share < 1.0 && share > 0.2, "{share}");
        }
        for end in [&states[0], &states[20_000]] {
            let away = end.position.iter().zip(&states[0].position).map(|(a, b)| (a - b).abs());
            assert!(away.fold(0.0, f64::max) < 1e-12);
            assert!(end.velocity.iter().chain(&end.acceleration).all(|v| v.abs() < 1e-12));
        }
        // Just inside it is no jump from rest.
        assert!(states[1].velocity.iter().all(|v| v.abs() < 1e-3), "{:?}", states[1].velocity);
    }
}

#[test]
fn task_seed_and_steps_decide() {
    let robot = robot(PANDA);
    let task = task(&robot, 3.0);
    let mut steps = Vec::new();
    let first = design(&task, 1, 10, |progress| steps.push(progress.steps)).unwrap();
    assert_eq!(steps, (1..=10).collect::<Vec<_>>());
    assert_eq!(first, designed(&task, 1, 10));
    assert_ne!(first.series, designed(&task, 2, 10).series);
    assert!(designed(&task, 1, 40).value < first.value);
}

/// What is known already counts, and what is wanted gets better than what is not.
#[test]
fn what_is_wanted_and_not_known_is_reported() {
    let robot = robot(TX40);
    let task_of_all = task(&robot, 3.0);
    let of_all = designed(&task_of_all, 1, 30).series;
    let place = |name: &str| {
        let column = robot.parameters().find(name).unwrap();
        task_of_all.columns.iter().position(|own| *own == column).unwrap()
    };
    let inertia = place("ia3");
    let task_of_one = Task {
        objective: DesignObjective::Deviations(vec![(inertia, 0.0)]),
        ..task_of_all.clone()
    };
    let of_one = designed(&task_of_one, 1, 30).series;
    let deviation = |motion| predict_result(&task_of_all, motion).unwrap().deviations[inertia];
    assert!(deviation(&of_one) < 0.8 * deviation(&of_all));

    let well_known = predict_result(&task_of_all, &of_all).unwrap();
    let mut before = task_of_all.prior_information.clone();
    for (k, deviation) in well_known.deviations.iter().enumerate() {
        before[(k, k)] = 1.0 / (0.01 * deviation).powi(2);
    }
    before[(inertia, inertia)] = 0.0;
    let remaining = Task { prior_information: before, ..task_of_all.clone() };
    let prediction = predict_result(&remaining, &of_all).unwrap().deviations;
    assert!(prediction.iter().zip(&well_known.deviations).all(|(with, alone)| with <= alone));
    // Alone it is identified better, with all others known.
    assert!(prediction[inertia] < 0.9 * well_known.deviations[inertia]);
    let next = designed(&remaining, 1, 30).series;
    assert!(predict_result(&remaining, &next).unwrap().deviations[inertia] < prediction[inertia]);
}

#[test]
fn a_condition_number_is_made_small() {
    let robot = robot(PANDA);
    let task = Task { objective: DesignObjective::ConditionNumber, ..task(&robot, 5.0) };
    let [first, last] = [1, 60].map(|steps| designed(&task, 1, steps));
    let number = |of: &Design| predict_result(&task, &of.series).unwrap().condition_number;
    assert!(number(&last) < 0.5 * number(&first), "{} {}", number(&last), number(&first));
    // Its logarithm, but for the sums that stand for the largest and the smallest.
    assert!((last.value - number(&last).ln()).abs() < 0.5);
}

#[test]
fn what_cannot_be_designed_is_refused() {
    let tx40 = robot(TX40);
    let nominal = tx40.nominal().unwrap().standard_parameters().to_vec();
    let bounds =
        |margins, accelerations, parameters| Bounds::new(&tx40, margins, accelerations, parameters);
    let unheld = bounds(Margins::default(), None, None);
    assert_eq!(unheld.unwrap_err(), ExcitationError::NoAcceleration { joint: JointIndex::new(0) });
    let wrong = Margins { speed: 1.5, ..Margins::default() };
    assert!(matches!(
        bounds(wrong, None, Some(nominal.clone())),
        Err(ExcitationError::BadValue { .. })
    ));
    let short = bounds(Margins::default(), Some(&[1.0]), None);
    assert!(matches!(short, Err(ExcitationError::Length { found: 1, .. })));

    let refused = |task: &Task| design(task, 1, 5, |_| ()).unwrap_err();
    let instant = Task { duration_s: 0.5, ..task(&tx40, 3.0) };
    assert!(matches!(refused(&instant), ExcitationError::BadValue { .. }));
    // An arm too weak to hold itself.
    let weak = Margins { torque: 1e-6, ..Margins::default() };
    let bounds = bounds(weak, None, Some(nominal)).unwrap();
    let weak = Task { bounds, ..task(&tx40, 3.0) };
    assert!(matches!(refused(&weak), ExcitationError::CannotHold { .. }));
    // The same parameter twice.
    let mut twice = task(&tx40, 3.0);
    twice.columns[1] = twice.columns[0];
    assert_eq!(refused(&twice), ExcitationError::NotIdentifiable { duration_s: 3.0 });
}
