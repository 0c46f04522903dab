//! Convex bodies of the links of a URDF, and the distances between them.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use didim_formats::{MeshError, MeshFolders, UrdfArm, UrdfGeometry, UrdfShape};
use didim_identification::excitation::Solid;
use nalgebra::{Point3, Vector3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::details::closest_points_support_map_support_map_with_params;
use parry3d_f64::query::gjk::{GJKResult, VoronoiSimplex};
use parry3d_f64::shape::SupportMap;

use super::assumptions::BodyAssumptions;

/// A shape of a URDF that is not checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadShape {
    /// Name of its link.
    pub link: String,
    /// Number of the driven joint that moves it; 0 for the base.
    pub number: usize,
    /// The problem.
    pub problem: ShapeProblem,
}

/// Reason why a shape is not checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ShapeProblem {
    /// No file has the name of its mesh. Remedy: give the folder of the packages.
    MissingMesh(String),
    /// Its mesh cannot be read.
    UnreadableMesh(String),
    /// It is no box, cylinder, sphere or mesh, or has no size.
    Unreadable,
}

/// Returns the bodies of the links, and the shapes that cannot be read.
pub(super) fn read_bodies(arm: &UrdfArm, folders: &MeshFolders) -> (Vec<Solid>, Vec<UnreadShape>) {
    let unreadable = arm.unread_shapes().iter().map(|(link, number)| UnreadShape {
        link: link.clone(),
        number: *number,
        problem: ShapeProblem::Unreadable,
    });
    let (mut solids, mut unread) = (Vec::new(), unreadable.collect::<Vec<_>>());
    for shape in arm.shapes() {
        match solid_of(shape, folders) {
            Ok(solid) => solids.push(solid),
            Err(error) => {
                let (link, number) = (shape.link.clone(), shape.number);
                let problem = match error {
                    MeshError::Missing { name } => ShapeProblem::MissingMesh(name),
                    other => ShapeProblem::UnreadableMesh(other.to_string()),
                };
                unread.push(UnreadShape { link, number, problem });
            }
        }
    }
    (solids, unread)
}

fn solid_of(shape: &UrdfShape, folders: &MeshFolders) -> Result<Solid, MeshError> {
    let (points, radius_m) = match &shape.geometry {
        UrdfGeometry::Box { size_m } => (box_corners(size_m.map(|side| 0.5 * side)), 0.0),
        UrdfGeometry::Sphere { radius_m } => (vec![[0.0; 3]], *radius_m),
        UrdfGeometry::Cylinder { radius_m, length_m } => (prism(*radius_m, 0.5 * length_m), 0.0),
        UrdfGeometry::Mesh { file, scale } => {
            let [x, y, z] = *scale;
            let points = folders.read_points(file)?.into_iter();
            (points.map(|[a, b, c]| [x * a, y * b, z * c]).collect(), 0.0)
        }
    };
    let points: Vec<[f64; 3]> =
        points.into_iter().map(|point| (shape.pose * Point3::from(point)).into()).collect();
    let (points_m, added_m) = reduce_hull(points);
    Ok(Solid { link: shape.number, points_m, radius_m: radius_m + added_m })
}

fn box_corners(half: [f64; 3]) -> Vec<[f64; 3]> {
    let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(|corner| core::array::from_fn(|axis| sign(corner, axis) * half[axis])).collect()
}

/// Returns the corners of a prism about a cylinder along z.
fn prism(radius_m: f64, half_length_m: f64) -> Vec<[f64; 3]> {
    let sides = BodyAssumptions::DEFAULT.cylinder_sides;
    let outer = radius_m / (PI / sides as f64).cos();
    let directions = (0..sides).map(|side| (TAU * side as f64 / sides as f64).sin_cos());
    let ends = |(sin, cos): (f64, f64)| {
        [half_length_m, -half_length_m].map(|z| [outer * cos, outer * sin, z])
    };
    directions.flat_map(ends).collect()
}

/// Returns a few points of a convex hull, and the radius about their hull that contains all points.
fn reduce_hull(points: Vec<[f64; 3]>) -> (Vec<[f64; 3]>, f64) {
    let count = BodyAssumptions::DEFAULT.hull_points;
    if points.len() <= count {
        return (points, 0.0);
    }
    let outermost: BTreeSet<usize> =
        (0..count).map(|k| farthest_index(&points, spiral_direction(k, count))).collect();
    let hull: Vec<[f64; 3]> = outermost.into_iter().map(|place| points[place]).collect();
    let radius = points.iter().map(|point| distance_outside(*point, &hull)).fold(0.0, f64::max);
    (hull, radius)
}

/// Returns a unit vector of a spiral, whose directions cover the sphere evenly.
fn spiral_direction(k: usize, count: usize) -> [f64; 3] {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let z = 1.0 - 2.0 * (k as f64 + 0.5) / count as f64;
    let (sin, cos) = (golden * k as f64).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    [radius * cos, radius * sin, z]
}

/// Returns the distance of a point from a hull \[m\]; 0 inside.
fn distance_outside(point: [f64; 3], hull: &[[f64; 3]]) -> f64 {
    let near = nearest_points([&[point], hull]);
    near.map_or(0.0, |[p, q]| (Vector3::from(p) - Vector3::from(q)).norm())
}

/// Returns the index of the point that is farthest in a direction; 0 without points.
fn farthest_index(points: &[[f64; 3]], [x, y, z]: [f64; 3]) -> usize {
    let mut farthest = (0, f64::NEG_INFINITY);
    for (place, [a, b, c]) in points.iter().enumerate() {
        let along = x * a + y * b + z * c;
        if along > farthest.1 {
            farthest = (place, along);
        }
    }
    farthest.0
}

/// Points whose convex hull is a shape of the library.
struct Hull<'a>(&'a [[f64; 3]]);

impl SupportMap for Hull<'_> {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let place = farthest_index(self.0, direction.to_array());
        Vector::from_array(self.0.get(place).copied().unwrap_or_default())
    }
}

/// Returns the nearest points of two convex hulls \[m\]; `None` if they overlap.
pub(super) fn nearest_points(hulls: [&[[f64; 3]]; 2]) -> Option<[[f64; 3]; 2]> {
    let [first, second] =
        hulls.map(|of| Vector::from_array(of.first().copied().unwrap_or_default()));
    let found = closest_points_support_map_support_map_with_params(
        &Pose::IDENTITY,
        &Hull(hulls[0]),
        &Hull(hulls[1]),
        f64::MAX,
        &mut VoronoiSimplex::new(),
        Some(second - first),
    );
    match found {
        GJKResult::ClosestPoints(p, q, _) => Some([p.to_array(), q.to_array()]),
        // An iteration without a result counts as an overlap.
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_boxes_are_those_of_their_sides() {
        let near = box_corners([0.5, 0.4, 0.3]);
        for (shift, expected) in [
            ([1.2, 0.1, 0.0], Some(0.2)),
            ([1.3, 1.2, 0.0], Some(0.5)),
            ([0.9, 0.7, 0.5], None),
            ([1.0 + 1e-6, 0.0, 0.0], Some(1e-6)),
        ] {
            let other: Vec<[f64; 3]> =
                near.iter().map(|of| core::array::from_fn(|k| of[k] + shift[k])).collect();
            let found = nearest_points([&near, &other]);
            let distance = found.map(|[p, q]| (Vector3::from(p) - Vector3::from(q)).norm());
            match (distance, expected) {
                (Some(distance), Some(expected)) => {
                    assert!((distance - expected).abs() < 1e-9, "{distance} {expected}");
                }
                (found, expected) => assert_eq!(found.is_some(), expected.is_some(), "{shift:?}"),
            }
        }
    }

    /// Many points of a sphere: no point is outside of the reduced body, which is hardly larger.
    #[test]
    fn a_reduced_hull_contains_all_points() {
        let points: Vec<[f64; 3]> = (0..3000)
            .map(|k| {
                let v = Vector3::from_fn(|i, _| (1.3 * f64::from(k) + 2.1 * i as f64).sin());
                (0.2 * v.normalize()).into()
            })
            .collect();
        let (hull, radius_m) = reduce_hull(points.clone());
        assert!(
            hull.len() <= BodyAssumptions::DEFAULT.hull_points && radius_m < 0.01,
            "{radius_m}"
        );
        for point in &points {
            assert!(distance_outside(*point, &hull) <= radius_m);
        }
    }
}
