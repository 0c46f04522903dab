//! Small random arms, smooth motions and exact torques: the same for the same seed.

use std::f64::consts::PI;
use std::fmt::Write as _;

use didim_dynamics::Signals;
use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::{FrictionLaw, JointFriction, ParameterKind, Robot, SignModel};
use didim_identification::identification::{DecimationFilter, Motion, Options, PositionFilter};
use nalgebra::DMatrix;

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn uniform(&mut self, min: f64, max: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        min + (max - min) * (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal, by Box and Muller.
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform(0.0, 1.0)).ln()).sqrt();
        radius * (2.0 * PI * self.uniform(0.0, 1.0)).cos()
    }
}

/// An arm with what a test needs to know about it.
#[derive(Clone)]
pub(crate) struct Arm {
    pub(crate) robot: Robot,
    pub(crate) model: Model,
    pub(crate) base: BaseParameters,
    /// Standard parameters.
    pub(crate) truth: Vec<f64>,
    /// The robot's file.
    text: String,
}

impl Arm {
    /// Revolute joints at random angles, the last motor coupled to the joint before, with random
    /// parameters.
    pub(crate) fn random(random: &mut Random, joints: usize) -> Self {
        Self::random_with(random, joints, true)
    }

    /// Without drive inertias its torques are measured behind the gear.
    pub(crate) fn random_with(random: &mut Random, joints: usize, drive_inertia: bool) -> Self {
        let mut text = "name = \"small\"\ngravity_m_s2 = [0, 0, -9.81]\n".to_owned();
        for joint in 0..joints {
            let (alpha, theta) = (random.uniform(40.0, 140.0), random.uniform(-180.0, 180.0));
            let (d, r) = (random.uniform(0.1, 0.4), random.uniform(0.1, 0.4));
            let alpha = if joint == 0 { 60.0 } else { alpha };
            write!(
                text,
                "[[joint]]\ntype = \"revolute\"\nalpha_deg = {alpha:?}\nd_m = {d:?}\n\
                 theta_deg = {theta:?}\nr_m = {r:?}\ndrive_inertia = {drive_inertia}\n\
                 position_min_deg = -170\nposition_max_deg = 170\n\
                 velocity_max_rad_s = 5\ntorque_max_nm = 50\n"
            )
            .unwrap();
        }
        let rows: Vec<Vec<f64>> = (0..joints)
            .map(|i| {
                let coupled = |j| i + 1 == joints && j + 1 == i;
                (0..joints)
                    .map(|j| if i == j { 30.0 } else { f64::from(u8::from(coupled(j))) * 30.0 })
                    .collect()
            })
            .collect();
        write!(
            text,
            "[transmission]\nrows = {rows:?}\n[friction]\nviscous = true\ncoulomb = true\n\
             offset = true\nsign = {{ model = \"tanh\", width_rad_s = 0.05 }}\n"
        )
        .unwrap();
        let robot = Robot::from_toml(&text).unwrap();
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model).unwrap();
        let truth = robot.parameters().parameters().iter().map(|parameter| {
            match parameter.kind {
                // Of the order of a small arm's, and positive where nature says so.
                ParameterKind::M => random.uniform(1.0, 3.0),
                ParameterKind::Xx | ParameterKind::Yy | ParameterKind::Zz => {
                    random.uniform(0.2, 0.4)
                }
                ParameterKind::Ia => random.uniform(0.1, 0.2),
                ParameterKind::Fv | ParameterKind::Fc => random.uniform(1.0, 3.0),
                ParameterKind::FvMotor | ParameterKind::FcMotor => random.uniform(0.5, 1.0),
                ParameterKind::Off => random.uniform(-0.5, 0.5),
                _ => random.uniform(-0.1, 0.1),
            }
        });
        let truth = truth.collect();
        Self { robot, model, base, truth, text }
    }

    /// An arm whose file states its truth.
    pub(crate) fn nominal(text: &str) -> Self {
        let robot = Robot::from_toml(text).unwrap();
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model).unwrap();
        let truth = robot.nominal().unwrap().standard_parameters().to_vec();
        Self { robot, model, base, truth, text: text.to_owned() }
    }

    /// With springs and cylinders at its joints in turn, and a file that states the truth.
    pub(crate) fn with_known_torques(self) -> Self {
        let torques = [
            "{ counterbalance = { base_radius_m = 0.5, link_radius_m = 0.2, closest_deg = -90.0, \
             pull_n = 150.0, length_m = 0.4, stiffness_n_m = 200.0 } }",
            "{ position_deg = [-170.0, 170.0], torque_nm = [9.0, -6.0] }",
        ];
        let mut text = String::new();
        for (joint, part) in self.text.split("torque_max_nm = 50\n").enumerate() {
            if joint > 0 {
                writeln!(text, "torque_max_nm = 50\nknown_torque = {}", torques[(joint - 1) % 2])
                    .unwrap();
            }
            text.push_str(part);
        }
        text.push_str("[nominal]\n");
        for (name, value) in self.robot.parameters().names().iter().zip(&self.truth) {
            writeln!(text, "{name} = {value:?}").unwrap();
        }
        let robot = Robot::from_toml(&text).unwrap();
        Self { model: Model::new(&robot), robot, text, ..self }
    }

    /// With friction of its own in every joint, in turn: bent viscous friction behind another law
    /// for the sign; Stribeck and a cube; viscous friction that differs by direction.
    pub(crate) fn with_friction_laws(self, random: &mut Random) -> Self {
        let friction = (0..self.robot.joints()).map(|joint| {
            let (width_rad_s, laws) = match joint % 3 {
                0 => (0.2, vec![FrictionLaw::Quadratic]),
                1 => (0.05, vec![FrictionLaw::Cubic, FrictionLaw::Stribeck { speed_rad_s: 1.0 }]),
                _ => (0.1, vec![FrictionLaw::Asymmetric]),
            };
            JointFriction { sign: SignModel::Tanh { width_rad_s }, laws }
        });
        let robot = self.robot.clone().with_friction(friction.collect());
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model).unwrap();
        let truth = robot.parameters().names().iter().map(|name| {
            let known_column = self.robot.parameters().find(name);
            known_column.map_or_else(|| random.uniform(0.2, 0.5), |column| self.truth[column])
        });
        let truth = truth.collect();
        Self { robot, model, base, truth, text: self.text }
    }

    /// With Coulomb friction that grows by a tenth of the load, more or less, in every joint that
    /// gravity moves.
    pub(crate) fn with_load_friction(self, random: &mut Random) -> Self {
        let friction = self.robot.own_friction().iter().map(|own| own.with_law(FrictionLaw::Load));
        let robot = self.robot.clone().with_friction(friction.collect());
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model).unwrap();
        let truth = robot.parameters().names().iter().map(|name| {
            let known_column = self.robot.parameters().find(name);
            known_column.map_or_else(|| random.uniform(0.05, 0.15), |column| self.truth[column])
        });
        let truth = truth.collect();
        Self { robot, model, base, truth, text: self.text }
    }

    /// With friction in every joint that turns over a tenth of a radian, more or less, and over
    /// more of the next.
    pub(crate) fn with_hysteresis(mut self, random: &mut Random) -> Self {
        for joint in 0..self.robot.joints() {
            let way_rad = random.uniform(0.05, 0.2);
            let size = random.uniform(0.2, 0.5);
            self = self.with_law(joint, FrictionLaw::Hysteresis { way_rad }, size);
        }
        self
    }

    /// With one more law of this size at a joint, counted from 0.
    pub(crate) fn with_law(self, joint: usize, law: FrictionLaw, size: f64) -> Self {
        let mut friction = self.robot.own_friction().to_vec();
        friction[joint] = friction[joint].with_law(law);
        let robot = self.robot.clone().with_friction(friction);
        let model = Model::new(&robot);
        let base = BaseParameters::compute(&model).unwrap();
        let truth = robot.parameters().names().iter().map(|name| {
            self.robot.parameters().find(name).map_or(size, |column| self.truth[column])
        });
        let truth = truth.collect();
        Self { robot, model, base, truth, text: self.text }
    }

    /// Smooth positions of every joint: sums of four sines up to `band_hz`, about ±1 rad.
    pub(crate) fn positions(
        &self,
        random: &mut Random,
        samples: usize,
        sample_rate_hz: f64,
        band_hz: f64,
    ) -> Vec<Vec<f64>> {
        let motion = self.motion(random, samples, sample_rate_hz, band_hz);
        motion.position.column_iter().map(|q| q.iter().copied().collect()).collect()
    }

    /// [`positions`](Self::positions) with their derivatives, in closed form.
    pub(crate) fn motion(
        &self,
        random: &mut Random,
        samples: usize,
        sample_rate_hz: f64,
        band_hz: f64,
    ) -> Motion {
        let waves: Vec<[(f64, f64, f64); 4]> = (0..self.robot.joints())
            .map(|_| {
                [(); 4].map(|()| {
                    let frequency = band_hz * random.uniform(0.2, 1.0);
                    (random.uniform(0.2, 0.5), 2.0 * PI * frequency, random.uniform(0.0, 2.0 * PI))
                })
            })
            .collect();
        fn matrix(
            value: fn((f64, f64, f64), f64) -> f64,
            samples: &usize,
            waves: &[[(f64, f64, f64); 4]],
            sample_rate_hz: &f64,
        ) -> nalgebra::DMatrix<f64> {
            DMatrix::from_fn(*samples, waves.len(), |k, joint| {
                let t = k as f64 / *sample_rate_hz;
                waves[joint].iter().map(|&wave| value(wave, t)).sum()
            })
        }
        Motion::from_matrices(
            matrix(
                |(size, omega, phase), t| size * (omega * t + phase).sin(),
                &samples,
                &waves,
                &sample_rate_hz,
            ),
            matrix(
                |(size, omega, phase), t| size * omega * (omega * t + phase).cos(),
                &samples,
                &waves,
                &sample_rate_hz,
            ),
            matrix(
                |(size, omega, phase), t| -size * omega * omega * (omega * t + phase).sin(),
                &samples,
                &waves,
                &sample_rate_hz,
            ),
        )
    }

    /// The torques of a motion, one vector per joint.
    pub(crate) fn torques(&self, motion: &Motion) -> Vec<Vec<f64>> {
        self.torques_of(&self.truth, motion)
    }

    /// Those of other standard parameters.
    pub(crate) fn torques_of(&self, standard: &[f64], motion: &Motion) -> Vec<Vec<f64>> {
        let (samples, joints) = motion.position.shape();
        let mut workspace = Workspace::new();
        let mut torques = vec![vec![0.0; samples]; joints];
        let mut tau = vec![0.0; joints];
        let matrices = motion.matrices();
        for k in 0..samples {
            let row = |m: &DMatrix<f64>| m.row(k).iter().copied().collect::<Vec<f64>>();
            let [q, dq, ddq] = matrices.each_ref().map(row);
            workspace.set_hysteresis(motion.hysteresis_at(k));
            self.model.inverse_dynamics(&mut workspace, standard, &q, &dq, &ddq, &mut tau);
            for (torque, tau) in torques.iter_mut().zip(&tau) {
                torque[k] = *tau;
            }
        }
        torques
    }

    /// What a perfect identification finds.
    pub(crate) fn true_base(&self) -> Vec<f64> {
        self.base.to_base(&self.truth)
    }
}

pub(crate) fn signals(
    sample_rate_hz: f64,
    position_rad: Vec<Vec<f64>>,
    torque_nm: Vec<Vec<f64>>,
) -> Signals {
    Signals { sample_rate_hz, position_rad, torque_nm, reference_rad: None }
}

pub(crate) fn options(cutoff_hz: f64, cutoff_ratio: f64, factor: usize) -> Options {
    Options::new(
        PositionFilter { order: 4, cutoff_hz },
        DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio, factor },
    )
}
