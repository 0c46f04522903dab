//! The bus: the meaning of its frames, and the gains of the drives.

use super::super::reference::Kind::{
    File, Integer, Number, Numbers, Other, Table, Tables, Text, Word,
};
use super::super::reference::Presence::{Choice, Default, Optional, Required};
use super::super::reference::{Key, Section, key};
use super::data::HOLD_KEYS;

const SIGNAL: &str = "With a DBC file: `Message.Signal`, with `{axis}` in place of the number of \
    the axis, from 1; or a list of one for each axis.";
const NAMES: &str = "text, or a list of texts";
const OBJECT: &str =
    "With `nodes` or `slaves`: index and sub-index of the object in hexadecimal, as `6064:00`.";
const UNIT: &str = "With `nodes` or `slaves`: the unit of the object, which their files do not \
    state; the gains are checked against it.";
const INTEGER: &str = "Its signal of the DBC file, as of `position`: an unsigned integer of at \
    most 16 bits, with factor 1 and offset 0. Its bits may be those of other signals.";
const READING: &[Key] = &[
    key(
        "signal",
        Other(NAMES),
        "",
        Optional("`object` names it"),
        "With a DBC file: `Message.Signal`, as of `position`; one signal may be that of every \
         axis. A temperature is in \"degC\", \"°C\" or \"C\", or in tenths (\"0.1 degC\", \"0.1 \
         °C\"); a voltage in \"V\", \"mV\", \"0.1 V\" or \"0.01 V\"; a mode is an integer of at \
         most 16 bits.",
    ),
    key("object", Text, "", Optional("`signal` names it"), OBJECT),
    key(
        "unit",
        Text,
        "",
        Optional("that of the DBC file"),
        "With `nodes` or `slaves`: the unit of the object, one of those; none of a mode.",
    ),
];
const PROVENANCE: &str = "Source of the numbers: a data sheet with its page, an object read \
    from the drive, a measurement. Never empty.";

pub(super) const SECTIONS: &[Section] = &[
    Section {
        heading: "[bus]",
        path: "bus",
        about: "The drive bus. didim only listens to it.",
        keys: &[
            key(
                "source",
                Other("text, or a list of texts"),
                "",
                Required,
                "Where the frames come from: `\"can:INTERFACE\"`, `\"log:FILE\"` (candump), \
                 `\"ethercat:INTERFACE\"` and `\"pcap:FILE\"` (a tap and a capture of EtherCAT) or \
                 `\"inproc:\"` (the simulated arm in the same process). A list of `can:` where \
                 several interfaces carry parts of one layout.",
            ),
            key(
                "receive_buffer_bytes",
                Integer,
                "bytes",
                Default("4194304"),
                "Receive buffer of each socket. The kernel counts 768 bytes for a CAN FD frame and \
                grants twice `net.core.rmem_max` at most.",
            ),
            key(
                "bitrate_bps",
                Integer,
                "bit/s",
                Optional("unknown"),
                "Bit rate of the bus, with CAN FD of the arbitration phase; 1000 to 1 000 000. \
                    It configures nothing: `didim check` uses it to check whether the frames \
                    fit.",
            ),
            key(
                "data_bitrate_bps",
                Integer,
                "bit/s",
                Optional("unknown"),
                "Bit rate of the data phase of CAN FD frames; `bitrate_bps` to 8 000 000. It \
                    configures nothing either.",
            ),
            key("layout", Table, "", Required, "Meaning of the bits of each frame."),
            key(
                "drives",
                Tables,
                "",
                Required,
                "The gains of each drive, in the order of the axes.",
            ),
        ],
        example: "[bus]\nsource = \"can:can0\"\nreceive_buffer_bytes = 4194304\nbitrate_bps = \
            1000000\ndata_bitrate_bps = 8000000",
    },
    Section {
        heading: "[bus.layout]",
        path: "bus.layout",
        about: "Signals of the arm in the DBC file, the device files or the EtherCAT network. \
            Each states when it is valid, relative to the instant of the sample: the SYNC, or \
            the arrival of the packed frame, or the cycle of EtherCAT.",
        keys: &[
            key(
                "dbc",
                File,
                "",
                Optional("`nodes` or `slaves` describe the frames"),
                "The DBC file. A layout has `dbc`, `nodes` or `slaves`.",
            ),
            key(
                "nodes",
                Tables,
                "",
                Default("[]"),
                "The CANopen drives with their device files, one entry for each axis, in their \
                order; in place of `dbc`, `sync` and `counter`.",
            ),
            key(
                "eni",
                File,
                "",
                Optional("`startup` describes the slaves"),
                "The ENI file by which the EtherCAT master was configured. `slaves` need it, or \
                `startup`.",
            ),
            key(
                "startup",
                File,
                "",
                Optional("`eni` describes the slaves"),
                "A capture that begins before the EtherCAT master starts and ends when the drives \
                run: didim learns from it how the master configured the slaves.",
            ),
            key(
                "slaves",
                Tables,
                "",
                Default("[]"),
                "The EtherCAT drives, one entry for each axis, in their order; in place of `dbc`, \
                `sync` and `counter`.",
            ),
            key("axes", Integer, "", Required, "Number of axes."),
            key(
                "rate_hz",
                Number,
                "Hz",
                Optional("`period_us` states it"),
                "The nominal rate of the bus cycle. A layout has `rate_hz` or `period_us`.",
            ),
            key(
                "period_us",
                Number,
                "µs",
                Optional("`rate_hz` states it"),
                "The nominal period of the bus cycle.",
            ),
            key(
                "sync",
                Text,
                "",
                Optional("one packed message"),
                "The message whose arrival is the instant of the sample. Without it every signal \
                 lies in one packed message, and the arrival of that is the instant. On a bus \
                 without SYNC it is any message that comes once a cycle, and may carry signals; \
                 every signal is then valid at its own `\"arrival\"`.",
            ),
            key(
                "cycles_by",
                Word(&["stamps", "frames"]),
                "",
                Default("\"stamps\""),
                "How bus cycles are counted. `\"stamps\"`: by the times of the frames, which have \
                 to be within half a period of their place, so that a missing SYNC and a wrong \
                 rate are noticed. `\"frames\"`: each SYNC or packed frame is the next cycle, \
                 however late it is stamped, for adapters and virtual machines that deliver in \
                 bursts.",
            ),
            key("position", Table, "", Required, "The measured position of the motor."),
            key("torque", Table, "", Required, "The torque of the motor, demanded or measured."),
            key(
                "reference",
                Table,
                "",
                Optional("not on the bus"),
                "The position command of the drive. Required by the methods that simulate the \
                closed loop.",
            ),
            key(
                "status_word",
                Text,
                "",
                Optional("every cycle counts"),
                "Signal or object of the status word of CiA 402 (6041h): a cycle counts when every \
                drive is in the state \"operation enabled\".",
            ),
            key(
                "enabled",
                Table,
                "",
                Optional("every cycle counts"),
                "With a DBC file, in place of `status_word`: a state that drives of another kind \
                send.",
            ),
            key(
                "temperature",
                Table,
                "",
                Optional("not on the bus"),
                "Temperature of each motor, however seldom it comes.",
            ),
            key(
                "supply_voltage",
                Table,
                "",
                Optional("not on the bus"),
                "Supply or DC link voltage of each drive, however seldom it comes.",
            ),
            key(
                "mode",
                Table,
                "",
                Optional("not on the bus"),
                "Mode of each drive (6061h of CiA 402): a window ends where one changes, and a log \
                is cut there.",
            ),
            key(
                "law",
                Table,
                "",
                Optional("not on the bus"),
                "With a DBC file: the control law that each command holds in addition to the \
                position, as in MIT mode. Where it stays along a record, the methods that simulate \
                the loop take it in place of `[controller]`.",
            ),
            key(
                "except",
                Tables,
                "",
                Default("[]"),
                "With a DBC file: frames that have the identifier of a message and carry something \
                else. They are counted as `excepted`.",
            ),
            key(
                "counter",
                Text,
                "",
                Optional("none"),
                "Signal of a counter in the packed message, one more for each sample.",
            ),
        ],
        example: "[bus.layout]\ndbc = \"../dbc/cia402_six_axes.dbc\"\naxes = 6\nrate_hz = \
            500.0\nsync = \"SYNC\"\ncycles_by = \"stamps\"\nposition = { signal = \
            \"TPDO1_{axis}.PositionActualValue\", valid = \"instant\" }\ntorque = { signal = \
            \"TPDO1_{axis}.TorqueDemand\", valid = { held = { hold_us = 200.0, delay_us = 0.0 } } \
            }\nreference = { signal = \"RPDO1_{axis}.TargetPosition\", valid = \"next-sync\" \
            }\nstatus_word = \"TPDO1_{axis}.StatusWord\"",
    },
    Section {
        heading: "bus.layout.nodes",
        path: "bus.layout.nodes.0",
        about: "One CANopen drive, or one axis of a drive of several. An entry has `eds` or `dcf`.",
        keys: &[
            key(
                "node_id",
                Integer,
                "",
                Required,
                "Its number on the bus, 1 to 127; `$NODEID` in the file.",
            ),
            key(
                "eds",
                File,
                "",
                Optional("`dcf` is the file"),
                "Its EDS file: what the drive does after a reset.",
            ),
            key(
                "dcf",
                File,
                "",
                Optional("`eds` is the file"),
                "Its DCF file: how the drive was configured.",
            ),
            key(
                "object_offset",
                Integer,
                "",
                Default("0"),
                "Added to the index of every object: 0x800 for the second axis of a drive of \
                several (CiA 402), which is listed once for each axis.",
            ),
        ],
        example: "[bus.layout]\nnodes = [\n  { node_id = 1, eds = \"drive.eds\" },\n  { node_id = \
            2, dcf = \"drive-2.dcf\", object_offset = 0x800 },\n]",
    },
    Section {
        heading: "bus.layout.enabled",
        path: "bus.layout.enabled",
        about: "A state that drives send which have no status word of CiA 402: a cycle counts when \
            all of them are enabled.",
        keys: &[
            key("signal", Other(NAMES), "", Required, INTEGER),
            key("is", Integer, "", Required, "Its value where the drive is enabled."),
        ],
        example: "[bus.layout]\nenabled = { signal = \"Feedback_{axis}.Status\", is = 1 }",
    },
    Section {
        heading: "bus.layout.temperature",
        path: "bus.layout.temperature",
        about: "The temperature of each motor. It may come in a message of its own, at any time, \
            with an object in a PDO that goes by events too: it is of the cycle that it comes in, \
            and no sample waits for it.",
        keys: READING,
        example: "[bus.layout]\ntemperature = { signal = \"LowSpeed_{axis}.MotorTemperature\" }",
    },
    Section {
        heading: "bus.layout.supply_voltage",
        path: "bus.layout.supply_voltage",
        about: "The supply or DC link voltage of each drive; it comes as a temperature does.",
        keys: READING,
        example: "[bus.layout]\nsupply_voltage = { object = \"6079:00\", unit = \"mV\" }",
    },
    Section {
        heading: "bus.layout.mode",
        path: "bus.layout.mode",
        about: "The mode of each drive; it comes as a temperature does. A window ends where one \
            changes, and a log is cut there.",
        keys: READING,
        example: "[bus.layout]\nmode = { object = \"6061:00\" }",
    },
    Section {
        heading: "bus.layout.law",
        path: "bus.layout.law",
        about: "The law that commands state, τ = `stiffness` (p_d − p) + `damping` (`speed` − v) + \
            `torque`, where p_d is the reference. Stiffness and damping have to stay along a \
            record, the speeds to be zero or those of the reference, the torques zero; another \
            record is refused by the methods that simulate. A `[controller]` that the cell states \
            is used in its place.",
        keys: &[
            key(
                "stiffness",
                Other(NAMES),
                "N·m/rad",
                Required,
                "Its signal, as of `position`, in \"Nm/rad\"; 0 to 511.",
            ),
            key(
                "damping",
                Other(NAMES),
                "N·m·s/rad",
                Required,
                "Its signal, in \"Nms/rad\"; 0 to 5.1.",
            ),
            key(
                "speed",
                Other(NAMES),
                "rad/s",
                Required,
                "The signal of the speed that is asked for, in \"rad/s\"; to ±65.",
            ),
            key(
                "torque",
                Other(NAMES),
                "N·m",
                Required,
                "The signal of the torque that is added, in \"Nm\"; to ±131.",
            ),
        ],
        example: "[bus.layout]\nlaw = { stiffness = \"MitCommand_{axis}.Kp\", damping = \
            \"MitCommand_{axis}.Kd\", speed = \"MitCommand_{axis}.SpeedRef\", torque = \
            \"MitCommand_{axis}.TorqueRef\" }",
    },
    Section {
        heading: "bus.layout.except",
        path: "bus.layout.except.0",
        about: "Frames that have the identifier of a message and carry something else, as answers \
            about registers.",
        keys: &[
            key("signal", Other(NAMES), "", Required, INTEGER),
            key("is", Numbers, "", Required, "Its values in such frames."),
        ],
        example: "[bus.layout]\nexcept = [{ signal = \"Feedback_{axis}.Register\", is = [0x33, \
            0x55, 0xAA] }]",
    },
    Section {
        heading: "bus.layout.slaves",
        path: "bus.layout.slaves.0",
        about: "One EtherCAT drive, or one axis of a drive of several. An entry has `name`, \
            `address` or both.",
        keys: &[
            key("name", Text, "", Optional("`address` says which"), "Its name in the ENI file."),
            key(
                "address",
                Integer,
                "",
                Optional("`name` says which"),
                "Its station address, as the master configured it; the only one that a `startup` \
                knows.",
            ),
            key(
                "object_offset",
                Integer,
                "",
                Default("0"),
                "Added to the index of every object: 0x800 for the second axis of a drive of \
                several (CiA 402), which is listed once for each axis.",
            ),
        ],
        example: "[bus.layout]\neni = \"arm.xml\"\nstartup = \"startup.pcapng\"\nslaves = [\n  { \
            name = \"Axis_1\" },\n  { address = 1002, object_offset = 0x800 },\n]",
    },
    Section {
        heading: "bus.layout.position",
        path: "bus.layout.position",
        about: "The measured position of the motor.",
        keys: &[
            key("signal", Other(NAMES), "", Optional("`object` names it"), SIGNAL),
            key("object", Text, "", Optional("`signal` names it"), OBJECT),
            key("unit", Text, "", Optional("that of the DBC file"), UNIT),
            key(
                "valid",
                Word(&["instant", "arrival"]),
                "",
                Required,
                "When it is valid: `\"instant\"`, at the instant of the sample, where drives latch \
                 it; `\"arrival\"`, at the arrival of its own frame, on a bus without SYNC: it is \
                 interpolated to the instant of the sample.",
            ),
        ],
        example: "[bus.layout]\nposition = { object = \"6064:00\", unit = \"count\", valid = \
            \"instant\" }",
    },
    Section {
        heading: "bus.layout.torque",
        path: "bus.layout.torque",
        about: "The torque of the motor, demanded or measured.",
        keys: &[
            key("signal", Other(NAMES), "", Optional("`object` names it"), SIGNAL),
            key("object", Text, "", Optional("`signal` names it"), OBJECT),
            key("unit", Text, "", Optional("that of the DBC file"), UNIT),
            key(
                "valid",
                Other("`\"instant\"`, `\"arrival\"`, or a table"),
                "",
                Required,
                "When it is valid: `\"instant\"`, at the instant of the sample, as a measured \
                 torque; `\"arrival\"`, as of the position; `{ held = { … } }`, a command that the \
                 current loop holds until the next one.",
            ),
        ],
        example: "[bus.layout]\ntorque = { object = \"6077:00\", unit = \"per mille\", valid = \
            \"instant\" }",
    },
    Section {
        heading: "bus.layout.torque.valid: held",
        path: "bus.layout.torque.valid.held",
        about: "A command that the current loop holds until the next one.",
        keys: HOLD_KEYS,
        example: "[bus.layout]\ntorque = { signal = \"Sample.Torque_{axis}\", valid = { held = { \
            hold_us = 200.0, delay_us = 0.0 } } }",
    },
    Section {
        heading: "bus.layout.reference",
        path: "bus.layout.reference",
        about: "The position command of the drive.",
        keys: &[
            key("signal", Other(NAMES), "", Optional("`object` names it"), SIGNAL),
            key("object", Text, "", Optional("`signal` names it"), OBJECT),
            key("unit", Text, "", Optional("that of the DBC file"), UNIT),
            key(
                "valid",
                Word(&["instant", "next-sync", "arrival"]),
                "",
                Required,
                "When it takes effect: `\"instant\"`, in the sample whose cycle carries it, as one \
                 that the drive reports; `\"next-sync\"`, in the next sample, as a synchronous \
                 RPDO (CiA 301) and an output of EtherCAT; `\"arrival\"`, as of the position.",
            ),
            key(
                "following_error",
                Word(&["target-minus-actual", "actual-minus-target"]),
                "",
                Optional("it is a position"),
                "Where no target is on the bus: the signal is a following error in the unit of the \
                 position, and this difference. `\"target-minus-actual\"`, as 60F4h of CiA 402: \
                 the reference is position + following error; `\"actual-minus-target\"`: position \
                 − following error. Drives have either: move one axis slowly forward, and the \
                 target is ahead.",
            ),
        ],
        example: "[bus.layout]\nreference = { signal = \"RPDO1_{axis}.TargetPosition\", valid = \
            \"next-sync\" }",
    },
    Section {
        heading: "[[bus.drives]]",
        path: "bus.drives.0",
        about: "The gains of one drive; one entry for each axis, in their order.",
        keys: &[
            key("position", Table, "", Required, "Gain of the position and of the reference."),
            key("torque", Table, "", Required, "Gain of the torque."),
        ],
        example: "[[bus.drives]]\nposition = { scale = { counts_per_revolution = 196608.0 }, sign \
            = 1, zero = 0.0, wraps = \"refuse\", provenance = \"data sheet of the motor, page 7\" \
            }\ntorque = { scale = { per_mille_of_rated_torque = { rated_torque_nm = 1.375 } }, \
            sign = 1, provenance = \"6076h read from the drive\" }",
    },
    Section {
        heading: "bus.drives: position",
        path: "bus.drives.0.position",
        about: "Motor angle = sign × scale × (value − zero).",
        keys: &[
            key(
                "scale",
                Other("`\"rad\"`, `\"deg\"`, or a table"),
                "",
                Required,
                "What one unit of the value is: one of the forms below.",
            ),
            key(
                "sign",
                Integer,
                "",
                Required,
                "1, or −1 where the drive counts against the direction of the robot file.",
            ),
            key(
                "zero",
                Number,
                "unit of the signal",
                Required,
                "The value, in the unit of the DBC file or of the object, at which the motor angle \
                of the robot file is 0.",
            ),
            key(
                "wraps",
                Word(&["refuse", "modulo"]),
                "",
                Required,
                "What to do where the integer starts again. `\"refuse\"`: the axis never reaches \
                 the end of the range, and a jump of half of it is out of range. `\"modulo\"`: the \
                 difference from `zero` is taken modulo the range, to ± half of it, for axes that \
                 travel less than the range.",
            ),
            key("provenance", Text, "", Required, PROVENANCE),
        ],
        example: "[[bus.drives]]\nposition = { scale = { counts_per_revolution = 65536.0 }, sign = \
            -1, zero = 1200.0, wraps = \"modulo\", provenance = \"608Fh read from the drive; zero \
            from the calibration of the arm\" }\ntorque = { scale = \"nm\", sign = 1, provenance = \
            \"DBC file of the drive\" }",
    },
    Section {
        heading: "bus.drives: position.scale",
        path: "bus.drives.0.position.scale",
        about: "One of these; the last two as a text, `scale = \"rad\"`.",
        keys: &[
            key(
                "counts_per_revolution",
                Number,
                "",
                Choice,
                "Counts to one revolution of the motor (608Fh).",
            ),
            key("rad_per_count", Number, "rad", Choice, "The angle of one count."),
            key("rad", Other("none"), "", Choice, "The factor of the DBC file already gives rad."),
            key("deg", Other("none"), "", Choice, "The factor of the DBC file gives degrees."),
        ],
        example: "[[bus.drives]]\nposition = { scale = { rad_per_count = 9.587e-5 }, sign = 1, \
            zero = 0.0, wraps = \"refuse\", provenance = \"data sheet\" }\ntorque = { scale = \
            \"nm\", sign = 1, provenance = \"data sheet\" }",
    },
    Section {
        heading: "bus.drives: torque",
        path: "bus.drives.0.torque",
        about: "Motor torque = sign × scale × value.",
        keys: &[
            key(
                "scale",
                Other("`\"nm\"`, or a table"),
                "",
                Required,
                "What one unit of the value is: one of the forms below.",
            ),
            key(
                "sign",
                Integer,
                "",
                Required,
                "1, or −1 if the drive's torque is against the direction of the robot file.",
            ),
            key("provenance", Text, "", Required, PROVENANCE),
        ],
        example: "[[bus.drives]]\nposition = { scale = \"rad\", sign = 1, zero = 0.0, wraps = \
            \"refuse\", provenance = \"DBC file of the drive\" }\ntorque = { scale = { \
            nm_per_count = 1.5e-4 }, sign = -1, provenance = \"data sheet of the drive, page 31\" \
            }",
    },
    Section {
        heading: "bus.drives: torque.scale",
        path: "bus.drives.0.torque.scale",
        about: "One of these; the last as a text, `scale = \"nm\"`.",
        keys: &[
            key(
                "per_mille_of_rated_torque",
                Table,
                "",
                Choice,
                "The value is in per mille of the rated torque (6074h and 6077h of 6076h).",
            ),
            key(
                "per_mille_of_rated_current",
                Table,
                "",
                Choice,
                "The value is in per mille of the rated current (6078h of 6075h), and the torque \
                constant makes a torque of it.",
            ),
            key("nm_per_count", Number, "N·m", Choice, "The torque of one count."),
            key(
                "nm_per_a",
                Number,
                "N·m/A",
                Choice,
                "The factor of the DBC file gives a current in A, of which an ampere is worth so \
                 much: torque constant, gear and what the firmware of the drive makes of a \
                 current, in one number.",
            ),
            key("nm", Other("none"), "", Choice, "The factor of the DBC file already gives N·m."),
        ],
        example: "[[bus.drives]]\nposition = { scale = \"rad\", sign = 1, zero = 0.0, wraps = \
            \"refuse\", provenance = \"data sheet\" }\ntorque = { scale = { nm_per_count = 1.5e-4 \
            }, sign = 1, provenance = \"data sheet\" }",
    },
    Section {
        heading: "bus.drives: per_mille_of_rated_torque",
        path: "bus.drives.0.torque.scale.per_mille_of_rated_torque",
        about: "Per mille of the rated torque.",
        keys: &[key(
            "rated_torque_nm",
            Number,
            "N·m",
            Required,
            "Rated torque of the motor (6076h).",
        )],
        example: "[[bus.drives]]\nposition = { scale = \"rad\", sign = 1, zero = 0.0, wraps = \
            \"refuse\", provenance = \"data sheet\" }\ntorque = { scale = { \
            per_mille_of_rated_torque = { rated_torque_nm = 1.375 } }, sign = 1, provenance = \
            \"6076h read from the drive\" }",
    },
    Section {
        heading: "bus.drives: per_mille_of_rated_current",
        path: "bus.drives.0.torque.scale.per_mille_of_rated_current",
        about: "Per mille of the rated current. Vendors disagree on which value of a sinusoidal \
            phase current they state, and it is a factor of √2.",
        keys: &[
            key("rated_current_a", Number, "A", Required, "Rated current of the motor (6075h)."),
            key(
                "current_is",
                Word(&["rms", "peak"]),
                "",
                Required,
                "Which value of the current that is: effective value or amplitude.",
            ),
            key(
                "torque_constant_nm_per_a",
                Number,
                "N·m/A",
                Required,
                "Torque constant of the motor.",
            ),
            key(
                "torque_constant_is",
                Word(&["rms", "peak"]),
                "",
                Required,
                "Per ampere of which value of the current.",
            ),
        ],
        example: "[[bus.drives]]\nposition = { scale = \"rad\", sign = 1, zero = 0.0, wraps = \
            \"refuse\", provenance = \"data sheet\" }\ntorque = { scale = { \
            per_mille_of_rated_current = { rated_current_a = 4.2, current_is = \"rms\", \
            torque_constant_nm_per_a = 0.33, torque_constant_is = \"rms\" } }, sign = 1, \
            provenance = \"6075h, and data sheet of the motor, page 12\" }",
    },
];
