//! Distance between two segments (C. Ericson, *Real-Time Collision Detection*, ch. 5.1.9).

use nalgebra::Vector3;

/// Squared length below which a segment is treated as a point \[m²\].
const POINT_LENGTH_M2: f64 = 1e-18;

/// Returns the points of two segments that are nearest to each other.
pub(super) fn nearest_points(
    [from, to]: [Vector3<f64>; 2],
    [other_from, other_to]: [Vector3<f64>; 2],
) -> [Vector3<f64>; 2] {
    let (own, other, between) = (to - from, other_to - other_from, from - other_from);
    let (a, e) = (own.norm_squared(), other.norm_squared());
    let (c, f) = (own.dot(&between), other.dot(&between));
    let unit = |share: f64| share.clamp(0.0, 1.0);
    let (s, t) = match (a > POINT_LENGTH_M2, e > POINT_LENGTH_M2) {
        (false, false) => (0.0, 0.0),
        (false, true) => (0.0, unit(f / e)),
        (true, false) => (unit(-c / a), 0.0),
        (true, true) => {
            let b = own.dot(&other);
            let across = a * e - b * b;
            // For parallel segments any point is suitable.
            let s = if across > 1e-12 * a * e { unit((b * f - c * e) / across) } else { 0.0 };
            let t = (b * s + f) / e;
            match t {
                t if t < 0.0 => (unit(-c / a), 0.0),
                t if t > 1.0 => (unit((b - c) / a), 1.0),
                t => (s, t),
            }
        }
    };
    [from + own * s, other_from + other * t]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the smallest distance on a fine grid of both segments.
    #[test]
    fn no_point_is_nearer() {
        let point = |k: usize| Vector3::from_fn(|i, _| ((7 * k + 3 * i) as f64 * 1.3).sin());
        for k in 0..200 {
            let mut ends = [0, 1, 2, 3].map(|i| point(4 * k + i));
            match k % 5 {
                // Cases: one point, two points, parallel segments, segments that meet.
                1 => ends[1] = ends[0],
                2 => (ends[1], ends[3]) = (ends[0], ends[2]),
                3 => ends[3] = ends[2] + (ends[1] - ends[0]) * 0.7,
                4 => ends[2] = 0.5 * (ends[0] + ends[1]),
                _ => {}
            }
            let [a, b, c, d] = ends;
            let [p, q] = nearest_points([a, b], [c, d]);
            let distance = (p - q).norm();
            let along = |from: Vector3<f64>, to: Vector3<f64>, i: u32| {
                from + (to - from) * (f64::from(i) / 100.0)
            };
            let least = (0..=100)
                .flat_map(|i| (0..=100).map(move |j| (i, j)))
                .map(|(i, j)| (along(a, b, i) - along(c, d, j)).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(
                distance <= least + 1e-12 && distance > least - 0.03,
                "{k}: {distance} {least}"
            );
        }
    }
}
