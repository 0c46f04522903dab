//! An exact model accuses nothing: no finding of a cause, at any noise, by any method.

use std::collections::BTreeSet;

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::Robot;
use didim_dynamics::simulation::NoiseConfig;
use didim_identification::identification::{
    Estimate, FindingCode, IdentificationError, Method, Start, identify,
};
use didim_sim::Scenario;

use crate::common::experiment::{MOTIONS, experiment, listed, on_motion, regression, with_loop};
use crate::common::parallel::in_parallel;
use crate::common::table::{Column, Table, writing};

/// Seeds of the noise where the table is written; the gate has the first alone.
const SEEDS: u64 = 3;

/// Largest share of results with a finding that accuses.
const ACCUSED_SHARE: f64 = 0.01;

/// Noise of the arm, which its controller feels.
struct Noise {
    name: &'static str,
    /// Disturbance torque as a share of the rms torque of each joint.
    disturbance: f64,
    /// Correlation time of the disturbance \[s\]; white without one.
    correlation_s: Option<f64>,
    /// Noise of each position, at the joint \[deg\].
    position_deg: f64,
}

const NOISES: [Noise; 7] = [
    Noise { name: "none", disturbance: 0.0, correlation_s: None, position_deg: 0.0 },
    Noise { name: "0.2 %, white", disturbance: 0.002, correlation_s: None, position_deg: 0.0 },
    Noise { name: "2 %, white", disturbance: 0.02, correlation_s: None, position_deg: 0.0 },
    Noise { name: "2 %, 20 ms", disturbance: 0.02, correlation_s: Some(0.02), position_deg: 0.0 },
    Noise { name: "20 %, white", disturbance: 0.2, correlation_s: None, position_deg: 0.0 },
    Noise { name: "20 %, 20 ms", disturbance: 0.2, correlation_s: Some(0.02), position_deg: 0.0 },
    Noise {
        name: "2 %, 20 ms, positions 0.001°",
        disturbance: 0.02,
        correlation_s: Some(0.02),
        position_deg: 1e-3,
    },
];

/// An arm whose model and configuration are exact.
struct Arm {
    name: &'static str,
    /// Scenario and robot file, with all base parameters. Without them the paper's arm with its
    /// essential parameters.
    files: Option<(&'static str, &'static str)>,
}

const ARMS: [Arm; 5] = [
    Arm { name: "TX40, 28", files: None },
    Arm {
        name: "TX40, 60",
        files: Some((
            include_str!("../../scenarios/tx40-physical.toml"),
            include_str!("../../../config/robots/tx40-physical.toml"),
        )),
    },
    Arm {
        name: "UR5e",
        files: Some((
            include_str!("../../scenarios/ur5e.toml"),
            include_str!("../../../config/robots/ur5e.toml"),
        )),
    },
    Arm {
        name: "PiPER",
        files: Some((
            include_str!("../../scenarios/piper.toml"),
            include_str!("../../../config/robots/piper.toml"),
        )),
    },
    Arm {
        name: "OpenArm",
        files: Some((
            include_str!("../../scenarios/openarm.toml"),
            include_str!("../../../config/robots/openarm.toml"),
        )),
    },
];

/// Returns true for a finding that names a cause: a wrong value, signal or law. The others are
/// figures beyond their limits, checks that did not run, and properties of the method, the filters
/// or the motion.
fn accuses(code: FindingCode) -> bool {
    use FindingCode as Code;
    !matches!(
        code,
        Code::ConditionNumber
            | Code::TorqueUncertainty
            | Code::RelativeError
            | Code::JointError
            | Code::FewRows
            | Code::Extrapolation
            | Code::JointExtrapolation
            | Code::JointAtRest
            | Code::CrossValidation
            | Code::TooFewMotions
            | Code::ParameterUncertainty
            | Code::ColouredResiduals
            | Code::PositionFilterUnchecked
            | Code::PositionNoiseUnchecked
            | Code::TorqueDelayUnchecked
            | Code::ControllerUnchecked
            | Code::FilterBias
            | Code::NoiseBias
            | Code::TorqueLimitOpen
            | Code::Insensitive
    )
}

/// Returns the exact scenario of an arm. Its robot has the truth as nominal parameters.
fn scenario_of(arm: &Arm, seed: u64) -> Scenario {
    match arm.files {
        Some((scenario, robot)) => {
            Scenario::from_toml(scenario, Robot::from_toml(robot).unwrap()).unwrap()
        }
        None => {
            let place = usize::try_from(seed - 1).unwrap() % MOTIONS.len();
            on_motion(MOTIONS[place])
        }
    }
}

fn with_noise(scenario: Scenario, noise: &Noise, seed: u64) -> Scenario {
    let quiet = scenario.with_noise(NoiseConfig::with_seed(seed)).unwrap();
    let torque = quiet.closed_loop().unwrap().run(quiet.samples()).unwrap().joint_torque_nm;
    let rows = torque.nrows() as f64;
    let disturbance = (torque.column_iter())
        .map(|column| noise.disturbance * column.norm() / rows.sqrt())
        .collect();
    let transmission = quiet.robot().transmission();
    let position = (0..quiet.robot().joints())
        .map(|motor| noise.position_deg.to_radians() * transmission.row(motor)[motor].abs());
    let noise = NoiseConfig {
        motor_position_rad: (noise.position_deg > 0.0).then(|| position.collect()),
        disturbance_torque_nm: (noise.disturbance > 0.0).then_some(disturbance),
        disturbance_correlation_s: noise.correlation_s,
        ..NoiseConfig::with_seed(seed)
    };
    quiet.with_noise(noise).unwrap()
}

/// Identifies an exact arm.
fn estimated(
    (arm, noise, seed): (&Arm, &Noise, u64),
    method: Method,
) -> Result<Estimate, IdentificationError> {
    let scenario = with_noise(scenario_of(arm, seed), noise, seed);
    let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
    let parameters = match arm.files {
        Some(_) => base.names().to_vec(),
        None => listed(&scenario),
    };
    let options = with_loop(regression(Some(parameters), 200.0), &scenario, Start::IdimLs);
    let experiment = experiment(&scenario);
    identify(method, scenario.robot(), &base, &experiment, &options).map(|found| found.estimate)
}

/// Returns the codes of the findings that accuse, each once, or the failure of the method.
fn accusations(
    found: Result<Estimate, IdentificationError>,
) -> Result<BTreeSet<&'static str>, String> {
    let estimate = found.map_err(|error| error.to_string())?;
    let findings = estimate.verdict.findings();
    let accused = findings.iter().filter(|finding| accuses(finding.code));
    Ok(accused.map(|finding| finding.code.name()).collect())
}

/// One result: arm, noise, method and seed.
type Case = (&'static Arm, &'static Noise, Method, u64);

fn cases(arms: &'static [Arm], noises: &[&'static Noise], seeds: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for arm in arms {
        for noise in noises {
            for method in Method::ALL {
                cases.extend((1..=seeds).map(|seed| (arm, *noise, method, seed)));
            }
        }
    }
    cases
}

/// Every arm, noise and method where the table is written; otherwise the arm of the paper at three
/// noises.
#[test]
fn an_exact_model_accuses_nothing() {
    let cases = match writing() {
        true => cases(&ARMS, &NOISES.each_ref(), SEEDS),
        false => cases(&ARMS[..1], &[&NOISES[0], &NOISES[3], &NOISES[6]], 1),
    };
    let outcomes = in_parallel(cases.len(), |index| {
        let (arm, noise, method, seed) = cases[index];
        let outcome = accusations(estimated((arm, noise, seed), method));
        println!("{}, {}, {}, seed {seed}: {outcome:?}", arm.name, noise.name, method.name());
        outcome
    });
    let judged: Vec<_> = outcomes.iter().flatten().collect();
    let accused = judged.iter().filter(|codes| !codes.is_empty()).count();
    assert!(2 * judged.len() > cases.len(), "{} of {} have a result", judged.len(), cases.len());
    if writing() {
        table(&cases, &outcomes).check();
    }
    let share = accused as f64 / judged.len() as f64;
    assert!(share <= ACCUSED_SHARE, "{accused} of {} accuse", judged.len());
}

/// Returns a row for each arm and noise.
fn table(cases: &[Case], outcomes: &[Result<BTreeSet<&'static str>, String>]) -> Table {
    let mut rows = Vec::new();
    for arm in &ARMS {
        for noise in &NOISES {
            let is_own = |of: &Case| of.0.name == arm.name && of.1.name == noise.name;
            let own: Vec<_> = cases.iter().zip(outcomes).filter(|(of, _)| is_own(of)).collect();
            let judged: Vec<_> = own.iter().filter_map(|(_, of)| of.as_ref().ok()).collect();
            let accused = judged.iter().filter(|codes| !codes.is_empty()).count();
            let codes: BTreeSet<&str> =
                judged.iter().flat_map(|codes| codes.iter().copied()).collect();
            let without = own.iter().filter(|(_, of)| of.is_err()).map(|(of, _)| of.2.name());
            let without: BTreeSet<&str> = without.collect();
            let list = |of: BTreeSet<&str>| match of.is_empty() {
                true => "none".to_owned(),
                false => of.into_iter().collect::<Vec<_>>().join(", "),
            };
            rows.push(vec![
                arm.name.to_owned(),
                noise.name.to_owned(),
                judged.len().to_string(),
                accused.to_string(),
                list(codes),
                (own.len() - judged.len()).to_string(),
                list(without),
            ]);
        }
    }
    let titles = ["arm", "noise", "results", "that accuse", "findings", "not converged", "of"];
    let columns = titles.map(Column::exact).into();
    Table { document: "truth.md", name: "exact models", columns, rows }
}
