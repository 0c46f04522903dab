//! Small random arms under control, recorded without noise.

use didim_dynamics::control::{
    ControlLaw, ControlTiming, ControllerConfig, JointController, SimulatedController,
};
use didim_dynamics::robot::ParameterKind;
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationConfig};
use didim_dynamics::trajectory::{ReferenceInterpolation, SampledReference};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{
    Experiment, Identification, Method, Options, Start, filtered_motion, identify,
    mean_joint_inertia,
};
use nalgebra::{DMatrix, DVectorView};

use crate::common::arm::{Arm, Random, options};

pub(crate) const RATE_HZ: f64 = 1000.0;
pub(crate) const PERIOD_S: f64 = 1.0 / RATE_HZ;
/// When the torque of a controller without computation delay acts.
pub(crate) const ZERO_ORDER_HOLD: SignalTiming = SignalTiming { hold_s: PERIOD_S, delay_s: 0.0 };
const SAMPLES: usize = 7000;

pub(crate) fn sampled(computation_delay_s: f64) -> ControlTiming {
    ControlTiming::Sampled { sample_period_s: PERIOD_S, computation_delay_s }
}

/// An arm whose reference and controller are known.
pub(crate) struct Looped {
    pub(crate) arm: Arm,
    pub(crate) reference: DMatrix<f64>,
    pub(crate) controller: ControllerConfig,
    /// What the drive makes of the reference between its samples.
    pub(crate) interpolation: ReferenceInterpolation,
}

/// Proportional and derivative control of 10 Hz for a joint of this inertia.
pub(crate) fn pd(inertia: f64) -> ControlLaw {
    pd_of(10.0, inertia)
}

pub(crate) fn pd_of(bandwidth_hz: f64, inertia: f64) -> ControlLaw {
    let omega = 2.0 * std::f64::consts::PI * bandwidth_hz;
    ControlLaw::Pd { kp_per_rad: omega * omega, kd_s_per_rad: 1.6 * omega, k_tau_nm: inertia }
}

impl Looped {
    pub(crate) fn random(
        seed: u64,
        joints: usize,
        timing: ControlTiming,
        law: impl Fn(f64) -> ControlLaw,
    ) -> Self {
        Self::of_inertia(1.0, seed, joints, timing, law)
    }

    /// With masses and inertias so many times as large.
    pub(crate) fn of_inertia(
        factor: f64,
        seed: u64,
        joints: usize,
        timing: ControlTiming,
        law: impl Fn(f64) -> ControlLaw,
    ) -> Self {
        use ParameterKind::{Fc, FcMotor, Fv, FvMotor, Off};

        let mut random = Random(seed);
        let mut arm = Arm::random(&mut random, joints);
        for (value, parameter) in arm.truth.iter_mut().zip(arm.robot.parameters().parameters()) {
            if !matches!(parameter.kind, Fv | Fc | FvMotor | FcMotor | Off) {
                *value *= factor;
            }
        }
        Self::of_arm(arm, random, timing, law)
    }

    /// With torques that are measured behind the gear: no drive inertias.
    pub(crate) fn behind_the_gear(seed: u64, joints: usize) -> Self {
        let mut random = Random(seed);
        let arm = Arm::random_with(&mut random, joints, false);
        Self::of_arm(arm, random, sampled(0.0), pd)
    }

    /// With friction of its own in every joint.
    pub(crate) fn with_friction_laws(seed: u64, joints: usize) -> Self {
        let mut random = Random(seed);
        let arm = Arm::random(&mut random, joints).with_friction_laws(&mut random);
        Self::of_arm(arm, random, sampled(0.0), pd)
    }

    /// With friction that grows with the load in every joint.
    pub(crate) fn with_load_friction(seed: u64, joints: usize) -> Self {
        let mut random = Random(seed);
        let arm = Arm::random(&mut random, joints).with_load_friction(&mut random);
        Self::of_arm(arm, random, sampled(0.0), pd)
    }

    /// With friction that lags at reversals in every joint.
    pub(crate) fn with_hysteresis(seed: u64, joints: usize, timing: ControlTiming) -> Self {
        let mut random = Random(seed);
        let arm = Arm::random(&mut random, joints).with_hysteresis(&mut random);
        Self::of_arm(arm, random, timing, pd)
    }

    /// With springs and cylinders at its joints, and a file that states its parameters.
    pub(crate) fn with_known_torques(
        seed: u64,
        joints: usize,
        law: impl Fn(f64) -> ControlLaw,
    ) -> Self {
        let mut random = Random(seed);
        let arm = Arm::random(&mut random, joints).with_known_torques();
        Self::of_arm(arm, random, sampled(0.0), law)
    }

    fn of_arm(
        arm: Arm,
        mut random: Random,
        timing: ControlTiming,
        law: impl Fn(f64) -> ControlLaw,
    ) -> Self {
        let joints = arm.robot.joints();
        let columns = arm.positions(&mut random, SAMPLES, RATE_HZ, 2.0);
        let reference = DMatrix::from_vec(SAMPLES, joints, columns.concat());
        let inertia = mean_joint_inertia(&arm.model, &arm.truth, &reference);
        let joint = |&inertia: &f64| JointController {
            law: law(inertia),
            feed_forward: Default::default(),
            torque_limit_nm: None,
        };
        let controller = ControllerConfig { timing, joints: inertia.iter().map(joint).collect() };
        let interpolation = ReferenceInterpolation::Cubic;
        Self { arm, reference, controller, interpolation }
    }

    /// What a log of the loop holds: measured positions, commanded torques and the reference.
    pub(crate) fn record(&self, torque_timing: SignalTiming) -> Experiment {
        self.record_with(torque_timing, |_| {})
    }

    /// The same with something done to the signals.
    pub(crate) fn record_with(
        &self,
        torque_timing: SignalTiming,
        change: impl Fn(&mut Signals),
    ) -> Experiment {
        let reference = SampledReference::new(RATE_HZ, &self.reference)
            .unwrap()
            .with_interpolation(self.interpolation);
        let periods = match PERIOD_S / self.controller.timing.sample_period_s() {
            ratio if ratio > 1.5 => 2,
            _ => 1,
        };
        let mut closed_loop = ClosedLoop::new(
            &self.arm.robot,
            &self.arm.truth,
            &self.controller,
            &reference,
            &SimulationConfig::default(),
            InitialState::OnReference,
        )
        .unwrap();
        let record = closed_loop.run(periods * SAMPLES).unwrap();
        fn columns(matrix: &DMatrix<f64>, periods: &usize) -> Vec<Vec<f64>> {
            let every = |c: DVectorView<'_, f64>| c.iter().copied().step_by(*periods).collect();
            matrix.column_iter().map(every).collect()
        }
        let mut signals = Signals {
            sample_rate_hz: RATE_HZ,
            position_rad: columns(&record.joint_position_rad, &periods),
            torque_nm: columns(&record.joint_torque_nm, &periods),
            reference_rad: Some(
                self.reference.column_iter().map(|c| c.iter().copied().collect()).collect(),
            ),
        };
        change(&mut signals);
        // The initial velocity is known as well as the filter shows it, the state of an integral
        // not at all. The first two seconds, in which the loop forgets them, do not count.
        Experiment::joint_side(&signals)
            .unwrap()
            .with_torque_timing(torque_timing)
            .unwrap()
            .with_counted(2000..SAMPLES - 100)
            .unwrap()
    }

    /// The cabinet's fixed gains, and the paper's start.
    pub(crate) fn options(&self) -> Options {
        let mut options = options(50.0, 0.8, 10);
        // A random arm on a random motion: the values are judged, not the motion.
        options.limits.condition_number = 1e6;
        options.controller = Some(SimulatedController::Cabinet {
            timing: self.controller.timing,
            joints: self.controller.joints.clone(),
            rescale_to_inertia_kg_m2: None,
        });
        options.simulation.reference = self.interpolation;
        options.simulation.start = Start::UnitDriveInertias;
        options
    }

    /// The same with gains that follow the estimate, and are the cabinet's where it is the truth:
    /// the inertia they were tuned for is the mean over the rows' filtered positions.
    pub(crate) fn rescaled_options(&self, experiment: &Experiment) -> Options {
        let mut options = self.options();
        let motion =
            filtered_motion(&self.arm.robot, experiment, &options.position_filter).unwrap();
        let decimation = options.decimation_filter.design().unwrap();
        let samples: Vec<usize> = decimation.kept_samples(experiment.counted()).collect();
        let postures = motion.position.select_rows(&samples);
        if let Some(SimulatedController::Cabinet { rescale_to_inertia_kg_m2, .. }) =
            &mut options.controller
        {
            let inertia = mean_joint_inertia(&self.arm.model, &self.arm.truth, &postures);
            *rescale_to_inertia_kg_m2 = Some(inertia);
        }
        options
    }

    pub(crate) fn identify(
        &self,
        experiment: &Experiment,
        options: &Options,
    ) -> Result<Identification, didim_identification::identification::IdentificationError> {
        identify(Method::Didim, &self.arm.robot, &self.arm.base, experiment, options)
    }

    /// Largest deviation from the true base parameters, relative to their value or to 0.1,
    /// whichever is more.
    pub(crate) fn deviation(&self, found: &Identification) -> f64 {
        let truth = self.arm.true_base();
        found.estimate.parameters.iter().fold(0.0, |largest: f64, parameter| {
            let truth = truth[self.arm.base.find(&parameter.name).unwrap()];
            largest.max((parameter.value - truth).abs() / truth.abs().max(0.1))
        })
    }
}
