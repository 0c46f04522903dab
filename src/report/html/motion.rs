//! The motion from which a result was identified.

use didim_dynamics::robot::JointIndex;
use maud::{Markup, html};

use super::super::figure::{MotionPanel, TORQUE_PANEL_HEIGHT, draw_motion};
use super::{Report, chart};

/// Plots position and velocity of every joint over time.
pub(super) fn section(report: &Report<'_>) -> Markup {
    let motion = &report.identification.fit.motion;
    if motion.time_s.is_empty() {
        return html! {};
    }
    let joints = motion.position.iter().zip(&motion.velocity).zip(report.cell.robot.chain());
    let content = html! { div.panels {
        @for (index, ((position, velocity), joint)) in joints.enumerate() {
        @let label = report.cell.robot.joint_label(JointIndex::new(index));
        @let (kind, time_s) = (joint.kind, &motion.time_s);
        @let title = format!("Position and velocity of joint {label}");
        @let panel = MotionPanel { joint: label, kind, time_s, position, velocity };
        figure { (chart::panel_of_height(
            TORQUE_PANEL_HEIGHT,
            &title,
            |svg| draw_motion(svg, &panel),
        )) }
    } } };
    let explanation = "Position of each joint, and below it the velocity, after the position \
        filter. Outside this range the result depends on the model alone.";
    super::section("Motion", explanation, &content)
}
