//! Several recordings: each is simulated by itself.

use didim_dynamics::Signals;
use didim_identification::identification::{
    Estimate, Experiment, IdentificationError, Method, SensitivityMethod, Start, identify,
};
use nalgebra::DMatrix;

use crate::common::arm::Random;
use crate::common::looped::{Looped, RATE_HZ, ZERO_ORDER_HOLD, pd, sampled};

const SIMULATING: [Method; 4] = [Method::IdimIv, Method::Clie, Method::Cloe, Method::Didim];

fn identified(
    looped: &Looped,
    method: Method,
    experiment: &Experiment,
    sensitivities: SensitivityMethod,
) -> Result<Estimate, IdentificationError> {
    let mut options = looped.options();
    options.simulation.start = Start::IdimLs;
    options.simulation.sensitivities = sensitivities;
    // Standard deviations are those of the noise, and what is left of a step shall not be seen.
    options.simulation.convergence.parameter_change = 1e-3;
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    identify(method, robot, base, experiment, &options).map(|found| found.estimate)
}

#[test]
fn a_recording_given_twice_says_what_it_says_once() {
    use SensitivityMethod::{Differences, Exact};

    let looped = Looped::random(70, 2, sampled(0.0), pd);
    let once = looped.record_with(ZERO_ORDER_HOLD, |signals: &mut Signals| {
        let mut random = Random(70);
        signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 0.05 * random.normal());
        signals.position_rad.iter_mut().flatten().for_each(|q| *q += 1e-5 * random.normal());
    });
    let twice = Experiment::join(&[once.clone(), once.clone()]).unwrap();
    let exact = SIMULATING.map(|method| (method, Exact));
    for (method, from) in exact.into_iter().chain([(Method::Clie, Differences)]) {
        let [once, twice] =
            [&once, &twice].map(|of| identified(&looped, method, of, from).unwrap());
        assert_eq!((twice.rows, twice.samples), (2 * once.rows, 2 * once.samples));
        assert_eq!(once.verdict.applicable, twice.verdict.applicable, "{method}: {twice:?}");
        for (once, twice) in once.parameters.iter().zip(&twice.parameters) {
            let shift = (once.value - twice.value).abs() / once.standard_deviation;
            assert!(shift < 1e-3, "{method}, {}: {shift}", once.name);
        }
        let errors = |of: &Estimate| {
            let position = of.relative_position_error_per_joint.clone().unwrap();
            [position, of.simulated_torque_error_per_joint.clone().unwrap()].concat()
        };
        // Both find nothing but noise.
        let controller = |of: &Estimate| of.controller_error_per_joint.clone().unwrap_or_default();
        assert!(controller(&once).iter().chain(&controller(&twice)).all(|size| *size < 1e-3));
        for (once, twice) in errors(&once).into_iter().zip(errors(&twice)) {
            assert!((once - twice).abs() <= 1e-4 * twice, "{method}: {once} {twice}");
        }
    }
}

/// The signals of one recording after those of another, as if it were one.
fn run_together(one: &Experiment, other: &Experiment) -> Experiment {
    let columns = |signal: fn(&Experiment) -> &DMatrix<f64>| -> Vec<Vec<f64>> {
        let both = signal(one).column_iter().zip(signal(other).column_iter());
        both.map(|(one, other)| one.iter().chain(other.iter()).copied().collect()).collect()
    };
    let signals = Signals {
        sample_rate_hz: RATE_HZ,
        position_rad: columns(Experiment::position_rad),
        torque_nm: columns(Experiment::torque_nm),
        reference_rad: Some(columns(|of| of.reference_rad().unwrap())),
    };
    let experiment =
        Experiment::joint_side(&signals).unwrap().with_torque_timing(ZERO_ORDER_HOLD).unwrap();
    let counted = one.counted().start..experiment.samples() - 100;
    experiment.with_counted(counted).unwrap()
}

/// The second one begins at another posture. It counts before a loop that continued from the end of
/// the first would have settled there.
#[test]
fn a_recording_begins_where_it_was_recorded_and_not_where_the_last_one_ended() {
    let mut looped = Looped::random(71, 2, sampled(0.0), pd);
    let samples = looped.reference.nrows();
    let counted = 50..samples - 100;
    let first = looped.record(ZERO_ORDER_HOLD).with_counted(counted.clone()).unwrap();
    let columns = looped.arm.positions(&mut Random(99), samples, RATE_HZ, 2.0);
    looped.reference = DMatrix::from_vec(samples, 2, columns.concat());
    let second = looped.record(ZERO_ORDER_HOLD).with_counted(counted).unwrap();
    let distance = second.position_rad().row(0) - first.position_rad().row(samples - 1);
    assert!(distance.norm() > 0.1, "{distance}");
    let recordings = Experiment::join(&[first.clone(), second.clone()]).unwrap();
    let continued = run_together(&first, &second);
    for method in SIMULATING {
        let [alone, together, continued] =
            [&second, &recordings, &continued].map(|experiment: &Experiment| {
                // From so far away the loop may diverge.
                let estimate =
                    identified(&looped, method, experiment, SensitivityMethod::Exact).ok();
                let errors = estimate.and_then(|found| found.relative_position_error_per_joint);
                errors.map_or(f64::INFINITY, |errors| errors.into_iter().fold(0.0, f64::max))
            });
        println!("{method}: {alone:.1e} alone, {together:.1e} together, {continued:.1e} continued");
        assert!(together < 1e-5, "{method}: {together}");
        assert!(continued > 100.0 * together, "{method}: {together} {continued}");
    }
}
