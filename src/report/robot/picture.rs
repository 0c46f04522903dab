//! A picture of the arm at q = 0, from three sides.

use std::fmt::Write as _;

use didim_dynamics::dynamics::{LinkFrame, Model};
use didim_dynamics::robot::{JointKind, Robot};

use crate::text::escape;

const PICTURE_SIZE: f64 = 340.0;
const MARGIN: f64 = 46.0;
const HEADER_HEIGHT: f64 = 44.0;
/// Length of a drawn axis, relative to the arm.
const AXIS_LENGTH: f64 = 0.16;
/// Distance below which two ends of axes share one label.
const LABEL_DISTANCE: f64 = 8.0;

const STYLE: &str = "svg{--paper:#fff;--ink:#1d2530;--faint:#d9dee5;--link:#9fb3c8;--axis:#b3261e}\
    @media screen and (prefers-color-scheme:dark){svg{--paper:#14181d;--ink:#e4e8ed;\
    --faint:#333c46;--link:#6d8299;--axis:#ff8a73}}text{font:12px sans-serif;fill:var(--ink)}\
    .heading{font-size:15px}.paper{fill:var(--paper)}.link{fill:none;stroke:var(--link);\
    stroke-width:7;stroke-linecap:round;stroke-linejoin:round}.axis{stroke:var(--axis);\
    stroke-width:2}.end{fill:var(--axis)}.joint{fill:var(--paper);stroke:var(--ink)}\
    .frame{fill:none;stroke:var(--faint)}.ground{stroke:var(--ink);stroke-width:2}";

pub(super) type Vector = [f64; 3];

/// Draws the links, and the axis of every joint with the joint's number at the positive end.
/// `names` are the names of the joints, if they have any.
pub fn picture(robot: &Robot, names: &[&str]) -> String {
    let frames = Model::new(robot).link_frames(&[]);
    let up = up_direction(robot.gravity_m_s2());
    let right = perpendicular_to(up);
    let back = cross(up, right);
    let slanted = normalised(add(scaled(right, 0.8), scaled(back, 0.6)));
    let tilted = normalised(add(up, scaled(add(scaled(right, -0.6), scaled(back, 0.8)), 0.35)));
    let views = [
        ("from the front", right, up),
        ("from the side", back, up),
        ("from above, aslant", slanted, tilted),
    ];
    let outline = axis_path(robot, &frames, &[]);
    let size = outline.iter().flatten().fold(0.05_f64, |size, value| size.max(value.abs()));
    let axis = AXIS_LENGTH * size;
    let mut svg = String::new();
    let (width, height) = (3.0 * PICTURE_SIZE, HEADER_HEIGHT + PICTURE_SIZE);
    draw_header(&mut svg, robot.name(), width, height);
    // All views have the same scale.
    let range = |direction: Vector| {
        let values = outline.iter().map(|point| dot(*point, direction));
        values.fold([-axis, axis], |[low, high], v| [low.min(v - axis), high.max(v + axis)])
    };
    let directions = views.iter().flat_map(|(_, along, upwards)| [along, upwards]);
    let spans = directions.map(|direction| range(*direction)).map(|[low, high]| high - low);
    let extent = spans.fold(0.0, f64::max);
    let scale = (PICTURE_SIZE - 2.0 * MARGIN) / extent;
    for (index, (title, along, upwards)) in views.into_iter().enumerate() {
        let seen = |point: Vector| [dot(point, along), dot(point, upwards)];
        let middle = [along, upwards].map(range).map(|[low, high]| 0.5 * (low + high));
        #[expect(clippy::cast_precision_loss, reason = "three views")]
        let offset = index as f64 * PICTURE_SIZE;
        let place = |[x, y]: [f64; 2]| {
            let x = offset + 0.5 * PICTURE_SIZE + scale * (x - middle[0]);
            (x, HEADER_HEIGHT + 0.5 * PICTURE_SIZE - scale * (y - middle[1]))
        };
        let _ = write!(
            svg,
            "<rect class=\"frame\" x=\"{}\" y=\"{HEADER_HEIGHT}\" width=\"{}\" height=\"{}\"/>\
             <text x=\"{}\" y=\"{}\">{title}</text>",
            offset + 6.0,
            PICTURE_SIZE - 12.0,
            PICTURE_SIZE - 6.0,
            offset + 16.0,
            HEADER_HEIGHT + 20.0
        );
        let line: Vec<String> = outline
            .iter()
            .map(|point| place(seen(*point)))
            .map(|(x, y)| format!("{x:.1},{y:.1}"))
            .collect();
        let (x, y) = place(seen([0.0; 3]));
        let _ = write!(
            svg,
            "<line class=\"ground\" x1=\"{}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/><polyline \
             class=\"link\" points=\"{}\"/>",
            x - 14.0,
            x + 14.0,
            line.join(" ")
        );
        let arrows: Vec<[(f64, f64); 2]> = frames
            .iter()
            .map(|frame| {
                let tip = add(frame.origin_m, scaled(frame.axes[2], axis));
                [frame.origin_m, tip].map(|point| place(seen(point)))
            })
            .collect();
        draw_axes(&mut svg, robot, names, &arrows);
        draw_scale(&mut svg, extent, scale, offset);
    }
    svg += "</svg>\n";
    svg
}

/// Writes the beginning of the picture: its style, its title and its background.
fn draw_header(svg: &mut String, robot: &str, width: f64, height: f64) {
    // Writing to a String cannot fail.
    let _ = write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"{0}\"><title>{0}</title><style>{STYLE}</style><rect class=\"paper\" \
         width=\"{width}\" height=\"{height}\"/><text class=\"heading\" x=\"16\" \
         y=\"26\">{0}</text>",
        escape(&format!("{} at q = 0, up is against gravity", robot))
    );
}

/// Draws the axis of each joint, from its origin to its tip in the picture.
fn draw_axes(svg: &mut String, robot: &Robot, names: &[&str], arrows: &[[(f64, f64); 2]]) {
    for (k, &[from, to]) in arrows.iter().enumerate() {
        // Axes with the same end share one label.
        let is_here =
            |other: &[(f64, f64); 2]| (other[1].0 - to.0).hypot(other[1].1 - to.1) < LABEL_DISTANCE;
        let label: Vec<String> = match arrows[..k].iter().any(is_here) {
            true => Vec::new(),
            false => {
                (1..).zip(arrows).filter(|(_, o)| is_here(o)).map(|(n, _)| n.to_string()).collect()
            }
        };
        let name = names.get(k).copied().unwrap_or_default();
        let kind = match robot.chain()[k].kind {
            JointKind::Revolute => "turns about",
            JointKind::Prismatic => "moves along",
        };
        let _ = write!(
            svg,
            "<g><title>joint {0} {1} {kind} this axis</title><line class=\"axis\" \
                 x1=\"{2:.1}\" y1=\"{3:.1}\" x2=\"{4:.1}\" y2=\"{5:.1}\"/><circle class=\"end\" \
                 cx=\"{4:.1}\" cy=\"{5:.1}\" r=\"3.5\"/><circle class=\"joint\" cx=\"{2:.1}\" \
                 cy=\"{3:.1}\" r=\"4.5\"/><text x=\"{6:.1}\" y=\"{7:.1}\">{8}</text></g>",
            k + 1,
            escape(name),
            from.0,
            from.1,
            to.0,
            to.1,
            to.0 + 6.0,
            to.1 - 4.0,
            label.join(", ")
        );
    }
}

/// Draws a scale bar with its length in metres.
fn draw_scale(svg: &mut String, extent: f64, scale: f64, offset: f64) {
    let metre = round_length(0.3 * extent);
    let (x, y) = (offset + 16.0, HEADER_HEIGHT + PICTURE_SIZE - 22.0);
    let _ = write!(
        svg,
        "<line class=\"ground\" x1=\"{x}\" x2=\"{:.1}\" y1=\"{y}\" y2=\"{y}\"/><text x=\"{x}\" \
             y=\"{}\">{metre} m</text>",
        x + scale * metre,
        y - 6.0
    );
}

/// Returns the path from one origin to the next, first along the common normal and then along the
/// axis, at these joint positions.
pub(super) fn axis_path(robot: &Robot, frames: &[LinkFrame], q: &[f64]) -> Vec<Vector> {
    let mut outline: Vec<Vector> = vec![[0.0; 3]];
    for (index, (joint, frame)) in robot.chain().iter().zip(frames).enumerate() {
        let slid = match joint.kind {
            JointKind::Revolute => 0.0,
            JointKind::Prismatic => q.get(index).copied().unwrap_or(0.0),
        };
        outline.push(add(frame.origin_m, scaled(frame.axes[2], -joint.r_m - slid)));
        outline.push(frame.origin_m);
    }
    outline
}

/// Returns the direction opposite to gravity, or z if there is no gravity.
pub(super) fn up_direction(gravity: Vector) -> Vector {
    let size = dot(gravity, gravity).sqrt();
    if size > 0.0 { scaled(gravity, -1.0 / size) } else { [0.0, 0.0, 1.0] }
}

/// Returns a direction perpendicular to another one, along x if possible.
pub(super) fn perpendicular_to(to: Vector) -> Vector {
    let projected = |axis: Vector| add(axis, scaled(to, -dot(axis, to)));
    let x = projected([1.0, 0.0, 0.0]);
    if dot(x, x) > 0.01 { normalised(x) } else { normalised(projected([0.0, 1.0, 0.0])) }
}

/// Returns the largest number of the form 1, 2 or 5 times a power of ten that does not exceed the
/// given value.
fn round_length(most: f64) -> f64 {
    let power = 10.0_f64.powf(most.log10().floor());
    let digit = [5.0, 2.0, 1.0].into_iter().find(|digit| digit * power <= most);
    // The rounding gives 0.05 instead of 0.05000000000000001.
    (digit.unwrap_or(1.0) * power * 1e6).round() / 1e6
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn scaled(a: Vector, by: f64) -> Vector {
    a.map(|value| value * by)
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn normalised(a: Vector) -> Vector {
    scaled(a, 1.0 / dot(a, a).sqrt())
}
