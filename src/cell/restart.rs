//! Changes of a cell file that need a restart of the service.

use super::{Cell, CellBus, ServiceSection};

impl Cell {
    /// Returns the first changed key that needs a restart: a key of the bus, of the meaning of its
    /// frames, or of the operation of the service. `None` if only windows, identification,
    /// controller and robot differ.
    pub fn needs_restart_for(&self, other: &Self) -> Option<&'static str> {
        let name = (self.name != other.name).then_some("name");
        let bus = match (&self.bus, &other.bus) {
            (Some(own), Some(other)) => bus_differs(own, other),
            (None, None) => None,
            _ => Some("bus"),
        };
        let contact = (self.contact != other.contact).then_some("contact");
        name.or(bus).or(contact).or_else(|| service_differs(&self.service, &other.service))
    }
}

fn bus_differs(one: &CellBus, other: &CellBus) -> Option<&'static str> {
    // The joint count needs no comparison: the layout would be refused for another joint count.
    let differs = [
        ("bus.source", one.sources != other.sources),
        ("bus.receive_buffer_bytes", one.receive_buffer_bytes != other.receive_buffer_bytes),
        ("bus.layout", one.layout != other.layout),
        ("bus.drives", one.drives != other.drives || one.scales != other.scales),
    ];
    differs.into_iter().find_map(|(key, differs)| differs.then_some(key))
}

fn service_differs(one: &ServiceSection, other: &ServiceSection) -> Option<&'static str> {
    let differs = [
        ("service.state_directory", one.state_directory != other.state_directory),
        ("service.runtime_directory", one.runtime_directory != other.runtime_directory),
        ("service.status_mode", one.status_mode != other.status_mode),
        ("service.status_group", one.status_group != other.status_group),
        ("service.command_mode", one.command_mode() != other.command_mode()),
        ("service.command_group", one.command_group != other.command_group),
        ("service.keep_results", one.keep_results != other.keep_results),
        ("service.buffer_s", one.buffer_s.to_bits() != other.buffer_s.to_bits()),
        ("service.real_time", one.real_time != other.real_time),
        ("service.processes", one.processes != other.processes),
        ("service.write_mb_per_day", one.write_mb_per_day != other.write_mb_per_day),
        ("service.recordings", one.recordings != other.recordings),
    ];
    let named = differs.into_iter().find_map(|(key, differs)| differs.then_some(key));
    // A change of an unlisted key needs a restart as well. The drift limits are an exception,
    // because each result is judged by the current limits.
    let other = ServiceSection { drift: one.drift, ..other.clone() };
    named.or_else(|| (*one != other).then_some("service"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::drift::DriftOptions;

    #[test]
    fn what_counts_as_drift_needs_no_restart() {
        let section = ServiceSection::default();
        let drift = DriftOptions { relative: 0.2, ..DriftOptions::default() };
        assert_eq!(service_differs(&section, &ServiceSection { drift, ..section.clone() }), None);
        let other = ServiceSection { drift, keep_results: 7, ..section.clone() };
        assert_eq!(service_differs(&section, &other), Some("service.keep_results"));
    }
}
