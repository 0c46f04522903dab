//! Possible collisions: of the links with each other, and of the links with the sides of a box.

use nalgebra::{DMatrix, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::basis::column;
use super::clearance::nearest_points;
use super::random::uniform;
use super::series::Course;
use didim_dynamics::dynamics::{LinkFrame, Model};
use didim_dynamics::robot::{Capsule, JointKind, Robot};

/// Smallest permitted gap between two shapes \[m\].
pub const MIN_GAP_M: f64 = 0.02;
/// Distance beyond [`MIN_GAP_M`] within which a gap affects the motion \[m\].
const REACH_M: f64 = 0.1;
/// Number of random postures for finding pairs of shapes that are near each other in every posture.
const PROXIMITY_POSTURES: usize = 1000;
/// A link is mounted at a side of the box if its gap to the side varies by less than this over all
/// random postures \[m\].
const STAND_HEIGHT_M: f64 = 1e-3;

/// Shape near a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Neighbour {
    /// Another link, by its number; 0 is the base.
    Link(usize),
    /// A side of the box.
    Side,
}

/// Gap between two shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Number of the link; 0 is the base.
    pub link: usize,
    /// Shape near the link.
    pub neighbour: Neighbour,
    /// Gap between them \[m\]; negative if they overlap.
    pub gap_m: f64,
}

/// Returns the share of the smallest permitted gap: 1 at this gap, more below it, and 0 if the gap
/// has no effect.
pub(super) fn gap_share(gap_m: f64) -> f64 {
    ((MIN_GAP_M + REACH_M - gap_m) / REACH_M).max(0.0)
}

/// Box in the frame of the base: its corners with the smallest and the largest coordinates \[m\].
pub type Corners = [[f64; 3]; 2];

#[derive(Clone, Copy, Debug, PartialEq)]
enum ShapePair {
    /// Two capsules, by index.
    Capsules(usize, usize),
    /// Capsule and a side of the box: the axis of the side, its outward sense and its position
    /// \[m\].
    Side { capsule: usize, axis: usize, sense: f64, at_m: f64 },
}

/// Shapes of an arm, and the pairs of shapes that must not collide. The pairs are links without a
/// common joint, and all links except the base with the sides of a box. Two kinds of pairs are
/// excluded and listed: links that are near each other in all of a thousand random postures, and
/// links that are mounted at a side of the box.
#[derive(Clone, Debug, PartialEq)]
pub struct Shapes {
    /// Capsules, each with the number of its link.
    capsules: Vec<(usize, Capsule)>,
    pairs: Vec<ShapePair>,
    /// Kind of each joint.
    kinds: Vec<JointKind>,
    /// Excluded pairs, because they are near each other in every posture.
    pub always_near: Vec<(usize, Neighbour)>,
    /// Links without a shape.
    pub links_without_shape: Vec<usize>,
    /// True if there is a box.
    pub has_box: bool,
}

impl Shapes {
    /// Creates the shapes of a robot, and of a box that it has to stay in. Returns `None` if the
    /// robot file defines no shape.
    pub fn new(robot: &Robot, inside: Option<Corners>) -> Option<Self> {
        let of_links = robot.capsules();
        let shapeless: Vec<usize> =
            (0..=robot.joints()).filter(|link| of_links[*link].is_empty()).collect();
        let capsules: Vec<(usize, Capsule)> = (of_links.iter().enumerate())
            .flat_map(|(link, own)| own.iter().map(move |capsule| (link, *capsule)))
            .collect();
        if capsules.is_empty() {
            return None;
        }
        let links = 0..capsules.len();
        let of_links = links.clone().flat_map(|a| links.clone().map(move |b| (a, b)));
        let separated = of_links.filter(|&(a, b)| capsules[a].0 + 2 <= capsules[b].0);
        let mut pairs: Vec<ShapePair> = separated.map(|(a, b)| ShapePair::Capsules(a, b)).collect();
        for corners in inside.iter() {
            for capsule in links.clone().filter(|of| capsules[*of].0 > 0) {
                for axis in 0..3 {
                    for (sense, corner) in [(-1.0, corners[0]), (1.0, corners[1])] {
                        let at_m = corner[axis];
                        pairs.push(ShapePair::Side { capsule, axis, sense, at_m });
                    }
                }
            }
        }
        let kinds = robot.chain().iter().map(|joint| joint.kind).collect();
        let boxed = inside.is_some();
        let mut shapes = Self {
            capsules,
            pairs,
            kinds,
            always_near: Vec::new(),
            links_without_shape: shapeless,
            has_box: boxed,
        };
        shapes.leave_out_what_is_always_near(robot);
        Some(shapes)
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
            let placed = self.place_capsules(&model, &q);
            for (k, pair) in self.pairs.iter().enumerate() {
                let gap_m = self.pair_gap(&placed, pair).0;
                widest[k] = widest[k].max(gap_m);
                narrowest[k] = narrowest[k].min(gap_m);
            }
        }
        // A link that never fits into the box is not excluded. No motion is then possible.
        let stands = |k: usize| {
            matches!(self.pairs[k], ShapePair::Capsules(..))
                || widest[k] - narrowest[k] < STAND_HEIGHT_M
        };
        let near = |k: &usize| widest[*k] < MIN_GAP_M && stands(*k);
        let (out, remaining_pairs): (Vec<usize>, Vec<usize>) =
            (0..self.pairs.len()).partition(near);
        self.always_near = out.iter().map(|k| self.pair_names(&self.pairs[*k])).collect();
        self.always_near.sort_unstable();
        self.always_near.dedup();
        self.pairs = remaining_pairs.iter().map(|k| self.pairs[*k]).collect();
    }

    fn pair_names(&self, pair: &ShapePair) -> (usize, Neighbour) {
        match *pair {
            ShapePair::Capsules(a, b) => (self.capsules[a].0, Neighbour::Link(self.capsules[b].0)),
            ShapePair::Side { capsule, .. } => (self.capsules[capsule].0, Neighbour::Side),
        }
    }

    /// Returns the frames of the links and the ends of the capsules in the frame of the base.
    fn place_capsules(&self, model: &Model, q: &[f64]) -> PlacedCapsules {
        let frames = model.link_frames(q);
        PlacedCapsules {
            end_points: self
                .capsules
                .iter()
                .map(|(link, capsule): &(usize, Capsule)| {
                    [capsule.from_m, capsule.to_m].map(|point| match link.checked_sub(1) {
                        None => Vector3::from(point),
                        Some(frame) => {
                            let LinkFrame { origin_m, axes } = &frames[frame];
                            let mut tip = Vector3::from(*origin_m);
                            for (axis, along) in axes.iter().zip(point) {
                                tip += Vector3::from(*axis) * along;
                            }
                            tip
                        }
                    })
                })
                .collect(),
            frames,
        }
    }

    /// Returns the gap of a pair.
    fn pair_gap(&self, placed: &PlacedCapsules, pair: &ShapePair) -> Gap {
        match *pair {
            ShapePair::Capsules(a, b) => {
                let [(own, first), (other, second)] = [self.capsules[a], self.capsules[b]];
                let [p, q] = nearest_points(placed.end_points[a], placed.end_points[b]);
                let distance = (p - q).norm();
                let gap = distance - first.radius_m - second.radius_m;
                (gap, (p - q) / distance.max(f64::MIN_POSITIVE), [(own, p), (other, q)])
            }
            ShapePair::Side { capsule, axis, sense, at_m } => {
                let (link, Capsule { radius_m, .. }) = self.capsules[capsule];
                let [from, to] = placed.end_points[capsule];
                let out = if sense * from[axis] > sense * to[axis] { from } else { to };
                let mut inwards = Vector3::zeros();
                inwards[axis] = -sense;
                (sense * (at_m - out[axis]) - radius_m, inwards, [(link, out), (0, out)])
            }
        }
    }

    /// Returns the narrowest gap in a posture \[rad or m\]; `None` without pairs.
    pub fn narrowest_gap(&self, model: &Model, q: &[f64]) -> Option<Nearest> {
        let placed = self.place_capsules(model, q);
        let gaps = self.pairs.iter().map(|pair| (pair, self.pair_gap(&placed, pair).0));
        let (pair, gap_m) = gaps.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let (link, other) = self.pair_names(pair);
        Some(Nearest { link, neighbour: other, gap_m })
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
        (0..=samples)
            .filter_map(|i: usize| {
                let state = motion.state(motion.duration_s() * i as f64 / samples as f64);
                self.narrowest_gap(model, &state.position[..model.joints()])
            })
            .min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
    }

    /// Returns the largest gap share for the positions of a motion (n × N).
    pub(super) fn largest_gap_share(&self, model: &Model, q: &DMatrix<f64>) -> f64 {
        let share_at =
            |i| self.narrowest_gap(model, column(q, i)).map_or(0.0, |of| gap_share(of.gap_m));
        (0..q.ncols()).map(share_at).fold(0.0, f64::max)
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
        let placed = self.place_capsules(model, q);
        let mut value = 0.0;
        for pair in &self.pairs {
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
struct PlacedCapsules {
    end_points: Vec<[Vector3<f64>; 2]>,
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
        let shapes = Shapes::new(&robot, Some([[-0.5, -0.5, 0.0], [0.5, 0.5, 0.9]])).unwrap();
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
