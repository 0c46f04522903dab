//! The controller of the arm.

use super::super::reference::Kind::{Form, Number, Numbers, Switch, Table, Tables};
use super::super::reference::Presence::{Default, Optional, Required};
use super::super::reference::{Key, Section, key};

const TIMING: Key =
    key("timing", Table, "", Required, "When the controllers compute: one of the forms below.");
const LAW: &str = "The form.";
const KP: Key = key("kp_per_rad", Number, "1/rad", Required, "Kp, the gain of the position error.");
const K_TAU: Key = key(
    "k_tau_nm",
    Number,
    "N·m",
    Required,
    "Kτ, the joint torque of one unit of the control signal, a current or a torque in the drive's \
    own unit.",
);

pub(super) const SECTIONS: &[Section] = &[
    Section {
        heading: "[controller]: cabinet",
        path: "controller",
        about: "The gains of the cabinet are known. The recorded torque is compared with the \
            command that they compute from the recorded reference and position.",
        keys: &[
            key("kind", Form("cabinet"), "", Required, "The form."),
            TIMING,
            key(
                "joints",
                Tables,
                "",
                Required,
                "The controller of each joint, in the order of the joints.",
            ),
            key(
                "rescale_to_inertia_kg_m2",
                Numbers,
                "kg·m²",
                Optional("the gains stay as they are"),
                "The inertia that each joint's gains were tuned for. Torque gain and \
                    feed-forward are multiplied by the estimated inertia over this one, so the \
                    bandwidth stays the same from one estimate to the next.",
            ),
        ],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"pd\", kp_per_rad = 341.87, kd_s_per_rad = \
            2.5361, k_tau_nm = 35.24 } },\n]",
    },
    Section {
        heading: "[controller]: bandwidth",
        path: "controller",
        about: "The gains are unknown: proportional and derivative control of a stated bandwidth, \
            computed from the estimated inertia J of each joint, τ = J ω² e + 2 ζ J ω ė (+ J q̈r) \
            with ω = 2π × bandwidth.",
        keys: &[
            key("kind", Form("bandwidth"), "", Required, "The form."),
            TIMING,
            key("bandwidth_hz", Numbers, "Hz", Required, "ω/2π of each joint."),
            key("damping", Number, "", Required, "ζ, the damping ratio; 0.8 is a usual one."),
            key(
                "acceleration_feed_forward",
                Switch,
                "",
                Required,
                "True adds J q̈r. Without it a loop of low bandwidth lags behind its reference.",
            ),
        ],
        example: "[controller]\nkind = \"bandwidth\"\ntiming = { kind = \"sampled\", \
            sample_period_s = 1e-3 }\nbandwidth_hz = [10.0, 10.0, 12.0, 15.0, 15.0, 20.0]\ndamping \
            = 0.8\nacceleration_feed_forward = true",
    },
    Section {
        heading: "controller.timing: sampled",
        path: "controller.timing",
        about: "Once a period, from the position that is measured then; the torque is held for one \
            period. The derivative is the backward difference of the error.",
        keys: &[
            key("kind", Form("sampled"), "", Required, "The form."),
            key("sample_period_s", Number, "s", Required, "The period."),
            key(
                "computation_delay_s",
                Number,
                "s",
                Default("0.0"),
                "From the measurement to the instant at which its command begins to act; 0 to 16 \
                periods.",
            ),
        ],
        example: "[controller]\nkind = \"bandwidth\"\ntiming = { kind = \"sampled\", \
            sample_period_s = 2e-4, computation_delay_s = 1e-4 }\nbandwidth_hz = [10.0]\ndamping = \
            0.8\nacceleration_feed_forward = false",
    },
    Section {
        heading: "controller.timing: continuous",
        path: "controller.timing",
        about: "At every instant, from the true position and velocity.",
        keys: &[
            key("kind", Form("continuous"), "", Required, "The form."),
            key(
                "sample_period_s",
                Number,
                "s",
                Required,
                "The period at which the loop is recorded.",
            ),
        ],
        example: "[controller]\nkind = \"bandwidth\"\ntiming = { kind = \"continuous\", \
            sample_period_s = 2e-4 }\nbandwidth_hz = [10.0]\ndamping = \
            0.8\nacceleration_feed_forward = false",
    },
    Section {
        heading: "controller.joints",
        path: "controller.joints.0",
        about: "The controller of one joint.",
        keys: &[
            key(
                "law",
                Table,
                "",
                Required,
                "The feedback law: one of the forms below. e is the position error, reference less \
                measured.",
            ),
            key("feed_forward", Table, "", Optional("none"), "Torque from the reference alone."),
            key(
                "torque_limit_nm",
                Number,
                "N·m",
                Optional("no limit"),
                "The command is limited to ± this joint torque. The simulations of an \
                identification leave it out.",
            ),
        ],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"p\", kp_per_rad = 341.87, k_tau_nm = 35.24 \
            }, feed_forward = { acceleration_kg_m2 = 1.2 }, torque_limit_nm = 131.84 },\n]",
    },
    Section {
        heading: "controller.joints: law p",
        path: "controller.joints.0.law",
        about: "τ = Kτ Kp e.",
        keys: &[key("kind", Form("p"), "", Required, LAW), KP, K_TAU],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"p\", kp_per_rad = 341.87, k_tau_nm = 35.24 \
            } },\n]",
    },
    Section {
        heading: "controller.joints: law pd",
        path: "controller.joints.0.law",
        about: "τ = Kτ (Kp e + Kd ė).",
        keys: &[
            key("kind", Form("pd"), "", Required, LAW),
            KP,
            key("kd_s_per_rad", Number, "s/rad", Required, "Kd, the gain of the velocity error."),
            K_TAU,
        ],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"pd\", kp_per_rad = 341.87, kd_s_per_rad = \
            2.5361, k_tau_nm = 35.24 } },\n]",
    },
    Section {
        heading: "controller.joints: law pid",
        path: "controller.joints.0.law",
        about: "τ = Kτ (Kp e + Kd ė + Ki ∫e dt). The integral keeps its value while the torque is \
            saturated and the error would drive it deeper.",
        keys: &[
            key("kind", Form("pid"), "", Required, LAW),
            KP,
            key("kd_s_per_rad", Number, "s/rad", Required, "Kd, the gain of the velocity error."),
            key("ki_per_rad_s", Number, "1/(rad·s)", Required, "Ki, the gain of the integral."),
            K_TAU,
            key(
                "integral_dead_zone_rad",
                Number,
                "rad",
                Default("0.0"),
                "The integral keeps its value while |e| is below this, against hunting under \
                Coulomb friction; at 0 it always integrates.",
            ),
        ],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"pid\", kp_per_rad = 341.87, kd_s_per_rad = \
            2.5361, ki_per_rad_s = 500.0, k_tau_nm = 35.24 } },\n]",
    },
    Section {
        heading: "controller.joints: law cascaded-p-pi",
        path: "controller.joints.0.law",
        about: "Position P around velocity PI: ve = Kv e + q̇r − q̇, τ = Kτ (Kp ve + Ki ∫ve dt).",
        keys: &[
            key("kind", Form("cascaded-p-pi"), "", Required, LAW),
            key("kv_per_s", Number, "1/s", Required, "Kv, the gain of the position loop."),
            key("kp_s_per_rad", Number, "s/rad", Required, "Kp of the velocity loop."),
            key("ki_per_rad", Number, "1/rad", Required, "Ki of the velocity loop."),
            K_TAU,
        ],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"cascaded-p-pi\", kv_per_s = 30.0, \
            kp_s_per_rad = 2.5, ki_per_rad = 60.0, k_tau_nm = 35.24 } },\n]",
    },
    Section {
        heading: "controller.joints: feed_forward",
        path: "controller.joints.0.feed_forward",
        about: "τ = `acceleration_kg_m2` × q̈r + `velocity_nm_s_per_rad` × q̇r.",
        keys: &[
            key(
                "acceleration_kg_m2",
                Number,
                "kg·m²",
                Default("0.0"),
                "The inertia that the feed-forward of the acceleration assumes.",
            ),
            key(
                "velocity_nm_s_per_rad",
                Number,
                "N·m·s/rad",
                Default("0.0"),
                "The viscous friction that the feed-forward of the velocity assumes.",
            ),
        ],
        example: "[controller]\nkind = \"cabinet\"\ntiming = { kind = \"sampled\", sample_period_s \
            = 2e-4 }\njoints = [\n  { law = { kind = \"p\", kp_per_rad = 341.87, k_tau_nm = 35.24 \
            }, feed_forward = { acceleration_kg_m2 = 1.2, velocity_nm_s_per_rad = 8.0 } },\n]",
    },
];
