//! Operation of the service.

use super::super::reference::Kind::{File, Integer, Number, Switch, Table, Text, Word};
use super::super::reference::Presence::{Default, Optional};
use super::super::reference::{Section, key};

pub(super) const SECTIONS: &[Section] = &[
    Section {
        heading: "[service]",
        path: "service",
        about: "Folders, rights and processes of `didim run`.",
        keys: &[
            key(
                "state_directory",
                File,
                "",
                Default("\"/var/lib/didim\""),
                "The folder of the results.",
            ),
            key(
                "runtime_directory",
                File,
                "",
                Default("\"/run/didim\""),
                "The folder of the sockets and of the stream's own files. The path of a socket in \
                it has at most 107 bytes.",
            ),
            key(
                "status_mode",
                Integer,
                "",
                Default("0o660"),
                "Permissions of the status socket: 0o600 and rights to read and write for others.",
            ),
            key(
                "status_group",
                Text,
                "",
                Optional("the service's own"),
                "Group of the status socket.",
            ),
            key(
                "command_mode",
                Integer,
                "",
                Optional("`0o600`; `0o660` with `command_group`"),
                "Permissions of the command socket, which is never for everybody.",
            ),
            key(
                "command_group",
                Text,
                "",
                Optional("the service's own"),
                "Group of the command socket.",
            ),
            key(
                "keep_results",
                Integer,
                "",
                Default("1000"),
                "Number of results that are kept; older ones are removed.",
            ),
            key(
                "buffer_s",
                Number,
                "s",
                Default("20.0"),
                "Longest absence of the estimation without loss of samples.",
            ),
            key(
                "real_time",
                Table,
                "",
                Optional("an ordinary thread"),
                "Priority and processor of the bus thread.",
            ),
            key(
                "processes",
                Word(&["one", "two"]),
                "",
                Default("\"one\""),
                "One process for everything; or acquisition and estimation in one each (`didim run \
                --part acquisition`, `--part estimation`).",
            ),
            key("recordings", Table, "", Optional("nothing is recorded"), "Raw frames on disk."),
            key(
                "drift",
                Table,
                "",
                Optional("as its defaults say"),
                "Definition of drift from the baseline.",
            ),
        ],
        example: "[service]\nstate_directory = \"/var/lib/didim\"\nruntime_directory = \
            \"/run/didim\"\nstatus_mode = 0o660\nstatus_group = \"operators\"\ncommand_group = \
            \"engineers\"\nbuffer_s = 60.0",
    },
    Section {
        heading: "[service.real_time]",
        path: "service.real_time",
        about: "Real-time settings of the thread that reads the bus. The status reports each one \
            that is not granted.",
        keys: &[
            key(
                "priority",
                Integer,
                "",
                Optional("an ordinary thread"),
                "Priority of SCHED_FIFO, 1 to 99. Keep it below the kernel's interrupt threads, \
                which have 50.",
            ),
            key("cpu", Integer, "", Optional("any"), "The only processor to run on, from 0."),
            key(
                "lock_memory",
                Switch,
                "",
                Default("false"),
                "True keeps the memory of the process that reads the bus from being swapped out.",
            ),
        ],
        example: "[service.real_time]\npriority = 20\ncpu = 3\nlock_memory = true",
    },
    Section {
        heading: "[service.recordings]",
        path: "service.recordings",
        about: "Raw frames: a ring of files with the newest ones, and from it the recordings of \
            results, faults and captures. 1 MB is 10⁶ bytes.",
        keys: &[
            key(
                "directory",
                File,
                "",
                Optional("`recordings` in `state_directory`"),
                "Another folder, as on another disk.",
            ),
            key(
                "ring_mb",
                Integer,
                "MB",
                Default("1000"),
                "The most that the ring takes on disk, the file being written included; 8 to 10 \
                000 000.",
            ),
            key(
                "segment_s",
                Number,
                "s",
                Default("60.0"),
                "A file of the ring is closed after this time, or at an eighth of the ring, at \
                most 64 MB; 1 to 3600.",
            ),
            key(
                "before_s",
                Number,
                "s",
                Default("2.0"),
                "Kept before the first sample of a window; 0.5 to 60.",
            ),
            key(
                "after_s",
                Number,
                "s",
                Default("1.0"),
                "Kept after the last sample of a window; 0 to 60.",
            ),
            key(
                "fault_before_s",
                Number,
                "s",
                Default("10.0"),
                "Kept before a fault; 0 to 600. After it `after_s`.",
            ),
            key(
                "fault_every_s",
                Number,
                "s",
                Default("60.0"),
                "At most one recording of a fault in this time; the others are counted; 1 to 86 \
                400.",
            ),
            key(
                "keep",
                Integer,
                "",
                Default("50"),
                "Recordings kept of each kind: results, faults, captures; 1 to 100 000.",
            ),
            key(
                "keep_mb",
                Integer,
                "MB",
                Default("1000"),
                "The most that all of them take together; the oldest go; 8 to 10 000 000.",
            ),
            key(
                "capture_max_s",
                Number,
                "s",
                Default("600.0"),
                "A capture is stopped after this time, or when it is half of the ring or of \
                `keep_mb`; 1 to 86 400.",
            ),
        ],
        example: "[service.recordings]\ndirectory = \"/mnt/ssd/didim\"\nring_mb = 8000\nkeep = \
            50\nkeep_mb = 1000",
    },
    Section {
        heading: "[service.drift]",
        path: "service.drift",
        about: "A parameter is outside its band if it differs from the baseline by more than \
            `standard_deviations` σ and by more than `relative`.",
        keys: &[
            key(
                "standard_deviations",
                Number,
                "σ",
                Default("4.0"),
                "Half of the band, in standard deviations of the difference; 1 to 100.",
            ),
            key(
                "relative",
                Number,
                "share",
                Default("0.1"),
                "Half of the band, as a share of the baseline's value; 0 to 10.",
            ),
            key(
                "results",
                Integer,
                "",
                Default("2"),
                "Results in a row outside the band that raise the alarm, and inside that clear it; \
                1 to 100.",
            ),
            key(
                "trend_results",
                Integer,
                "d",
                Default("50"),
                "Days with results of which the trend is formed, the last ones; 3 to 500.",
            ),
        ],
        example: "[service.drift]\nstandard_deviations = 4.0\nrelative = 0.15\nresults = \
            3\ntrend_results = 50",
    },
];
