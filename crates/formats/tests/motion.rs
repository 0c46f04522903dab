//! Motions that are written are read back here as a controller reads them.
#![allow(clippy::cast_possible_truncation, reason = "small whole numbers")]

use std::path::Path;

use didim_formats::{MotionError, MotionFile, MotionFormat, MotionPoints, read_motion};
use didim_identification::excitation::{FourierSeries, JointSeries};

/// Six joints, twelve harmonics in 6 s that rest at both ends: pairs of neighbours k a_k cancel,
/// and k² b_k.
fn series(joints: usize) -> FourierSeries {
    FourierSeries {
        duration_s: 6.0,
        joints: (0..joints)
            .map(|j: usize| {
                let (mut sine, mut cosine) = (vec![0.0; 12], vec![0.0; 12]);
                for k in 0..12 {
                    let number = 1.0 + k as f64;
                    let size = 0.2 * ((j + k / 2) as f64 * 1.3).cos();
                    let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                    sine[k] = sign * size / number;
                    cosine[k] = sign * size / (number * number);
                }
                JointSeries { mean: 0.3 * j as f64 - 0.8, sine, cosine }
            })
            .collect(),
    }
}

fn written(format: MotionFormat, series: &FourierSeries) -> String {
    let joints: Vec<String> = (1..=series.joints.len()).map(|j| format!("arm_{j}")).collect();
    let header = ["first at 10 %".to_owned(), "collision NOT checked".to_owned()];
    let file = MotionFile { motion: series, joints: &joints, header: &header };
    let text = format.write(&file, "a-motion").unwrap();
    for line in &header {
        assert!(text.contains(line), "{format:?}");
    }
    text
}

/// Every number in a text.
fn numbers(text: &str) -> Vec<f64> {
    let parts = text.split(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | 'E')));
    parts.filter_map(|part| part.parse().ok()).collect()
}

fn assert_close(found: &[f64], expected: &[f64], within: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= within, "{found} {expected}");
    }
}

#[test]
fn a_table_has_the_motion() {
    let series = series(7);
    let text = written(MotionFormat::Csv, &series);
    let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!((names.len(), names[0], names[7]), (22, "time_s", "joint_position_rad_7"));
    assert_eq!((names[8], names[21]), ("joint_velocity_rad_s_1", "joint_acceleration_rad_s2_7"));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|v| v.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 3001);
    for (k, row) in rows.iter().enumerate() {
        assert!((row[0] - 0.002 * k as f64).abs() < 1e-9);
        let state = series.state(row[0]);
        assert_close(&row[1..8], &state.position, 1e-9);
        assert_close(&row[8..15], &state.velocity, 1e-9);
        assert_close(&row[15..], &state.acceleration, 1e-9);
    }
    assert!(rows[0][8..].iter().chain(&rows[3000][8..]).all(|value| value.abs() < 1e-12));
}

#[test]
fn a_table_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("motion.csv");
    let series = series(6);
    std::fs::write(&file, written(MotionFormat::Csv, &series)).unwrap();
    let MotionPoints { rate_hz, positions } = read_motion(&file).unwrap();
    assert!((rate_hz - 500.0).abs() < 1e-9);
    assert_eq!(positions.shape(), (3001, 6));
    for k in 0..3001 {
        let row: Vec<f64> = positions.row(k).iter().copied().collect();
        assert_close(&row, &series.state(k as f64 / 500.0).position, 1e-9);
    }
    for (text, problem) in [
        ("", "empty"),
        ("joint_position_rad_1\n1\n", "no column time_s"),
        ("time_s,q\n0,1\n", "no column joint_position_rad_1"),
        ("# a\ntime_s,joint_position_rad_1\n0,0\n1,x\n", "line 4: `x` in joint_position_rad_1"),
        ("time_s,joint_position_rad_1\n0,0\n", "even steps"),
        ("time_s,joint_position_rad_1\n0,0\n1,0\n3,0\n", "even steps"),
    ] {
        std::fs::write(&file, text).unwrap();
        let error = read_motion(&file).unwrap_err().to_string();
        assert!(error.contains(problem) && error.contains("motion.csv"), "{error}");
    }
}

/// Between its points as the trajectory controller has it: the quintic through position, velocity
/// and acceleration.
#[test]
fn a_ros_2_trajectory_has_the_motion_between_its_points_too() {
    let series = series(7);
    let text = written(MotionFormat::JointTrajectory, &series);
    assert!(text.contains("joint_names: ['arm_1', 'arm_2',"));
    let values = |key: &str| -> Vec<Vec<f64>> {
        let lines = text.lines().filter_map(|line| line.split_once(key));
        lines.map(|(_, values)| numbers(values)).collect()
    };
    let [q, dq, ddq] = ["positions: ", "velocities: ", "accelerations: "].map(values);
    let times = values("time_from_start: ");
    let times: Vec<f64> = times.iter().map(|of| of[0] + 1e-9 * of[1]).collect();
    assert_eq!((q.len(), dq.len(), ddq.len(), times.len()), (601, 601, 601, 601));
    assert!(times.is_sorted_by(|a, b| a < b) && (times[600] - 6.0).abs() < 1e-12);
    let mut largest: f64 = 0.0;
    for k in 0..600 {
        let h = times[k + 1] - times[k];
        for s in [0.0, 0.25, 0.5, 0.9] {
            let state = series.state(times[k] + s * h);
            for j in 0..7 {
                // Hermite's quintic by its divided differences.
                let (p, v, a) = (q[k][j], dq[k][j] * h, ddq[k][j] * h * h);
                let (d, w, b) = (q[k + 1][j] - p, dq[k + 1][j] * h, ddq[k + 1][j] * h * h);
                let c3 = 10.0 * d - 6.0 * v - 4.0 * w - 1.5 * a + 0.5 * b;
                let c4 = -15.0 * d + 8.0 * v + 7.0 * w + 1.5 * a - b;
                let c5 = 6.0 * d - 3.0 * (v + w) - 0.5 * (a - b);
                let position = p + s * (v + s * (0.5 * a + s * (c3 + s * (c4 + s * c5))));
                largest = largest.max((position - state.position[j]).abs());
            }
        }
    }
    assert!(largest <= 1e-6, "{largest}");
    assert!(dq[0].iter().chain(&dq[600]).all(|v| v.abs() < 1e-12));
}

/// What the loop of the program computes, by the lists and numbers that stand in it.
#[test]
fn a_urscript_program_has_the_motion_in_every_cycle() {
    let series = series(6);
    let text = written(MotionFormat::UrScript, &series);
    assert!(text.starts_with('#') && text.contains("def a_motion():"));
    assert_eq!(text.lines().filter(|line| line.trim() == "end").count(), 5);
    fn value(name: &str, text: &str) -> Vec<f64> {
        let start = format!("  {name} = ");
        numbers(text.lines().find_map(|line| line.strip_prefix(start.as_str())).unwrap())
    }
    assert_eq!(value("speed", &text), [0.1]);
    let (duration, knots) = (value("duration", &text)[0], value("knots", &text)[0]);
    let lists: Vec<Vec<f64>> = (1..=6).map(|j| value(&format!("c{j}"), &text)).collect();
    assert!(lists.iter().all(|list| list.len() == knots as usize));
    assert_close(&value("start", &text), &series.state(0.0).position, 1e-8);
    let mut largest: f64 = 0.0;
    for cycle in 0..3000 {
        let time = 0.002 * f64::from(cycle);
        let u = time / duration * knots;
        let s = u - u.floor();
        let [s2, s3, s4, s5] = [2, 3, 4, 5].map(|power| s.powi(power));
        let w = [
            (1.0 - s).powi(5),
            26.0 - 50.0 * s + 20.0 * s2 + 20.0 * s3 - 20.0 * s4 + 5.0 * s5,
            66.0 - 60.0 * s2 + 30.0 * s4 - 10.0 * s5,
            26.0 + 50.0 * s + 20.0 * s2 - 20.0 * s3 - 20.0 * s4 + 10.0 * s5,
            1.0 + 5.0 * s + 10.0 * s2 + 10.0 * s3 + 5.0 * s4 - 5.0 * s5,
            s5,
        ];
        let position = series.state(time).position;
        for (list, expected) in lists.iter().zip(position) {
            let target = |k: usize| list[(u as usize + list.len() + k - 2) % list.len()];
            let filtered: f64 = w.iter().enumerate().map(|(k, w)| w / 120.0 * target(k)).sum();
            largest = largest.max((filtered - expected).abs());
        }
    }
    assert!(largest <= 1e-6, "{largest}");
    // The weights are those of the program.
    let spaced = text.lines().find(|line| line.trim_start().starts_with("w = [")).unwrap();
    let spaced = ["s2", "s3", "s4", "s5", "r2"]
        .iter()
        .fold(spaced.to_owned(), |text, name| text.replace(name, ""));
    assert_eq!(
        numbers(&spaced)
            .into_iter()
            .filter(|number| number.abs() > 2.0)
            .map(|number| number as i32)
            .collect::<Vec<_>>(),
        [26, 50, 20, 20, 20, 5, 66, 60, 30, 10, 26, 50, 20, 20, 20, 10, 5, 10, 10, 5, 5]
    );
}

#[test]
fn programs_of_controllers_with_a_time_law_of_their_own_visit_the_motion() {
    let series = series(6);
    for (format, mark, points) in
        [(MotionFormat::Krl, "PTP {", 61), (MotionFormat::Rapid, "MoveAbsJ [[", 61)]
    {
        let text = written(format, &series);
        assert!(!format.keeps_time());
        let lines: Vec<&str> = text.lines().filter(|line| line.contains(mark)).collect();
        assert_eq!(lines.len(), points, "{format:?}");
        for (k, line) in lines.iter().enumerate() {
            let (_, axes) = line.split_once(mark).unwrap();
            let axes: String = axes.split([']', '}']).next().unwrap().replace('A', " A");
            let words: Vec<f64> =
                axes.split([',', ' ']).filter_map(|word| word.parse().ok()).collect();
            let visited: Vec<f64> = words.iter().map(|q| q.to_radians()).collect();
            assert_eq!(visited.len(), 6, "{line}");
            assert_close(&visited, &series.state(0.1 * k as f64).position, 1e-6);
        }
    }
    let krl = written(MotionFormat::Krl, &series);
    assert!(krl.starts_with("DEF a_motion()") && krl.ends_with("ENDSPLINE\nEND\n"));
    let rapid = written(MotionFormat::Rapid, &series);
    assert!(rapid.starts_with("MODULE a_motion_module") && rapid.ends_with("ENDMODULE\n"));
}

#[test]
fn what_cannot_be_written_is_refused_with_what_to_do() {
    for (name, format) in [
        ("a.csv", MotionFormat::Csv),
        ("a.YAML", MotionFormat::JointTrajectory),
        ("a.script", MotionFormat::UrScript),
        ("a.src", MotionFormat::Krl),
        ("a.mod", MotionFormat::Rapid),
    ] {
        assert_eq!(MotionFormat::from_path(Path::new(name)), Ok(format));
    }
    let refused = MotionFormat::from_path(Path::new("a.txt")).unwrap_err();
    assert!(refused.to_string().contains(".script (Universal Robots)"), "{refused}");
    let seven = series(7);
    let file = MotionFile { motion: &seven, joints: &[], header: &[] };
    for format in [MotionFormat::UrScript, MotionFormat::Krl, MotionFormat::Rapid] {
        let refused = format.write(&file, "a").unwrap_err();
        assert!(matches!(refused, MotionError::SixAxes { joints: 7, .. }));
    }
}
