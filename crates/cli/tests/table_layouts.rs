//! Tables as loggers write them: each leads from `didim new` to the friction of the same arm.

use std::fs;
use std::path::Path;

use crate::new::{URDF, motion, new};
use crate::program::{didim, json};

/// A row: time \[s\], positions \[rad\] and torques \[N·m\] of the two joints.
type Row = [f64; 5];

/// A table, with what `didim new` has to write for it.
struct Layout {
    name: &'static str,
    text: fn(&[Row]) -> String,
    answers: &'static [&'static str],
    lines: &'static [&'static str],
}

/// Joins the fields of each row.
fn rows(
    header: &str,
    rows: &[Row],
    separator: &str,
    field: impl Fn(&Row) -> Vec<String>,
) -> String {
    let rows = rows.iter().map(|row| field(row).join(separator) + "\n");
    format!("{header}\n") + &rows.collect::<String>()
}

fn fixed(values: &[f64]) -> Vec<String> {
    values.iter().map(|value| format!("{value:.7}")).collect()
}

/// Rows with their times replaced.
fn with_times(rows: &[Row], time: impl Fn(f64) -> f64) -> Vec<Row> {
    rows.iter().map(|row| [time(row[0]), row[1], row[2], row[3], row[4]]).collect()
}

const HEADER: &str = "time,q1,q2,tau1,tau2";

const LAYOUTS: [Layout; 20] = [
    Layout {
        name: "numpy.savetxt",
        text: |of| {
            rows("# time q0 q1 tau0 tau1", of, " ", |row| {
                row.iter().map(|value| format!("{value:.18e}")).collect()
            })
        },
        answers: &[],
        lines: &["position.column = \"q{index}\"", "torque.column = \"tau{index}\""],
    },
    Layout {
        name: "no header",
        text: |of| rows("", of, ",", |row| fixed(row)).trim_start().to_owned(),
        answers: &[],
        lines: &[
            "time.column = 1",
            "position.columns = [2, 3]",
            "torque.columns = [4, 5]",
            "rate_hz = 200.0",
        ],
    },
    Layout {
        name: "ros2 topic echo --csv",
        text: |of| {
            let state = |[t, q1, q2, tau1, tau2]: &Row| {
                let (sec, nanosec) = (1_714_560_000.0 + t.floor(), (1e9 * t.fract()).round());
                let values = fixed(&[*q2, *q1, 0.0, 0.0, *tau2, *tau1]).join(",");
                vec![format!("{sec},{nanosec},,elbow,shoulder,{values}")]
            };
            rows("", of, ",", state).trim_start().to_owned()
        },
        answers: &[],
        lines: &[
            "time.sec = 1",
            "time.nanosec = 2",
            "position.columns = [7, 6]",
            "torque.columns = [11, 10]",
        ],
    },
    Layout {
        name: "lists in fields",
        text: |of| {
            rows("timestamp,position,effort", of, ",", |[t, q1, q2, tau1, tau2]| {
                vec![format!("{t},\"[{q1:.7}, {q2:.7}]\",\"[{tau1:.7}, {tau2:.7}]\"")]
            })
        },
        answers: &[],
        lines: &["position.column = \"position[{index}]\""],
    },
    Layout {
        name: "TwinCAT Scope",
        text: |of| {
            let channels = ["fbAxis[1].rActPos", "fbAxis[2].rActPos", "fbAxis[1].rActTorque"];
            let channels = channels.into_iter().chain(["fbAxis[2].rActTorque"]);
            let head = |of: &str| format!("{of}\t{of}\t{of}\t{of}\n");
            let names: Vec<String> = channels.map(|name| format!("Name\t{name}")).collect();
            let header = format!(
                "Name\tScope Arm\nFile\tC:\\arm.svdx\n\n{}\n{}{}",
                names.join("\t"),
                head("SymbolComment\t"),
                head("SampleTime[ms]\t5")
            );
            let row = |[t, q1, q2, tau1, tau2]: &Row| {
                let values = [q1.to_degrees(), q2.to_degrees(), *tau1, *tau2];
                let field = |value| format!("{:.0}\t{value:.7}", 1e3 * t).replace('.', ",");
                values.into_iter().map(field).collect()
            };
            rows(&header, of, "\t", row)
        },
        answers: &[],
        lines: &[
            "time.column = 1",
            "time.unit = \"ms\"",
            "position.column = \"fbAxis[{axis}].rActPos\"",
            "position.unit = \"deg\"",
        ],
    },
    Layout {
        name: "a row of units",
        text: |of| {
            let header = "Time;J1 position;J2 position;J1 torque;J2 torque\ns;rad;rad;Nm;Nm";
            rows(header, of, ";", |row| fixed(row))
        },
        answers: &[],
        lines: &["time.unit = \"s\"", "position.unit = \"rad\"", "torque.unit = \"Nm\""],
    },
    Layout {
        name: "the same name for all axes, quoted decimal commas",
        text: |of| {
            rows("time,position,position,effort,effort", of, ",", |row| {
                let comma = |value: &f64| format!("\"{value:.7}\"").replace('.', ",");
                row.iter().map(comma).collect()
            })
        },
        answers: &[],
        lines: &["position.columns = [2, 3]", "torque.columns = [4, 5]"],
    },
    Layout {
        name: "PlotJuggler",
        text: |of| {
            let names = ["elbow/position", "shoulder/position", "elbow/effort", "shoulder/effort"];
            let names = names.map(|name| format!("/joint_states/{name}")).join(",");
            let row = |[t, q1, q2, tau1, tau2]: &Row| {
                let of_another_topic = format!("{:.4},,,,,7", t + 0.002);
                let state = format!("{t:.4},{q2:.7},{q1:.7},{tau2:.7},{tau1:.7},");
                vec![state, of_another_topic]
            };
            rows(&format!("__time,{names},/battery/voltage"), of, "\n", row)
        },
        answers: &[],
        lines: &[
            "rate_hz = 200.0",
            "position.columns = [\"/joint_states/shoulder/position\", \
                \"/joint_states/elbow/position\"]",
        ],
    },
    Layout {
        name: "names of the joints in the rows",
        text: |of| {
            let header = "time,name_0,name_1,position_0,position_1,effort_0,effort_1";
            rows(header, of, ",", |[t, q1, q2, tau1, tau2]| {
                let values = fixed(&[*q2, *q1, *tau2, *tau1]).join(",");
                vec![format!("{t:.4},elbow,shoulder,{values}")]
            })
        },
        answers: &[],
        lines: &["position.columns = [\"position_1\", \"position_0\"]"],
    },
    Layout {
        name: "turns and percent",
        text: |of| {
            let header = "time,pos_1 [rev],pos_2 [rev],ActTrq1 [%],ActTrq2 [%]";
            rows(header, of, ",", |[t, q1, q2, tau1, tau2]| {
                let turn = core::f64::consts::TAU;
                vec![format!("{t},{:.9},{:.9},{},{}", q1 / turn, q2 / turn, tau1 / 1.2, tau2 / 0.6)]
            })
        },
        answers: &[
            "data.side=joint",
            "data.torque.unit=[{ name = \"%\", si = 1.2 }, { name = \"%\", si = 0.6 }]",
        ],
        lines: &["position.unit = \"rev\""],
    },
    Layout {
        name: "times of two decimals",
        text: |of| {
            let coarse = with_times(of, |t| (100.0 * t).floor() / 100.0);
            rows(HEADER, &coarse, ",", |row| fixed(row))
        },
        answers: &[],
        lines: &["rate_hz = 200.0"],
    },
    Layout {
        name: "each state in four rows",
        text: |of| {
            rows(HEADER, of, "\n", |[t, q1, q2, tau1, tau2]| {
                let row = |k| format!("{:.5},{q1:.7},{q2:.7},{tau1:.7},{tau2:.7}", t + k);
                [0.0, 0.00125, 0.0025, 0.00375].map(row).to_vec()
            })
        },
        answers: &[],
        lines: &["rate_hz = 200.0"],
    },
    Layout {
        name: "two recordings with their headers",
        text: |of| rows(HEADER, of, ",", |row| fixed(row)).repeat(2),
        answers: &[],
        lines: &["rate_hz = 200.0"],
    },
    Layout {
        name: "degrees from 0 to 360",
        text: |of| {
            let header = "time,q1 [deg],q2 [deg],tau1 [Nm],tau2 [Nm]";
            rows(header, of, ",", |[t, q1, q2, tau1, tau2]| {
                let [q1, q2] = [q1, q2].map(|angle| angle.to_degrees().rem_euclid(360.0));
                fixed(&[*t, q1, q2, *tau1, *tau2])
            })
        },
        answers: &[],
        lines: &["position.wraps = true"],
    },
    Layout {
        name: "InfluxDB, annotated and pivoted",
        text: |of| {
            let types = "#datatype,string,long,dateTime:RFC3339,double,double,double,double";
            let header = format!(
                "#group,false,false,false,false,false,false,false\n{types}\n\
                #default,_result,,,,,,\n,result,table,_time,pos_1,pos_2,effort_1,effort_2"
            );
            rows(&header, of, ",", |row| {
                let time = format!("2026-11-03T09:00:{:09.6}Z", row[0]);
                vec![format!(",,0,{time},{}", fixed(&row[1..]).join(","))]
            })
        },
        answers: &[],
        lines: &["time.column = \"_time\"", "position.column = \"pos_{axis}\""],
    },
    Layout {
        name: "LabVIEW measurement file",
        text: |of| {
            let names = "Position 1\tPosition 2\tTorque 1\tTorque 2";
            let header = format!(
                "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n\
                X_Columns\tOne\n***End_of_Header***\t\n\t\t\t\t\n\
                Channels\t4\t\t\t\t\nSamples\t9\t9\t9\t9\t\n\
                Date\t2026/11/03\t2026/11/03\t2026/11/03\t2026/11/03\t\n\
                Y_Unit_Label\trad\trad\tNm\tNm\t\n\
                ***End_of_Header***\t\t\t\t\t\nX_Value\t{names}\tComment"
            );
            rows(&header, of, "\t", |row| fixed(row))
        },
        answers: &[],
        lines: &["time.column = 1", "position.column = \"Position {axis}\""],
    },
    Layout {
        name: "columns of two levels (pandas)",
        text: |of| {
            let header = ",position,position,effort,effort\n,q1,q2,q1,q2\ntime,,,,";
            rows(header, of, ",", |row| fixed(row))
        },
        answers: &[],
        lines: &[
            "time.column = \"time\"",
            "position.column = \"position q{axis}\"",
            "torque.column = \"effort q{axis}\"",
        ],
    },
    Layout {
        name: "units behind the numbers (Grafana)",
        text: |of| {
            rows("\"Time\",\"pos 1\",\"pos 2\",\"torque 1\",\"torque 2\"", of, ",", |row| {
                let time = format!("2026-11-03 09:00:{:06.3}", row[0]);
                let [q1, q2] = [row[1], row[2]].map(f64::to_degrees);
                vec![format!("{time},{q1:.6}°,{q2:.6}°,{:.6} N·m,{:.6} N·m", row[3], row[4])]
            })
        },
        answers: &[],
        lines: &["position.unit = \"deg\"", "torque.unit = \"Nm\""],
    },
    Layout {
        name: "German words",
        text: |of| {
            let header = "Zeit [ms];Istposition A1 [°];Istposition A2 [°];Istmoment A1 [Nm];\
                Istmoment A2 [Nm]";
            rows(&format!("\u{feff}{header}"), of, ";", |row| {
                let [q1, q2] = [row[1], row[2]].map(f64::to_degrees);
                let fields = fixed(&[1e3 * row[0], q1, q2, row[3], row[4]]);
                fields.iter().map(|field| field.replace('.', ",")).collect()
            })
        },
        answers: &[],
        lines: &["time.unit = \"ms\"", "position.column = \"Istposition A{axis} [°]\""],
    },
    Layout {
        name: "several blanks",
        text: |of| rows("  t   q1  q2 tau1   tau2", of, "   ", |row| fixed(row)),
        answers: &[],
        lines: &["torque.column = \"tau{axis}\""],
    },
];

#[test]
fn every_layout_leads_to_the_same_arm() {
    let folder = tempfile::tempdir().unwrap();
    let path_of = |name: &str| folder.path().join(name);
    fs::write(path_of("arm.urdf"), URDF).unwrap();
    let measured = motion(&path_of("arm.urdf"));
    for layout in LAYOUTS {
        fs::write(path_of("log.csv"), (layout.text)(&measured)).unwrap();
        check_layout(&layout, folder.path());
        fs::remove_file(path_of("cell.toml")).unwrap();
    }
}

fn check_layout(layout: &Layout, folder: &Path) {
    let [cell, log] = ["cell.toml", "log.csv"].map(|name| folder.join(name));
    let mut answers = vec!["--set", "urdf.drive_inertia=false"];
    layout.answers.iter().for_each(|answer| answers.extend(["--set", *answer]));
    let made = new(folder, &answers);
    assert_eq!(made.code, Some(0), "{}: {}", layout.name, made.stderr);
    let text = fs::read_to_string(&cell).unwrap();
    for line in layout.lines {
        assert!(text.lines().any(|own| own == *line), "{}: {line}:\n{text}", layout.name);
    }
    let identified = didim(&[&"identify", &"--json", &"--cell", &cell, &"--input", &log]);
    assert_eq!(identified.code, Some(0), "{}: {}\n{text}", layout.name, identified.stderr);
    let result = json(&identified.stdout);
    for (name, configured) in [("fv1", 3.0), ("fc1", 4.0), ("fv2", 1.0), ("fc2", 2.0)] {
        let parameters = result["parameters"].as_array().unwrap();
        let own = parameters.iter().find(|own| own["name"] == name).unwrap();
        let value = own["value"].as_f64().unwrap();
        assert!((value / configured - 1.0).abs() < 0.02, "{}: {name}: {value}", layout.name);
    }
}
