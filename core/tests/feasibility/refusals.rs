//! What cannot be used is an error that says what to do.

use didim_core::feasibility::{Estimate, FeasibilityError, Prior, consistent};

use super::estimates::{Known, states, torques};
use crate::dynamics::arms::{Random, tx40, tx40_physical};

fn known() -> Known {
    let robot = tx40_physical();
    let seen = states(&mut Random(3), 6, 100);
    let exact = torques(&robot, robot.nominal().unwrap().standard(), &seen);
    Known::fit(robot, &seen, &exact, 1.0)
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
    let mut known = known();
    let prior = Prior::geometric(&known.robot, 22.4).unwrap();
    for weight in [0.0, -2.0, f64::NAN, f64::INFINITY] {
        let refused = known.consistent(&prior, weight).unwrap_err();
        assert!(matches!(refused, FeasibilityError::Weight { .. }));
    }
    let good = known.values.clone();
    known.values[3] = f64::NAN;
    let name = known.names[3].clone();
    assert_eq!(known.consistent(&prior, 2.0), Err(FeasibilityError::NoValue { name }));
    known.values = good;

    let fewer = Estimate { values: &known.values[1..], ..known.estimate() };
    let refused = consistent(&known.robot, &known.base, &fewer, &prior, 2.0).unwrap_err();
    assert!(matches!(refused, FeasibilityError::Shape { .. }));
    let mut names = known.names.clone();
    names[0] = "zz9".into();
    let other = Estimate { names: &names, ..known.estimate() };
    let refused = consistent(&known.robot, &known.base, &other, &prior, 2.0).unwrap_err();
    assert!(matches!(refused, FeasibilityError::Unknown(_)), "{refused}");

    let twin = known.covariance.column(0).into_owned();
    known.covariance.set_column(1, &twin);
    known.covariance.set_row(1, &twin.transpose());
    let entry = known.covariance[(0, 0)];
    known.covariance[(1, 1)] = entry;
    assert_eq!(known.consistent(&prior, 2.0), Err(FeasibilityError::Covariance));
}

/// Values of 1e140 cost more than any number of steps takes off: an error, and no values that look like a result.
#[test]
fn what_does_not_converge_is_an_error() {
    let mut known = known();
    let prior = Prior::geometric(&known.robot, 22.4).unwrap();
    known.values.iter_mut().for_each(|value| *value = -1e140);
    let refused = known.consistent(&prior, 2.0).unwrap_err();
    assert!(matches!(refused, FeasibilityError::NotConverged { .. }), "{refused}");
    assert!(refused.to_string().contains("larger weight"), "{refused}");
}
