//! Recordings of other programs.

use super::super::reference::Kind::{Number, Other, Table, Text, Texts, Word};
use super::super::reference::Presence::{Default, Optional, Required};
use super::super::reference::{Key, Kind, Section, key};

const UNITS: Kind = Other("text, or a list of one for each axis");
const SIGNS: Kind = Other("number, or a list of one for each axis");
const SIDES: &str = "The side of the transmission on which the signals were measured: those of the \
    motors, or of the joints. Required with columns or a bag.";

const fn columns(units: &'static str, per_ampere: &'static str) -> [Key; 5] {
    [
        key(
            "column",
            Text,
            "",
            Optional("`columns` names them"),
            "The name of the columns, with `{axis}` (from 1) or `{index}` (from 0) in place of the \
            number.",
        ),
        key(
            "columns",
            Texts,
            "",
            Optional("`column` names them"),
            "A name for each axis, in the arm's order.",
        ),
        key("unit", UNITS, "", Required, units),
        key("per_ampere", SIGNS, "N·m/A or N/A", Optional("required with a current"), per_ampere),
        key(
            "sign",
            SIGNS,
            "",
            Optional("1"),
            "1 if the signal is positive in the robot's positive direction, −1 if not.",
        ),
    ]
}

const POSITIONS: [Key; 5] = columns(
    "The unit of the columns: `\"rad\"`, `\"deg\"`; of a prismatic joint `\"m\"`, `\"mm\"`.",
    "Not for positions.",
);
const TORQUES: [Key; 5] = columns(
    "The unit of the columns: `\"Nm\"`, `\"mNm\"`; of a prismatic joint `\"N\"`; `\"A\"` or \
    `\"mA\"`, of a current.",
    "Of a current: the torque or force of one ampere, on the side of the transmission that `side` \
    states.",
);

pub(super) const SECTIONS: &[Section] = &[
    Section {
        heading: "[data]",
        path: "data",
        about: "Recordings of other programs, in place of `[bus]`. With `rate_hz` and \
            `torque_valid` alone, tables are didim's own (`time_s`, `motor_position_rad_1`, \
            `joint_torque_nm_1` and so on).",
        keys: &[
            key("rate_hz", Number, "Hz", Required, "Samples per second; 1 to 20 000."),
            key(
                "torque_valid",
                Other("`\"instant\"`, or a table"),
                "",
                Required,
                "When a torque is valid: `\"instant\"`, that of the sample itself, as a measured \
                 one; `{ held = { … } }`, a command that acts until the next one.",
            ),
            key(
                "side",
                Word(&["motor", "joint"]),
                "",
                Optional("from the names of didim's own columns"),
                SIDES,
            ),
            key(
                "time",
                Table,
                "",
                Optional("the rows are `rate_hz` apart"),
                "The column of the time.",
            ),
            key("position", Table, "", Optional("didim's own columns"), "Positions."),
            key(
                "torque",
                Table,
                "",
                Optional("didim's own columns"),
                "Torques, forces or currents.",
            ),
            key("reference", Table, "", Optional("none"), "Commanded positions."),
            key("bag", Table, "", Optional("no bags"), "Joint states of ROS 2 bags."),
        ],
        example: "[data]\nrate_hz = 250.0\ntorque_valid = \"instant\"\nside = \"joint\"\ntime = { \
            column = \"t\", unit = \"ms\" }\nposition = { column = \"actual_q_{axis}\", unit = \
            \"deg\" }\ntorque = { column = \"tau_{index}\", unit = \"Nm\", sign = -1 }\nreference \
            = { columns = [\"goal_base\", \"goal_elbow\"], unit = \"rad\" }",
    },
    Section {
        heading: "data.torque_valid: held",
        path: "data.torque_valid.held",
        about: "A command that acts until the next one.",
        keys: HOLD_KEYS,
        example: "[data]\nrate_hz = 250.0\ntorque_valid = { held = { hold_us = 4000.0, delay_us = \
            0.0 } }",
    },
    Section {
        heading: "data.time",
        path: "data.time",
        about: "One column (`column` and `unit`), or a stamp in two (`sec` and `nanosec`).",
        keys: &[
            key("column", Text, "", Optional("`sec` and `nanosec`"), "The name of the column."),
            key(
                "unit",
                Text,
                "",
                Optional("`sec` and `nanosec`"),
                "Its unit: `\"s\"`, `\"ms\"`, `\"us\"`, `\"ns\"`; `\"iso8601\"`, of dates as \
                2024-05-01T12:00:00.123456Z.",
            ),
            key(
                "sec",
                Text,
                "",
                Optional("`column` and `unit`"),
                "The column of the whole seconds of a stamp in two columns [s].",
            ),
            key(
                "nanosec",
                Text,
                "",
                Optional("`column` and `unit`"),
                "The column of the nanoseconds beyond them [ns].",
            ),
        ],
        example: "[data]\nrate_hz = 250.0\ntorque_valid = \"instant\"\ntime = { sec = \
            \"header.stamp.sec\", nanosec = \"header.stamp.nanosec\" }",
    },
    Section {
        heading: "data.position",
        path: "data.position",
        about: "The columns of the positions. `data.reference` has the same keys.",
        keys: &POSITIONS,
        example: "[data]\nrate_hz = 250.0\ntorque_valid = \"instant\"\nside = \"motor\"\nposition \
            = { columns = [\"q_base\", \"q_rail\"], unit = [\"rad\", \"mm\"], sign = [1, -1] }",
    },
    Section {
        heading: "data.torque",
        path: "data.torque",
        about: "The columns of the torques, forces or currents.",
        keys: &TORQUES,
        example: "[data]\nrate_hz = 250.0\ntorque_valid = \"instant\"\nside = \"motor\"\ntorque = \
            { column = \"current_{axis}\", unit = \"A\", per_ampere = [0.12, 0.08] }",
    },
    Section {
        heading: "data.reference",
        path: "data.reference",
        about: "The columns of the commanded positions.",
        keys: &POSITIONS,
        example: "[data]\nrate_hz = 250.0\ntorque_valid = \"instant\"\nside = \"motor\"\nreference \
            = { column = \"goal_{axis}\", unit = \"rad\" }",
    },
    Section {
        heading: "[data.bag]",
        path: "data.bag",
        about: "Joint states (`sensor_msgs/msg/JointState`) of ROS 2 bags in MCAP files.",
        keys: &[
            key(
                "joints",
                Texts,
                "",
                Optional("those of the URDF"),
                "Names of the joints in the messages, in the arm's order. Required with a robot \
                file.",
            ),
            key(
                "topic",
                Text,
                "",
                Optional("the only one with these joints"),
                "The topic, where several have these joints.",
            ),
            key(
                "effort",
                Table,
                "",
                Required,
                "The unit of `effort`, which no bag states, and its sign.",
            ),
            key(
                "time",
                Word(&["header", "log", "rows"]),
                "",
                Default("\"header\""),
                "The time to use: the stamps in the messages, the time at which they were \
                    recorded, or none, so that each message is one row of `rate_hz`.",
            ),
        ],
        example: "[data]\nrate_hz = 100.0\ntorque_valid = \"instant\"\nside = \
            \"joint\"\n\n[data.bag]\njoints = [\"A1\", \"A2\", \"A3\"]\ntopic = \
            \"/joint_states\"\neffort = { unit = \"Nm\", sign = 1 }\ntime = \"header\"",
    },
    Section {
        heading: "data.bag.effort",
        path: "data.bag.effort",
        about: "Meaning of `effort` in the messages.",
        keys: &[
            key(
                "unit",
                UNITS,
                "",
                Required,
                "`\"Nm\"`, `\"mNm\"`; of a prismatic joint `\"N\"`; `\"A\"` or `\"mA\"`, of a \
                current.",
            ),
            key(
                "per_ampere",
                SIGNS,
                "N·m/A or N/A",
                Optional("required with a current"),
                "Of a current: the torque or force of one ampere.",
            ),
            key(
                "sign",
                SIGNS,
                "",
                Optional("1"),
                "1 if effort drives the joint, −1 if it is the reaction on the link before.",
            ),
        ],
        example: "[data]\nrate_hz = 100.0\ntorque_valid = \"instant\"\nside = \"joint\"\nbag = { \
            effort = { unit = \"A\", per_ampere = 0.12, sign = -1 } }",
    },
];

pub(super) const HOLD_KEYS: &[Key] = &[
    key(
        "hold_us",
        Number,
        "µs",
        Required,
        "How long a command acts: as a rule the cycle of the position controller; 0 to ten periods \
        of the samples.",
    ),
    key(
        "delay_us",
        Number,
        "µs",
        Required,
        "How much later than the instant of the sample it starts to act; 0 to ten periods of the \
        samples.",
    ),
];
