//! What cannot be used is an error that says what to do.

use didim_identification::feasibility::{
    Estimate, FeasibilityError, FeasibilityLimits, Prior, fit_consistent,
};

use super::estimates::{Example, states, torques};
use crate::arms::{Random, tx40, tx40_physical};

fn example() -> Example {
    let robot = tx40_physical();
    let seen = states(&mut Random(3), 6, 100);
    let exact = torques(&robot, robot.nominal().unwrap().standard_parameters(), &seen);
    Example::fit(robot, &seen, &exact, 1.0)
}

#[test]
fn priors_have_to_be_bodies() {
    assert_eq!(Prior::nominal(&tx40()), Err(FeasibilityError::NominalIsNoBody { link: 1 }));
    for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = Prior::geometric(&tx40(), mass).unwrap_err();
        assert!(refused.to_string().contains("data sheet"), "{refused}");
    }
}

#[test]
fn weights_and_estimates_have_to_be_numbers() {
    let mut example = example();
    let prior = Prior::geometric(&example.robot, 22.4).unwrap();
    for weight in [0.0, -2.0, f64::NAN, f64::INFINITY] {
        let refused = example.consistent(&prior, weight).unwrap_err();
        assert!(matches!(refused, FeasibilityError::Weight { .. }));
    }
    let good = example.values.clone();
    example.values[3] = f64::NAN;
    let name = example.names[3].clone();
    assert_eq!(example.consistent(&prior, 2.0), Err(FeasibilityError::NoValue { name }));
    example.values = good;

    let fewer = Estimate { values: &example.values[1..], ..example.estimate() };
    let refused = fit_consistent(
        &example.robot,
        &example.base,
        &fewer,
        &prior,
        2.0,
        &FeasibilityLimits::default(),
    )
    .unwrap_err();
    assert!(matches!(refused, FeasibilityError::Shape { .. }));
    let mut names = example.names.clone();
    names[0] = "zz9".into();
    let other = Estimate { names: &names, ..example.estimate() };
    let refused = fit_consistent(
        &example.robot,
        &example.base,
        &other,
        &prior,
        2.0,
        &FeasibilityLimits::default(),
    )
    .unwrap_err();
    assert!(matches!(refused, FeasibilityError::Unknown(_)), "{refused}");

    let matching = example.covariance.column(0).into_owned();
    example.covariance.set_column(1, &matching);
    example.covariance.set_row(1, &matching.transpose());
    let entry = example.covariance[(0, 0)];
    example.covariance[(1, 1)] = entry;
    assert_eq!(example.consistent(&prior, 2.0), Err(FeasibilityError::Covariance));
}

/// Values of 1e140 cost more than any number of steps takes off: an error, and no values that look
/// like a result.
#[test]
fn what_does_not_converge_is_an_error() {
    let mut example = example();
    let prior = Prior::geometric(&example.robot, 22.4).unwrap();
    example.values.iter_mut().for_each(|value| *value = -1e140);
    let refused = example.consistent(&prior, 2.0).unwrap_err();
    assert!(matches!(refused, FeasibilityError::NotConverged { .. }), "{refused}");
    assert!(refused.to_string().contains("larger weight"), "{refused}");
}
