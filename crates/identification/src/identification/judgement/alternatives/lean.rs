//! Gravity that is turned from its configured direction.

use nalgebra::{DVector, Matrix2, Rotation3, Unit, Vector2, Vector3};

use super::chosen::Chosen;
use super::gravity_columns::GravityColumns;
use super::normal_equations::{DEPENDENT, NormalEquations};
use crate::regression::ObservationMatrix;

/// Largest step \[rad\]. The torque is nearly linear in smaller ones.
const LONGEST_STEP: f64 = 0.5;

/// Half of the confidence interval of 95 % \[standard deviations\].
const QUANTILE_OF_95: f64 = 1.96;

/// Turn of gravity about an axis of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lean {
    /// Configured gravity in the base \[m/s²\].
    pub configured_m_s2: [f64; 3],
    /// Axis in the base, of length 1 and perpendicular to the configured gravity.
    pub axis: [f64; 3],
    /// Angle \[rad\].
    pub angle_rad: Chosen,
}

impl Lean {
    /// Returns the turn from the configured gravity to another direction, about the axis that is
    /// perpendicular to both. `None` if they have the same or the opposite direction.
    pub(super) fn between(configured_m_s2: [f64; 3], other: [f64; 3]) -> Option<Self> {
        let [from, to] = [configured_m_s2, other].map(Vector3::from);
        let across = Unit::try_new(from.cross(&to), f64::EPSILON * from.norm() * to.norm())?;
        let angle_rad = Chosen { value: from.angle(&to), standard_deviation: 0.0 };
        Some(Self { configured_m_s2, axis: across.into_inner().into(), angle_rad })
    }

    /// Returns gravity along the axis of the base that lies inside the confidence interval of 95 %,
    /// unless that is the configured direction.
    pub(super) fn near_axis(&self) -> Option<[f64; 3]> {
        let [configured, gravity] = [self.configured_m_s2, self.gravity_m_s2()].map(Vector3::from);
        let axis = gravity.iamax();
        let along = Vector3::ith(axis, configured.norm() * gravity[axis].signum());
        let is_near = |other: &Vector3<f64>| {
            other.angle(&along) <= QUANTILE_OF_95 * self.angle_rad.standard_deviation
        };
        (is_near(&gravity) && !is_near(&configured)).then(|| along.into())
    }

    /// Returns the standard deviation of the turned gravity across its direction \[m/s²\].
    pub(in super::super) fn standard_deviation_m_s2(&self) -> f64 {
        Vector3::from(self.configured_m_s2).norm() * self.angle_rad.standard_deviation
    }

    /// Returns the turned gravity \[m/s²\].
    pub(in super::super) fn gravity_m_s2(&self) -> [f64; 3] {
        rotate(self.configured_m_s2, self.axis, self.angle_rad.value)
    }
}

/// Returns the cosine of the angle between two vectors.
pub(super) fn cosine(one: [f64; 3], other: [f64; 3]) -> f64 {
    let [one, other] = [one, other].map(Vector3::from);
    one.dot(&other) / (one.norm() * other.norm())
}

/// Returns a vector that is turned about an axis of length 1.
pub(super) fn rotate(vector: [f64; 3], axis: [f64; 3], angle_rad: f64) -> [f64; 3] {
    let axis = Unit::new_unchecked(Vector3::from(axis));
    (Rotation3::from_axis_angle(&axis, angle_rad) * Vector3::from(vector)).into()
}

/// Returns two axes of length 1 that are perpendicular to a vector and to each other.
pub(super) fn perpendicular(vector: [f64; 3]) -> [[f64; 3]; 2] {
    let vector = Vector3::from(vector);
    let first = vector.cross(&Vector3::ith(vector.iamin(), 1.0)).normalize();
    [first.into(), vector.cross(&first).normalize().into()]
}

/// Share of the squared effect of a turn below which it stays as it is.
const NO_EFFECT: f64 = 1e-6;

/// Returns the gravity after a Gauss-Newton step. The residual is split into what a turn of gravity
/// explains and what a change of the parameters does. `weights` are those of the squared torques of
/// each joint.
pub(super) fn better_gravity(
    columns: &GravityColumns,
    gravity_m_s2: [f64; 3],
    torque: &DVector<f64>,
    weights: &[f64],
) -> Option<[f64; 3]> {
    let own = columns.matrix(gravity_m_s2);
    let mut equations = NormalEquations::new(&own, DEPENDENT);
    let parameters = equations.solve(torque.as_slice(), weights)?;
    let axes = perpendicular(gravity_m_s2);
    let mut effects = Vec::new();
    for axis in axes {
        let change = Vector3::from(axis).cross(&Vector3::from(gravity_m_s2));
        let effect = columns.added_torque(change.into(), &parameters);
        effects.push(unexplained(&own, &mut equations, &effect, weights)?);
    }
    let residual = unexplained(&own, &mut equations, torque, weights)?;
    let rows = torque.len() / weights.len();
    let product = |a: &DVector<f64>, b: &DVector<f64>| -> f64 {
        let of_joint = |(joint, weight): (usize, &f64)| {
            weight * a.rows(joint * rows, rows).dot(&b.rows(joint * rows, rows))
        };
        weights.iter().enumerate().map(of_joint).sum()
    };
    let mut normal = Matrix2::from_fn(|k, n| product(&effects[k], &effects[n]));
    // About the axis of an arm that moves in a plane, a turn has no effect.
    normal += Matrix2::identity() * (NO_EFFECT * normal.trace());
    let right = Vector2::from_fn(|k, _| product(&effects[k], &residual));
    let step = normal.cholesky()?.solve(&right).cap_magnitude(LONGEST_STEP);
    // Small turns about perpendicular axes add up to one about the sum of the axes.
    let axis = Vector3::from(axes[0]) * step[0] + Vector3::from(axes[1]) * step[1];
    let axis = Unit::try_new(axis, 0.0)?;
    Some(rotate(gravity_m_s2, axis.into_inner().into(), step.norm()))
}

/// Returns the part of a torque that no parameters explain.
fn unexplained(
    matrix: &ObservationMatrix,
    equations: &mut NormalEquations,
    torque: &DVector<f64>,
    weights: &[f64],
) -> Option<DVector<f64>> {
    let parameters = equations.solve(torque.as_slice(), weights)?;
    Some(torque - matrix.times_parameters(&parameters))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about_x(angle_deg: f64) -> Lean {
        let angle_rad = Chosen { value: angle_deg.to_radians(), standard_deviation: 0.01 };
        Lean { configured_m_s2: [0.0, 0.0, -9.8], axis: [1.0, 0.0, 0.0], angle_rad }
    }

    #[test]
    fn a_turn_leads_from_one_direction_to_the_other() {
        let configured = [0.3, -0.4, -9.8];
        for axis in perpendicular(configured) {
            let [of_axis, gravity] = [axis, configured].map(Vector3::from);
            assert!((of_axis.norm() - 1.0).abs() < 1e-12 && of_axis.dot(&gravity).abs() < 1e-12);
            for angle_rad in [0.01, 0.8, 2.9] {
                let other = rotate(configured, axis, angle_rad);
                assert!((Vector3::from(other).norm() / gravity.norm() - 1.0).abs() < 1e-12);
                let found = Lean::between(configured, other).unwrap();
                assert!((found.angle_rad.value - angle_rad).abs() < 1e-9);
                let again = found.gravity_m_s2();
                assert!((0..3).all(|k| (again[k] - other[k]).abs() < 1e-9), "{again:?}");
            }
        }
        let near = [0.5, 45.0, 89.5, 90.5, 179.5].map(|deg| about_x(deg).near_axis());
        let rounded = near.map(|of| of.map(|along| along.map(|own| (10.0 * own).round() / 10.0)));
        let wall = Some([0.0, 9.8, 0.0]);
        assert_eq!(rounded, [None, None, wall, wall, Some([0.0, 0.0, 9.8])]);
        assert_eq!(Lean::between(configured, configured.map(|of| 2.0 * of)), None);
    }
}
