//! Bodies of links, and the walls that they stay behind.

use nalgebra::Vector3;

use didim_dynamics::robot::Capsule;

/// Box in the frame of the base: its corners with the smallest and the largest coordinates \[m\].
pub type Corners = [[f64; 3]; 2];

/// Returns the nearest points of the convex hulls of two sets of points \[m\]; `None` if the hulls
/// overlap.
pub type NearestPoints = fn([&[[f64; 3]]; 2]) -> Option<[[f64; 3]; 2]>;

/// A convex body of a link: all points within a radius of the convex hull of some points, in the
/// frame of the link.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Number of the link; 0 is the base.
    pub link: usize,
    /// Points of the hull \[m\]; at least one.
    pub points_m: Vec<[f64; 3]>,
    /// Radius about the hull \[m\].
    pub radius_m: f64,
}

/// Kind of a wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum WallKind {
    /// A side of a box around the arm.
    Side,
    /// The plane on which the arm is mounted, or the floor.
    Floor,
}

/// A plane in the frame of the base that all links except the base stay in front of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Its kind.
    pub kind: WallKind,
    /// Unit vector towards the arm.
    pub normal: [f64; 3],
    /// Coordinate of the plane along the normal \[m\].
    pub offset_m: f64,
}

impl Wall {
    /// Returns the sides of a box.
    pub fn sides(corners: Corners) -> [Self; 6] {
        core::array::from_fn(|side| {
            let (axis, corner) = (side / 2, side % 2);
            let inwards = if corner == 0 { 1.0 } else { -1.0 };
            let mut normal = [0.0; 3];
            normal[axis] = inwards;
            Self { kind: WallKind::Side, normal, offset_m: inwards * corners[corner][axis] }
        })
    }
}

impl Solid {
    /// Creates the body of a capsule.
    pub(super) fn of_capsule(link: usize, capsule: &Capsule) -> Self {
        let Capsule { from_m, to_m, radius_m } = *capsule;
        Self { link, points_m: [from_m, to_m].into(), radius_m }
    }

    /// Returns the centre and the radius of a ball about the body \[m\].
    pub(super) fn ball(&self) -> (Vector3<f64>, f64) {
        let points = || self.points_m.iter().map(|point| Vector3::from(*point));
        let low = points().fold(Vector3::repeat(f64::INFINITY), |low, of| low.inf(&of));
        let high = points().fold(Vector3::repeat(f64::NEG_INFINITY), |high, of| high.sup(&of));
        let centre = 0.5 * (low + high);
        let farthest = points().map(|of| (of - centre).norm()).fold(0.0, f64::max);
        (centre, farthest + self.radius_m)
    }
}
