//! Check for sample rates that cannot be verified.

use didim_drivers::layout::CyclesBy;

use super::finding::Finding;
use crate::cell::CellBus;

pub(super) fn check(bus: &CellBus, findings: &mut Vec<Finding>) {
    if bus.layout.cycles_by() == CyclesBy::Frames {
        findings.push(Finding::note(
            "bus.layout.cycles_by",
            "cycles are counted by frames: neither the rate nor a SYNC lost on the wire is checked"
                .to_owned(),
            "compare the rate with the controller's configuration: inertias are wrong by twice its \
             error; leave the key out if the adapter stamps its frames",
        ));
    }
}
