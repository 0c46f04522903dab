//! The TX40 whose links are bodies: right signs, wrong ones, and another unit of mass.

use didim_dynamics::robot::Robot;
use didim_identification::feasibility::{
    Estimate, FeasibilityError, FeasibilityLimits, FixedParameter, Judgement, Outcome, Prior,
    PriorSource, StandardParameter, ValueSource, fit_consistent as solve,
};
use nalgebra::DVector;

use super::estimates::{Example, states, torques};
use crate::arms::{Random, TX40_PHYSICAL, difference, tx40_physical};

const TOTAL_MASS_KG: f64 = 22.4;

/// An estimate from torques with 5 % noise, which `wrong` may change at joint and sample.
fn measured(robot: Robot, wrong: impl Fn(usize, f64) -> f64) -> Example {
    let mut random = Random(7);
    let seen = states(&mut random, 6, 300);
    let arm = tx40_physical();
    let exact = torques(&arm, arm.nominal().unwrap().standard_parameters(), &seen);
    let noise = 0.05 * exact.norm() / (exact.len() as f64).sqrt();
    let mut normal = || (0..12).map(|_| random.uniform(-0.5, 0.5)).sum::<f64>();
    let torques =
        exact.iter().enumerate().map(|(k, torque)| wrong(k % 6, *torque) + noise * normal());
    let torques = DVector::from_vec(torques.collect());
    Example::fit(robot, &seen, &torques, noise)
}

fn consistent(example: &Example) -> Outcome {
    let prior = Prior::geometric(&example.robot, TOTAL_MASS_KG).unwrap();
    example.consistent(&prior, prior.default_weight()).unwrap()
}

#[test]
fn its_estimate_is_feasible_and_says_what_of_it_is_the_priors() {
    let case = measured(tx40_physical(), |_, torque| torque);
    let outcome = consistent(&case);
    println!("J {} of {}, D {:?}", outcome.cost, outcome.threshold, outcome.divergence_per_link);
    println!(
        "least J {}, {:?}, {} steps",
        outcome.least_cost,
        outcome.largest_shift(),
        outcome.steps
    );
    assert_eq!(outcome.judgement, Judgement::Feasible);
    assert_eq!(outcome.prior, PriorSource::Geometry { total_mass_kg: TOTAL_MASS_KG });
    assert!(outcome.negative_parameters.is_empty() && outcome.least_cost < 20.0);
    // Six offsets, and what is known of the set without them.
    let count = |class| outcome.parameters.iter().filter(|own| own.class == class).count();
    let classes =
        [ValueSource::Data, ValueSource::Combination, ValueSource::Prior, ValueSource::Absent]
            .map(count);
    assert_eq!(classes, [39 + 6, 30, 11, 0]);
    // χ² of 60 at 99 %, by its table.
    assert!((outcome.threshold - 88.379).abs() < 1e-3, "{}", outcome.threshold);

    // Facts besides the class: a mass that no torque depends on keeps about its prior uncertainty.
    let parameter = |name: &str| outcome.parameters.iter().find(|own| own.name == name).unwrap();
    assert!(
        parameter("m1").deviation > 0.5 * parameter("m1").value
            && parameter("fv1").deviation < 0.1 * parameter("fv1").value
    );
    assert!(parameter("off1").share_of_data >= 1.0);
}

/// With CAD right, the bodies stay CAD's where the data say nothing, and the data cost nothing.
#[test]
fn nominal_bodies_are_a_prior() {
    let case = measured(tx40_physical(), |_, torque| torque);
    let prior = Prior::nominal(&case.robot).unwrap();
    let outcome = case.consistent(&prior, prior.default_weight()).unwrap();
    assert_eq!((outcome.prior, outcome.weight), (PriorSource::Nominal, 22.0));
    assert_eq!(outcome.judgement, Judgement::Feasible);
    assert!(outcome.divergence_per_link.iter().sum::<f64>() < 2.0, "{outcome:?}");
    let (found, truth) = (&outcome.parameters, case.robot.nominal().unwrap().standard_parameters());
    for (own, truth) in found.iter().zip(truth) {
        assert!((own.value - truth).abs() < 4.0 * own.deviation + 1e-12, "{own:?}, {truth}");
    }
}

#[test]
fn a_reversed_torque_is_infeasible_and_shows_in_friction_first() {
    for joint in 0..3 {
        let case = measured(tx40_physical(), |at, tau| if at == joint { -tau } else { tau });
        let outcome = consistent(&case);
        println!("joint {joint}: least J {}, {} steps", outcome.least_cost, outcome.steps);
        assert_eq!(outcome.judgement, Judgement::Infeasible);
        let names: Vec<&str> =
            outcome.negative_parameters.iter().map(|own| own.name.as_str()).collect();
        let [fv, fc] = ["fv", "fc"].map(|kind| format!("{kind}{}", joint + 1));
        assert!(names.contains(&fv.as_str()) && names.contains(&fc.as_str()), "{names:?}");
        assert!(outcome.link_bodies.iter().all(|body| body.is_possible()));
    }
}

/// A base on the ceiling whose file says floor: bodies fit, but ones that nobody builds.
#[test]
fn reversed_gravity_contradicts_the_prior() {
    let ceiling = TX40_PHYSICAL.replace("[0.0, 0.0, -9.81]", "[0.0, 0.0, 9.81]");
    let case = measured(Robot::from_toml(&ceiling).unwrap(), |_, torque| torque);
    let outcome = consistent(&case);
    println!("least J {}, D {:?}", outcome.least_cost, outcome.divergence_per_link);
    assert_eq!(outcome.judgement, Judgement::ContradictsPrior);
}

/// In grams, with the prior's bodies and the estimate in grams, everything is the same but the
/// unit.
#[test]
fn another_unit_of_mass_changes_nothing() {
    let mut case = measured(tx40_physical(), |_, torque| torque);
    let consistent_of = |example: &Example| {
        example.consistent(&Prior::nominal(&example.robot).unwrap(), 2.0).unwrap()
    };
    let kilograms = consistent_of(&case);
    case.robot = case.robot.with_scaled_nominal(|_| 1000.0);
    case.values.iter_mut().for_each(|value| *value *= 1000.0);
    case.covariance *= 1e6;
    let grams = consistent_of(&case);
    let scaled: Vec<f64> = kilograms.standard_values().iter().map(|value| 1000.0 * value).collect();
    assert!(difference(&scaled, &grams.standard_values()) < 1e-7);
    assert!((kilograms.objective / grams.objective - 1.0).abs() < 1e-9);
    assert_eq!(kilograms.judgement, grams.judgement);
}

/// Without fv_m6 and off1, as in a model that lacks them, and with mx4 fixed at a value. The
/// coupled joints' viscous friction is two numbers then, missing parameters are 0, and fixed values
/// stay.
#[test]
fn what_a_model_lacks_is_0_and_what_it_keeps_is_held() {
    let case = measured(tx40_physical(), |_, torque| torque);
    let left_out = ["fv_m6", "off1", "mx4"];
    let rows: Vec<usize> = (0..case.names.len())
        .filter(|&row| !left_out.contains(&case.names[row].as_str()))
        .collect();
    let names: Vec<String> = rows.iter().map(|&row| case.names[row].clone()).collect();
    let values: Vec<f64> = rows.iter().map(|&row| case.values[row]).collect();
    let covariance = case.covariance.select_rows(&rows).select_columns(&rows);
    let fixed = [FixedParameter { name: "mx4".into(), value: 0.0145, deviation: 1e-5 }];
    let estimate =
        Estimate { names: &names, values: &values, covariance: &covariance, fixed: &fixed };
    let prior = Prior::geometric(&case.robot, TOTAL_MASS_KG).unwrap();
    let outcome =
        solve(&case.robot, &case.base, &estimate, &prior, 2.0, &FeasibilityLimits::default())
            .unwrap();
    let parameter = |name: &str| outcome.parameters.iter().find(|own| own.name == name).unwrap();
    for name in ["fv_m6", "off1"] {
        let StandardParameter { value, deviation, class, .. } = *parameter(name);
        assert_eq!((value, deviation, class), (0.0, 0.0, ValueSource::Absent), "{name}");
    }
    assert!(
        (parameter("mx4").value - 0.0145).abs() < 1e-4
            && parameter("mx4").class == ValueSource::Data
    );
    assert_eq!(outcome.shifts.last().unwrap().name, "mx4");
    assert!(outcome.largest_shift().unwrap().deviations.powi(2) < outcome.cost);

    let bare = Estimate { fixed: &[], ..estimate };
    let refused = solve(&case.robot, &case.base, &bare, &prior, 2.0, &FeasibilityLimits::default())
        .unwrap_err();
    assert_eq!(refused, FeasibilityError::LeftOut { names: vec!["mx4".into()] });
}
