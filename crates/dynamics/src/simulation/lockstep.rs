//! Several loops simulated in parallel: their dynamics use the lanes of vector instructions (SIMD
//! over simulations).

use crate::MAX_JOINTS;
use crate::dynamics::Workspace;
use crate::numeric::{Lanes, Scalar, WIDTH};
use crate::trajectory::Reference;

use super::error::SimulationError;
use super::hold::CommandHold;
use super::integrator::RungeKuttaStages;
use super::plant::Plant;
use super::reference_point::ReferencePoint;
use super::{ClosedLoop, StepOutput};

/// Up to [`WIDTH`] loops of one robot with one schedule (timing, integrator and substeps), at time
/// 0, rigid and without sensitivities. Parameters, gains, references, noise and starts may differ.
/// Each loop gives the same bits as alone, in a fraction of the time.
pub struct Lockstep<R> {
    loops: Vec<ClosedLoop<R>>,
    dynamics: ParallelDynamics,
    /// The states of all loops, one after the other.
    state: Vec<f64>,
    stages: RungeKuttaStages,
    is_started: bool,
}

/// The direct dynamics of all loops at once; lanes without a loop repeat the last one.
struct ParallelDynamics {
    workspace: Workspace<Lanes<WIDTH>>,
    parameters: Vec<Lanes<WIDTH>>,
    known_torque: Vec<Lanes<WIDTH>>,
    /// q, q̇, τ and q̈.
    motion: [[Lanes<WIDTH>; MAX_JOINTS]; 4],
}

impl<R: Reference> Lockstep<R> {
    /// Returns the loops as one simulation; `loops` has 1 to [`WIDTH`] of them.
    pub fn new(loops: Vec<ClosedLoop<R>>) -> Self {
        debug_assert!(
            (1..=WIDTH).contains(&loops.len())
                && loops.iter().all(|one| {
                    let schedule = |of: &ClosedLoop<R>| {
                        (of.controller.timing, of.config.integrator, of.config.substeps)
                    };
                    schedule(one) == schedule(&loops[0])
                        && one.state.len() == loops[0].state.len()
                        && one.command_variation.is_none()
                }),
            "a few loops of one schedule and size, without sensitivities"
        );
        let lanes = |of: fn(&Plant<R>) -> &[f64]| -> Vec<Lanes<WIDTH>> {
            let of_lane = |l: usize| of(&loops[l.min(loops.len() - 1)].plant);
            (0..of_lane(0).len()).map(|k| Lanes::from_fn(|l| of_lane(l)[k])).collect()
        };
        let dynamics = ParallelDynamics {
            workspace: Workspace::new(),
            parameters: lanes(|plant| &plant.parameters),
            known_torque: lanes(|plant| &plant.flexible_inertia),
            motion: [[Lanes::zero(); MAX_JOINTS]; 4],
        };
        let state = loops.iter().flat_map(|closed_loop| &closed_loop.state).copied();
        let state: Vec<f64> = state.collect();
        Self {
            dynamics,
            stages: RungeKuttaStages::new(state.len()),
            state,
            loops,
            is_started: false,
        }
    }

    /// Simulates the next sample of every loop, like [`ClosedLoop::step`].
    ///
    /// # Errors
    /// The first one that a loop meets. The simulation has ended then.
    pub fn step(&mut self) -> Result<(), SimulationError> {
        let [first, ..] = &self.loops[..] else { return Ok(()) };
        let index = if self.is_started { first.output().index + 1 } else { 0 };
        let time_s = first.time_s(index);
        if self.is_started {
            self.advance()?;
        }
        let references = reference_points(&self.loops, |one| {
            ReferencePoint::from_reference(&one.plant.reference, time_s)
        });
        let size = self.state.len() / self.loops.len();
        for ((one, reference), y) in
            self.loops.iter_mut().zip(&references).zip(self.state.chunks_exact(size))
        {
            one.plant.check_bounds(time_s, reference, y)?;
            one.state.copy_from_slice(y);
            one.measure_and_command(index, time_s, reference);
        }
        let rate = self.stages.first_rate_mut();
        self.dynamics.compute_rates(&mut self.loops, &references, time_s, &self.state, rate)?;
        for (one, rate) in self.loops.iter_mut().zip(rate.chunks_exact(size)) {
            one.stages.first_rate_mut().copy_from_slice(rate);
            one.fill_output();
        }
        self.is_started = true;
        Ok(())
    }

    /// Returns the samples of the last [`step`](Self::step).
    pub fn outputs(&self) -> impl Iterator<Item = &StepOutput> {
        self.loops.iter().map(ClosedLoop::output)
    }

    /// Integrates from one sample to the next like [`ClosedLoop::step`].
    fn advance(&mut self) -> Result<(), SimulationError> {
        let [first, ..] = &self.loops[..] else { return Ok(()) };
        let (start_s, rest_s) = (first.output().time_s, first.rest_s());
        let length_s = first.period_s() - rest_s;
        if rest_s > 0.0 {
            for one in &mut self.loops {
                one.apply_command(CommandHold::during_remainder, CommandHold::during_remainder);
            }
            self.integrate(start_s, rest_s, true)?;
        }
        for one in &mut self.loops {
            one.apply_command(CommandHold::after_remainder, CommandHold::after_remainder);
        }
        self.integrate(start_s + rest_s, length_s, rest_s <= 0.0)
    }

    fn integrate(
        &mut self,
        start_s: f64,
        length_s: f64,
        at_sample: bool,
    ) -> Result<(), SimulationError> {
        let Self { loops, dynamics, state, stages, .. } = self;
        let [first, ..] = &loops[..] else { return Ok(()) };
        let (integrator, substeps) = (first.config.integrator, first.config.substeps);
        stages.advance_over(
            integrator,
            substeps,
            (start_s, length_s),
            at_sample,
            state,
            |t: f64, y: &[f64], rate: &mut [f64]| {
                let references = reference_points(loops, |one| one.plant.continuous_reference(t));
                dynamics.compute_rates(loops, &references, t, y, rate)
            },
        )
    }
}

/// Returns the reference of every loop; `None` beyond them.
fn reference_points<R>(
    loops: &[ClosedLoop<R>],
    at: impl Fn(&ClosedLoop<R>) -> ReferencePoint,
) -> [ReferencePoint; WIDTH] {
    let mut references = [ReferencePoint::ZERO; WIDTH];
    for (reference, one) in references.iter_mut().zip(loops) {
        *reference = at(one);
    }
    references
}

impl ParallelDynamics {
    /// Computes ẏ = f(t, y) of every loop along its reference.
    fn compute_rates<R: Reference>(
        &mut self,
        loops: &mut [ClosedLoop<R>],
        references: &[ReferencePoint; WIDTH],
        time_s: f64,
        y: &[f64],
        rate: &mut [f64],
    ) -> Result<(), SimulationError> {
        let size = y.len() / loops.len();
        let [q, dq, torque, ddq] = &mut self.motion;
        let mut hysteresis = None;
        let parts = y.chunks_exact(size).zip(rate.chunks_exact_mut(size));
        for (l, ((one, reference), (y, rate))) in
            loops.iter_mut().zip(references).zip(parts).enumerate()
        {
            let n = one.plant.joints;
            one.plant.drive_rates(reference, time_s, y, rate)?;
            if let Some(shares) = one.plant.workspace.hysteresis() {
                let lanes = hysteresis.get_or_insert([Lanes::zero(); MAX_JOINTS]);
                for (lanes, share) in lanes.iter_mut().zip(shares) {
                    lanes.0[l..].fill(share);
                }
            }
            let velocities = y[..n].iter().zip(&y[n..]).zip(&one.plant.torque);
            for (((own, q), dq), torque) in velocities.zip(&mut *q).zip(&mut *dq).zip(&mut *torque)
            {
                ((q.0[l], dq.0[l]), torque.0[l]) = ((*own.0.0, *own.0.1), *own.1);
            }
        }
        let last = loops.len() - 1;
        for lanes in [&mut *q, dq, torque].into_iter().flatten() {
            let value = lanes.0[last];
            lanes.0[last..].fill(value);
        }
        let [first, ..] = loops else { return Ok(()) };
        let n = first.plant.joints;
        let (workspace, parameters) = (&mut self.workspace, &self.parameters);
        workspace.set_hysteresis(hysteresis);
        first
            .plant
            .model
            .direct_dynamics_without(
                workspace,
                parameters,
                &self.known_torque,
                &q[..n],
                &dq[..n],
                &torque[..n],
                &mut ddq[..n],
            )
            .map_err(|error| SimulationError::NotPositiveDefinite { joint: error.joint, time_s })?;
        for (l, rate) in rate.chunks_exact_mut(size).enumerate() {
            for (rate, ddq) in rate[n..].iter_mut().zip(&ddq[..n]) {
                *rate = ddq.0[l];
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{
        ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
    };
    use crate::robot::{FrictionLaw, Parameter, ParameterKind, Robot};
    use crate::simulation::{InitialState, NoiseConfig, SimulationConfig};
    use crate::trajectory::SampledReference;
    use nalgebra::DMatrix;

    const PERIOD_S: f64 = 2e-4;

    /// The paper's arm with inertias scaled by this share, under noise scaled by this share.
    fn closed_loop(timing: ControlTiming, share: f64) -> ClosedLoop<SampledReference> {
        let robot = Robot::from_toml(include_str!("../../../../config/robots/tx40.toml")).unwrap();
        let law = FrictionLaw::Hysteresis { way_rad: 0.02 };
        let lagging = robot.own_friction().iter().map(|own| own.with_law(law)).collect();
        let robot = robot.with_friction(lagging);
        let of_column = |(own, value): (&Parameter, &f64)| match own.kind {
            ParameterKind::Fh => share,
            _ => share * value,
        };
        let table = robot.parameters().parameters().iter();
        let parameters: Vec<f64> =
            table.zip(robot.nominal().unwrap().standard_parameters()).map(of_column).collect();
        let joint = |inertia: f64| JointController {
            law: ControlLaw::CascadedPPi {
                kv_per_s: 30.0,
                kp_s_per_rad: 150.0,
                ki_per_rad: 900.0,
                k_tau_nm: inertia,
            },
            feed_forward: FeedForward::default(),
            torque_limit_nm: Some(100.0),
        };
        let joints = [1.5, 1.2, 0.25, 0.05, 0.08, 0.03].map(joint).to_vec();
        let record =
            DMatrix::from_fn(100, 6, |k, j| 0.3 * (k as f64 * 0.02 * (1 + j) as f64).sin());
        let config = SimulationConfig {
            substeps: 2,
            noise: Some(NoiseConfig {
                motor_position_rad: Some(vec![1e-5 * share.abs(); 6]),
                disturbance_torque_nm: Some(vec![0.1 * share.abs(); 6]),
                ..NoiseConfig::with_seed(5)
            }),
            ..SimulationConfig::default()
        };
        ClosedLoop::new(
            &robot,
            &parameters,
            &ControllerConfig { timing, joints },
            SampledReference::new(1000.0, &record).unwrap(),
            &config,
            InitialState::OnReference,
        )
        .unwrap()
    }

    #[test]
    fn every_loop_does_what_it_does_alone() {
        let sampled = |delay: f64| ControlTiming::Sampled {
            sample_period_s: PERIOD_S,
            computation_delay_s: delay * PERIOD_S,
        };
        let continuous = ControlTiming::Continuous { sample_period_s: PERIOD_S };
        for timing in [sampled(0.0), sampled(1.3), continuous] {
            let mut alone = [0.7, 1.0, 1.2].map(|share| closed_loop(timing, share));
            let mut together =
                Lockstep::new([0.7, 1.0, 1.2].map(|s| closed_loop(timing, s)).into());
            for _ in 0..450 {
                together.step().unwrap();
                for (one, found) in alone.iter_mut().zip(together.outputs()) {
                    assert_eq!(one.step().unwrap(), found, "{timing:?}");
                }
            }
        }
    }

    /// A loop that fails ends the others and reports the time.
    #[test]
    fn the_first_failure_ends_all() {
        let timing = ControlTiming::Continuous { sample_period_s: PERIOD_S };
        let mut alone = closed_loop(timing, -1.0);
        let expected = alone.step().unwrap_err();
        let mut together =
            Lockstep::new([1.0, -1.0].map(|share| closed_loop(timing, share)).into());
        assert_eq!(together.step().unwrap_err(), expected);
    }
}
