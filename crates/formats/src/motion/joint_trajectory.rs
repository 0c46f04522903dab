//! A motion as a `trajectory_msgs/msg/JointTrajectory` of ROS 2, in YAML.

use core::fmt::Write as _;

use super::file::{MotionFile, POINTS_HZ, list};

/// Writes points with positions, velocities and accelerations. The trajectory controller of
/// ros2_control interpolates them by quintic polynomials (control.ros.org, *Trajectory
/// Representation*). Times increase, and the last velocity is 0.
pub(super) fn write(file: &MotionFile<'_>) -> String {
    let n = file.motion.joints();
    let names: Vec<String> = file.joints.iter().map(|name| format!("'{name}'")).collect();
    let mut text = file.header_comments("#");
    let _ = writeln!(text, "joint_names: [{}]\npoints:", names.join(", "));
    for time_s in file.times_s(POINTS_HZ) {
        let state = file.motion.state(time_s);
        let values = |of: &[f64]| list(of[..n].iter().copied(), 9);
        #[expect(clippy::cast_possible_truncation, reason = "some seconds in nanoseconds")]
        let nanoseconds = (time_s * 1e9).round() as i64;
        let _ = writeln!(
            text,
            "- positions: [{}]\n  velocities: [{}]\n  accelerations: [{}]\n  \
             time_from_start: {{sec: {}, nanosec: {}}}",
            values(&state.position),
            values(&state.velocity),
            values(&state.acceleration),
            nanoseconds / 1_000_000_000,
            nanoseconds % 1_000_000_000
        );
    }
    text
}
