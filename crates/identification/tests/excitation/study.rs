//! The tables of docs/evidence/excitation.md, by hand:
//! `cargo test --release -p didim-identification --test tests -- --ignored --nocapture study`.

use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::Robot;
use didim_dynamics::trajectory::Reference;
use didim_identification::excitation::{
    Bounds, DesignObjective, LimitKind, Margins, Noise, Task, design, predict_result,
    simulate_record,
};
use didim_identification::identification::{Experiment, Method, ParameterEstimate, identify};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardUniform};

use super::task_within;
use crate::common::arm::{Random, options, signals};

const STEPS: u32 = 600;
const SEQUENCES: u64 = 20;
/// Where a robot's file states none \[rad/s²\].
const ACCELERATION: f64 = 10.0;

const ROBOTS: [(&str, &str); 8] = [
    ("tx40", include_str!("../../../../config/robots/tx40.toml")),
    ("iiwa7 (Med7)", include_str!("../../../../config/robots/iiwa7.toml")),
    ("panda", include_str!("../../../../config/robots/panda.toml")),
    ("ur5e", include_str!("../../../../config/robots/ur5e.toml")),
    ("piper", include_str!("../../../../config/robots/piper.toml")),
    ("openarm", include_str!("../../../../config/robots/openarm.toml")),
    ("kr300", include_str!("../../../../config/robots/kr300-r2700-2.toml")),
    ("tiago", include_str!("../../../../tests/data/tiago/robot.toml")),
];

fn task_of(file: &str, duration_s: f64) -> (Robot, Task) {
    let robot = Robot::from_toml(file).unwrap();
    let is_configured =
        robot.nominal().is_some() || robot.limits().all(|l| l.acceleration_max.is_some());
    let accelerations = (!is_configured).then(|| vec![ACCELERATION; robot.joints()]);
    let nominal = robot.nominal().map(|nominal| nominal.standard_parameters().to_vec());
    let bounds = Bounds::new(&robot, Margins::default(), accelerations.as_deref(), nominal);
    let task = task_within(&robot, duration_s, bounds.unwrap());
    (robot, task)
}

/// Moves from one random posture to the next, each as fast as the limits allow.
struct Quintics(Vec<Move>);

struct Move {
    begin_s: f64,
    length_s: f64,
    from: Vec<f64>,
    to: Vec<f64>,
}

impl Quintics {
    fn draw(robot: &Robot, model: &Model, duration_s: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let unit = |random: &mut ChaCha8Rng| -> f64 { StandardUniform.sample(random) };
        let Margins { position, speed, .. } = Margins::default();
        let (mut moves, mut begin_s) = (Vec::new(), 0.0);
        let mut start: Vec<f64> =
            robot.limits().map(|l| 0.5 * (l.position_min + l.position_max)).collect();
        let fits = |of: &Move| {
            let Some(nominal) = robot.nominal() else { return true };
            let (n, mut workspace) = (robot.joints(), Workspace::new());
            let alone = Quintics(vec![Move {
                begin_s: 0.0,
                from: of.from.clone(),
                to: of.to.clone(),
                ..*of
            }]);
            (0..=50).all(|i| {
                let [mut q, mut dq, mut ddq, mut tau] = [(); 4].map(|()| vec![0.0; n]);
                alone.evaluate(of.length_s * f64::from(i) / 50.0, &mut q, &mut dq, &mut ddq);
                model.inverse_dynamics(
                    &mut workspace,
                    nominal.standard_parameters(),
                    &q,
                    &dq,
                    &ddq,
                    &mut tau,
                );
                robot
                    .limits()
                    .zip(tau)
                    .all(|(l, tau)| tau.abs() <= Margins::default().torque * l.torque_max.unwrap())
            })
        };
        loop {
            let target: Vec<f64> = (robot.limits())
                .map(|l| {
                    let range = l.position_max - l.position_min;
                    l.position_min + range * (position + (1.0 - 2.0 * position) * unit(&mut random))
                })
                .collect();
            let mut length_s: f64 = 0.0;
            for ((from, to), limits) in start.iter().zip(&target).zip(robot.limits()) {
                let distance = (to - from).abs();
                length_s = length_s.max(1.875 * distance / (speed * limits.velocity_max.unwrap()));
                let configured = limits.acceleration_max.map(|a| speed * a);
                let assumed = robot.nominal().is_none().then_some(ACCELERATION);
                if let Some(acceleration) = configured.or(assumed) {
                    length_s = length_s.max((5.7735 * distance / acceleration).sqrt());
                }
            }
            let mut next = Move { begin_s, length_s, from: start.clone(), to: target.clone() };
            while !fits(&next) && next.length_s < duration_s {
                next.length_s *= 1.05;
            }
            if begin_s + next.length_s > duration_s {
                return Self(moves);
            }
            begin_s += next.length_s;
            start = target;
            moves.push(next);
        }
    }
}

impl Reference for Quintics {
    fn joints(&self) -> usize {
        self.0[0].from.len()
    }

    fn evaluate(&self, time_s: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
        let index = self.0.iter().rposition(|of| of.begin_s <= time_s).unwrap_or(0);
        let Move { begin_s, length_s, from, to } = &self.0[index];
        let s = ((time_s - begin_s) / length_s).clamp(0.0, 1.0);
        let shape = [
            s * s * s * (10.0 + s * (-15.0 + 6.0 * s)),
            30.0 * s * s * (1.0 - s) * (1.0 - s) / length_s,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (length_s * length_s),
        ];
        for (j, (from, to)) in from.iter().zip(to).enumerate() {
            let distance = to - from;
            (q[j], dq[j], ddq[j]) =
                (from + shape[0] * distance, shape[1] * distance, shape[2] * distance);
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
#[ignore = "needs minutes: tests/run full"]
fn against_random_moves() {
    println!(
        "| arm | length [s] | median of σ | least favourable parameter | condition number | of the \
        moves | time [s] |"
    );
    println!("|---|---|---|---|---|---|---|");
    // Where the median gains less than 2.5 times in 10 s, or 2 times in 20 s, or a parameter is
    // more than 1.2 times worse.
    let mut missed = Vec::new();
    for (name, file) in ROBOTS {
        for duration_s in [10.0, 20.0] {
            let (robot, task) = task_of(file, duration_s);
            let begin = std::time::Instant::now();
            let designed = (1..=2)
                .map(|seed| design(&task, seed, STEPS, |_| ()).unwrap())
                .min_by(|a, b| a.value.total_cmp(&b.value))
                .unwrap();
            let time_s = begin.elapsed().as_secs_f64() / 2.0;
            let prediction = predict_result(&task, &designed.series).unwrap();
            let conditioned = Task { objective: DesignObjective::ConditionNumber, ..task.clone() };
            let best = design(&conditioned, 1, STEPS, |_| ()).unwrap();
            let best = predict_result(&task, &best.series).unwrap().condition_number;
            let of_moves: Vec<_> = (0..SEQUENCES)
                .filter_map(|seed| {
                    let moves = Quintics::draw(&robot, &task.model, duration_s, seed);
                    predict_result(&task, &moves).ok()
                })
                .collect();
            let ratios: Vec<f64> = (prediction.deviations.iter().enumerate())
                .map(|(k, own)| median(of_moves.iter().map(|of| of.deviations[k] / own).collect()))
                .collect();
            let worst = ratios.iter().copied().fold(f64::INFINITY, f64::min);
            let conditions = median(of_moves.iter().map(|of| of.condition_number).collect());
            println!(
                "| {name} | {duration_s} | {:.1} times smaller | {:.2} times | {best:.1} | \
                {conditions:.0} | {time_s:.0} |",
                median(ratios.clone()),
                worst
            );
            let wanted = if duration_s < 15.0 { 2.5 } else { 2.0 };
            if median(ratios) < wanted || worst < 1.0 / 1.2 {
                missed.push(format!("{name}, {duration_s} s"));
            }
            assert!(best <= 35.0, "{name}");
        }
    }
    assert_eq!(missed, ["openarm, 10 s", "openarm, 20 s"]);
}

/// Whether more starts and more steps find more on the arm that gains least, and which limits hold
/// it.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn why_the_openarm_gains_little() {
    let mean = |of: &[f64]| of.iter().map(|of| of.ln()).sum::<f64>() / of.len() as f64;
    for duration_s in [10.0, 20.0] {
        let (robot, task) = task_of(ROBOTS[5].1, duration_s);
        let draw = |seed| Quintics::draw(&robot, &task.model, duration_s, seed);
        let of_moves: Vec<_> = (0..SEQUENCES)
            .filter_map(|seed| Some(predict_result(&task, &draw(seed)).ok()?.deviations))
            .collect();
        let means = of_moves.iter().map(|of| mean(of));
        let [low, high] = means.fold([f64::MAX, f64::MIN], |[a, b], of| [a.min(of), b.max(of)]);
        println!("{duration_s} s: mean ln σ of the moves {low:.2} to {high:.2}");
        for (seed, steps) in [(1, STEPS), (2, STEPS), (3, STEPS), (1, 4 * STEPS)] {
            let designed = design(&task, seed, steps, |_| ()).unwrap();
            let prediction = predict_result(&task, &designed.series).unwrap().deviations;
            let ratio =
                |k: usize| median(of_moves.iter().map(|of| of[k] / prediction[k]).collect());
            let gain = median((0..prediction.len()).map(ratio).collect());
            fn used(
                kind: LimitKind,
                designed_used: &[didim_identification::excitation::UsedLimit],
            ) -> Vec<String> {
                let of_kind = designed_used.iter().filter(|used| used.kind == kind);
                of_kind.map(|used| format!("{:.2}", used.used_share)).collect()
            }
            println!(
                "start {seed}, {steps} steps: mean ln σ {:.2}, median {gain:.2} times smaller; \
                used of speed {:?}, of acceleration {:?}",
                designed.value,
                used(LimitKind::Speed, &designed.used),
                used(LimitKind::Acceleration, &designed.used)
            );
            assert!(designed.value < low);
        }
    }
}

/// From recordings of a designed motion, with exact positions and white noise of the torques: the
/// error of each parameter, and the standard deviation of the results, in units of the predicted
/// one.
#[test]
#[ignore = "needs minutes: tests/run full"]
fn what_is_predicted_comes() {
    const RATE_HZ: f64 = 400.0;
    const REST: usize = 400;
    const SEEDS: u64 = 40;
    // What its recording leaves (docs/evidence/real-arms.md): the limit of the torso is a
    // placeholder.
    const OF_TIAGO: [f64; 8] = [0.3, 0.52, 0.92, 0.57, 0.68, 0.071, 0.042, 0.026];
    println!("| arm | length [s] | σ that the results say | scatter | of a single parameter |");
    println!("|---|---|---|---|---|");
    for (name, file) in ROBOTS {
        for duration_s in [10.0, 20.0] {
            let (robot, mut task) = task_of(file, duration_s);
            if name == "tiago" {
                task.noise.deviations = OF_TIAGO.to_vec();
            }
            let base = BaseParameters::compute(&task.model).unwrap();
            let motion = design(&task, 1, STEPS, |_| ()).unwrap().series;
            let predicted = predict_result(&task, &motion).unwrap().deviations;
            let standard = robot.nominal().map(|nominal| nominal.standard_parameters().to_vec());
            let standard =
                standard.unwrap_or_else(|| vec![0.0; robot.parameters().parameters().len()]);
            let quiet = Noise { deviations: vec![0.0; robot.joints()], ..task.noise.clone() };
            let quiet = Task { noise: quiet, ..task.clone() };
            let [position, torque] = simulate_record(&quiet, &standard, &motion, RATE_HZ, REST);
            let samples_per_row = RATE_HZ / task.noise.rows_per_s;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "ten")]
            let options = options(20.0, 0.8, samples_per_row as usize);
            let counted = 100..position[0].len() - 100;
            let estimates: Vec<_> = (1..=SEEDS)
                .map(|seed: u64| {
                    let mut random = Random(seed);
                    let torque = torque
                        .iter()
                        .zip(&task.noise.deviations)
                        .map(|(torque, level): (&Vec<f64>, &f64)| {
                            let level = level * samples_per_row.sqrt();
                            torque.iter().map(|torque| torque + level * random.normal()).collect()
                        })
                        .collect();
                    let experiment =
                        Experiment::joint_side(signals(RATE_HZ, position.clone(), torque)).unwrap();
                    let experiment = experiment.with_counted(counted.clone()).unwrap();
                    let identified = identify(Method::IdimLs, &robot, &base, &experiment, &options);
                    identified.unwrap().estimate.parameters
                })
                .collect();
            let count = SEEDS as f64;
            let mean_of = |k: usize, value: &dyn Fn(&ParameterEstimate) -> f64| {
                estimates.iter().map(|estimate| value(&estimate[k])).sum::<f64>() / count
            };
            let truth = base.to_base(&standard);
            let scatter =
                |k: usize| mean_of(k, &|own| (own.value - truth[k]).powi(2)).sqrt() / predicted[k];
            let said = |k: usize| mean_of(k, &|own| own.standard_deviation) / predicted[k];
            let rms = |of: &[f64]| (of.iter().map(|x| x * x).sum::<f64>() / of.len() as f64).sqrt();
            let scatters: Vec<f64> = (0..predicted.len()).map(scatter).collect();
            let saids: Vec<f64> = (0..predicted.len()).map(said).collect();
            let [least, most] =
                scatters.iter().fold([f64::MAX, 0.0], |[a, b], x| [x.min(a), x.max(b)]);
            println!(
                "| {name} | {duration_s} | {:.2} | {:.2} | {least:.2} to {most:.2} |",
                rms(&saids),
                rms(&scatters)
            );
            for of in [rms(&scatters), rms(&saids)] {
                assert!((of - 1.0).abs() < 0.2, "{name}, {duration_s} s: {of}");
            }
        }
    }
}
