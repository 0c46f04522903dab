//! An arm in the postures of a motion, from two sides.

use std::fmt::Write as _;

use didim_core::dynamics::Model;
use didim_core::robot::Robot;

use super::picture::{Vector, cross, dot, perpendicular, up, way};

const SIZE: f64 = 400.0;
const MARGIN: f64 = 30.0;

/// The arm in each posture \[rad or m\], the first one strong, and the way of its last origin: from the front and from the side,
/// in one scale.
pub fn postures(robot: &Robot, postures: &[Vec<f64>], path: &[Vec<f64>]) -> String {
    let model = Model::new(robot);
    let ways: Vec<Vec<Vector>> =
        postures.iter().map(|q| way(robot, &model.link_frames(q), q)).collect();
    let tip: Vec<Vector> =
        path.iter().filter_map(|q| Some(model.link_frames(q).last()?.origin_m)).collect();
    let up = up(robot.gravity_m_s2());
    let right = perpendicular(up);
    let views = [("from the front", right), ("from the side", cross(up, right))];
    let all = || ways.iter().flatten().chain(&tip);
    let reach = all().flatten().fold(0.05_f64, |reach, value| reach.max(value.abs()));
    let scale = (0.5 * SIZE - MARGIN) / reach;
    let mut svg = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        r#"<svg class="arm" viewBox="0 0 {} {SIZE}" role="img" aria-label="The arm along the motion">"#,
        2.0 * SIZE
    );
    for ((title, along), left) in views.into_iter().zip([0.0, SIZE]) {
        let place = |point: &Vector| {
            let x = left + 0.5 * SIZE + scale * dot(*point, along);
            format!("{x:.1},{:.1}", 0.5 * SIZE - scale * dot(*point, up))
        };
        let line = |points: &[Vector]| points.iter().map(place).collect::<Vec<_>>().join(" ");
        let _ = write!(svg, r#"<text x="{}" y="20">{title}</text>"#, left + 12.0);
        for (class, own) in ways.iter().enumerate().rev().map(|(k, own)| (k == 0, own)) {
            let class = if class { "link first" } else { "link" };
            let _ = write!(svg, r#"<polyline class="{class}" points="{}"/>"#, line(own));
        }
        let _ = write!(svg, r#"<polyline class="tip" points="{}"/>"#, line(&tip));
        let (x, y) = (left + 0.5 * SIZE, 0.5 * SIZE);
        let _ = write!(
            svg,
            r#"<line class="ground" x1="{}" x2="{}" y1="{y}" y2="{y}"/>"#,
            x - 14.0,
            x + 14.0
        );
    }
    svg + "</svg>"
}
