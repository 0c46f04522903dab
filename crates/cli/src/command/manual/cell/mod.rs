//! The keys of the cell file.

mod arm;
mod bus;
mod controller;
mod data;
mod identification;
mod service;

use super::reference::Reference;

pub(super) const CELL: Reference = Reference {
    name: "didim-cell",
    document: "cell-file.md",
    title: "the cell file: every key, with type, unit, default and meaning",
    description: &[
        "A cell file (TOML) describes the arm, the meaning of its frames or recorded signals, \
            its controller, and when and how to identify. `didim new` writes one, `didim check \
            --cell FILE` reads one and lists its mistakes. `/usr/share/didim/config/cells` has \
            complete examples.",
        "Every section below describes one table of the file. Units are part of the name of a \
            key, and of no value. A key that is not listed here is an error. Names of files are \
            relative to the cell file. A required key is required if its table is present.",
    ],
    sections: &[
        arm::SECTIONS,
        bus::SECTIONS,
        data::SECTIONS,
        controller::SECTIONS,
        identification::SECTIONS,
        service::SECTIONS,
    ],
    files: &[
        ["/etc/didim/cell.toml", "the cell of the service"],
        ["/usr/share/didim/config/cells", "examples"],
    ],
    see_also: &[
        ["didim-robot(5)", "robot-file.md", "robot file"],
        ["didim-parameters(7)", "parameters.md", "names of parameters"],
        ["didim-new(1)", "../guide/cell.md", "cell guide"],
        ["didim-check(1)", "../method/README.md", "methods"],
    ],
};
