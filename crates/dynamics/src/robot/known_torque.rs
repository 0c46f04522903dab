//! A known torque with a configured law: that of a spring or of a counterbalance.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{JointKind, Limits};
use crate::numeric::Scalar;

/// A torque that acts on a joint in addition to gravity and the drive, positive along the joint's
/// positive direction.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownTorque {
    /// Factor of the law \[1\].
    factor: f64,
    law: Law,
}

/// Law of a known torque over the position of its joint.
#[derive(Clone, Debug, PartialEq)]
enum Law {
    /// Linear between points \[(rad, N·m) or (m, N)\], in the order of the positions.
    Table(Vec<[f64; 2]>),
    /// A cylinder or spring between the link and the part that carries the joint.
    Counterbalance(Counterbalance),
}

/// A cylinder or spring whose two ends turn about a joint's axis. With a and b the distances of its
/// ends from the axis and β = q − q₀, its length is l = √(a² + b² − 2ab cos β); it pulls its ends
/// together with a force F, which is a torque of −F ab sin β / l on the joint. A spring pulls with
/// F₀ + k (l − l₀), a cylinder on an accumulator, whose gas keeps its temperature, with F₀ / (1 −
/// (l − l₀)/s).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Counterbalance {
    /// a, from the axis to the end on the part that carries the joint \[m\].
    pub base_radius_m: f64,
    /// b, from the axis to the end on the link \[m\]; not equal to a.
    pub link_radius_m: f64,
    /// q₀, the position of the joint at which the ends are closest \[°\].
    pub closest_deg: f64,
    /// F₀, negative if it pushes \[N\].
    pub pull_n: f64,
    /// l₀, the length at which it pulls with F₀ \[m\].
    pub length_m: f64,
    /// k of a spring \[N/m\]. Not with `gas_length_m`.
    ///
    /// If left out: no spring.
    #[serde(default)]
    pub stiffness_n_m: Option<f64>,
    /// s of a cylinder on an accumulator \[m\]: the volume of the gas at l₀ over the area of the
    /// piston.
    ///
    /// If left out: no accumulator.
    #[serde(default)]
    pub gas_length_m: Option<f64>,
}

impl Counterbalance {
    /// Returns the torque on the joint and its derivative with respect to the position.
    fn torque_and_slope(&self, position_rad: f64) -> [f64; 2] {
        let (a, b) = (self.base_radius_m, self.link_radius_m);
        let (sin, cos) = (position_rad - self.closest_deg.to_radians()).sin_cos();
        let length = (a * a + b * b - 2.0 * a * b * cos).sqrt();
        let [pull, stiffness] = self.pull_and_slope(length - self.length_m);
        // `lever` is dl/dβ, `lever_rate` is d²l/dβ².
        let lever = a * b * sin / length;
        let lever_rate = (a * b * cos - lever * lever) / length;
        [-pull * lever, -stiffness * lever * lever - pull * lever_rate]
    }

    /// Returns F \[N\] at a length `longer_m` above l₀, and its derivative with respect to the
    /// length.
    fn pull_and_slope(&self, longer_m: f64) -> [f64; 2] {
        match (self.stiffness_n_m, self.gas_length_m) {
            (Some(stiffness), _) => [self.pull_n + stiffness * longer_m, stiffness],
            (None, Some(gas)) => {
                let compressed = 1.0 / (1.0 - longer_m / gas);
                [self.pull_n * compressed, self.pull_n * compressed * compressed / gas]
            }
            (None, None) => [self.pull_n, 0.0],
        }
    }

    fn validated(self) -> Result<Self, String> {
        if !(self.closest_deg.is_finite() && self.pull_n.is_finite()) {
            return Err("`closest_deg` and `pull_n` have to be finite numbers".into());
        }
        let (a, b) = (self.base_radius_m, self.link_radius_m);
        let positive = [
            ("base_radius_m", Some(a)),
            ("link_radius_m", Some(b)),
            ("length_m", Some(self.length_m)),
            ("stiffness_n_m", self.stiffness_n_m),
            ("gas_length_m", self.gas_length_m),
        ];
        for (key, value) in positive {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(format!("`{key}` is {value}; give a positive number"));
            }
        }
        // At length 0 the direction of the force is undefined.
        if (a - b).abs() < 1e-9 {
            return Err(
                "`base_radius_m` and `link_radius_m` are equal; their ends would meet".into()
            );
        }
        match (self.stiffness_n_m, self.gas_length_m) {
            (Some(_), Some(_)) => Err("give `stiffness_n_m` or `gas_length_m`, not both".into()),
            (_, Some(gas)) if a + b - self.length_m >= gas => Err(format!(
                "at its longest, {} m, it would have no gas left; check `length_m` and \
                `gas_length_m`",
                a + b
            )),
            _ => Ok(self),
        }
    }
}

impl KnownTorque {
    /// Returns the factor of the configured law \[1\].
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns the torque at a position \[N·m at rad, or N at m\] and its derivative. Beyond the
    /// points of a table it is the torque of the nearest point.
    pub fn torque_and_slope(&self, position: f64) -> [f64; 2] {
        self.law.torque_and_slope(position).map(|of| self.factor * of)
    }

    /// Returns the torque at one position, or at several in parallel.
    #[inline(always)]
    pub(crate) fn torque<T: Scalar>(&self, position: T) -> T {
        position.apply(|position| self.torque_and_slope(position))
    }
}

impl Law {
    fn torque_and_slope(&self, position: f64) -> [f64; 2] {
        match self {
            Self::Counterbalance(own) => own.torque_and_slope(position),
            Self::Table(points) => {
                let next = points.partition_point(|[at, _]| *at <= position);
                match (next.checked_sub(1).and_then(|last| points.get(last)), points.get(next)) {
                    (Some([x0, y0]), Some([x1, y1])) => {
                        let slope = (y1 - y0) / (x1 - x0);
                        [y0 + slope * (position - x0), slope]
                    }
                    (Some([_, end]), None) | (None, Some([_, end])) => [*end, 0.0],
                    (None, None) => [0.0, 0.0],
                }
            }
        }
    }
}

/// A known torque as written in a file.
#[derive(Deserialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "a known torque: { position_deg = [-90, 0, 90], torque_nm = [-300, 0, 300] }, or \
                 { counterbalance = { … } }"
)]
pub(super) struct RawKnownTorque {
    /// At least two positions that increase, from limit to limit of the joint \[°\].
    ///
    /// Required with `torque_nm`.
    position_deg: Option<Vec<f64>>,
    /// The torque at each \[N·m\].
    ///
    /// Required with `position_deg`.
    torque_nm: Option<Vec<f64>>,
    /// At least two positions that increase, from limit to limit of the joint \[m\].
    ///
    /// Required with `force_n`.
    position_m: Option<Vec<f64>>,
    /// The force at each \[N\].
    ///
    /// Required with `position_m`.
    force_n: Option<Vec<f64>>,
    /// The cylinder or spring.
    ///
    /// Required without `position_deg` and `torque_nm`.
    counterbalance: Option<Counterbalance>,
    /// Factor of all of it \[1\].
    #[serde(default = "one")]
    factor: f64,
}

fn one() -> f64 {
    1.0
}

impl RawKnownTorque {
    /// Converts it to the known torque of a joint of this kind with these limits.
    ///
    /// # Errors
    /// The fault, in words.
    pub(super) fn of_joint(&self, kind: JointKind, limits: &Limits) -> Result<KnownTorque, String> {
        let factor = self.factor;
        if !factor.is_finite() {
            return Err(format!("`factor` is {factor}; give a finite number"));
        }
        Ok(KnownTorque { factor, law: self.law(kind, limits)? })
    }

    fn law(&self, kind: JointKind, limits: &Limits) -> Result<Law, String> {
        let Self { position_deg, torque_nm, position_m, force_n, counterbalance, .. } = self;
        let (positions, torques, to_si, keys) =
            match (kind, position_deg, torque_nm, position_m, force_n, counterbalance) {
                (JointKind::Revolute, None, None, None, None, Some(own)) => {
                    return own.validated().map(Law::Counterbalance);
                }
                (JointKind::Revolute, Some(positions), Some(torques), None, None, None) => (
                    positions,
                    torques,
                    f64::to_radians as fn(f64) -> f64,
                    ["position_deg", "torque_nm"],
                ),
                (JointKind::Prismatic, None, None, Some(positions), Some(forces), None) => {
                    (positions, forces, core::convert::identity as _, ["position_m", "force_n"])
                }
                (JointKind::Revolute, ..) => {
                    return Err(
                        "give either `position_deg` and `torque_nm`, or `counterbalance`".into()
                    );
                }
                (JointKind::Prismatic, ..) => {
                    return Err("of a prismatic joint give `position_m` and `force_n`".into());
                }
            };
        let [position, torque] = keys;
        if positions.len() != torques.len() || positions.len() < 2 {
            return Err(format!(
                "`{position}` has {} values and `{torque}` has {}; give as many of each, two at \
                least",
                positions.len(),
                torques.len()
            ));
        }
        if !positions.iter().chain(torques).all(|value| value.is_finite()) {
            return Err(format!("`{position}` and `{torque}` have to be finite numbers"));
        }
        if !positions.is_sorted_by(|a, b| a < b) {
            return Err(format!("the values of `{position}` have to increase"));
        }
        let points: Vec<[f64; 2]> =
            positions.iter().zip(torques).map(|(at, torque)| [to_si(*at), *torque]).collect();
        let reaches = |[at, _]: &[f64; 2], limit: f64| (at - limit).abs() < 1e-9;
        let (first, last) = (&points[0], &points[points.len() - 1]);
        let spans = (first[0] <= limits.position_min || reaches(first, limits.position_min))
            && (last[0] >= limits.position_max || reaches(last, limits.position_max));
        if !spans {
            return Err(format!("`{position}` has to reach from limit to limit of the joint"));
        }
        Ok(Law::Table(points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPRING: Counterbalance = Counterbalance {
        base_radius_m: 0.7,
        link_radius_m: 0.2,
        closest_deg: -90.0,
        pull_n: 12_000.0,
        length_m: 0.5,
        stiffness_n_m: Some(4000.0),
        gas_length_m: None,
    };
    const CYLINDER: Counterbalance =
        Counterbalance { stiffness_n_m: None, gas_length_m: Some(0.6), ..SPRING };

    /// The torque is what the stored energy loses, −dE/dq: E is F₀ x + k x²/2 of a spring, −F₀ s
    /// ln(1 − x/s) of a gas, with x = l − l₀.
    #[test]
    fn the_torque_is_that_of_the_energy_and_the_slope_that_of_the_torque() {
        let energy = |of: &Counterbalance, q: f64| {
            let Counterbalance { base_radius_m: a, link_radius_m: b, pull_n, .. } = of;
            let beta = q + 90.0_f64.to_radians();
            let x = (a * a + b * b - 2.0 * a * b * beta.cos()).sqrt() - 0.5;
            match of.gas_length_m {
                None => pull_n * x + 2000.0 * x * x,
                Some(s) => -pull_n * s * (1.0 - x / s).ln(),
            }
        };
        for of in [SPRING, CYLINDER] {
            assert_eq!(of.validated(), Ok(of));
            for q in [-2.5, -1.6, -0.4, 0.0, 1.3] {
                let h = 1e-5;
                let [torque, slope] = of.torque_and_slope(q);
                let expected = -(energy(&of, q + h) - energy(&of, q - h)) / (2.0 * h);
                assert!((torque - expected).abs() < 1e-3, "{q}: {torque} for {expected}");
                let expected =
                    (of.torque_and_slope(q + h)[0] - of.torque_and_slope(q - h)[0]) / (2.0 * h);
                assert!((slope - expected).abs() < 1e-3, "{q}: {slope} for {expected}");
            }
            // Where the ends are closest, the torque is 0.
            assert!(of.torque_and_slope(-90.0_f64.to_radians())[0].abs() < 1e-9);
        }
        let both = Counterbalance { stiffness_n_m: Some(1.0), ..CYLINDER };
        assert!(both.validated().unwrap_err().contains("not both"));
        let short = Counterbalance { gas_length_m: Some(0.3), ..CYLINDER };
        assert!(short.validated().unwrap_err().contains("no gas left"));
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "numbers that are exact")]
    fn a_table_is_linear_between_its_points_and_ends_there() {
        let law = Law::Table(vec![[-1.0, 4.0], [0.0, 0.0], [2.0, -1.0]]);
        let table = KnownTorque { factor: 1.0, law: law.clone() };
        let values = [-5.0, -1.0, -0.5, 0.0, 1.0, 2.0, 3.0].map(|q| table.torque_and_slope(q));
        let expected = [
            [4.0, 0.0],
            [4.0, -4.0],
            [2.0, -4.0],
            [0.0, -0.5],
            [-0.5, -0.5],
            [-1.0, 0.0],
            [-1.0, 0.0],
        ];
        assert_eq!(values, expected);
        let half = KnownTorque { factor: 0.5, law };
        assert_eq!(half.torque_and_slope(-0.5), [1.0, -2.0]);
    }
}
