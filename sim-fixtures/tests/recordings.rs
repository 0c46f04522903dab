//! Two motions of the simulated TX40 in one identification.

use didim_dynamics::SignalTiming;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationConfig};
use didim_identification::identification::{Experiment, Method, Start, identify};

use crate::common::experiment::{MOTIONS, loop_options, on_motion};

/// What the drives log of a motion without noise. The loop forgets in two seconds that its initial
/// velocity is known as well as the filter shows it.
fn record(motion: Option<u64>) -> Experiment {
    let scenario = on_motion(motion);
    let record = ClosedLoop::new(
        scenario.robot(),
        scenario.standard_parameters(),
        scenario.controller(),
        scenario.trajectory(),
        &SimulationConfig::default(),
        InitialState::OnReference,
    );
    let record = record.unwrap().run(scenario.samples()).unwrap();
    let hold_s = scenario.controller().timing.sample_period_s();
    Experiment::motor_side(record.motor_signals(), scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
        .with_counted(10_000..scenario.samples() - 500)
        .unwrap()
}

#[test]
fn two_motions_together_give_the_truth_back_as_one_does() {
    let motions = MOTIONS.map(record);
    let scenario = on_motion(None);
    let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
    let mut options = loop_options(&scenario, 200.0, Start::IdimLs);
    let together = Experiment::join(&motions[1..]).unwrap();
    // Instruments of an exact motion are no better than the measured one, which the filter smooths.
    for (method, most) in
        [(Method::IdimIv, 1e-3), (Method::Clie, 1e-7), (Method::Cloe, 1e-7), (Method::Didim, 1e-7)]
    {
        if method == Method::Didim {
            // Standard deviations of IDIM-LS, which are large compared with those without noise.
            options.simulation.convergence.parameter_change = 1e-8;
        }
        let [one, two] = [&motions[1], &together].map(|experiment| {
            let identified =
                identify(method, scenario.robot(), &base, experiment, &options).unwrap();
            identified.estimate.parameters.iter().fold(0.0, |largest: f64, p| {
                largest.max((p.value / scenario.truth_of(&p.name).unwrap() - 1.0).abs())
            })
        });
        println!("{method}: {one:.1e} of one, {two:.1e} of two");
        assert!(two < most, "{method}: {one} {two}");
    }
}
