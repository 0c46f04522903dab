//! Preview of a designed motion before the arm moves.

use didim_dynamics::robot::{JointIndex, Robot};
use didim_identification::excitation::Course;
use maud::{PreEscaped, html};

use super::super::figure::{MotionPanel, TORQUE_PANEL_HEIGHT, draw_motion};
use super::super::robot::draw_postures;
use super::chart;

/// Number of points of a curve, and below it the number of drawn postures.
const CURVE_POINTS: usize = 800;
const DRAWN_POSTURES: usize = 16;

const STYLE: &str = ".arm{max-width:100%}.arm \
.link{fill:none;stroke:var(--measured);stroke-width:4;stroke-linejoin:round;\
stroke-linecap:round;opacity:.35}.arm .first{stroke:var(--accent);opacity:1}.arm .tip{fill:none;\
stroke:var(--bad);stroke-width:1;opacity:.8}.arm .ground{stroke:var(--ink);stroke-width:2}";

/// Creates a page with the arm along a motion, and the position and velocity of every joint.
/// `header` is the header of the motion's files, and `collision` states which links were checked.
pub fn preview_page(
    robot: &Robot,
    motion: &dyn Course,
    header: &[String],
    collision: &str,
) -> String {
    let joints = robot.joints();
    #[expect(clippy::cast_precision_loss, reason = "a few hundred points")]
    let times = |count: usize| -> Vec<f64> {
        (0..=count).map(|k| motion.duration_s() * k as f64 / count as f64).collect()
    };
    let positions = |times: &[f64]| -> Vec<Vec<f64>> {
        times.iter().map(|time| motion.state(*time).position[..joints].to_vec()).collect()
    };
    let time_s = times(CURVE_POINTS);
    let states: Vec<_> = time_s.iter().map(|time| motion.state(*time)).collect();
    let curves: Vec<[Vec<f64>; 2]> = (0..joints)
        .map(|joint: usize| -> [Vec<f64>; 2] {
            [
                states.iter().map(|state| state.position[joint]).collect(),
                states.iter().map(|state| state.velocity[joint]).collect(),
            ]
        })
        .collect();
    let arm = draw_postures(robot, &positions(&times(DRAWN_POSTURES)), &positions(&time_s));
    let title = format!("{} · a motion of {} s", robot.name(), motion.duration_s());
    let content = html! {
        header {
            p.kind { "Preview of the motion" }
            h1 { (robot.name()) }
            p { strong { (collision) } }
        }
        main {
            (super::section(
                "The arm along the motion",
                "Axes and common normals at the beginning (strong) and at fifteen later \
                    instants, with the path of the last link's origin. Up is against gravity.",
                &PreEscaped(arm),
            ))
            (super::section(
                "Joints over time",
                "Position of each joint, and below it the velocity.",
                &html! { div.panels {
                    @let joints = curves.iter().zip(robot.chain());
                    @for (index, (curves, joint)) in joints.enumerate() {
                    @let label = robot.joint_label(JointIndex::new(index));
                    @let [position, velocity] = curves;
                    @let (kind, time_s) = (joint.kind, &time_s);
                    @let title = format!("Position and velocity of joint {label}");
                    @let panel = MotionPanel { joint: label, kind, time_s, position, velocity };
                    figure { (chart::panel_of_height(
                        TORQUE_PANEL_HEIGHT,
                        &title,
                        |svg| draw_motion(svg, &panel),
                    )) }
                } } },
            ))
            (super::section(
                "What was checked",
                "The head of every file of the motion.",
                &html! { ul { @for line in header { li { (line) } } } },
            ))
        }
    };
    super::document(&title, STYLE, &content)
}
