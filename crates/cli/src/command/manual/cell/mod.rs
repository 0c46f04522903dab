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
        "A cell file (TOML) states which arm there is, what its frames or recorded signals mean, \
         what controls it, when to identify, and how. `didim new` writes one, `didim check --cell \
         FILE` reads one and tells what is wrong. `/usr/share/didim/config/cells` has whole \
         examples.",
        "Every section below states one table of the file. Units are part of the name of a key, \
         and of no value. A key that is not listed here is an error. Names of files are relative \
         to the cell file. A key that is required is required where its table is there.",
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
