//! The arm, and the conditions for identification.

use super::super::reference::Kind::{File, Form, Number, Numbers, Other, Switch, Table, Text};
use super::super::reference::Presence::{Default, Optional, Required};
use super::super::reference::{Section, key};

pub(super) const SECTIONS: &[Section] = &[
    Section {
        heading: "The top of the file",
        path: "",
        about: "Before the first `[table]`.",
        keys: &[
            key(
                "name",
                Text,
                "",
                Required,
                "Name of the cell. It is part of the names of its shared memory and stands in \
                every result.",
            ),
            key("robot", File, "", Required, "The robot file (didim-robot(5)) or a URDF."),
            key(
                "urdf",
                Table,
                "",
                Optional("the robot is a robot file"),
                "Properties of the drives, which a URDF does not have. Required with a URDF.",
            ),
            key(
                "bus",
                Table,
                "",
                Optional("the cell has `[data]`"),
                "The bus and the meaning of its frames. A cell has `[bus]` or `[data]`.",
            ),
            key(
                "data",
                Table,
                "",
                Optional("the cell has `[bus]`"),
                "Recordings of other programs, in place of a bus.",
            ),
            key(
                "window",
                Table,
                "",
                Optional("windows by command alone"),
                "When to identify. Required with `[bus]`.",
            ),
            key(
                "controller",
                Table,
                "",
                Optional("unknown"),
                "Controller of the arm. Required by the methods that simulate the closed loop.",
            ),
            key(
                "identification",
                Table,
                "",
                Required,
                "Identification: parameters, method and \
                filters.",
            ),
            key("service", Table, "", Optional("as its defaults say"), "How the service runs."),
        ],
        example: "name = \"press-4\"\nrobot = \"../robots/tx40.toml\"",
    },
    Section {
        heading: "[urdf]",
        path: "urdf",
        about: "Properties of the drives, which a URDF does not have. The first three are \
            required with a URDF.",
        keys: &[
            key(
                "drive_inertia",
                Switch,
                "",
                Optional("required with a URDF"),
                "True if the inertias of the drives are parameters: torque comes from motor \
                    current. False if joint torque sensors measure it.",
            ),
            key(
                "gear_ratios",
                Numbers,
                "",
                Optional("required with a URDF"),
                "Motor turns per joint turn; 1 if the signals are on the joint side. Negative \
                    if they turn in opposite directions. For a prismatic joint radians of the \
                    motor per metre.",
            ),
            key(
                "friction",
                Other("table"),
                "",
                Optional("required with a URDF"),
                "Friction terms: the keys of `[friction]` of a robot file.",
            ),
            key(
                "base",
                Text,
                "",
                Optional("the root of the URDF"),
                "The link on which the arm stands, if the URDF has several roots or the arm \
                    begins later.",
            ),
            key(
                "tip",
                Text,
                "",
                Optional("the end of the URDF"),
                "The link at which the arm ends, if the URDF has several ends or continues as a \
                    gripper.",
            ),
            key(
                "joints",
                Other("table of tables"),
                "",
                Default("{}"),
                "Properties of single joints, by their names in the URDF: `drive_inertia`, \
                    `friction`, `known_torque` and the largest acceleration and jerk, with the \
                    keys of a joint in a robot file.",
            ),
            key(
                "joint_friction",
                Other("table of tables"),
                "",
                Default("{}"),
                "The friction of single joints, as earlier versions had it; now `friction` under \
                `joints`.",
            ),
        ],
        example: "[urdf]\ndrive_inertia = true\ngear_ratios = [101.0, 101.0, 101.0, 54.6, 54.6, \
            54.6]\nfriction = { viscous = true, coulomb = true, offset = true, sign = { model = \
            \"tanh\", width_rad_s = 0.02 } }\nbase = \"base_link\"\ntip = \"tool0\"\n\n\
            [urdf.joints]\nelbow_joint = { drive_inertia = false, friction = { quadratic = true } \
            }",
    },
    Section {
        heading: "[window]",
        path: "window",
        about: "When to identify. A window is the part of the stream of samples for one result: \
            a margin, the samples that count, and a margin.",
        keys: &[
            key(
                "trigger",
                Table,
                "",
                Required,
                "The trigger that opens and closes a window: one of the forms below.",
            ),
            key(
                "margin_before_s",
                Number,
                "s",
                Default("0.25"),
                "Samples kept before those that count, for the edges of the filters; 0 to 10.",
            ),
            key(
                "margin_after_s",
                Number,
                "s",
                Default("0.25"),
                "Samples kept after those that count; 0 to 10.",
            ),
            key(
                "min_s",
                Number,
                "s",
                Default("2.0"),
                "A window with fewer counted samples than this is rejected as too short; 0 to \
                    600.",
            ),
            key(
                "max_s",
                Number,
                "s",
                Default("60.0"),
                "A window is closed at this length, its margins included: the bound of its memory; \
                0.1 to 600.",
            ),
        ],
        example: "[window]\ntrigger = { by = \"motion\", velocity_threshold_rad_s = 0.5 \
            }\nmargin_before_s = 0.25\nmargin_after_s = 0.25\nmin_s = 3.0\nmax_s = 60.0",
    },
    Section {
        heading: "window.trigger: motion",
        path: "window.trigger",
        about: "Motion opens a window, rest closes it.",
        keys: &[
            key("by", Form("motion"), "", Required, "The form."),
            key(
                "velocity_threshold_rad_s",
                Number,
                "rad/s",
                Required,
                "A motor that turns faster than this is in motion. The speed is that of the motor, \
                before the gear.",
            ),
            key(
                "idle_s",
                Number,
                "s",
                Default("0.5"),
                "Rest closes the window after this time, or after `margin_after_s` where that is \
                longer; 0 to 60.",
            ),
            key(
                "difference_s",
                Number,
                "s",
                Default("0.01"),
                "The speed is the difference of two positions this far apart: long enough that one \
                 count of the encoder is no motion; 0 to 1.",
            ),
        ],
        example: "[window]\ntrigger = { by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = \
            0.5, difference_s = 0.01 }",
    },
    Section {
        heading: "window.trigger: interval",
        path: "window.trigger",
        about: "One window after the other, whether the arm moves or not.",
        keys: &[
            key("by", Form("interval"), "", Required, "The form."),
            key(
                "length_s",
                Number,
                "s",
                Required,
                "Length of the counted samples of each window: `min_s` at least, and with its \
                    margins `max_s` at most.",
            ),
        ],
        example: "[window]\ntrigger = { by = \"interval\", length_s = 20.0 }",
    },
    Section {
        heading: "window.trigger: command",
        path: "window.trigger",
        about: "`didim window begin` opens a window, `didim window end` closes it.",
        keys: &[key("by", Form("command"), "", Required, "The form.")],
        example: "[window]\ntrigger = { by = \"command\" }",
    },
];
