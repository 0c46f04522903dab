//! Joints that are not rigid.

use serde::{Deserialize, Serialize};

use super::checked::{check_length, check_not_negative, check_positive};
use super::error::SetupError;

/// A part of a joint's inertia behind a spring and a damper, such as a belt or a gear (Spong,
/// Hutchinson and Vidyasagar, *Robot Modeling and Control*, on joint elasticity):
///
/// J_f q̈_f = −k (q_f − q) − d (q̇_f − q̇), and the joint feels −J_f q̈_f,
///
/// with k = J_f ω² and d = 2 ζ J_f ω. The arm's rigid mass matrix is M(q) less J_f on the diagonal,
/// so that slow motion, where q_f = q, has the inertia of M. With J = M_jj, the other joints held,
/// torques move the joint by an antiresonance at ω and a resonance at ω √(J/(J − J_f)). Gravity,
/// Coriolis and centrifugal torques stay those of the whole arm at q.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlexibleMode {
    /// ω/2π, the natural frequency with the joint fixed: the antiresonance \[Hz\]. Explicit
    /// integration limits it: ode3 with a step h is stable below about 0.25/h, and the resonance is
    /// higher.
    pub frequency_hz: f64,
    /// ζ, the damping ratio with the joint fixed; 0 is none.
    pub damping_ratio: f64,
    /// J_f \[kg·m², or kg of a prismatic joint\]; 0 is a rigid joint.
    pub inertia_kg_m2: f64,
}

impl FlexibleMode {
    /// Returns q̈_f for the joint at q with velocity q̇ and the flexible part at q_f with velocity
    /// q̇_f.
    pub(super) fn acceleration(&self, q: f64, dq: f64, q_f: f64, dq_f: f64) -> f64 {
        let omega = core::f64::consts::TAU * self.frequency_hz;
        omega * (omega * (q - q_f) + 2.0 * self.damping_ratio * (dq - dq_f))
    }
}

pub(super) fn validate(modes: &[FlexibleMode], joints: usize) -> Result<(), SetupError> {
    check_length("unmodelled.flexible", joints, modes.len())?;
    for mode in modes {
        check_positive("unmodelled.flexible.frequency_hz", mode.frequency_hz)?;
        check_not_negative("unmodelled.flexible.damping_ratio", mode.damping_ratio)?;
        check_not_negative("unmodelled.flexible.inertia_kg_m2", mode.inertia_kg_m2)?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::control::{
        ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
    };
    use crate::robot::Robot;
    use crate::simulation::{ClosedLoop, InitialState, Integrator, SimulationConfig, Unmodelled};
    use crate::trajectory::{JointLimits, MoveSequence, Trajectory};

    const SPRING: FlexibleMode =
        FlexibleMode { frequency_hz: 8.0, damping_ratio: 0.0, inertia_kg_m2: 0.2 };

    /// Energy of a free pendulum with zz = 0.5, mx = 0.4, at the start and after one second.
    fn energies(damping_ratio: f64, integrator: Integrator, steps: u32) -> (f64, f64) {
        let robot = Robot::from_toml(
            "name = 'pendulum'\ngravity_m_s2 = [0.0, 0.0, -9.81]\n[[joint]]\ntype = 'revolute'\n\
             alpha_deg = -90.0\nd_m = 0.0\ntheta_deg = 90.0\nr_m = 0.0\ndrive_inertia = false\n\
             position_min_deg = -360.0\nposition_max_deg = 360.0\nvelocity_max_rad_s = 50.0\n\
             torque_max_nm = 100.0\n[transmission]\nrows = [[1.0]]\n\
             [friction]\nviscous = false\ncoulomb = false\noffset = false\n",
        )
        .unwrap();
        let value = |name: &String| match name.as_str() {
            "zz1" => 0.5,
            "mx1" => 0.4,
            _ => 0.0,
        };
        let parameters: Vec<f64> = robot.parameters().names().iter().map(value).collect();
        let law = ControlLaw::P { kp_per_rad: 0.0, k_tau_nm: 0.0 };
        let feed_forward = FeedForward::default();
        let controller = ControllerConfig {
            timing: ControlTiming::Continuous { sample_period_s: 1.0 / f64::from(steps) },
            joints: vec![JointController { law, feed_forward, torque_limit_nm: None }],
        };
        let limits = JointLimits {
            position_min_rad: -6.0,
            position_max_rad: 6.0,
            velocity_max_rad_s: 1.0,
            acceleration_max_rad_s2: 1.0,
        };
        let still = MoveSequence { start_rad: vec![0.0], start_dwell_s: 1.0, moves: vec![] };
        let reference = Trajectory::plan(&still, &[limits]).unwrap();
        let mode = FlexibleMode { damping_ratio, ..SPRING };
        let unmodelled = Unmodelled { flexible: Some(vec![mode]), ..Default::default() };
        let config = SimulationConfig {
            integrator,
            unmodelled: Some(unmodelled),
            ..SimulationConfig::default()
        };
        let start = InitialState::At { position_rad: vec![1.5], velocity_rad_s: vec![2.0] };
        let mut closed_loop =
            ClosedLoop::new(&robot, &parameters, &controller, &reference, &config, start).unwrap();
        let stiffness = 0.2 * (core::f64::consts::TAU * 8.0).powi(2);
        // (q, q̇, ∫, q_f, q̇_f)
        let energy = |y: &[f64]| {
            let spring = 0.5 * stiffness * (y[3] - y[0]).powi(2);
            0.5 * 0.3 * y[1] * y[1] + 0.5 * 0.2 * y[4] * y[4] + spring - 0.4 * 9.81 * y[0].cos()
        };
        closed_loop.step().unwrap();
        let first = energy(&closed_loop.state);
        for _ in 0..steps {
            closed_loop.step().unwrap();
        }
        (first, energy(&closed_loop.state))
    }

    #[test]
    fn energy_stays_without_damping_and_falls_with_it() {
        for (integrator, order) in [(Integrator::Ode3, 3.0), (Integrator::Rk4, 4.0)] {
            let energy_loss = |steps| {
                let (first, last) = energies(0.0, integrator, steps);
                (last - first).abs()
            };
            let (coarse, fine) = (energy_loss(1000), energy_loss(2000));
            assert!(coarse < 2e-4, "{integrator:?}: {coarse}");
            assert!((coarse / fine).log2() > order - 0.4, "{integrator:?}: {coarse} {fine}");
        }
        let (first, last) = energies(0.2, Integrator::Rk4, 1000);
        assert!(last < first - 1e-3, "{first} {last}");
    }
}
