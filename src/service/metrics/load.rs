//! The load on the flange, as metric families.

use super::exposition::{FamilyKind, MetricsText, count_value, flag_value, write};
use crate::live::worker::{LoadState, LoadStatus};

use FamilyKind::{Counter, Gauge};

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
