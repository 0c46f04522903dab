//! Random arms and motions for tests of identities: the same for the same seed.

use std::fmt::Write as _;
use std::iter::repeat;

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot};

pub(crate) const TX40: &str = include_str!("../../../../config/robots/tx40.toml");
pub(crate) const TX40_PHYSICAL: &str = include_str!("../../../../config/robots/tx40-physical.toml");

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        usize::try_from(self.bits() % end as u64).unwrap()
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    pub(crate) fn uniform(&mut self, min: f64, max: f64) -> f64 {
        min + (max - min) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn vector(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.uniform(-size, size)).collect()
    }
}

/// What a random robot is made of, written out as a file so that the reader is tested as well.
#[derive(Clone)]
pub(crate) struct Design {
    pub(crate) gravity: [f64; 3],
    /// Whether the joint is prismatic; alpha \[deg\], d \[m\], theta \[deg\], r \[m\]; drive
    /// inertia.
    pub(crate) joints: Vec<(bool, [f64; 4], bool)>,
    pub(crate) rows: Vec<Vec<f64>>,
    pub(crate) friction: [bool; 3],
    pub(crate) sign: &'static str,
    /// What of a joint's friction differs from the others', as written in its file.
    pub(crate) own_friction: Vec<Option<&'static str>>,
    /// Whether springs and counterbalances act on the joints.
    pub(crate) known_torques: bool,
}

/// A spring and a cylinder of a revolute joint, and a spring of a prismatic one.
const KNOWN_TORQUES: [&str; 3] = [
    "{ position_deg = [-170.0, -20.0, 60.0, 170.0], torque_nm = [30.0, -4.0, -20.0, 10.0] }",
    "{ counterbalance = { base_radius_m = 0.7, link_radius_m = 0.2, closest_deg = 30.0, \
     pull_n = 400.0, length_m = 0.6, stiffness_n_m = 900.0 } }",
    "{ position_m = [-1.0, 0.5, 1.0], force_n = [12.0, -3.0, 9.0] }",
];

impl Design {
    pub(crate) fn random(random: &mut Random) -> Self {
        let n = 1 + random.below(8);
        Self::random_of(random, n)
    }

    /// A random arm of so many joints.
    pub(crate) fn random_of(random: &mut Random, n: usize) -> Self {
        let joints = (0..n)
            .map(|_| {
                let mut angle = || {
                    let quarter = [-90.0, 0.0, 90.0, 180.0][random.below(4)];
                    if random.chance(0.6) { quarter } else { random.uniform(-180.0, 180.0) }
                };
                let (alpha, theta) = (angle(), angle());
                let mut length =
                    || if random.chance(0.4) { 0.0 } else { random.uniform(-0.5, 0.5) };
                let (d, r) = (length(), length());
                (random.chance(0.3), [alpha, d, theta, r], random.chance(0.7))
            })
            .collect();
        let mut rows = vec![vec![0.0; n]; n];
        for (i, row) in rows.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                if i == j {
                    *entry =
                        random.uniform(20.0, 100.0) * if random.chance(0.3) { -1.0 } else { 1.0 };
                } else if random.chance(0.1) {
                    *entry = random.uniform(-15.0, 15.0);
                }
            }
        }
        let gravity = [
            [0.0, 0.0, -9.81],
            [0.0, 0.0, 9.81],
            [0.0, 0.0, 0.0],
            [random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0)],
        ][random.below(4)];
        let friction = [random.chance(0.7), random.chance(0.7), random.chance(0.7)];
        let sign = [
            "{ model = \"sign\" }",
            "{ model = \"tanh\", width_rad_s = 0.05 }",
            "{ model = \"dead-band\", threshold_rad_s = 0.5 }",
        ][random.below(3)];
        let own_friction = (0..n).map(|_| {
            let laws = [
                "quadratic = true, sign = { model = \"tanh\", width_rad_s = 0.2 }",
                "cubic = true, stribeck_rad_s = 0.8",
                "asymmetric = true",
            ];
            // The last needs no Coulomb friction.
            let first = if friction[1] { 0 } else { 2 };
            random.chance(0.4).then(|| laws[first + random.below(3 - first)])
        });
        let own_friction = own_friction.collect();
        Self { gravity, joints, rows, friction, sign, own_friction, known_torques: false }
    }

    pub(crate) fn toml(&self) -> String {
        let [viscous, coulomb, offset] = self.friction;
        let mut text = format!("name = \"random\"\ngravity_m_s2 = {:?}\n", self.gravity);
        let own_friction = self.own_friction.iter().chain(repeat(&None));
        for (index, ((prismatic, [alpha, d, theta, r], drive_inertia), own)) in
            self.joints.iter().zip(own_friction).enumerate()
        {
            let (kind, limits) = if *prismatic {
                (
                    "prismatic",
                    "position_min_m = -1\nposition_max_m = 1\nvelocity_max_m_s = 1\nforce_max_n = \
                    10",
                )
            } else {
                (
                    "revolute",
                    "position_min_deg = -170\nposition_max_deg = 170\nvelocity_max_rad_s = 5\n\
                     torque_max_nm = 10",
                )
            };
            writeln!(
                text,
                "[[joint]]\ntype = \"{kind}\"\nalpha_deg = {alpha:?}\nd_m = {d:?}\n\
                 theta_deg = {theta:?}\nr_m = {r:?}\ndrive_inertia = {drive_inertia}\n{limits}"
            )
            .unwrap();
            if let Some(own) = own {
                writeln!(text, "friction = {{ {own} }}").unwrap();
            }
            if self.known_torques {
                let known_torque = KNOWN_TORQUES[if *prismatic { 2 } else { index % 2 }];
                writeln!(text, "known_torque = {known_torque}").unwrap();
            }
        }
        write!(
            text,
            "[transmission]\nrows = {:?}\n[friction]\nviscous = {viscous}\ncoulomb = {coulomb}\n\
             offset = {offset}\n",
            self.rows
        )
        .unwrap();
        if coulomb {
            writeln!(text, "sign = {}", self.sign).unwrap();
        }
        text
    }

    pub(crate) fn robot(&self) -> Robot {
        Robot::from_toml(&self.toml()).unwrap()
    }
}

/// The drives of an arm by what their motors have, on the motor side.
pub(crate) struct Motors {
    pub(crate) inertia: Vec<f64>,
    pub(crate) viscous: Vec<f64>,
    pub(crate) coulomb: Vec<f64>,
}

impl Motors {
    pub(crate) fn random(random: &mut Random, n: usize) -> Self {
        let mut positive = |size| (0..n).map(|_| random.uniform(0.01, size)).collect();
        Self { inertia: positive(1e-4), viscous: positive(1e-3), coulomb: positive(0.1) }
    }

    /// Standard parameters of the drives, all others 0: what the motors have, seen at their own
    /// joints, with what the model regroups into other joints added there.
    pub(crate) fn parameters(&self, robot: &Robot) -> Vec<f64> {
        use ParameterKind::{Fc, FcMotor, Fv, FvMotor, Ia};

        let table = robot.parameters();
        let mut parameters = vec![0.0; table.names().len()];
        let mut add = |kind, joint, value: f64| {
            if let Some(column) = table.column(kind, JointIndex::new(joint)) {
                parameters[column] += value;
            }
        };
        for m in 0..robot.joints() {
            let s = robot.transmission().direction(m);
            let ratio = robot.transmission().row(m)[m];
            let coupled = robot.transmission().is_coupled(m);
            let inertia = self.inertia[m] * ratio * ratio;
            let viscous = self.viscous[m] * ratio * ratio;
            add(Ia, m, inertia);
            add(if coupled { FvMotor } else { Fv }, m, viscous);
            add(if coupled { FcMotor } else { Fc }, m, self.coulomb[m] * ratio.abs());
            for (i, s) in s.into_iter().enumerate().take(robot.joints()) {
                if coupled {
                    add(Fv, i, viscous * s * s);
                }
                let drives = robot.chain()[m].drive_inertia;
                if i != m && drives && !robot.transmission().is_coupled(i) {
                    add(Ia, i, inertia * s * s);
                }
            }
        }
        parameters
    }
}

/// Random standard parameters of a physical arm: links of point masses, drives by their motors,
/// friction in the joints and offsets on top.
pub(crate) fn physical_parameters(random: &mut Random, robot: &Robot) -> Vec<f64> {
    use ParameterKind::{Fc, Fv, Off, Xx};

    let mut parameters = Motors::random(random, robot.joints()).parameters(robot);
    for (column, parameter) in robot.parameters().parameters().iter().enumerate() {
        match parameter.kind {
            Xx => (0..6).for_each(|_| {
                let mass = random.uniform(0.1, 2.0);
                let point = [(); 3].map(|()| random.uniform(-0.3, 0.3));
                let link = &mut parameters[column..column + 10];
                link.iter_mut().zip(point_mass(point)).for_each(|(sum, unit)| *sum += mass * unit);
            }),
            Fv | Fc => parameters[column] += random.uniform(0.01, 1.0),
            Off => parameters[column] += random.uniform(-1.0, 1.0),
            _ => {}
        }
    }
    parameters
}

/// The ten link parameters of a unit mass at a point.
pub(crate) fn point_mass([x, y, z]: [f64; 3]) -> [f64; 10] {
    let (xx, yy, zz) = (y * y + z * z, x * x + z * z, x * x + y * y);
    [xx, -x * y, -x * z, yy, -y * z, zz, x, y, z, 1.0]
}

/// Random robots, each with the generator that made it.
pub(crate) fn random_robots(count: u64) -> impl Iterator<Item = (Random, Robot)> {
    (0..count).map(|seed| {
        let mut random = Random(seed);
        let robot = Design::random(&mut random).robot();
        (random, robot)
    })
}

pub(crate) fn tx40() -> Robot {
    Robot::from_toml(TX40).unwrap()
}

pub(crate) fn tx40_physical() -> Robot {
    Robot::from_toml(TX40_PHYSICAL).unwrap()
}

pub(crate) fn mass_matrix(model: &Model, parameters: &[f64], q: &[f64]) -> Vec<f64> {
    let mut mass = vec![0.0; q.len() * q.len()];
    model.mass_matrix(&mut Workspace::new(), parameters, q, &mut mass);
    mass
}

pub(crate) fn inverse(
    model: &Model,
    parameters: &[f64],
    q: &[f64],
    dq: &[f64],
    ddq: &[f64],
) -> Vec<f64> {
    let mut tau = vec![0.0; q.len()];
    model.inverse_dynamics(&mut Workspace::new(), parameters, q, dq, ddq, &mut tau);
    tau
}

pub(crate) fn multiply(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    let dot = |row: &[f64]| row.iter().zip(vector).map(|(m, x)| m * x).sum();
    matrix.chunks_exact(vector.len()).map(dot).collect()
}

/// Largest difference between two vectors, relative to the largest entry (or 1).
pub(crate) fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let size = a.iter().chain(b).fold(1.0_f64, |size, x| size.max(x.abs()));
    a.iter().zip(b).fold(0.0_f64, |worst, (a, b)| {
        // NaN must not be lost in a maximum.
        let error = (a - b).abs() / size;
        if error.is_nan() { f64::INFINITY } else { worst.max(error) }
    })
}
