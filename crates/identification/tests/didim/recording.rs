//! The real recording of a TX40, whose controller is unknown and whose reference was reconstructed
//! from the measured positions.

use didim_dynamics::Signals;
use didim_dynamics::control::{ControlTiming, SimulatedController};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{Robot, SignModel};
use didim_identification::identification::{
    DecimationFilter, Experiment, Method, Options, PositionFilter, Start, identify,
};

use crate::common::dataset::{columns, datasets};

const TX40: &str = include_str!("../../../../config/robots/tx40.toml");

/// The loop is stiff and the reference was fitted to the measured motion, so that the result must
/// be that of IDIM-LS: a bias in alignment, start or simulation would show.
#[test]
#[ignore = "needs the recording in DIDIM_DATASETS: tests/run"]
fn a_stiff_loop_along_the_reconstructed_reference_gives_the_result_of_idim_ls() {
    let folder = datasets();
    let sign_model = SignModel::Tanh { width_rad_s: 0.05 };
    let robot = Robot::from_toml(TX40).unwrap().with_sign_model(sign_model);
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let table = |name: &str| columns(&folder.join(format!("tx40/motor_{name}.csv")));
    let signals = Signals {
        sample_rate_hz: 5000.0,
        position_rad: table("position"),
        torque_nm: table("torque"),
        reference_rad: Some(table("reference_reconstructed")),
    };
    let experiment = Experiment::motor_side(&signals, robot.transmission())
        .unwrap()
        .with_counted(300..37_401)
        .unwrap();
    let names = robot.nominal().unwrap().given_values().iter().map(|(name, _)| name.clone());
    let mut options = Options::new(
        PositionFilter { order: 4, cutoff_hz: 50.0 },
        DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio: 0.8, factor: 100 },
    );
    options.parameters = Some(names.collect());
    // A torque of the instant belongs to a controller that acts at every instant.
    options.controller = Some(SimulatedController::Bandwidth {
        timing: ControlTiming::Continuous { sample_period_s: 2e-4 },
        bandwidth_hz: vec![50.0; 6],
        damping: 0.8,
        acceleration_feed_forward: true,
    });
    options.simulation.start = Start::UnitDriveInertias;
    let equation_error =
        identify(Method::IdimLs, &robot, &base, &experiment, &options).unwrap().estimate;
    let estimate = identify(Method::Didim, &robot, &base, &experiment, &options).unwrap().estimate;
    assert!(estimate.simulations <= 8, "{:?}", estimate.convergence);
    // Usable for monitoring and for the torque, as the result of IDIM-LS, and as uncertain outside
    // the recorded motion.
    assert!(estimate.verdict.applicable, "{:?}", estimate.verdict.reasons);
    let extrapolation_error =
        [&equation_error, &estimate].map(|of| of.extrapolation.relative_error);
    assert!(
        (extrapolation_error[1] / extrapolation_error[0] - 1.0).abs() < 0.2,
        "{extrapolation_error:?}"
    );
    // IDIM-LS has 5.35 %; the reconstruction is a little worse than the measurement itself.
    assert!((0.053..0.058).contains(&estimate.relative_error), "{}", estimate.relative_error);
    for (ours, theirs) in estimate.parameters.iter().zip(&equation_error.parameters) {
        // The classical deviations are half as large as the corrected ones.
        let deviation = theirs.classical_standard_deviation;
        let difference = (ours.value - theirs.value) / deviation;
        assert_eq!(ours.name, theirs.name);
        if deviation < 0.1 * ours.value.abs() {
            assert!(difference.abs() < 2.0, "{}: {difference:.2} standard deviations", ours.name);
        }
    }
}
