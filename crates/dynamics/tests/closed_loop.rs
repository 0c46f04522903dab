//! The closed loop against known solutions.
#![allow(clippy::float_cmp, reason = "what must be the same bits is compared as such")]
#![allow(clippy::unwrap_used, reason = "a helper that fails is a test that fails")]

use std::f64::consts::{FRAC_PI_2, TAU};

use didim_dynamics::control::{
    ControlLaw, ControlTiming, ControllerConfig, FeedForward, JointController,
};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_dynamics::simulation::{
    ClosedLoop, InitialState, Integrator, NoiseConfig, SimulationConfig, SimulationError,
    StateQuantity,
};
use didim_dynamics::trajectory::Reference;

/// One joint with a horizontal axis that hangs down at q = 0, geared by `gear`.
fn pendulum(gear: f64) -> Robot {
    let text = format!(
        "name = 'pendulum'\n\
         gravity_m_s2 = [0.0, 0.0, -9.81]\n\
         [[joint]]\n\
         type = 'revolute'\n\
         alpha_deg = -90.0\n\
         d_m = 0.0\n\
         theta_deg = 90.0\n\
         r_m = 0.0\n\
         drive_inertia = true\n\
         position_min_deg = -360.0\n\
         position_max_deg = 360.0\n\
         velocity_max_rad_s = 50.0\n\
         torque_max_nm = 100.0\n\
         [transmission]\n\
         rows = [[{gear:?}]]\n\
         [friction]\n\
         viscous = true\n\
         coulomb = false\n\
         offset = false\n"
    );
    Robot::from_toml(&text).unwrap()
}

/// Standard parameters of the pendulum: zz1, mx1, ia1, fv1.
fn parameters(robot: &Robot, zz: f64, mx: f64, ia: f64, fv: f64) -> Vec<f64> {
    let value = |name: &String| match name.as_str() {
        "zz1" => zz,
        "mx1" => mx,
        "ia1" => ia,
        "fv1" => fv,
        _ => 0.0,
    };
    robot.parameters().names().iter().map(value).collect()
}

fn controller(timing: ControlTiming, law: ControlLaw) -> ControllerConfig {
    let joint =
        JointController { law, feed_forward: FeedForward::default(), torque_limit_nm: None };
    ControllerConfig { timing, joints: vec![joint] }
}

fn pd(kp: f64, kd: f64) -> ControlLaw {
    ControlLaw::Pd { kp_per_rad: kp, kd_s_per_rad: kd, k_tau_nm: 1.0 }
}

fn sampled(period: f64, delay: f64) -> ControlTiming {
    ControlTiming::Sampled { sample_period_s: period, computation_delay_s: delay }
}

fn initial_state(position: f64, velocity: f64) -> InitialState {
    InitialState::At { position_rad: vec![position], velocity_rad_s: vec![velocity] }
}

/// q_r = amplitude · sin(ω t)
struct Sine {
    amplitude: f64,
    omega: f64,
}

impl Reference for Sine {
    fn joints(&self) -> usize {
        1
    }
    fn evaluate(&self, t: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
        let (sin, cos) = (self.omega * t).sin_cos();
        q[0] = self.amplitude * sin;
        dq[0] = self.amplitude * self.omega * cos;
        ddq[0] = -self.amplitude * self.omega * self.omega * sin;
    }
}

/// Two joints commanded to stay at 0.
struct Still2;

impl Reference for Still2 {
    fn joints(&self) -> usize {
        2
    }
    fn evaluate(&self, _: f64, q: &mut [f64], dq: &mut [f64], ddq: &mut [f64]) {
        [q, dq, ddq].into_iter().for_each(|values| values[..2].fill(0.0));
    }
}

const STILL: Sine = Sine { amplitude: 0.0, omega: 1.0 };

/// A free pendulum released at 90° is back after 4 K(1/2) / ω₀, K the complete elliptic integral.
#[test]
fn a_free_pendulum_returns_after_its_period_with_the_method_s_order() {
    let robot = pendulum(1.0);
    let (zz, mx) = (0.5, 0.4);
    let omega = (mx * 9.81_f64 / zz).sqrt();
    let period = 4.0 * 1.854_074_677_301_372 / omega;
    fn run(
        integrator: Integrator,
        steps: u32,
        period: &f64,
        robot: &Robot,
        zz: &f64,
        mx: &f64,
    ) -> (f64, f64) {
        let timing = ControlTiming::Continuous { sample_period_s: *period / f64::from(steps) };
        let config = SimulationConfig { integrator, ..Default::default() };
        let mut closed_loop = ClosedLoop::new(
            robot,
            &parameters(robot, *zz, *mx, 0.0, 0.0),
            &controller(timing, pd(0.0, 0.0)),
            &STILL,
            &config,
            initial_state(FRAC_PI_2, 0.0),
        )
        .unwrap();
        let record = closed_loop.run(steps as usize + 1).unwrap();
        let last = record.samples() - 1;
        fn energy(
            k: usize,
            zz: &f64,
            mx: &f64,
            record_true_position_rad: &nalgebra::DMatrix<f64>,
            record_true_velocity_rad_s: &nalgebra::DMatrix<f64>,
        ) -> f64 {
            let (q, dq) = (record_true_position_rad[(k, 0)], record_true_velocity_rad_s[(k, 0)]);
            0.5 * *zz * dq * dq - *mx * 9.81 * q.cos()
        }
        // At the turning point the position is flat; the velocity shows the error of time.
        (
            record.true_velocity_rad_s[(last, 0)].abs(),
            (energy(last, zz, mx, &record.true_position_rad, &record.true_velocity_rad_s)
                - energy(0, zz, mx, &record.true_position_rad, &record.true_velocity_rad_s))
            .abs(),
        )
    }
    for (integrator, order) in [(Integrator::Ode3, 3.0), (Integrator::Rk4, 4.0)] {
        let (coarse, fine) = (
            run(integrator, 400, &period, &robot, &zz, &mx),
            run(integrator, 800, &period, &robot, &zz, &mx),
        );
        let observed = (coarse.0 / fine.0).log2();
        assert!((observed - order).abs() < 0.3, "{integrator:?}: order {observed}");
        assert!(fine.0 < 1e-6, "{integrator:?}: {fine:?}");
        assert!(fine.1 < 1e-6 * mx * 9.81, "{integrator:?}: energy {fine:?}");
        assert!(fine.1 < coarse.1 / 6.0, "energy drifts with the order: {coarse:?} {fine:?}");
    }
}

/// J q̈ = −Kp q − (Kd + fv) q̇, underdamped: the textbook's decaying cosine.
#[test]
fn a_continuous_pd_gives_the_damped_oscillation() {
    let robot = pendulum(1.0);
    let (inertia, kp, kd, fv) = (0.5, 200.0, 3.0, 1.0);
    let mut closed_loop = ClosedLoop::new(
        &robot,
        &parameters(&robot, 0.2, 0.0, 0.3, fv),
        &controller(ControlTiming::Continuous { sample_period_s: 1e-3 }, pd(kp, kd)),
        &STILL,
        &SimulationConfig { integrator: Integrator::Rk4, ..Default::default() },
        initial_state(0.1, 0.0),
    )
    .unwrap();
    let decay: f64 = (kd + fv) / (2.0 * inertia);
    let omega = (kp / inertia - decay * decay).sqrt();
    for _ in 0..1000 {
        let sample = *closed_loop.step().unwrap();
        let t = sample.time_s;
        let (sin, cos) = (omega * t).sin_cos();
        let exact = 0.1 * (-decay * t).exp() * (cos + decay / omega * sin);
        assert!((sample.true_position_rad[0] - exact).abs() < 1e-9, "{t}");
        let torque = -kp * sample.true_position_rad[0] - kd * sample.true_velocity_rad_s[0];
        assert!((sample.joint_torque_nm[0] - torque).abs() < 1e-12);
    }
}

/// On a pure inertia a held torque gives parabolas, which every method integrates exactly: the
/// recursion of the sampled loop, with its derivative law, hold and delay, is written out here.
#[test]
fn the_sampled_loop_is_its_recursion() {
    let robot = pendulum(-3.0);
    let (inertia, period, kp, kd) = (0.5, 0.01, 40.0, 2.0);
    let reference = Sine { amplitude: 0.3, omega: 5.0 };
    // Whole periods of delay and the rest.
    for (periods, rest, integrator, substeps) in [
        (0, 0.0, Integrator::Ode3, 1),
        (0, 0.0, Integrator::Rk4, 3),
        (0, 0.004, Integrator::Ode3, 1),
        (1, 0.0, Integrator::Ode3, 2),
        (1, 0.003, Integrator::Rk4, 1),
    ] {
        let delay = if periods == 0 { rest } else { period + rest };
        let mut closed_loop = ClosedLoop::new(
            &robot,
            &parameters(&robot, inertia, 0.0, 0.0, 0.0),
            &controller(sampled(period, delay), pd(kp, kd)),
            &reference,
            &SimulationConfig { integrator, substeps, ..Default::default() },
            initial_state(0.05, 0.2),
        )
        .unwrap();
        let (mut q, mut dq, mut last_error) = (0.05, 0.2, None);
        let mut commands: Vec<f64> = Vec::new();
        for k in 0..300 {
            let error = 0.3 * (5.0 * k as f64 * period).sin() - q;
            let rate = last_error.map_or(0.0, |last| (error - last) / period);
            last_error = Some(error);
            commands.push(kp * error + kd * rate);
            let sample = closed_loop.step().unwrap();
            assert!((sample.true_position_rad[0] - q).abs() < 1e-9, "{delay} {k}");
            assert!((sample.true_velocity_rad_s[0] - dq).abs() < 1e-8, "{delay} {k}");
            assert!((sample.joint_torque_nm[0] - commands[k]).abs() < 1e-5, "{delay} {k}");
            assert!((sample.motor_position_rad[0] + 3.0 * q).abs() < 1e-8);
            assert!((sample.motor_torque_nm[0] + commands[k] / 3.0).abs() < 1e-5);
            // Before the first command arrives, it acts already.
            let acting = |age: usize| commands[k.saturating_sub(age)];
            for (torque, h) in [(acting(periods + 1), rest), (acting(periods), period - rest)] {
                q += h * dq + 0.5 * h * h * torque / inertia;
                dq += h * torque / inertia;
            }
        }
    }
}

fn noisy(seed: u64, change: impl Fn(&mut NoiseConfig)) -> SimulationConfig {
    let mut noise = NoiseConfig::with_seed(seed);
    change(&mut noise);
    SimulationConfig { noise: Some(noise), ..Default::default() }
}

fn noisy_loop(config: &SimulationConfig) -> ClosedLoop<Sine> {
    let robot = pendulum(50.0);
    ClosedLoop::new(
        &robot,
        &parameters(&robot, 0.5, 0.4, 0.0, 0.5),
        &controller(sampled(1e-3, 0.0), pd(500.0, 10.0)),
        Sine { amplitude: 0.5, omega: 3.0 },
        config,
        InitialState::OnReference,
    )
    .unwrap()
}

#[test]
fn measured_positions_lie_on_the_encoder_s_grid() {
    let config =
        SimulationConfig { encoder_counts_per_turn: Some(vec![4096]), ..Default::default() };
    let resolution = TAU / 4096.0;
    let mut closed_loop = noisy_loop(&config);
    let mut different = 0;
    for _ in 0..1000 {
        let sample = closed_loop.step().unwrap();
        let counts = sample.motor_position_rad[0] / resolution;
        assert!((counts - counts.round()).abs() < 1e-9);
        let error = sample.motor_position_rad[0] - 50.0 * sample.true_position_rad[0];
        assert!(error.abs() <= 0.5 * resolution * (1.0 + 1e-9));
        assert!((sample.joint_position_rad[0] - sample.motor_position_rad[0] / 50.0).abs() < 1e-15);
        different += usize::from(error.abs() > 0.1 * resolution);
    }
    assert!(different > 500, "the grid does nothing");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let with_noise = |noise: &mut NoiseConfig| {
        noise.motor_position_rad = Some(vec![1e-3]);
        noise.disturbance_torque_nm = Some(vec![0.1]);
        noise.torque_measurement_nm = Some(vec![0.1]);
    };
    let mut closed_loop = noisy_loop(&noisy(1, with_noise));
    let first = closed_loop.run(500).unwrap();
    let again = noisy_loop(&noisy(1, with_noise)).run(500).unwrap();
    assert_eq!(first, again);
    assert_ne!(first, noisy_loop(&noisy(2, with_noise)).run(500).unwrap());
    let robot = pendulum(50.0);
    closed_loop.restart(&parameters(&robot, 0.5, 0.4, 0.0, 0.5)).unwrap();
    assert_eq!(first, closed_loop.run(500).unwrap());
    closed_loop.restart(&parameters(&robot, 0.6, 0.4, 0.0, 0.5)).unwrap();
    assert_ne!(first, closed_loop.run(500).unwrap());
}

#[test]
fn the_arm_feels_a_disturbance_and_not_the_measurement() {
    let quiet = noisy_loop(&SimulationConfig::default()).run(2000).unwrap();
    let config = noisy(3, |noise| noise.torque_measurement_nm = Some(vec![0.2]));
    let measured = noisy_loop(&config).run(2000).unwrap();
    assert_eq!(quiet.true_position_rad, measured.true_position_rad);
    let noise = &measured.joint_torque_nm - &quiet.joint_torque_nm;
    let rms = (noise.norm_squared() / 2000.0).sqrt();
    // The standard error of a standard deviation from 2000 samples is 1.6 %.
    assert!((rms / 0.2 - 1.0).abs() < 0.06, "{rms}");

    let mut disturbed =
        noisy_loop(&noisy(3, |noise| noise.disturbance_torque_nm = Some(vec![0.2])));
    let (mut shifted, mut sum) = (0.0_f64, 0.0);
    for k in 0..2000 {
        let sample = disturbed.step().unwrap();
        sum += (sample.true_torque_nm[0] - sample.joint_torque_nm[0]).powi(2);
        shifted =
            shifted.max((sample.true_position_rad[0] - quiet.true_position_rad[(k, 0)]).abs());
        // M q̈ + fv q̇ + g = the torque that the arm felt
        let (q, dq) = (sample.true_position_rad[0], sample.true_velocity_rad_s[0]);
        let demand = 0.5 * sample.true_acceleration_rad_s2[0] + 0.5 * dq + 0.4 * 9.81 * q.sin();
        assert!((demand - sample.true_torque_nm[0]).abs() < 1e-9);
    }
    assert!(((sum / 2000.0_f64).sqrt() / 0.2 - 1.0).abs() < 0.06);
    assert!(shifted > 1e-6);
}

#[test]
fn divergence_names_joint_and_time_and_leaves_the_loop_where_it_was() {
    let robot = pendulum(1.0);
    let mut closed_loop = ClosedLoop::new(
        &robot,
        &parameters(&robot, 0.5, 0.0, 0.0, 0.0),
        &controller(sampled(0.01, 0.0), pd(1e5, 0.0)),
        &STILL,
        &SimulationConfig::default(),
        initial_state(0.01, 0.0),
    )
    .unwrap();
    let mut last = None;
    let error = loop {
        match closed_loop.step() {
            Ok(sample) => last = Some(sample.time_s),
            Err(error) => break error,
        }
    };
    let SimulationError::Divergence { joint, time_s, quantity, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(joint, JointIndex::new(0));
    assert!((time_s - last.unwrap() - 0.01).abs() < 1e-12, "{error}");
    assert!(matches!(quantity, StateQuantity::PositionError | StateQuantity::Velocity));
    assert_eq!(closed_loop.step().unwrap_err(), error);
    assert!(error.to_string().starts_with("joint 1 diverged at 0.0"), "{error}");
}

#[test]
fn parameters_of_no_arm_are_an_error() {
    let robot = pendulum(1.0);
    let mut closed_loop = ClosedLoop::new(
        &robot,
        &parameters(&robot, -0.5, 0.0, 0.1, 0.0),
        &controller(sampled(0.01, 0.0), pd(1.0, 0.0)),
        &STILL,
        &SimulationConfig::default(),
        initial_state(0.01, 0.0),
    )
    .unwrap();
    let error = closed_loop.step().unwrap_err();
    assert_eq!(
        error,
        SimulationError::NotPositiveDefinite { joint: JointIndex::new(0), time_s: 0.0 }
    );
}

/// Two parallel joints whose mass matrix loses its definiteness as the second one stretches.
#[test]
fn an_error_at_a_sample_ends_the_simulation_until_it_is_restarted() {
    let joint = |d: f64| {
        format!(
            "[[joint]]\ntype = 'revolute'\nalpha_deg = 0.0\nd_m = {d:?}\ntheta_deg = 0.0\n\
             r_m = 0.0\ndrive_inertia = true\nposition_min_deg = -360.0\n\
             position_max_deg = 360.0\nvelocity_max_rad_s = 50.0\ntorque_max_nm = 100.0\n"
        )
    };
    let text = format!(
        "name = 'two'\ngravity_m_s2 = [0.0, 0.0, -9.81]\n{}{}[transmission]\n\
         rows = [[1.0, 0.0], [0.0, 1.0]]\n[friction]\nviscous = true\ncoulomb = false\n\
         offset = false\n",
        joint(0.0),
        joint(1.0)
    );
    let robot = Robot::from_toml(&text).unwrap();
    let value = |name: &String| match name.as_str() {
        "zz1" | "zz2" => 1.0,
        "mx2" => 1.2,
        _ => 0.0,
    };
    let parameters: Vec<f64> = robot.parameters().names().iter().map(value).collect();
    let mut controller = controller(sampled(0.01, 0.0), pd(0.0, 0.0));
    controller.joints.push(controller.joints[0].clone());
    let mut at_samples = 0;
    for k in 0..40 {
        let initial = InitialState::At {
            position_rad: vec![0.0, 2.0],
            velocity_rad_s: vec![0.0, -1.0 - 0.1 * f64::from(k)],
        };
        let config = SimulationConfig::default();
        let mut closed_loop =
            ClosedLoop::new(&robot, &parameters, &controller, Still2, &config, initial).unwrap();
        let first = closed_loop.run(1_000).unwrap_err();
        assert_eq!(closed_loop.step().unwrap_err(), first);
        assert_eq!(closed_loop.step().unwrap_err(), first);
        closed_loop.restart(&parameters).unwrap();
        assert_eq!(closed_loop.run(1_000).unwrap_err(), first);
        if let SimulationError::NotPositiveDefinite { time_s, .. } = first {
            let samples = time_s / 0.01;
            at_samples += i32::from((samples - samples.round()).abs() < 1e-9);
        }
    }
    assert!(at_samples > 0, "no run failed at a sample");
}

#[test]
fn what_does_not_fit_the_arm_is_refused_by_name() {
    let robot = pendulum(1.0);
    fn build(
        parameters: &[f64],
        config: &SimulationConfig,
        initial: InitialState,
        robot: &Robot,
    ) -> String {
        let controller = controller(sampled(0.01, 0.0), pd(1.0, 0.0));
        ClosedLoop::new(robot, parameters, &controller, &STILL, config, initial)
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    }
    let good = parameters(&robot, 0.5, 0.0, 0.0, 0.0);
    let config = SimulationConfig::default();
    let start = InitialState::OnReference;
    assert_eq!(build(&good, &config, start.clone(), &robot), "");
    assert!(build(&good[1..], &config, start.clone(), &robot).contains("parameters"));
    let mut bad = good.clone();
    bad[0] = f64::NAN;
    assert!(build(&bad, &config, start.clone(), &robot).contains("parameters = NaN"));
    let counts =
        |counts| SimulationConfig { encoder_counts_per_turn: Some(counts), ..Default::default() };
    assert!(
        build(&good, &counts(vec![1, 2]), start.clone(), &robot)
            .contains("encoder_counts_per_turn")
    );
    assert!(
        build(&good, &counts(vec![0]), start.clone(), &robot).contains("encoder_counts_per_turn")
    );
    let substeps = SimulationConfig { substeps: 0, ..Default::default() };
    assert!(build(&good, &substeps, start.clone(), &robot).contains("substeps"));
    let noise = noisy(0, |noise| noise.motor_position_rad = Some(vec![-1.0]));
    assert!(build(&good, &noise, start, &robot).contains("noise.motor_position_rad"));
    let initial = InitialState::At { position_rad: vec![], velocity_rad_s: vec![0.0] };
    assert!(build(&good, &config, initial, &robot).contains("initial position"));
}

/// The shorter the period, the closer the sampled loop is to the continuous one, at first order.
#[test]
fn the_sampled_loop_tends_to_the_continuous_one() {
    let robot = pendulum(1.0);
    let reference = Sine { amplitude: 0.5, omega: 4.0 };
    let law = ControlLaw::Pid {
        kp_per_rad: 300.0,
        kd_s_per_rad: 15.0,
        ki_per_rad_s: 500.0,
        k_tau_nm: 1.0,
        integral_dead_zone_rad: 0.0,
    };
    fn position(
        timing: ControlTiming,
        samples: usize,
        robot: &Robot,
        law: &ControlLaw,
        reference: &Sine,
    ) -> f64 {
        let mut closed_loop = ClosedLoop::new(
            robot,
            &parameters(robot, 0.5, 0.4, 0.0, 0.3),
            &controller(timing, *law),
            reference,
            &SimulationConfig { integrator: Integrator::Rk4, ..Default::default() },
            InitialState::OnReference,
        )
        .unwrap();
        let record = closed_loop.run(samples + 1).unwrap();
        record.true_position_rad[(samples, 0)]
    }
    let exact = position(
        ControlTiming::Continuous { sample_period_s: 1e-4 },
        5000,
        &robot,
        &law,
        &reference,
    );
    let coarse = (position(sampled(4e-4, 0.0), 1250, &robot, &law, &reference) - exact).abs();
    let fine = (position(sampled(1e-4, 0.0), 5000, &robot, &law, &reference) - exact).abs();
    assert!(fine < 1e-4, "{fine}");
    assert!(((coarse / fine).log2() - 2.0).abs() < 0.2, "{coarse} {fine}");
}
