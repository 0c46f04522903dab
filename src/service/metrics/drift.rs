//! Differences between the last estimate and the baseline, as metric families.

use super::exposition::{FamilyKind, MAX_LABELS, MetricsText, flag_value};
use crate::archive::drift::DriftStatus;

use FamilyKind::Gauge;

pub(super) fn add_drift(text: &mut MetricsText, status: &DriftStatus) {
    let help =
        "Whether the last result was compared with the baseline; `didim status` says why not.";
    text.family("didim_drift_compared", Gauge, help).value(flag_value(status.compared));
    // Prometheus uses NaN for a missing number.
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let shown = || status.parameters.iter().take(MAX_LABELS);
    let help = "Relative change of a parameter since the baseline.";
    let mut family = text.family("didim_drift_relative_change_ratio", Gauge, help);
    for parameter in shown() {
        family.add_labelled(
            &[("parameter", &parameter.parameter)],
            number(parameter.relative_change),
        );
    }
    let help =
        "Change of a parameter as a share of its band around the baseline: more than 1 is outside.";
    let mut family = text.family("didim_drift_band_share_ratio", Gauge, help);
    for parameter in shown() {
        family.add_labelled(&[("parameter", &parameter.parameter)], number(parameter.band_share));
    }
    let help = "Alarms of parameters that have left their bands; always 1.";
    let mut family = text.family("didim_drift_alarm", Gauge, help);
    for alarm in status.alarms.iter().take(MAX_LABELS) {
        let description = alarm.description.as_deref().map(|of| ("description", of));
        let labels = [("parameter", alarm.parameter.as_str())];
        family.add_labelled(&labels.into_iter().chain(description).collect::<Vec<_>>(), 1.0);
    }
}
