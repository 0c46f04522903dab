//! The load on the flange, as metric families.

use didim_identification::identification::{CentreOfMass, UncertainValue};

use super::exposition::{FamilyKind, MetricsText, count_value, flag_value, write};
use crate::live::worker::{LoadState, LoadStatus};

use FamilyKind::{Counter, Gauge};

/// Adds a figure of the centre along each axis on which it is known.
fn add_centre(
    text: &mut MetricsText,
    name: &'static str,
    help: &str,
    (frame, centre_m): (&str, &[Option<UncertainValue>; 3]),
    figure: fn(&UncertainValue) -> f64,
) {
    if centre_m.iter().all(Option::is_none) {
        return;
    }
    let mut family = text.family(name, Gauge, help);
    for (axis, value) in ["x", "y", "z"].into_iter().zip(centre_m) {
        if let Some(value) = value {
            family.add_labelled(&[("frame", frame), ("axis", axis)], figure(value));
        }
    }
}

pub(super) fn add_load(text: &mut MetricsText, status: &LoadStatus) {
    let gauges = [
        ("didim_load_known", "Whether it is known what the arm carries.", {
            flag_value(status.state != LoadState::Unknown)
        }),
        ("didim_load_seen", "Whether the arm carries more than with its baseline.", {
            flag_value(status.state == LoadState::Load)
        }),
    ];
    write(text, Gauge, &gauges);
    if let Some(mass) = status.mass_kg {
        let gauges = [
            (
                "didim_load_mass_kilograms",
                "Mass on the flange beyond that of the baseline.",
                mass.value,
            ),
            (
                "didim_load_mass_standard_deviation_kilograms",
                "Standard deviation of the mass on the flange.",
                mass.standard_deviation,
            ),
        ];
        write(text, Gauge, &gauges);
    }
    let centre = status.last_look.as_ref().and_then(|load| load.centre_of_mass.as_ref());
    if let Some(CentreOfMass { frame, centre_m, .. }) = centre {
        let help = "Centre of mass of the load in the frame of a link, of the last look.";
        add_centre(text, "didim_load_centre_metres", help, (frame, centre_m), |of| of.value);
        let help = "Standard deviation of the centre of mass of the load, of the last look.";
        let name = "didim_load_centre_standard_deviation_metres";
        add_centre(text, name, help, (frame, centre_m), |of| of.standard_deviation);
    }
    let counters = [
        (
            "didim_load_changes_total",
            "Changes of the load on the flange.",
            count_value(status.changes),
        ),
        (
            "didim_load_looks_left_out_total",
            "Looks for a load that were left out, because the one before took too long.",
            count_value(status.looks_left_out),
        ),
    ];
    write(text, Counter, &counters);
}
