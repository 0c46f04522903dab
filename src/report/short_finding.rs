//! A finding in a few words, with its figure and the parameter or joint that it is about.

use didim_dynamics::robot::Robot;
use didim_identification::identification::{Finding, FindingCode as Code, Subject};

use crate::text::{few_listed, significant_digits};

/// Describes a finding: `fv_m6 ± 50.1 % and 27 more`.
pub(super) fn short_text(finding: &Finding, robot: &Robot) -> String {
    let of = subject_text(finding, robot);
    let figure = finding.figure.map(|figure| figure_text(finding, figure)).unwrap_or_default();
    match finding.code {
        Code::ParameterUncertainty => uncertain_parameters(finding, &figure),
        Code::ConditionNumber => format!("condition number {figure}"),
        Code::TorqueUncertainty => format!("torque of {of} ± {figure} along the motion"),
        Code::RelativeError => format!("relative error {figure}"),
        Code::JointError => format!("relative error {figure} of {of}"),
        Code::Extrapolation => format!("torque ± {figure} outside the recorded motion"),
        Code::JointExtrapolation => {
            format!("torque of {of} ± {figure} outside the recorded motion")
        }
        Code::CrossValidation => format!("cross-validation error {figure}"),
        Code::FewRows => format!("{figure} independent rows for each parameter"),
        Code::TooFewMotions => "only one motion".to_owned(),
        Code::NotDecimated => "no decimation filter".to_owned(),
        Code::JointAtRest => format!("{of} does not move"),
        Code::NegativeParameter => format!("{of} is negative ({figure})"),
        Code::IndefiniteMassMatrix => format!("no positive definite mass matrix ({figure})"),
        Code::NoBodies => match figure.is_empty() {
            true => "no physically consistent parameters".to_owned(),
            false => format!("physically consistent parameters only at {figure}"),
        },
        Code::Controller => format!("command of {of} {figure} from that of the controller"),
        Code::OppositeCommand => format!("command of {of} has the opposite sign"),
        Code::WrongSigns => "torques or positions have the wrong sign".to_owned(),
        Code::WrongSignsOfJoint => format!("torque or position of {of} has the wrong sign"),
        Code::OtherUnit => format!("torque of {of} is {figure} times its limit"),
        Code::ConstantTorque => format!("torque of {of} is constant"),
        Code::UnsignedTorque => format!("torques of {of} have no sign"),
        Code::ClippedTorque => format!("torque of {of} looks clipped"),
        Code::FrozenPosition => format!("position of {of} freezes"),
        Code::OppositeSignal => format!("sign of torque or position of {of}"),
        Code::SwappedMotors => format!("drives of {of} may be swapped"),
        Code::LowPassed => "a low-passed signal".to_owned(),
        Code::LateSignal => "a late signal".to_owned(),
        Code::PositionScale => format!("position of {of} fits at {figure} times its value"),
        Code::Coupling => format!("another coupling of {of} fits better"),
        Code::DriveInertia => format!("inertia of the drive of {of} is missing"),
        Code::GravityDirection => "another direction of gravity fits better".to_owned(),
        Code::TorqueGain => format!("torque gain of {of} fits at {figure} times its value"),
        Code::TorqueDelay => format!("torque delay of {of} does not fit"),
        Code::KnownTorque => format!("known torque on {of} does not fit"),
        Code::Geometry => format!("zero or geometry of {of} does not fit"),
        Code::LocalMinimum => "a local minimum, or another control loop".to_owned(),
        Code::Insensitive => "the simulation hardly depends on the parameters".to_owned(),
        Code::PositionsDisagree => format!("torques and positions disagree on {of}"),
        Code::WeakInstruments => "the simulated motion is not the measured one".to_owned(),
        _ => first_clause(&finding.message),
    }
}

/// Returns the limit of a finding, if a reader can compare its figure with it.
pub(super) fn limit_text(finding: &Finding) -> Option<String> {
    let limit = finding.limit.filter(|_| finding.code != Code::OtherUnit)?;
    finding.figure?;
    Some(figure_text(finding, limit))
}

/// Formats a number of a finding in its own unit. Only shares are in percent.
fn figure_text(finding: &Finding, value: f64) -> String {
    let unit = finding.unit.as_deref().unwrap_or_default();
    match (finding.code, unit) {
        // The distance from physically consistent parameters, from its χ².
        (Code::NoBodies, _) => format!("{} σ", significant_digits(value.max(0.0).sqrt(), 2)),
        (Code::ConditionNumber, _) => format!("{value:.0}"),
        (code, "1") if is_share(code) => format!("{} %", significant_digits(100.0 * value, 3)),
        (_, "1") => significant_digits(value, 3),
        (_, unit) => format!("{} {unit}", significant_digits(value, 2)),
    }
}

/// True if the figure of a finding without a unit is a share of something.
fn is_share(code: Code) -> bool {
    matches!(
        code,
        Code::TorqueUncertainty
            | Code::RelativeError
            | Code::JointError
            | Code::Extrapolation
            | Code::JointExtrapolation
            | Code::CrossValidation
            | Code::ParameterUncertainty
            | Code::Controller
            | Code::WrongSigns
            | Code::ClippedTorque
            | Code::ConstantTorque
            | Code::FrozenPosition
            | Code::Outliers
            | Code::UnmodelledEffect
    )
}

/// Names the worst parameter, which comes first, and counts the others.
fn uncertain_parameters(finding: &Finding, figure: &str) -> String {
    let Some(Subject::Parameters(names)) = &finding.subject else {
        return format!("a parameter ± {figure}");
    };
    let worst = names.first().map_or("a parameter", String::as_str);
    match names.len() {
        0 | 1 => format!("{worst} ± {figure}"),
        count => format!("{worst} ± {figure} and {} more", count - 1),
    }
}

fn subject_text(finding: &Finding, robot: &Robot) -> String {
    match &finding.subject {
        Some(Subject::Joints(joints)) => {
            let names = joints.iter().map(|joint| match joint.position() < robot.joints() {
                true => robot.joint_label(*joint),
                false => joint.to_string(),
            });
            counted("joint", names)
        }
        Some(Subject::Motors(motors)) => counted("motor", motors.iter().map(ToString::to_string)),
        Some(Subject::Links(links)) => counted("link", links.iter().map(ToString::to_string)),
        Some(Subject::Parameters(names)) => few_listed(names),
        None => "the arm".to_owned(),
    }
}

/// `joint 3`, `joints 1, 2 and 4 more`
fn counted(noun: &str, names: impl ExactSizeIterator<Item = String>) -> String {
    let plural = if names.len() == 1 { "" } else { "s" };
    format!("{noun}{plural} {}", few_listed(names))
}

/// Returns the part of a message before its remedy.
pub(super) fn first_clause(message: &str) -> String {
    message.split(": ").next().unwrap_or(message).to_owned()
}

#[cfg(test)]
mod tests {
    use didim_identification::identification::Severity;

    use super::*;

    fn finding(code: Code, figure: f64, limit: f64) -> Finding {
        Finding {
            code,
            severity: Severity::Blocking,
            uses: Vec::new(),
            subject: None,
            figure: Some(figure),
            limit: Some(limit),
            unit: Some("1".to_owned()),
            significance: None,
            set: None,
            message: String::new(),
        }
    }

    #[test]
    fn only_shares_are_in_percent() {
        let robot = Robot::from_toml(include_str!("../../config/robots/tx40.toml")).unwrap();
        for (code, figure, text, limit) in [
            // Squared distances of 9.3 and 11 standard deviations.
            (Code::NoBodies, 121.0, "only at 11 σ", "9.3 σ"),
            (Code::PositionScale, 0.983, "fits at 0.983 times its value", "86.0"),
            (Code::ConditionNumber, 512.4, "condition number 512", "86"),
            (Code::FewRows, 3.21, "3.21 independent rows for each parameter", "86.0"),
            (Code::RelativeError, 0.125, "relative error 12.5 %", "8600 %"),
        ] {
            let finding = finding(code, figure, 86.0);
            let found = short_text(&finding, &robot);
            assert!(found.ends_with(text), "{found}");
            assert_eq!(limit_text(&finding).as_deref(), Some(limit), "{code:?}");
        }
    }
}
