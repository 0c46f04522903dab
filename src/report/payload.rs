//! A load as text.

use didim_dynamics::robot::{NamedFrame, Robot};
use didim_identification::identification::{
    Comparison, DeclaredLoad, LoadBody, LoadParameter, Payload, PayloadLimits, UncertainValue,
};

use crate::text::{align_table, significant_digits, to_uncertainty};

pub(super) const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];
pub(super) const INERTIA_NAMES: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];
/// Maximum number of digits of a value.
const MAX_DIGITS: usize = 5;

/// Everything of a load that depends on the axes of a frame.
pub(super) struct FrameView<'a> {
    frame: String,
    pub(super) centre_m: &'a [Option<UncertainValue>; 3],
    pub(super) inertia_kg_m2: &'a [Option<UncertainValue>; 6],
    pub(super) parameters: &'a [LoadParameter],
    pub(super) without_effect: &'a [&'static str],
    pub(super) not_identifiable: &'a [&'static str],
    body: Option<&'a LoadBody>,
    comparison: Option<&'a Comparison>,
    /// Declared centre in the frame \[m\].
    declared_centre_m: Option<[f64; 3]>,
}

impl<'a> FrameView<'a> {
    /// Returns the load in the frame of a person, or in that of the model if its sums cannot be
    /// chosen there.
    pub(super) fn new(payload: &'a Payload, declared: DeclaredLoad, frame: &NamedFrame) -> Self {
        let Payload { load, parameters, without_effect, not_identifiable, .. } = payload;
        match &payload.in_frame {
            Some(own) => Self {
                frame: own.centre.frame.clone(),
                centre_m: &own.centre.centre_m,
                inertia_kg_m2: &own.centre.inertia_kg_m2,
                parameters: &own.parameters,
                without_effect: &own.without_effect,
                not_identifiable: &own.not_identifiable,
                body: own.body.as_ref(),
                comparison: own.declared.as_ref(),
                declared_centre_m: declared.centre_m.map(|centre| frame.point_in_frame(centre)),
            },
            None => Self {
                frame: "the model on the last link".to_owned(),
                centre_m: &load.centre_m,
                inertia_kg_m2: &load.inertia_kg_m2,
                parameters,
                without_effect,
                not_identifiable,
                body: payload.body.as_ref(),
                comparison: payload.declared.as_ref(),
                declared_centre_m: declared.centre_m,
            },
        }
    }
}

/// Returns the heading of a column of standard deviations.
pub(super) fn deviation_heading(is_combined: bool) -> &'static str {
    if is_combined { "σ (combined)" } else { "σ (statistical)" }
}

/// Formats the identified load with the declared one, and notes. The declared centre is in the
/// frame of the last link; centre and inertia are printed in `frame`.
pub fn payload_text(
    payload: &Payload,
    declared: DeclaredLoad,
    robot: &Robot,
    frame: &NamedFrame,
) -> String {
    let view = FrameView::new(payload, declared, frame);
    let mut text = headline(payload);
    let rows = rows(payload, declared, &view);
    if !rows.is_empty() {
        let sigma = deviation_heading(payload.with_model_errors);
        text += "\n";
        text += &align_table(
            &["", "found", sigma, "unit", "possible body", "declared", "found − declared"],
            &rows,
        );
    }
    text += "\n";
    if let Some(declared) = view.comparison {
        let (is, together) =
            (if declared.within { "within" } else { "outside" }, &declared.together);
        text += &format!(
            "the declared load is {is} the uncertainty: χ² {} of {} (by chance with a probability \
            of {})\n",
            significant_digits(together.chi_squared, 3),
            together.degrees_of_freedom,
            significant_digits(together.probability, 2)
        );
    }
    let [before, after] = [&payload.before, &payload.after].map(|of| 100.0 * of.relative_error);
    text += &format!("error of the torques: {before:.2} % as the arm alone");
    if payload.presence.seen {
        text += &format!(", {after:.2} % with the load");
    }
    text += "\n";
    if view.centre_m.iter().any(Option::is_some) || declared.centre_m.is_some() {
        text += &format!(
            "centre and inertia are in the frame of {}, inertia about the centre\n",
            view.frame
        );
    }
    notes(payload, robot, &view)
        .into_iter()
        .map(|note| format!("note: {note}\n"))
        .for_each(|note| text += &note);
    text
}

fn headline(payload: &Payload) -> String {
    let presence = &payload.presence;
    match (presence.seen, presence.mass_deviations, presence.mass_limit_kg) {
        (true, Some(deviations), _) => {
            format!("a load is seen: its mass is {} σ\n", significant_digits(deviations, 3))
        }
        (true, None, _) => "a load is seen, but not its mass\n".to_owned(),
        (false, _, Some(limit)) => {
            format!(
                "no load is seen: its mass is below {} kg (95 %)\n",
                significant_digits(limit, 2)
            )
        }
        (false, Some(deviations), None) => {
            format!("no load is seen: the mass is {} σ\n", significant_digits(deviations, 3))
        }
        (false, None, None) => "no load is seen; its mass is not identifiable\n".to_owned(),
    }
}

/// Formats a declared number with the digits that it was given, as far as they count.
fn declared_text(value: f64) -> String {
    let digits = significant_digits(value, MAX_DIGITS);
    digits.parse::<f64>().map_or(digits, |value| value.to_string())
}

/// Creates a row for each value that is identified or declared.
fn rows(payload: &Payload, declared: DeclaredLoad, view: &FrameView<'_>) -> Vec<Vec<String>> {
    let (body, compared) = (view.body, view.comparison);
    let mut rows = Vec::new();
    let mut row =
        |name: String, unit: &str, values: [Option<f64>; 3], found: Option<UncertainValue>| {
            let [possible, configured, off] = values;
            if found.is_none() && configured.is_none() {
                return;
            }
            let none = || "–".to_owned();
            let to_found = |value: f64| match found {
                Some(of) => to_uncertainty(value, of.standard_deviation, MAX_DIGITS),
                None => significant_digits(value, MAX_DIGITS),
            };
            rows.push(vec![
                name,
                found.map_or_else(none, |of| {
                    to_uncertainty(of.value, of.standard_deviation, MAX_DIGITS)
                }),
                found.map_or_else(none, |of| significant_digits(of.standard_deviation, 2)),
                unit.to_owned(),
                possible.map_or_else(none, to_found),
                configured.map_or_else(none, declared_text),
                off.map_or_else(none, |off| format!("{off:+.1} σ")),
            ]);
        };
    let mass_off = compared.and_then(|of| of.mass_deviations);
    let possible = body.map(|of| of.mass_kg);
    row("mass".to_owned(), "kg", [possible, declared.mass_kg, mass_off], payload.load.mass_kg);
    for (k, axis) in AXIS_NAMES.into_iter().enumerate() {
        let off = compared.and_then(|of| of.centre_deviations[k]);
        let values = [body.map(|of| of.centre_m[k]), view.declared_centre_m.map(|of| of[k]), off];
        row(format!("centre {axis}"), "m", values, view.centre_m[k]);
    }
    for (k, entry) in INERTIA_NAMES.into_iter().enumerate() {
        let values = [body.map(|of| of.inertia_kg_m2[k]), None, None];
        row(format!("inertia {entry}"), "kg·m²", values, view.inertia_kg_m2[k]);
    }
    rows
}

/// Returns notes on the load.
fn notes(payload: &Payload, robot: &Robot, view: &FrameView<'_>) -> Vec<String> {
    let limits = &PayloadLimits::default();
    let (presence, mut notes) = (&payload.presence, Vec::new());
    let has_mass = presence.seen || presence.mass_limit_kg.is_some();
    if presence.mass_deviations.is_some() && !has_mass {
        notes.push(
            "the mass is negative: the arm was identified with a load that it does not carry here, \
             or has changed; identify it empty"
                .to_owned(),
        );
    } else if !presence.seen && presence.from_none.is_significant(limits) {
        notes.push(
            "no mass is seen, but the torques differ from those of the arm by more than its \
             uncertainty: it has changed, its model lacks something along this motion, or what it \
             carries is light and wide"
                .to_owned(),
        );
    }
    if let Some(body) = payload.body.as_ref().filter(|body| !body.is_the_estimate) {
        notes.push(if body.cost > body.cost_limit {
            format!(
                "no body explains what is found: the nearest costs {} where the true one stays \
                 below {} (χ², 99 %); the arm has changed, or the load is not fixed",
                significant_digits(body.cost, 3),
                significant_digits(body.cost_limit, 3)
            )
        } else {
            "what is found is no body by itself; the possible one agrees with it within the \
            uncertainty"
                .to_owned()
        });
    }
    let near_none = INERTIA_NAMES.iter().zip(view.inertia_kg_m2);
    let near_none = near_none.filter(|(_, of)| of.is_some_and(|of| !of.differs_from_none(limits)));
    let near_none: Vec<&str> = near_none.map(|(entry, _)| *entry).collect();
    if !near_none.is_empty() {
        notes.push(format!("the recording does not tell inertia {} from 0", near_none.join(" ")));
    }
    if !view.without_effect.is_empty() {
        notes.push(format!(
            "no motion of this arm shows {} of a load",
            view.without_effect.join(" ")
        ));
    }
    if !payload.standing.is_empty() {
        let joints: Vec<String> =
            payload.standing.iter().map(|joint| robot.joint_label(*joint)).collect();
        notes.push(format!(
            "joint {} stood: friction at rest holds any torque below its own, so what was measured \
            there counts nothing",
            joints.join(", ")
        ));
    }
    if !view.not_identifiable.is_empty() {
        let sums = view.parameters.iter().map(|of| of.name.as_str());
        notes.push(format!(
            "arm and recording do not tell {} by themselves, only these sums: {}",
            view.not_identifiable.join(" "),
            sums.collect::<Vec<_>>().join(", ")
        ));
    }
    if !payload.with_model_errors {
        notes.push(
            "the result does not say what errors of its model do: the uncertainty is without them"
                .to_owned(),
        );
    }
    notes
}
