//! The keys of the robot file.

use super::reference::Kind::{Number, Numbers, Other, Switch, Table, Tables, Text, Word};
use super::reference::Presence::{Default, Optional, Required};
use super::reference::{Key, Kind, Presence, Reference, Section, key};

pub(super) const ROBOT: Reference = Reference {
    name: "didim-robot",
    document: "robot-file.md",
    title: "the robot file: every key, with type, unit, default and meaning",
    description: &[
        "A robot file (TOML) describes an arm: its axes, limits, transmission, friction terms, \
         known torques, and values of its parameters where they are known. The key `robot` of a \
         cell file (didim-cell(5)) names it. A URDF does as well; `didim robot arm.urdf --toml` \
         prints it as a robot file. `didim robot FILE` shows the arm that a file describes.",
        "Every section below states one table of the file. A key that is not listed here is an \
        error.",
    ],
    sections: &[TOP, JOINT, KNOWN_TORQUE, DRIVES],
    files: &[[
        "/usr/share/didim/config/robots",
        "robot files of arms whose dimensions are published",
    ]],
    see_also: &[
        ["didim-cell(5)", "cell-file.md", "cell file"],
        ["didim-parameters(7)", "parameters.md", "names of parameters"],
        ["didim-robot(1)", "../guide/export.md", "export guide"],
    ],
};

const TOP: &[Section] = &[
    Section {
        heading: "The top of the file",
        path: "",
        about: "Before the first `[table]`.",
        keys: &[
            key("name", Text, "", Required, "Name of the robot, as results and scenarios have it."),
            key(
                "gravity_m_s2",
                Numbers,
                "m/s²",
                Required,
                "Gravity in the frame of the base, x, y and z.",
            ),
            key(
                "joint",
                Tables,
                "",
                Required,
                "The joints, `[[joint]]`, from the base to the flange; 1 to 8.",
            ),
            key("transmission", Table, "", Required, "Gear ratios and couplings."),
            key("friction", Table, "", Required, "The friction terms of all joints."),
            key(
                "base_capsules",
                Tables,
                "",
                Optional("none"),
                "Shapes of the base, in its frame: as `capsules` of a joint. Without ends one \
                reaches from the origin of the base to that of the first link.",
            ),
            key(
                "nominal",
                Other("table of numbers"),
                "",
                Optional("unknown"),
                "Values of parameters, by their names (didim-parameters(7)) and in their units. \
                 Those that are not listed are 0. `zz1r` and `zz1` are one parameter.",
            ),
        ],
        example: "name = \"tx40\"\ngravity_m_s2 = [0.0, 0.0, -9.81]\n\n[nominal]\nzz1 = 1.24\nfv1 \
            = 8.0\nfc1 = 7.34",
    },
    Section {
        heading: "base_capsules",
        path: "base_capsules.0",
        about: "As `joint.capsules`, in the frame of the base.",
        keys: &CAPSULE,
        example: "base_capsules = [{ from_m = [0.0, 0.0, 0.05], to_m = [0.0, 0.0, 0.3], radius_m = \
            0.09 }]",
    },
];

const fn limit(name: &'static str, unit: &'static str, meaning: &'static str) -> Key {
    key(name, Number, unit, Required, meaning)
}

/// Defines a limit that may be left open.
const fn optional_limit(name: &'static str, unit: &'static str, meaning: &'static str) -> Key {
    key(name, Other("number or `\"unknown\"`"), unit, Required, meaning)
}

const fn planned(name: &'static str, unit: &'static str, meaning: &'static str) -> Key {
    key(name, Number, unit, Optional("unknown"), meaning)
}

const LOWEST: &str = "Smallest position of the joint.";
const HIGHEST: &str = "Largest position of the joint.";
/// Keys of a shape, of a link and of the base.
const CAPSULE: [Key; 3] = [
    key(
        "from_m",
        Numbers,
        "m",
        Optional("the origin of that frame"),
        "One end of the segment, x, y and z.",
    ),
    key(
        "to_m",
        Numbers,
        "m",
        Optional("the origin of the next link's frame; of the last link its own"),
        "The other end. Has to be stated where the next joint is prismatic.",
    ),
    key("radius_m", Number, "m", Required, "The radius; greater than 0."),
];
const FASTEST: &str = "Largest speed of the joint; greater than 0. `\"unknown\"` where no source \
    gives it: recordings are then not checked against it, and no motion is designed.";
const PLANNED: &str = "Largest acceleration; greater than 0. Motions are planned with it; no \
    identification needs it.";
const JERK: &str =
    "Largest jerk; greater than 0. Motions are planned with it; no identification needs it.";

const JOINT: &[Section] = &[
    Section {
        heading: "[[joint]]",
        path: "joint.0",
        about: "One joint and the link that it carries, in modified Denavit–Hartenberg parameters \
            (Khalil): the frame of a link in that of the link before is RotX(α) TransX(d) RotZ(θ) \
            TransZ(r). The position of a revolute joint is added to θ, that of a prismatic one to \
            r.",
        keys: &[
            key(
                "type",
                Word(&["revolute", "prismatic"]),
                "",
                Required,
                "Revolute joints turn about their z axis, prismatic joints slide along it.",
            ),
            key(
                "alpha_deg",
                Number,
                "°",
                Required,
                "α, from the z axis of the link before to this one, about the x axis of the link \
                before.",
            ),
            key(
                "d_m",
                Number,
                "m",
                Required,
                "d, from the z axis of the link before to this one, along the x axis of the link \
                before.",
            ),
            key("theta_deg", Number, "°", Required, "θ, about this z axis, at position 0."),
            key("r_m", Number, "m", Required, "r, along this z axis, at position 0."),
            key(
                "drive_inertia",
                Switch,
                "",
                Required,
                "True if the inertia of the joint's drive is a parameter (`ia`).",
            ),
            key(
                "friction",
                Table,
                "",
                Optional("as `[friction]` says"),
                "Friction of this joint, in place of the general one.",
            ),
            key(
                "known_torque",
                Table,
                "",
                Optional("none"),
                "A torque or force on the joint in addition to gravity and the drive, as of a \
                spring or a counterbalance; positive along the positive direction of the joint.",
            ),
            key(
                "capsules",
                Tables,
                "",
                Optional("none"),
                "Shapes of the link. Designed motions keep them apart from those of other links \
                    and from a box. Without any, collisions of the link are not checked.",
            ),
        ],
        example: REVOLUTE,
    },
    Section {
        heading: "joint.capsules",
        path: "joint.0.capsules.0",
        about: "All points within a radius of a segment in the frame of the link: at least as \
            large as the link part that it represents.",
        keys: &CAPSULE,
        example: CAPSULES,
    },
    Section {
        heading: "[[joint]]: limits of a revolute joint",
        path: "joint.0",
        about: "Further keys where `type = \"revolute\"`.",
        keys: &[
            limit("position_min_deg", "°", LOWEST),
            limit("position_max_deg", "°", HIGHEST),
            optional_limit("velocity_max_rad_s", "rad/s", FASTEST),
            planned("acceleration_max_rad_s2", "rad/s²", PLANNED),
            planned("jerk_max_rad_s3", "rad/s³", JERK),
            optional_limit(
                "torque_max_nm",
                "N·m",
                "Largest torque of the drive on the side of the joint, behind the gear; greater \
                 than 0. `\"unknown\"` where no source gives it: recordings are then not checked \
                 against it, what is little torque is judged by the largest recorded, and no \
                 motion is designed with torques or without a result.",
            ),
        ],
        example: REVOLUTE,
    },
    Section {
        heading: "[[joint]]: limits of a prismatic joint",
        path: "joint.0",
        about: "Further keys where `type = \"prismatic\"`.",
        keys: &[
            limit("position_min_m", "m", LOWEST),
            limit("position_max_m", "m", HIGHEST),
            optional_limit("velocity_max_m_s", "m/s", FASTEST),
            planned("acceleration_max_m_s2", "m/s²", PLANNED),
            planned("jerk_max_m_s3", "m/s³", JERK),
            optional_limit(
                "force_max_n",
                "N",
                "Largest force of the drive along the joint, behind the gear; greater than 0. \
                `\"unknown\"` as of `torque_max_nm`.",
            ),
        ],
        example: PRISMATIC,
    },
    Section {
        heading: "joint.friction",
        path: "joint.0.friction",
        about: "Friction of one joint; missing keys are those of `[friction]`.",
        keys: &OWN_FRICTION,
        example: "[[joint]]\ntype = \"revolute\"\nalpha_deg = -90.0\nd_m = 0.0\ntheta_deg = \
            -90.0\nr_m = 0.0\ndrive_inertia = true\nposition_min_deg = -125.0\nposition_max_deg = \
            125.0\nvelocity_max_rad_s = 5.009\ntorque_max_nm = 131.84\nfriction = { quadratic = \
            true, stribeck_rad_s = 0.1 }",
    },
];

const REVOLUTE: &str = "[[joint]]\ntype = \"revolute\"\nalpha_deg = -90.0\nd_m = 0.0\ntheta_deg = \
    -90.0\nr_m = 0.0\ndrive_inertia = true\nposition_min_deg = -125.0\nposition_max_deg = \
    125.0\nvelocity_max_rad_s = 5.009\ntorque_max_nm = 131.84";
const CAPSULES: &str = "[[joint]]\ntype = \"revolute\"\nalpha_deg = -90.0\nd_m = 0.0\ntheta_deg = \
    -90.0\nr_m = 0.0\ndrive_inertia = true\nposition_min_deg = -125.0\nposition_max_deg = \
    125.0\nvelocity_max_rad_s = 5.009\ntorque_max_nm = 131.84\ncapsules = [{ from_m = [0.0, 0.0, \
    0.05], to_m = [0.225, 0.0, 0.05], radius_m = 0.07 }]";
const PRISMATIC: &str = "[[joint]]\ntype = \"prismatic\"\nalpha_deg = 90.0\nd_m = 0.0\ntheta_deg = \
    0.0\nr_m = 0.12\ndrive_inertia = true\nposition_min_m = 0.0\nposition_max_m = \
    1.2\nvelocity_max_m_s = 1.5\nforce_max_n = 900.0";

const KNOWN_TORQUE: &[Section] = &[
    Section {
        heading: "joint.known_torque: table of a revolute joint",
        path: "joint.0.known_torque",
        about: "A torque that is linear between points.",
        keys: &[
            key(
                "position_deg",
                Numbers,
                "°",
                Required,
                "At least two positions that increase, from limit to limit of the joint.",
            ),
            key("torque_nm", Numbers, "N·m", Required, "The torque at each."),
        ],
        example: "[[joint]]\ntype = \"revolute\"\nalpha_deg = 0.0\nd_m = 0.0\ntheta_deg = 0.0\nr_m \
            = 0.0\ndrive_inertia = true\nposition_min_deg = -90.0\nposition_max_deg = \
            90.0\nvelocity_max_rad_s = 2.0\ntorque_max_nm = 900.0\nknown_torque = { position_deg = \
            [-90.0, 0.0, 90.0], torque_nm = [-300.0, 0.0, 300.0] }",
    },
    Section {
        heading: "joint.known_torque: table of a prismatic joint",
        path: "joint.0.known_torque",
        about: "A force that is linear between points.",
        keys: &[
            key(
                "position_m",
                Numbers,
                "m",
                Required,
                "At least two positions that increase, from limit to limit of the joint.",
            ),
            key("force_n", Numbers, "N", Required, "The force at each."),
        ],
        example: "[[joint]]\ntype = \"prismatic\"\nalpha_deg = 0.0\nd_m = 0.0\ntheta_deg = \
            0.0\nr_m = 0.0\ndrive_inertia = true\nposition_min_m = 0.0\nposition_max_m = \
            1.2\nvelocity_max_m_s = 1.5\nforce_max_n = 900.0\nknown_torque = { position_m = [0.0, \
            1.2], force_n = [250.0, 130.0] }",
    },
    Section {
        heading: "joint.known_torque: counterbalance",
        path: "joint.0.known_torque",
        about: "The law of a cylinder or a spring, of a revolute joint.",
        keys: &[key("counterbalance", Table, "", Required, "The cylinder or spring.")],
        example: COUNTERBALANCE,
    },
    Section {
        heading: "joint.known_torque.counterbalance",
        path: "joint.0.known_torque.counterbalance",
        about: "A cylinder or spring between the link and what carries the joint. With the \
            distances a and b of its ends from the axis and β = q − q₀ its length is l = √(a² + b² \
            − 2ab cos β); its pull F is a torque of −F ab sin β / l. A spring pulls with F₀ + k (l \
            − l₀), a cylinder on an accumulator with F₀ / (1 − (l − l₀)/s). With neither k nor s \
            the pull is F₀ throughout.",
        keys: &[
            key(
                "base_radius_m",
                Number,
                "m",
                Required,
                "a, from the axis to the end on what carries the joint.",
            ),
            key(
                "link_radius_m",
                Number,
                "m",
                Required,
                "b, from the axis to the end on the link; another than a.",
            ),
            key(
                "closest_deg",
                Number,
                "°",
                Required,
                "q₀, the position of the joint at which the ends are closest.",
            ),
            key("pull_n", Number, "N", Required, "F₀, negative where it pushes."),
            key("length_m", Number, "m", Required, "l₀, the length at which it pulls with F₀."),
            key(
                "stiffness_n_m",
                Number,
                "N/m",
                Optional("no spring"),
                "k of a spring. Not with `gas_length_m`.",
            ),
            key(
                "gas_length_m",
                Number,
                "m",
                Optional("no accumulator"),
                "s of a cylinder on an accumulator: the volume of the gas at l₀ over the area of \
                the piston.",
            ),
        ],
        example: COUNTERBALANCE,
    },
];

const COUNTERBALANCE: &str = "[[joint]]\ntype = \"revolute\"\nalpha_deg = -90.0\nd_m = \
    0.0\ntheta_deg = 0.0\nr_m = 0.0\ndrive_inertia = true\nposition_min_deg = \
    -140.0\nposition_max_deg = -5.0\nvelocity_max_rad_s = 2.0\ntorque_max_nm = \
    9000.0\nknown_torque = { counterbalance = { base_radius_m = 0.9, link_radius_m = 0.2, \
    closest_deg = -90.0, pull_n = 6000.0, length_m = 0.7, gas_length_m = 1.1 } }";

const fn term(name: &'static str, absent: Presence, meaning: &'static str) -> Key {
    key(name, Switch, "", absent, meaning)
}

const STRIBECK: (Kind, &str) = (Number, "rad/s");
const SIGN: &str = "The law for the sign of the speed: one of the forms below. Required with \
    `coulomb = true`, and not without.";
const QUADRATIC: &str = "A term `fvq` × speed × |speed|.";
const CUBIC: &str = "A term `fvc` × speed³.";
const ASYMMETRIC: &str = "A term `fva` × |speed|: viscous friction that differs by direction.";
const LOAD: &str = "A term `fcl` × |load| × sign: Coulomb friction that grows with the torque that \
    the drive holds where the arm rests.";
const BELL: &str = "A term `fs` × exp(−(speed/vs)²) × sign, which falls as motion begins; this is \
    vs. Of a prismatic joint the same number of m/s.";

const HYSTERESIS: &str = "A term `fh` × z, which lags: after a reversal z goes from −1 to 1 over \
    this way, and stays there (Maxwell slip); less than the joint's range. Of a prismatic joint \
    the same number of m.";

const OWN_FRICTION: [Key; 7] = [
    key(
        "sign",
        Table,
        "",
        Optional("that of `[friction]`"),
        "The law for the sign of the speed, of this joint.",
    ),
    term("quadratic", Optional("that of `[friction]`"), QUADRATIC),
    term("cubic", Optional("that of `[friction]`"), CUBIC),
    term("asymmetric", Optional("that of `[friction]`"), ASYMMETRIC),
    term("load", Optional("that of `[friction]`"), LOAD),
    key("stribeck_rad_s", STRIBECK.0, STRIBECK.1, Optional("that of `[friction]`"), BELL),
    key("hysteresis_rad", Number, "rad", Optional("that of `[friction]`"), HYSTERESIS),
];

const DRIVES: &[Section] = &[
    Section {
        heading: "[transmission]",
        path: "transmission",
        about: "q of the motors = R × q of the joints; torques of the joints = Rᵀ × torques of the \
            motors.",
        keys: &[key(
            "rows",
            Other("list of lists of numbers"),
            "",
            Required,
            "R, one row for each motor with one entry for each joint: the gear ratios, and \
                couplings outside the diagonal. For a prismatic joint radians of the motor per \
                metre.",
        )],
        example: "[transmission]\nrows = [[101.0]]",
    },
    Section {
        heading: "[friction]",
        path: "friction",
        about: "Friction of all joints: `fv` × speed + `fc` × sign + `off`, as far as they are \
            switched on, and further terms.",
        keys: &[
            term("viscous", Required, "The term `fv`, proportional to the speed."),
            term("coulomb", Required, "The term `fc`, of constant size against the motion."),
            term(
                "offset",
                Required,
                "The term `off`, a constant: unequal friction in the two directions, and the \
                offset of the drive's current.",
            ),
            key("sign", Table, "", Optional("required with `coulomb = true`"), SIGN),
            term("quadratic", Default("false"), QUADRATIC),
            term("cubic", Default("false"), CUBIC),
            term("asymmetric", Default("false"), ASYMMETRIC),
            term("load", Default("false"), LOAD),
            key("stribeck_rad_s", STRIBECK.0, STRIBECK.1, Optional("no such term"), BELL),
            key("hysteresis_rad", Number, "rad", Optional("no such term"), HYSTERESIS),
        ],
        example: "[friction]\nviscous = true\ncoulomb = true\noffset = true\nsign = { model = \
            \"tanh\", width_rad_s = 0.05 }\nquadratic = false",
    },
    Section {
        heading: "friction.sign: tanh",
        path: "friction.sign",
        about: "tanh(speed / width): smooth, for simulations too.",
        keys: &[
            key("model", Kind::Form("tanh"), "", Required, "The form."),
            key(
                "width_rad_s",
                Number,
                "rad/s",
                Required,
                "The speed of the joint at which friction has reached 76 %; greater than 0. Of a \
                prismatic joint the same number of m/s.",
            ),
        ],
        example: "[friction]\nviscous = true\ncoulomb = true\noffset = true\nsign = { model = \
            \"tanh\", width_rad_s = 0.05 }",
    },
    Section {
        heading: "friction.sign: dead-band",
        path: "friction.sign",
        about: "The sign above a threshold, and 0 below it: for recordings with idle parts.",
        keys: &[
            key("model", Kind::Form("dead-band"), "", Required, "The form."),
            key(
                "threshold_rad_s",
                Number,
                "rad/s",
                Required,
                "The speed of the joint below which there is no friction; greater than 0. Of a \
                prismatic joint the same number of m/s.",
            ),
        ],
        example: "[friction]\nviscous = true\ncoulomb = true\noffset = true\nsign = { model = \
            \"dead-band\", threshold_rad_s = 0.02 }",
    },
    Section {
        heading: "friction.sign: sign",
        path: "friction.sign",
        about: "−1, 0 or 1: the textbook's law, which takes the sign of noise at rest.",
        keys: &[key("model", Kind::Form("sign"), "", Required, "The form.")],
        example: "[friction]\nviscous = true\ncoulomb = true\noffset = true\nsign = { model = \
            \"sign\" }",
    },
];
