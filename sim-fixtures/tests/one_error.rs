//! Which error of the arm does what to which method: each error alone, against IDIM-LS.

use std::fmt::Write as _;

use crate::common::experiment::{experiment, loop_options};
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, writing};
use didim_dynamics::control::ControlLaw;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::simulation::{Cogging, FlexibleMode, NoiseConfig, Unmodelled};
use didim_identification::identification::{Estimate, Method, Start};
use didim_sim::{Scenario, tx40_paper};
use nalgebra::DMatrix;

/// The table has medians over these seeds of the noise.
const SEEDS: [u64; 5] = [1, 2, 3, 4, 5];

/// Root mean square of every column.
fn rms(signals: &DMatrix<f64>) -> Vec<f64> {
    let rows = signals.nrows() as f64;
    signals.column_iter().map(|column| (column.norm_squared() / rows).sqrt()).collect()
}

/// In place of the scenario's noise a disturbance of this share of the torque of each joint, with a
/// correlation time of 20 ms.
fn disturbed(scenario: Scenario, share: f64) -> Scenario {
    let record = scenario.closed_loop().unwrap().run(scenario.samples()).unwrap();
    let disturbance = rms(&record.joint_torque_nm).iter().map(|torque| share * torque).collect();
    let noise = NoiseConfig {
        disturbance_torque_nm: Some(disturbance),
        disturbance_correlation_s: Some(0.02),
        ..NoiseConfig::with_seed(1)
    };
    scenario.with_noise(noise).unwrap()
}

/// Ripple of this share of the torque of each motor, six periods in a turn.
fn cogging(scenario: &Scenario, share: f64) -> Unmodelled {
    let record = scenario.closed_loop().unwrap().run(scenario.samples()).unwrap();
    let of_motor =
        |torque: &f64| Cogging { torque_nm: share * torque, periods_per_turn: 6, phase_rad: 0.0 };
    let cogging = rms(&record.motor_torque_nm).iter().map(of_motor).collect();
    Unmodelled { cogging: Some(cogging), ..Default::default() }
}

/// A third of the inertia of each joint on a spring.
fn flexible(frequency_hz: f64) -> Unmodelled {
    let mode = |inertia_kg_m2| FlexibleMode { frequency_hz, damping_ratio: 0.05, inertia_kg_m2 };
    let modes = [0.4, 0.3, 0.04, 0.01, 0.01, 0.003].map(mode);
    Unmodelled { flexible: Some(modes.into()), ..Default::default() }
}

/// The PD of every joint with `kp_factor` times its Kp, and an integral action Ki = `ki_per_s` Kp.
fn controlled(scenario: Scenario, kp_factor: f64, ki_per_s: f64) -> Scenario {
    let mut controller = scenario.controller().clone();
    for joint in &mut controller.joints {
        let ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm } = joint.law else {
            panic!("the paper's arm has PD controllers");
        };
        joint.law = ControlLaw::Pid {
            kp_per_rad: kp_factor * kp_per_rad,
            kd_s_per_rad,
            ki_per_rad_s: ki_per_s * kp_per_rad,
            k_tau_nm,
            integral_dead_zone_rad: 0.0,
        };
    }
    scenario.with_controller(controller).unwrap()
}

/// Every arm of the table by what it has.
fn arms() -> Vec<(&'static str, Scenario)> {
    let paper = tx40_paper().unwrap();
    let controlled = |kp_factor, ki_per_s| controlled(paper.clone(), kp_factor, ki_per_s);
    let unmodelled = |errors| paper.clone().with_unmodelled(errors).unwrap();
    let width = Unmodelled { coulomb_width_rad_s: Some(0.2), ..Default::default() };
    vec![
        ("nothing", paper.clone()),
        ("disturbance of 7 %, correlated over 20 ms", disturbed(paper.clone(), 0.07)),
        ("friction of width 0.2 in place of 0.05 rad/s", unmodelled(width)),
        ("cogging of 10 %", unmodelled(cogging(&paper, 0.1))),
        ("flexible joints, 30 Hz", unmodelled(flexible(30.0))),
        ("Kp 5 % larger than described", controlled(1.05, 0.0)),
        ("Ki = 0.1 Kp/s that is not described", controlled(1.0, 0.1)),
        ("Ki = 1 Kp/s that is not described", controlled(1.0, 1.0)),
        ("disturbance of 6 % and Ki = 0.2 Kp/s", disturbed(controlled(1.0, 0.2), 0.06)),
    ]
}

const METHODS: [&str; 4] = ["IDIM-LS", "DIDIM", "CLIE", "CLOE"];

/// What [`METHODS`] make of an arm whose controller is taken for that of `tx40-paper`, at the
/// settings of `config/cells/tx40-paper.toml` but for the start.
fn identify(arm: &Scenario) -> [Estimate; 4] {
    let robot = arm.robot();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    let experiment = experiment(arm);
    let options = loop_options(&tx40_paper().unwrap(), 50.0, Start::IdimLs);
    [Method::IdimLs, Method::Didim, Method::Clie, Method::Cloe].map(|method| {
        let identified = didim_identification::identification::identify(
            method,
            robot,
            &base,
            &experiment,
            &options,
        );
        identified.unwrap().estimate
    })
}

/// Parameters of a method that are further than 3 σ of IDIM-LS from IDIM-LS.
fn outside(idim_ls: &Estimate, method: &Estimate) -> usize {
    let pairs = idim_ls.parameters.iter().zip(&method.parameters);
    pairs.filter(|(a, b)| (b.value - a.value).abs() > 3.0 * a.standard_deviation).count()
}

/// How much larger than those of IDIM-LS the parameters of a method are whose names begin so [%];
/// −200 is the same size with the other sign.
fn changes(idim_ls: &Estimate, method: &Estimate, prefix: &str) -> Vec<f64> {
    let pairs = idim_ls.parameters.iter().zip(&method.parameters);
    let named = pairs.filter(|(a, _)| a.name.starts_with(prefix));
    named.map(|(a, b)| 100.0 * (b.value / a.value - 1.0)).collect()
}

/// The middle one of an odd number of values.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// An arm's row, without its name, from the estimates of every seed.
fn cells(seeds: &[[Estimate; 4]]) -> Vec<String> {
    let errors = (0..4).map(|method| {
        let error = median(seeds.iter().map(|found| 100.0 * found[method].relative_error));
        format!("{error:.2}")
    });
    let outside = (1..4).map(|method| {
        let counts = seeds.iter().map(|found| outside(&found[0], &found[method]) as f64);
        median(counts).to_string()
    });
    let changes = ["fc", "fc1", "fc2", "mx4"].map(|prefix| {
        let of_seed = |found: &[Estimate; 4]| median(changes(&found[0], &found[3], prefix));
        // No minus before a zero.
        format!("{:+}", median(seeds.iter().map(of_seed)).round() + 0.0)
    });
    errors.chain(outside).chain(changes).collect()
}

/// The change of every parameter, for who wants more than the table has.
fn all_changes(arm: &str, seeds: &[[Estimate; 4]]) -> String {
    let mut text = format!("{arm}: changes against IDIM-LS [%]\n");
    for parameter in &seeds[0][0].parameters {
        write!(text, "{:>6}", parameter.name).unwrap();
        for method in 1..4 {
            let of_seed =
                |found: &[Estimate; 4]| changes(&found[0], &found[method], &parameter.name)[0];
            let change = median(seeds.iter().map(of_seed));
            write!(text, "  {} {change:+6.1}", METHODS[method]).unwrap();
        }
        text.push('\n');
    }
    text
}

/// The table of these arms, from the estimates of every seed of each.
fn table(arms: &[(&str, Scenario)], found: &[[Estimate; 4]]) -> Table {
    let mut rows = Vec::new();
    for ((arm, _), seeds) in arms.iter().zip(found.chunks_exact(SEEDS.len())) {
        println!("{}", all_changes(arm, seeds));
        rows.push([vec![(*arm).to_owned()], cells(seeds)].concat());
    }
    let columns = vec![
        Column::exact("the arm has"),
        Column::within("error of IDIM-LS [%]", 0.05),
        Column::within("DIDIM", 0.05),
        Column::within("CLIE", 0.05),
        Column::within("CLOE", 0.05),
        Column::within("outside: DIDIM", 1.0),
        Column::within("CLIE", 1.0),
        Column::within("CLOE", 1.0),
        Column::within("change by CLOE [%]: fc", 1.0),
        Column::within("fc1", 1.0),
        Column::within("fc2", 1.0),
        Column::within("mx4", 1.0),
    ];
    Table { document: "paper.md", name: "one error at a time", columns, rows }
}

/// The two main statements on the table as limits, and their two rows as they stand there.
///
/// `DIDIM_WRITE_DOCS=1 cargo test -p didim-sim one_error` runs every arm and writes the table, in
/// minutes; with `--nocapture` it prints the changes of all parameters.
#[test]
fn torque_errors_touch_all_methods_alike_and_an_unknown_controller_touches_cloe() {
    let mut arms = arms();
    let (mut disturbed, mut integrating) = (1, 6);
    if !writing() {
        arms = vec![arms.swap_remove(disturbed), arms.swap_remove(integrating)];
        (disturbed, integrating) = (0, 1);
    }
    let estimates = in_parallel(arms.len() * SEEDS.len(), |run| {
        let (_, arm) = &arms[run / SEEDS.len()];
        identify(&arm.clone().with_seed(SEEDS[run % SEEDS.len()]))
    });
    let table = table(&arms, &estimates);
    println!("{}", table.markdown());
    let seeds: Vec<&[[Estimate; 4]]> = estimates.chunks_exact(SEEDS.len()).collect();
    for [idim_ls, others @ ..] in &seeds[disturbed][..2] {
        for (method, name) in others.iter().zip(&METHODS[1..]) {
            assert!(outside(idim_ls, method) <= 1, "{name}");
        }
    }
    for [idim_ls, didim, clie, cloe] in &seeds[integrating][..2] {
        for method in [didim, clie] {
            let largest = changes(idim_ls, method, "").into_iter().map(f64::abs);
            let largest = largest.fold(0.0, f64::max);
            assert!(largest < 1.0, "{}: {largest} %", method.method);
        }
        assert!(outside(idim_ls, cloe) >= 26);
        assert!(cloe.relative_error > 10.0 * clie.relative_error);
        let fc = changes(idim_ls, cloe, "fc");
        assert!(fc[0] < -5.0 && fc[1] < -5.0 && median(fc.clone()) < -1.0, "{fc:?} %");
    }
    table.check_part(1);
}
