//! Options with a fixed set of names, for help, completions and suggestions after a mistake.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use didim::analysis::Format;
use didim_identification::identification::{Method, Use};

/// Default cell file: the one that the unit file of this machine's service names.
pub(super) const DEFAULT_CELL: &str = "/etc/didim/cell.toml";

/// File for the result in a command that the user can paste.
pub(super) const RESULT_FILE: &str = "result.json";
/// File for the report in such a command.
pub(super) const REPORT_FILE: &str = "report.html";

/// File for the advised motions in such a command.
pub(super) const MOTION_FILE: &str = "next.csv";
/// File for a simulated recording in such a command.
pub(super) const SIMULATED_FILE: &str = "simulated.csv";
/// File for the preview of a motion in such a command.
pub(super) const PREVIEW_FILE: &str = "preview.html";

/// Returns a parser for the name of a method.
pub(super) fn method_parser() -> impl TypedValueParser<Value = Method> {
    one_of(Method::ALL, |method| PossibleValue::new(method.name()).help(method.long_name()))
}

/// Returns a parser for the name of a model format.
pub(super) fn format_parser() -> impl TypedValueParser<Value = Format> {
    one_of(Format::ALL, |format| PossibleValue::new(format.name()))
}

/// Uses with a verdict of yes or no. Contact detection has none: its thresholds are not part of
/// the result.
const DECIDED_USES: [Use; 4] =
    [Use::Monitoring, Use::Prediction, Use::PhysicalValues, Use::RigidBody];

/// Returns a parser for the name of a use that has a verdict of yes or no.
pub(super) fn use_parser() -> impl TypedValueParser<Value = Use> {
    one_of(DECIDED_USES, |usage| PossibleValue::new(usage.name()))
}

/// A requirement on a running service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ServiceRequirement {
    /// Its last result is usable for this.
    Use(Use),
    /// Its health is good.
    Healthy,
}

/// Returns a parser for a requirement on a service.
pub(super) fn service_requirement_parser() -> impl TypedValueParser<Value = ServiceRequirement> {
    let [a, b, c, d] = DECIDED_USES.map(ServiceRequirement::Use);
    one_of([a, b, c, d, ServiceRequirement::Healthy], |requirement| match requirement {
        ServiceRequirement::Use(usage) => PossibleValue::new(usage.name()),
        ServiceRequirement::Healthy => {
            PossibleValue::new("healthy").help("the service reports no reason for bad health")
        }
    })
}

fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    shown: fn(T) -> PossibleValue,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(shown)).try_map(move |name| {
        all.into_iter().find(|of| shown(*of).get_name() == name).ok_or("no such name")
    })
}
