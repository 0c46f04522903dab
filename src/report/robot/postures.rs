//! A picture of the arm in the postures of a motion, from two sides.

use std::fmt::Write as _;

use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::Robot;

use super::picture::{Vector, axis_path, cross, dot, perpendicular_to, up_direction};

const PICTURE_SIZE: f64 = 400.0;
const MARGIN: f64 = 30.0;

/// Draws the arm in each posture \[rad or m\], the first one bold, and the path of its last origin.
/// The views from the front and from the side have the same scale.
pub fn draw_postures(robot: &Robot, postures: &[Vec<f64>], path: &[Vec<f64>]) -> String {
    let model = Model::new(robot);
    let outlines: Vec<Vec<Vector>> =
        postures.iter().map(|q| axis_path(robot, &model.link_frames(q), q)).collect();
    let tip: Vec<Vector> =
        path.iter().filter_map(|q| Some(model.link_frames(q).last()?.origin_m)).collect();
    let up = up_direction(robot.gravity_m_s2());
    let right = perpendicular_to(up);
    let views = [("from the front", right), ("from the side", cross(up, right))];
    let all_points = || outlines.iter().flatten().chain(&tip);
    let reach = all_points().flatten().fold(0.05_f64, |reach, value| reach.max(value.abs()));
    let scale = (0.5 * PICTURE_SIZE - MARGIN) / reach;
    let mut svg = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        "<svg class=\"arm\" viewBox=\"0 0 {} {PICTURE_SIZE}\" role=\"img\" aria-label=\"The arm \
         along the motion\">",
        2.0 * PICTURE_SIZE
    );
    for ((title, along), x_offset) in views.into_iter().zip([0.0, PICTURE_SIZE]) {
        let line = |points: &[Vector]| {
            points
                .iter()
                .map(|point: &Vector| {
                    let x = x_offset + 0.5 * PICTURE_SIZE + scale * dot(*point, along);
                    format!("{x:.1},{:.1}", 0.5 * PICTURE_SIZE - scale * dot(*point, up))
                })
                .collect::<Vec<_>>()
                .join(" ")
        };
        let _ = write!(svg, r#"<text x="{}" y="20">{title}</text>"#, x_offset + 12.0);
        for (class, own) in outlines.iter().enumerate().rev().map(|(k, own)| (k == 0, own)) {
            let class = if class { "link first" } else { "link" };
            let _ = write!(svg, r#"<polyline class="{class}" points="{}"/>"#, line(own));
        }
        let _ = write!(svg, r#"<polyline class="tip" points="{}"/>"#, line(&tip));
        let (x, y) = (x_offset + 0.5 * PICTURE_SIZE, 0.5 * PICTURE_SIZE);
        let _ = write!(
            svg,
            r#"<line class="ground" x1="{}" x2="{}" y1="{y}" y2="{y}"/>"#,
            x - 14.0,
            x + 14.0
        );
    }
    svg + "</svg>"
}
