//! What is wrong with the input is said, with its place and what to do.

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{
    Experiment, ExperimentError, IdentificationError, Method, Motion, Options, Reason, Selection,
    VerdictLimits, identify, observation_matrix,
};
use didim_identification::signal::SignalError;

use crate::common::arm::{Arm, Random, options, signals};

const SAMPLES: usize = 2000;

fn arm() -> (Arm, Signals) {
    let mut random = Random(4);
    let arm = Arm::random(&mut random, 3);
    let position = arm.positions(&mut random, SAMPLES, 400.0, 3.0);
    let torque = arm.positions(&mut random, SAMPLES, 400.0, 3.0);
    let signals = signals(400.0, position, torque);
    (arm, signals)
}

fn refused(arm: &Arm, signals: &Signals, options: &Options) -> IdentificationError {
    let experiment = Experiment::joint_side(signals).unwrap();
    identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, options).unwrap_err()
}

#[test]
fn signals_that_are_no_experiment_are_refused() {
    let (arm, good) = arm();
    let refused = |change: &dyn Fn(&mut Signals)| {
        let mut signals = good.clone();
        change(&mut signals);
        Experiment::joint_side(&signals).unwrap_err()
    };
    assert_eq!(
        refused(&|s| s.sample_rate_hz = -1.0),
        ExperimentError::SampleRate { sample_rate_hz: -1.0 }
    );
    assert_eq!(
        refused(&|s| _ = s.torque_nm.pop()),
        ExperimentError::Axes { signal: "torque", axes: 2, expected: 3 }
    );
    assert_eq!(
        refused(&|s| _ = s.position_rad[1].pop()),
        ExperimentError::Samples { signal: "position", axis: 2, samples: 1999, expected: 2000 }
    );
    assert_eq!(
        refused(&|s| s.reference_rad = Some(vec![vec![0.0; 5]; 3])),
        ExperimentError::Samples { signal: "reference", axis: 1, samples: 5, expected: 2000 }
    );
    assert_eq!(
        refused(&|s| s.torque_nm[2][77] = f64::INFINITY),
        ExperimentError::NotFinite { signal: "torque", axis: 3, sample: 77, value: f64::INFINITY }
    );
    assert_eq!(refused(&|s| s.position_rad = vec![vec![]; 3]), ExperimentError::Empty);
    assert!(matches!(refused(&|s| s.position_rad.clear()), ExperimentError::Axes { axes: 0, .. }));
    assert!(matches!(
        refused(&|s| s.position_rad = vec![vec![0.0]; 17]),
        ExperimentError::Axes { axes: 17, expected: 16, .. }
    ));
    // Finite at the motor, infinite at the joint.
    let mut signals = good.clone();
    signals.torque_nm[0][3] = 1e308;
    let overflow = Experiment::motor_side(&signals, arm.robot.transmission()).unwrap_err();
    assert!(matches!(
        overflow,
        ExperimentError::NotFinite { signal: "torque", axis: 1, sample: 3, .. }
    ));
    let two = Arm::random(&mut Random(1), 2);
    assert_eq!(
        Experiment::motor_side(&good, two.robot.transmission()).unwrap_err(),
        ExperimentError::Axes { signal: "position", axes: 3, expected: 2 }
    );
}

#[test]
fn impossible_timing_and_ranges_are_refused() {
    let (_, signals) = arm();
    let experiment = Experiment::joint_side(&signals).unwrap();
    for (hold_s, delay_s) in [(-0.1, 0.0), (f64::NAN, 0.0), (0.0, f64::INFINITY), (0.0, -6.0)] {
        let timing = SignalTiming { hold_s, delay_s };
        let refused = experiment.clone().with_torque_timing(timing);
        assert!(matches!(refused, Err(ExperimentError::Timing { signal: "torque", .. })));
        assert!(experiment.clone().with_reference_timing(timing).is_err());
    }
    #[expect(clippy::reversed_empty_ranges, reason = "what a person may type")]
    for counted in [0..0, 5..5, 10..2, 0..2001, 3000..3001] {
        let expected = ExperimentError::Counted { counted: counted.clone(), samples: SAMPLES };
        assert_eq!(experiment.clone().with_counted(counted), Err(expected));
    }
}

#[test]
fn wrong_parameter_lists_are_refused_by_name() {
    let (arm, signals) = arm();
    let refused_with = |names: &[&str]| {
        let mut options = options(20.0, 0.8, 10);
        options.parameters = Some(names.iter().map(|&name| name.to_owned()).collect());
        refused(&arm, &signals, &options)
    };
    let unknown = refused_with(&["fv1", "fv9"]);
    assert!(
        matches!(&unknown, IdentificationError::UnknownParameter { name, available }
            if name == "fv9" && available == arm.base.names()),
        "{unknown}"
    );
    let repeated = IdentificationError::RepeatedParameter { name: "fv1".to_owned() };
    assert_eq!(refused_with(&["fv1", "fc1", "fv1"]), repeated);
    assert_eq!(refused_with(&[]), IdentificationError::NoParameter);
}

#[test]
fn another_arm_is_refused() {
    let (arm, signals) = arm();
    let experiment = Experiment::joint_side(&signals).unwrap();
    let options = options(20.0, 0.8, 10);
    let two = Arm::random(&mut Random(1), 2);
    let refused =
        identify(Method::IdimLs, &two.robot, &two.base, &experiment, &options).unwrap_err();
    assert!(matches!(refused, IdentificationError::JointCount { joints: 2, experiment: 3, .. }));
    let tx40 = Robot::from_toml(include_str!("../../../../config/robots/tx40.toml")).unwrap();
    let foreign = BaseParameters::compute(&Model::new(&tx40)).unwrap();
    let refused =
        identify(Method::IdimLs, &arm.robot, &foreign, &experiment, &options).unwrap_err();
    assert!(matches!(refused, IdentificationError::OtherBaseParameters { .. }), "{refused}");
}

#[test]
fn filters_that_do_not_fit_the_record_are_refused() {
    let (arm, signals) = arm();
    let refusal = refused(&arm, &signals, &options(200.0, 0.8, 10));
    assert_eq!(refusal, IdentificationError::PositionFilter(SignalError::Cutoff { ratio: 1.0 }));
    let refusal = refused(&arm, &signals, &options(20.0, 0.8, 0));
    assert_eq!(refusal, IdentificationError::DecimationFilter(SignalError::Factor));
    let refusal = refused(&arm, &signals, &options(20.0, 0.8, 250));
    assert!(matches!(refusal, IdentificationError::TooFewRows { rows: 24, .. }), "{refusal}");

    let mut short = signals;
    for signal in short.position_rad.iter_mut().chain(&mut short.torque_nm) {
        signal.truncate(27);
    }
    let refusal = refused(&arm, &short, &options(20.0, 0.8, 1));
    assert!(
        matches!(
            refusal,
            IdentificationError::RegressorFilter(SignalError::TooShort { samples: 27, needed: 28 })
        ),
        "{refusal}"
    );
}

#[test]
fn a_joint_at_rest_is_named_by_its_parameters() {
    let (arm, mut signals) = arm();
    signals.position_rad[1].fill(0.7);
    let refusal = refused(&arm, &signals, &options(20.0, 0.8, 10));
    let (IdentificationError::NotExcited { parameters }
    | IdentificationError::RankDeficient { parameters }) = &refusal
    else {
        panic!("{refusal}")
    };
    assert!(parameters.iter().any(|name| name == "fv2"), "{refusal}");
}

#[test]
fn a_silent_torque_is_refused() {
    let (arm, mut signals) = arm();
    signals.torque_nm[2].fill(0.0);
    let refusal = refused(&arm, &signals, &options(20.0, 0.8, 10));
    assert_eq!(refusal, IdentificationError::NoTorque { joint: JointIndex::new(2) });
}

#[test]
fn a_torque_of_the_wrong_sign_is_not_applicable() {
    let (arm, mut signals) = arm();
    let experiment = Experiment::joint_side(&signals).unwrap();
    let options = options(20.0, 0.8, 10);
    let motion = didim_identification::identification::filtered_motion(
        &arm.robot,
        &experiment,
        &options.position_filter,
    )
    .unwrap();
    signals.torque_nm = arm.torques(&motion);
    signals.torque_nm.iter_mut().flatten().for_each(|tau| *tau = -*tau);
    let experiment = Experiment::joint_side(&signals).unwrap();
    let verdict = identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options)
        .unwrap()
        .estimate
        .verdict;
    assert!(!verdict.applicable);
    assert!(matches!(verdict.reasons[0], Reason::WrongSigns { .. }), "{verdict:?}");
}

#[test]
fn torques_of_another_arm_are_not_applicable() {
    let (arm, signals) = arm();
    let experiment = Experiment::joint_side(&signals).unwrap();
    let verdict =
        identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options(20.0, 0.8, 10))
            .unwrap()
            .estimate
            .verdict;
    assert!(verdict.reasons.iter().any(|r| matches!(r, Reason::RelativeError { .. })));
    assert!(verdict.reasons.iter().any(|r| r.to_string().contains("of joint 2")), "{verdict:?}");
}

#[test]
fn options_are_read_strictly() {
    let text = "position_filter = { cutoff_hz = 50 }\ndecimation_filter = { factor = 100 }\n";
    let read: Options = toml::from_str(text).unwrap();
    let mut expected = options(50.0, 0.8, 100);
    assert_eq!(read, expected);
    let read: Options =
        toml::from_str(&format!("{text}parameters = ['fv1']\nlimits = {{ relative_error = 0.2 }}"))
            .unwrap();
    expected.parameters = Some(vec!["fv1".to_owned()]);
    expected.limits.relative_error = 0.2;
    assert_eq!(read, expected);
    for bad in [
        "position_filter = { order = 4 }\ndecimation_filter = { factor = 100 }",
        "position_filter = { cutoff_hz = 50, cut = 1 }\ndecimation_filter = { factor = 100 }",
        "position_filter = { cutoff_hz = 50 }\ndecimation_filter = { ratio = 100 }",
        "position_filter = { cutoff_hz = 50 }\ndecimation_filter = { factor = 100 }\nfoo = 1",
        "position_filter = { cutoff_hz = 50 }\ndecimation_filter = { factor = 1 }\nlimits = { a = \
        1 }",
    ] {
        assert!(toml::from_str::<Options>(bad).is_err(), "{bad}");
    }
}

#[test]
fn methods_are_known_by_name() {
    for method in Method::ALL {
        assert_eq!(method.name().parse(), Ok(method));
        assert_eq!(method.to_string(), method.name());
    }
    let unknown = "idim".parse::<Method>().unwrap_err();
    let method_names = "idim-ls, idim-iv, clie, cloe, didim";
    assert_eq!(unknown.to_string(), format!("unknown method \"idim\"; known: {method_names}"));
}

#[test]
fn counted_samples_need_their_torque_in_the_record() {
    let (arm, signals) = arm();
    let options = options(20.0, 0.8, 10);
    let period_s = 1.0 / signals.sample_rate_hz;
    let identify = |periods: f64, counted: std::ops::Range<usize>| {
        let timing = SignalTiming { hold_s: 0.0, delay_s: periods * period_s };
        let experiment = Experiment::joint_side(&signals).unwrap();
        let experiment = experiment.with_torque_timing(timing).unwrap();
        identify(
            Method::IdimLs,
            &arm.robot,
            &arm.base,
            &experiment.with_counted(counted).unwrap(),
            &options,
        )
    };
    for (periods, counted) in [(50.0, 49..SAMPLES), (50.0, 0..1000), (-50.0, 0..SAMPLES - 48)] {
        let counted = counted.start.saturating_sub(1)..counted.end;
        let error = identify(periods, counted.clone()).unwrap_err();
        let IdentificationError::TorqueOutside { counted: named, samples, .. } = &error else {
            panic!("{error}");
        };
        assert_eq!((named, *samples), (&counted, SAMPLES));
        assert!(error.to_string().contains("count fewer samples"), "{error}");
    }
    for (periods, counted) in [(50.0, 50..SAMPLES), (-50.0, 0..SAMPLES - 50), (0.5, 0..SAMPLES)] {
        let outcome = identify(periods, counted);
        assert!(!matches!(outcome, Err(IdentificationError::TorqueOutside { .. })), "{outcome:?}");
    }
}

#[test]
fn limits_that_nothing_can_be_held_against_are_refused_by_name() {
    type Limit = fn(&mut VerdictLimits) -> &mut f64;

    let (arm, signals) = arm();
    let experiment = Experiment::joint_side(&signals).unwrap();
    let good = options(20.0, 0.8, 10);
    assert_eq!(good.limits.validate(), Ok(()));
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let set: [(&str, Limit); 4] = [
            ("condition_number", |limits| &mut limits.condition_number),
            ("relative_error", |limits| &mut limits.relative_error),
            ("relative_error_per_joint", |limits| &mut limits.relative_error_per_joint),
            ("negative_deviations", |limits| &mut limits.negative_deviations),
        ];
        for (name, limit) in set {
            let mut options = good.clone();
            *limit(&mut options.limits) = bad;
            let error =
                identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options).unwrap_err();
            assert!(error.to_string().starts_with(&format!("limit {name} = ")), "{error}");
        }
    }
}

#[test]
fn a_regressor_that_cannot_be_filtered_is_of_no_joint() {
    let (arm, _) = arm();
    let decimation = options(20.0, 0.8, 10).decimation_filter.design().unwrap();
    let selection = Selection::new(&arm.robot, &arm.base, None).unwrap();
    let few = nalgebra::DMatrix::zeros(5, arm.robot.joints());
    let motion = Motion::from_matrices(few.clone(), few.clone(), few);
    let error = observation_matrix(&arm.model, &selection, &motion, &decimation, 0..5);
    assert!(matches!(error, Err(IdentificationError::RegressorFilter(_))), "{error:?}");
}
