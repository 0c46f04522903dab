//! Possible collisions: of the links with each other, and of the links with walls.

use core::ops::Range;

use nalgebra::{DMatrix, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::basis::column;
use super::clearance::nearest_points;
use super::random::uniform;
use super::series::Course;
use super::solid::{NearestPoints, Solid, Wall, WallKind};
use didim_dynamics::dynamics::{LinkFrame, Model};
use didim_dynamics::robot::{JointKind, Robot};

/// Smallest permitted gap between two shapes \[m\].
pub const MIN_GAP_M: f64 = 0.02;
/// Distance beyond [`MIN_GAP_M`] within which a gap affects the motion \[m\].
const REACH_M: f64 = 0.1;
/// Number of random postures for finding pairs of shapes that are near each other in every posture.
const PROXIMITY_POSTURES: usize = 1000;
/// A link is mounted at a wall if its gap to the wall varies by less than this over all random
/// postures \[m\].
const STAND_HEIGHT_M: f64 = 1e-3;

/// Shape near a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Neighbour {
    /// Another link, by its number; 0 is the base.
    Link(usize),
    /// A wall.
    Wall(WallKind),
}

/// Gap between two shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Number of the link; 0 is the base.
    pub link: usize,
    /// Shape near the link.
    pub neighbour: Neighbour,
    /// Gap between them \[m\]; 0 or less if they overlap.
    pub gap_m: f64,
}

impl core::fmt::Display for Nearest {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.neighbour {
            Neighbour::Link(other) => {
                let [first, second] = [self.link.min(other), self.link.max(other)];
                match first {
                    0 => write!(f, "the base and link {second}")?,
                    _ => write!(f, "links {first} and {second}")?,
                }
            }
            Neighbour::Wall(WallKind::Side) => write!(f, "link {} and the box", self.link)?,
            Neighbour::Wall(WallKind::Floor) => write!(f, "link {} and the floor", self.link)?,
        }
        match self.gap_m > 0.0 {
            true => write!(f, ", {:.0} mm apart", 1e3 * self.gap_m),
            false => write!(f, ", which overlap"),
        }
    }
}

/// Returns the share of the smallest permitted gap: 1 at this gap, more below it, and 0 if the gap
/// has no effect.
pub(super) fn gap_share(gap_m: f64) -> f64 {
    ((MIN_GAP_M + REACH_M - gap_m) / REACH_M).max(0.0)
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum ShapePair {
    /// Two solids, by index.
    Solids(usize, usize),
    /// A solid and a wall, by index.
    Wall(usize, usize),
}

/// Shapes of an arm, and the pairs of shapes that must not collide. The pairs are links without a
/// common joint, and all links except the base with the walls. Three kinds of pairs are excluded
/// and listed: links that are near each other in all of a thousand random postures, links that
/// overlap in a reference posture, and links that are mounted at a wall.
#[derive(Clone, Debug)]
pub struct Shapes {
    solids: Vec<Solid>,
    /// Centre and radius of a ball about each solid, in the frame of its link \[m\].
    balls: Vec<(Vector3<f64>, f64)>,
    /// Places of the points of each solid among those of all.
    ranges: Vec<Range<usize>>,
    walls: Vec<Wall>,
    pairs: Vec<ShapePair>,
    /// Kind of each joint.
    kinds: Vec<JointKind>,
    nearest_points: Option<NearestPoints>,
    /// Excluded pairs, because they are near each other in every posture.
    pub always_near: Vec<(usize, Neighbour)>,
    /// Excluded pairs, because they overlap in the reference posture.
    pub touching_at_reference: Vec<(usize, Neighbour)>,
    /// Links without a shape.
    pub links_without_shape: Vec<usize>,
}

impl Shapes {
    /// Creates the shapes of a robot file, and of walls. Returns `None` if the robot file defines
    /// no shape.
    pub fn new(robot: &Robot, walls: &[Wall]) -> Option<Self> {
        let capsules = robot.capsules().iter().enumerate();
        let solids = capsules
            .flat_map(|(link, own)| own.iter().map(move |of| Solid::of_capsule(link, of)))
            .collect();
        Self::with_pairs(robot, solids, walls, None, None)
    }

    /// Creates the shapes of an arm from bodies, the function that finds their nearest points, and
    /// walls. `reference` is a posture \[rad or m\] in which links cannot touch: those whose bodies
    /// overlap there are larger than the links, and excluded. Returns `None` without bodies.
    pub fn of_solids(
        robot: &Robot,
        solids: Vec<Solid>,
        nearest_points: NearestPoints,
        walls: &[Wall],
        reference: &[f64],
    ) -> Option<Self> {
        Self::with_pairs(robot, solids, walls, Some(nearest_points), Some(reference))
    }

    fn with_pairs(
        robot: &Robot,
        mut solids: Vec<Solid>,
        walls: &[Wall],
        nearest_points: Option<NearestPoints>,
        reference: Option<&[f64]>,
    ) -> Option<Self> {
        solids.retain(|of| !of.points_m.is_empty());
        if solids.is_empty() {
            return None;
        }
        let has_none = |link: &usize| solids.iter().all(|solid| solid.link != *link);
        let links_without_shape = (0..=robot.joints()).filter(has_none).collect();
        let count = solids.len();
        let of_links = (0..count).flat_map(|a| (0..count).map(move |b| (a, b)));
        let separated = of_links.filter(|&(a, b)| solids[a].link + 2 <= solids[b].link);
        let of_walls = (0..count)
            .filter(|solid| solids[*solid].link > 0)
            .flat_map(|solid| (0..walls.len()).map(move |wall| ShapePair::Wall(solid, wall)));
        let pairs = separated.map(|(a, b)| ShapePair::Solids(a, b)).chain(of_walls).collect();
        let mut end = 0;
        let ranges = solids.iter().map(|of| {
            end += of.points_m.len();
            end - of.points_m.len()..end
        });
        let mut shapes = Self {
            ranges: ranges.collect(),
            balls: solids.iter().map(Solid::ball).collect(),
            solids,
            walls: walls.to_vec(),
            pairs,
            kinds: robot.chain().iter().map(|joint| joint.kind).collect(),
            nearest_points,
            always_near: Vec::new(),
            touching_at_reference: Vec::new(),
            links_without_shape,
        };
        shapes.leave_out_what_is_always_near(robot);
        if let Some(reference) = reference {
            shapes.leave_out_what_touches(&Model::new(robot), reference);
        }
        Some(shapes)
    }

    /// Returns true if there is a wall of this kind.
    pub fn has_wall(&self, kind: WallKind) -> bool {
        self.walls.iter().any(|wall| wall.kind == kind)
    }

    fn leave_out_what_is_always_near(&mut self, robot: &Robot) {
        let model = Model::new(robot);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut widest = vec![f64::NEG_INFINITY; self.pairs.len()];
        let mut narrowest = vec![f64::INFINITY; self.pairs.len()];
        for _ in 0..PROXIMITY_POSTURES {
            let sample_at =
                |low: f64, high: f64, share: f64| 0.5 * (low + high + share * (high - low));
            let q: Vec<f64> = (robot.limits())
                .map(|of| sample_at(of.position_min, of.position_max, uniform(&mut random)))
                .collect();
            let placed = self.place_solids(&model, &q);
            for (k, pair) in self.pairs.iter().enumerate() {
                let least_m = self.least_gap_m(&placed, pair);
                let gap_m =
                    if least_m < MIN_GAP_M { self.pair_gap(&placed, pair).0 } else { least_m };
                widest[k] = widest[k].max(gap_m);
                narrowest[k] = narrowest[k].min(gap_m);
            }
        }
        // A link that never fits behind the walls is not excluded. No motion is then possible. A
        // constant gap that is wide enough needs no check.
        let is_constant = |k: usize| widest[k] - narrowest[k] < STAND_HEIGHT_M;
        let stands = |k: usize| matches!(self.pairs[k], ShapePair::Solids(..)) || is_constant(k);
        let near: Vec<bool> =
            (0..self.pairs.len()).map(|k| widest[k] < MIN_GAP_M && stands(k)).collect();
        let constant: Vec<bool> = (0..self.pairs.len())
            .filter(|k| !near[*k])
            .map(|k| is_constant(k) && matches!(self.pairs[k], ShapePair::Wall(..)))
            .collect();
        self.always_near = self.leave_out(&near);
        self.leave_out(&constant);
    }

    fn leave_out_what_touches(&mut self, model: &Model, reference: &[f64]) {
        let placed = self.place_solids(model, reference);
        let touches = |pair: &ShapePair| {
            matches!(pair, ShapePair::Solids(..)) && self.pair_gap(&placed, pair).0 <= 0.0
        };
        let touching: Vec<bool> = self.pairs.iter().map(touches).collect();
        self.touching_at_reference = self.leave_out(&touching);
    }

    /// Removes the marked pairs, and returns their names.
    fn leave_out(&mut self, marked: &[bool]) -> Vec<(usize, Neighbour)> {
        let pairs = || self.pairs.iter().zip(marked);
        let out = pairs().filter(|(_, marked)| **marked);
        let mut names: Vec<_> = out.map(|(pair, _)| self.pair_names(pair)).collect();
        names.sort_unstable();
        names.dedup();
        let remaining_pairs = pairs().filter(|(_, marked)| !**marked).map(|(pair, _)| *pair);
        self.pairs = remaining_pairs.collect();
        names
    }

    fn pair_names(&self, pair: &ShapePair) -> (usize, Neighbour) {
        match *pair {
            ShapePair::Solids(a, b) => (self.solids[a].link, Neighbour::Link(self.solids[b].link)),
            ShapePair::Wall(solid, wall) => {
                (self.solids[solid].link, Neighbour::Wall(self.walls[wall].kind))
            }
        }
    }

    /// Returns the frames of the links and the points of the solids in the frame of the base.
    fn place_solids(&self, model: &Model, q: &[f64]) -> PlacedSolids {
        let frames = model.link_frames(q);
        let place = |link: usize, point: [f64; 3]| match link.checked_sub(1) {
            None => Vector3::from(point),
            Some(frame) => {
                let LinkFrame { origin_m, axes } = &frames[frame];
                let mut tip = Vector3::from(*origin_m);
                for (axis, along) in axes.iter().zip(point) {
                    tip += Vector3::from(*axis) * along;
                }
                tip
            }
        };
        let points = (self.solids.iter())
            .flat_map(|solid| solid.points_m.iter().map(|point| place(solid.link, *point).into()))
            .collect();
        let centres = self.solids.iter().zip(&self.balls);
        let centres = centres.map(|(solid, (centre, _))| place(solid.link, (*centre).into()));
        PlacedSolids { points, centres: centres.collect(), frames }
    }

    /// Returns the gap of balls about the shapes of a pair, which is not above the gap of the pair
    /// \[m\]. There is none at a wall.
    fn least_gap_m(&self, placed: &PlacedSolids, pair: &ShapePair) -> f64 {
        match *pair {
            ShapePair::Solids(a, b) => {
                let distance = (placed.centres[a] - placed.centres[b]).norm();
                distance - self.balls[a].1 - self.balls[b].1
            }
            ShapePair::Wall(..) => f64::NEG_INFINITY,
        }
    }

    /// Returns the gap of a pair.
    fn pair_gap(&self, placed: &PlacedSolids, pair: &ShapePair) -> Gap {
        match *pair {
            ShapePair::Solids(a, b) => {
                let [first, second] = [&self.solids[a], &self.solids[b]];
                let found = self.nearest_of_hulls(placed, [a, b]);
                let [p, q] = found.unwrap_or([placed.centres[a]; 2]);
                let distance = (p - q).norm();
                let gap = distance - first.radius_m - second.radius_m;
                let direction = (p - q) / distance.max(f64::MIN_POSITIVE);
                (gap, direction, [(first.link, p), (second.link, q)])
            }
            ShapePair::Wall(solid, wall) => {
                let (Solid { link, radius_m, .. }, wall) = (&self.solids[solid], &self.walls[wall]);
                let normal = Vector3::from(wall.normal);
                let points = self.points_of(placed, solid).iter().map(|of| Vector3::from(*of));
                let (height, out) = points.fold((f64::INFINITY, normal), |(least, out), point| {
                    let height = normal.dot(&point);
                    if height < least { (height, point) } else { (least, out) }
                });
                (height - wall.offset_m - radius_m, normal, [(*link, out), (0, out)])
            }
        }
    }

    /// Returns the nearest points of two hulls; `None` if they overlap.
    fn nearest_of_hulls(
        &self,
        placed: &PlacedSolids,
        pair: [usize; 2],
    ) -> Option<[Vector3<f64>; 2]> {
        let points = pair.map(|solid| self.points_of(placed, solid));
        match (points, self.nearest_points) {
            ([[a, b], [c, d]], _) => {
                Some(nearest_points([*a, *b].map(Vector3::from), [*c, *d].map(Vector3::from)))
            }
            (_, Some(nearest)) => Some(nearest(points)?.map(Vector3::from)),
            (_, None) => None,
        }
    }

    fn points_of<'a>(&self, placed: &'a PlacedSolids, solid: usize) -> &'a [[f64; 3]] {
        &placed.points[self.ranges[solid].clone()]
    }

    /// Returns the narrowest gap in a posture \[rad or m\]; `None` without pairs.
    pub fn narrowest_gap(&self, model: &Model, q: &[f64]) -> Option<Nearest> {
        self.gap_below(model, q, f64::INFINITY)
    }

    /// Returns the narrowest gap in a posture, if it is below `limit_m`.
    fn gap_below(&self, model: &Model, q: &[f64], limit_m: f64) -> Option<Nearest> {
        let placed = self.place_solids(model, q);
        let mut narrowest: Option<Nearest> = None;
        for pair in &self.pairs {
            let limit_m = narrowest.map_or(limit_m, |of| of.gap_m);
            if self.least_gap_m(&placed, pair) >= limit_m {
                continue;
            }
            let gap_m = self.pair_gap(&placed, pair).0;
            if gap_m < limit_m {
                let (link, neighbour) = self.pair_names(pair);
                narrowest = Some(Nearest { link, neighbour, gap_m });
            }
        }
        narrowest
    }

    /// Returns the narrowest gap along a motion.
    pub(super) fn nearest_along(
        &self,
        model: &Model,
        motion: &dyn Course,
        rate_hz: f64,
    ) -> Option<Nearest> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a motion has far fewer samples than 2^52"
        )]
        let samples = (motion.duration_s() * rate_hz).ceil().max(1.0) as usize;
        let mut narrowest: Option<Nearest> = None;
        for i in 0..=samples {
            let state = motion.state(motion.duration_s() * i as f64 / samples as f64);
            let limit_m = narrowest.map_or(f64::INFINITY, |of| of.gap_m);
            let found = self.gap_below(model, &state.position[..model.joints()], limit_m);
            narrowest = found.or(narrowest);
        }
        narrowest
    }

    /// Returns the largest gap share for the positions of a motion (n × N).
    pub(super) fn largest_gap_share(&self, model: &Model, q: &DMatrix<f64>) -> f64 {
        let near = |i| self.gap_below(model, column(q, i), MIN_GAP_M + REACH_M);
        (0..q.ncols()).filter_map(near).map(|of| gap_share(of.gap_m)).fold(0.0, f64::max)
    }

    /// Adds the barrier of all gaps in a posture: `weight` times the sum of −ln(1 − z²), with z the
    /// share of each gap. Adds its gradient to `by_q`. Returns `None` if a gap is too narrow.
    pub(super) fn add(
        &self,
        model: &Model,
        weight: f64,
        q: &[f64],
        by_q: &mut [f64],
    ) -> Option<f64> {
        let placed = self.place_solids(model, q);
        let mut value = 0.0;
        for pair in &self.pairs {
            if self.least_gap_m(&placed, pair) >= MIN_GAP_M + REACH_M {
                continue;
            }
            let (gap_m, direction, points) = self.pair_gap(&placed, pair);
            let z = gap_share(gap_m);
            let slack = 1.0 - z * z;
            if slack.is_nan() || slack <= 0.0 {
                return None;
            }
            if z == 0.0 {
                continue;
            }
            value -= weight * slack.ln();
            let slope = -weight * 2.0 * z / (slack * REACH_M);
            for ((link, point), sense) in points.into_iter().zip([1.0, -1.0]) {
                for (joint, by_q) in by_q.iter_mut().enumerate().take(link) {
                    let LinkFrame { origin_m, axes } = &placed.frames[joint];
                    let axis = Vector3::from(axes[2]);
                    let velocity = match self.kinds[joint] {
                        JointKind::Revolute => axis.cross(&(point - Vector3::from(*origin_m))),
                        JointKind::Prismatic => axis,
                    };
                    *by_q += sense * slope * direction.dot(&velocity);
                }
            }
        }
        Some(value)
    }
}

/// Gap of a pair \[m\], the direction towards the first shape, and the nearest points with their
/// links.
type Gap = (f64, Vector3<f64>, [(usize, Vector3<f64>); 2]);

/// Arm in a posture, in the frame of the base.
struct PlacedSolids {
    /// Points of all solids.
    points: Vec<[f64; 3]>,
    /// Centres of the balls about the solids.
    centres: Vec<Vector3<f64>>,
    frames: Vec<LinkFrame>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let file = include_str!("../../../../config/robots/tx40.toml");
        let shaped =
            "drive_inertia = true\ncapsules = [{ to_m = [0.03, 0.02, 0.1], radius_m = 0.05 }]";
        let robot = Robot::from_toml(&file.replace("drive_inertia = true", shaped)).unwrap();
        let shapes =
            Shapes::new(&robot, &Wall::sides([[-0.5, -0.5, 0.0], [0.5, 0.5, 0.9]])).unwrap();
        let model = Model::new(&robot);
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut active = 0;
        for _ in 0..300 {
            let q: Vec<f64> = (0..6).map(|_| 2.0 * uniform(&mut random)).collect();
            let along: Vec<f64> = (0..6).map(|_| uniform(&mut random)).collect();
            let mut gradient = vec![0.0; 6];
            if !shapes.add(&model, 1.0, &q, &mut gradient).is_some_and(|value| value > 0.0) {
                continue;
            }
            active += 1;
            let gap_at = |h: f64| {
                let near: Vec<f64> = q.iter().zip(&along).map(|(q, along)| q + h * along).collect();
                shapes.add(&model, 1.0, &near, &mut [0.0; 6]).unwrap()
            };
            let h = 1e-6;
            let expected = (gap_at(h) - gap_at(-h)) / (2.0 * h);
            let slope: f64 = gradient.iter().zip(&along).map(|(g, along)| g * along).sum();
            assert!((slope - expected).abs() < 1e-5 * (1.0 + expected.abs()), "{slope} {expected}");
        }
        assert!(active > 50, "{active}");
    }
}
