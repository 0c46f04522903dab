//! Flexible joints, against known solutions.

use std::f64::consts::TAU;

use didim_dynamics::control::{
    ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_dynamics::simulation::{
    ClosedLoop, FlexibleMode, InitialState, Integrator, SetupError, SimulationConfig, Unmodelled,
};
use didim_dynamics::trajectory::Reference;
use serde::Deserialize;

/// One joint that hangs down at q = 0.
const PENDULUM: &str = "
    name = 'pendulum'
    gravity_m_s2 = [0.0, 0.0, -9.81]
    [[joint]]
    type = 'revolute'
    alpha_deg = -90.0
    d_m = 0.0
    theta_deg = 90.0
    r_m = 0.0
    drive_inertia = true
    position_min_deg = -360.0
    position_max_deg = 360.0
    velocity_max_rad_s = 50.0
    torque_max_nm = 100.0
    [transmission]
    rows = [[1.0]]
    [friction]
    viscous = true
    coulomb = false
    offset = false
";

/// zz + ia of the pendulum, and the part of it on the spring.
const INERTIA: f64 = 0.5;
const FLEXIBLE_INERTIA: f64 = 0.2;
const PERIOD_S: f64 = 1e-3;

fn mode(frequency_hz: f64, damping_ratio: f64) -> FlexibleMode {
    FlexibleMode { frequency_hz, damping_ratio, inertia_kg_m2: FLEXIBLE_INERTIA }
}

/// A pendulum from rest at this angle, under a continuous law with this feed-forward.
fn pendulum<R: Reference>(
    [mx, fv, angle]: [f64; 3],
    [kp, kd, ff]: [f64; 3],
    reference: R,
    flexible: Option<FlexibleMode>,
) -> Result<ClosedLoop<R>, SetupError> {
    let robot = Robot::from_toml(PENDULUM).unwrap();
    let value = |name: &String| match name.as_str() {
        "zz1" => 0.2,
        "ia1" => INERTIA - 0.2,
        "mx1" => mx,
        "fv1" => fv,
        _ => 0.0,
    };
    let parameters: Vec<f64> = robot.parameters().names().iter().map(value).collect();
    let law = ControlLaw::Pd { kp_per_rad: kp, kd_s_per_rad: kd, k_tau_nm: 1.0 };
    let feed_forward = FeedForward { acceleration_kg_m2: ff, ..FeedForward::default() };
    let controller = ControllerConfig {
        timing: ControlTiming::Continuous { sample_period_s: PERIOD_S },
        joints: vec![JointController { law, feed_forward, torque_limit_nm: None }],
    };
    let unmodelled =
        flexible.map(|mode| Unmodelled { flexible: Some(vec![mode]), ..Default::default() });
    let config = SimulationConfig { integrator: Integrator::Rk4, unmodelled, ..Default::default() };
    let start = InitialState::At { position_rad: vec![angle], velocity_rad_s: vec![0.0] };
    ClosedLoop::new(&robot, &parameters, &controller, reference, &config, start)
}

/// q_r, q̇_r, q̈_r of one joint as a function of time.
struct Motion<F>(F);

impl<F: Fn(f64) -> [f64; 3]> Reference for Motion<F> {
    fn joints(&self) -> usize {
        1
    }
    fn evaluate(&self, t: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
        [q[0], dq[0], ddq[0]] = (self.0)(t);
    }
}

fn sine(t: f64) -> [f64; 3] {
    let (amplitude, omega) = (0.3, 5.0);
    let (sin, cos) = (omega * t).sin_cos();
    [amplitude * sin, amplitude * omega * cos, -amplitude * omega * omega * sin]
}

#[derive(Deserialize)]
struct Golden {
    time_s: Vec<f64>,
    position_rad: Vec<f64>,
    velocity_rad_s: Vec<f64>,
}

#[test]
fn a_flexible_pendulum_moves_as_two_bodies_do() {
    let golden: Golden = toml::from_str(include_str!("golden/flexible.toml")).unwrap();
    let arm = [0.4, 0.3, 0.1];
    let mut closed_loop =
        pendulum(arm, [300.0, 4.0, 0.0], Motion(sine), Some(mode(7.0, 0.05))).unwrap();
    let record = closed_loop.run(2001).unwrap();
    let states = golden.time_s.iter().zip(&golden.position_rad).zip(&golden.velocity_rad_s);
    for (k, ((t, q), dq)) in (100..).step_by(100).zip(states) {
        assert!((t - k as f64 * PERIOD_S).abs() < 1e-9);
        let (found, speed) = (record.true_position_rad[(k, 0)], record.true_velocity_rad_s[(k, 0)]);
        // RK4 at 1 kHz: (50 rad/s · 1 ms)⁴/120 a step, some hundred times.
        assert!((found - q).abs() < 1e-6, "{t}: {found} {q}");
        assert!((speed - dq).abs() < 1e-4, "{t}: {speed} {dq}");
    }
}

/// A constant torque τ: the centre of mass moves by τt²/(2J), the joint by J_f/J times the spring's
/// τ/(J_1 ω_r²) (1 − cos ω_r t) more, ω_r = ω √(J/(J − J_f)): the resonance.
#[test]
fn a_step_of_torque_rings_at_the_resonance() {
    let torque = 2.0;
    let reference = Motion(|t: f64| [0.5 * t * t, t, 1.0]);
    let mut closed_loop =
        pendulum([0.0; 3], [0.0, 0.0, torque], reference, Some(mode(7.0, 0.0))).unwrap();
    let rest = INERTIA - FLEXIBLE_INERTIA;
    let resonance = TAU * 7.0 * (INERTIA / rest).sqrt();
    for _ in 0..1000 {
        let sample = closed_loop.step().unwrap();
        let t = sample.time_s;
        let spring = torque / (rest * resonance * resonance) * (1.0 - (resonance * t).cos());
        let exact = 0.5 * torque * t * t / INERTIA + FLEXIBLE_INERTIA / INERTIA * spring;
        assert!((sample.true_position_rad[0] - exact).abs() < 1e-6, "{t}");
    }
}

/// Undamped, a torque at ω does not move the joint for ever: it moves the flexible part, while the
/// joint rings at the resonance and drifts. Over whole periods of both, its motion at ω is 0.
#[test]
fn a_torque_at_the_natural_frequency_does_not_move_the_joint() {
    // J/(J − J_f) = (5/3): resonance and antiresonance have no common period, so that the joint's
    // motion is fitted by drift, resonance and ω.
    let omega = TAU * 7.0;
    let resonance = omega * (INERTIA / (INERTIA - FLEXIBLE_INERTIA)).sqrt();
    fn amplitude_at(frequency: f64, resonance: &f64) -> f64 {
        let reference = Motion(move |t: f64| [0.0, 0.0, (frequency * t).sin()]);
        let mut closed_loop =
            pendulum([0.0; 3], [0.0, 0.0, 10.0], reference, Some(mode(7.0, 0.0))).unwrap();
        let record = closed_loop.run(3000).unwrap();
        let matrix = nalgebra::DMatrix::from_fn(3000, 6, |k: usize, c: usize| {
            let t = k as f64 * PERIOD_S;
            [
                1.0,
                t,
                (*resonance * t).sin(),
                (*resonance * t).cos(),
                (frequency * t).sin(),
                (frequency * t).cos(),
            ][c]
        });
        let fitted = matrix.svd(true, true).solve(&record.true_position_rad, 0.0).unwrap();
        fitted[4].hypot(fitted[5])
    }
    // Half the frequency: |q| = τ (ω² − f²)/(J_1 f² (ω_r² − f²)), elementary mechanics.
    let half = 0.5 * omega;
    let expected = 10.0 * (omega * omega - half * half)
        / ((INERTIA - FLEXIBLE_INERTIA) * half * half * (resonance * resonance - half * half));
    let slow = amplitude_at(half, &resonance);
    assert!((slow / expected - 1.0).abs() < 1e-4, "{slow} {expected}");
    let still = amplitude_at(omega, &resonance);
    assert!(still < 1e-4 * expected, "{still} {expected}");
}

/// A stiff spring is a rigid joint: the difference falls with the square of its frequency.
#[test]
fn what_is_slow_has_the_whole_inertia() {
    let arm = [0.4, 0.3, 0.1];
    fn run(flexible: Option<FlexibleMode>, arm: &[f64; 3]) -> nalgebra::DMatrix<f64> {
        let mut closed_loop = pendulum(*arm, [30.0, 4.0, 0.0], Motion(sine), flexible).unwrap();
        closed_loop.run(2000).unwrap().true_position_rad
    }
    let rigid = run(None, &arm);
    let difference = |frequency| (run(Some(mode(frequency, 0.1)), &arm) - &rigid).amax();
    let (soft, stiff) = (difference(25.0), difference(50.0));
    assert!(soft < 0.01, "{soft}");
    assert!((soft / stiff - 4.0).abs() < 0.5, "{soft} {stiff}");
}

#[test]
fn more_flexible_inertia_than_there_is_is_refused() {
    let heavy = FlexibleMode { inertia_kg_m2: 0.6, ..mode(7.0, 0.1) };
    let built = pendulum([0.0; 3], [0.0; 3], Motion(sine), Some(heavy));
    assert_eq!(built.err(), Some(SetupError::FlexibleInertia { joint: JointIndex::new(0) }));
}

#[test]
fn there_are_no_sensitivities_of_an_arm_with_errors() {
    let closed_loop = pendulum([0.0; 3], [0.0; 3], Motion(sine), Some(mode(7.0, 0.1))).unwrap();
    let refused = closed_loop.with_sensitivities(&[0]).err();
    assert_eq!(refused, Some(SetupError::NoSensitivity { what: "errors of the model" }));
}
