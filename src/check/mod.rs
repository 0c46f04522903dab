//! Checks that find problems before the service starts.
//!
//! [`Cell::read`] refuses invalid settings. These checks find valid settings that will not work: a
//! bus without capacity for its frames, gains of unknown origin, parameters that no motion
//! identifies, a machine without the interface. There is one file per kind of finding.

mod bus;
mod bus_load;
mod finding;
mod identifiable;
mod limits;
mod machine;
mod method;
mod paths;
mod provenance;
mod rate;
mod real_time;
mod recordings;
mod wire;

pub use finding::{Finding, Severity};
pub use machine::Machine;
pub use recordings::writing_text;

use crate::analysis::screening::{FRICTION_LAWS_REMEDY, LIMITS_REMEDY, open_limits, unlisted_laws};
use crate::cell::Cell;
use crate::service::limits::low_limits;

/// Returns the problems of a cell that do not depend on the machine, the worst first.
pub fn check_cell(cell: &Cell) -> Vec<Finding> {
    let mut findings = Vec::new();
    for note in &cell.robot_notes {
        let remedy = "inspect the arm with `didim robot`, and correct the URDF if it is wrong";
        findings.push(Finding::note("robot", note.clone(), remedy));
    }
    if let Some(open) = open_limits(&cell.robot) {
        findings.push(Finding::note("robot", open, LIMITS_REMEDY));
    }
    if let Some(unlisted) = unlisted_laws(cell) {
        findings.push(Finding::warning(
            "identification.parameters",
            unlisted,
            FRICTION_LAWS_REMEDY,
        ));
    }
    if let Ok(bus) = cell.bus() {
        bus_load::check(cell, bus, &mut findings);
        provenance::check(bus, &mut findings);
        rate::check(bus, &mut findings);
        recordings::check(cell, bus, &mut findings);
    }
    identifiable::check(cell, &mut findings);
    method::check(cell, &mut findings);
    sort_findings(findings)
}

/// Returns the problems of a cell on this machine and for this user, the worst first.
pub fn check_machine(cell: &Cell, machine: &Machine) -> Vec<Finding> {
    let mut findings = Vec::new();
    // Without a bus there is no service.
    if let Ok(bus) = cell.bus() {
        bus::check(cell, bus, machine, &mut findings);
        paths::check(cell, machine, &mut findings);
        recordings::check_disk(cell, &mut findings);
        real_time::check(cell, &mut findings);
        findings.extend(
            low_limits().map(|low| Finding::error("service", low.shortage(), low.remedy())),
        );
    }
    sort_findings(findings)
}

fn sort_findings(mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.sort_by_key(|finding| finding.severity);
    findings
}

#[cfg(test)]
mod tests;
