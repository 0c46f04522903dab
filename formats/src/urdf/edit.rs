//! A URDF with other bodies and friction, and everything else as it was.

use core::ops::Range;

use didim_core::feasibility::Body as LinkBody;
use nalgebra::Matrix3;

use super::UrdfArm;
use super::chain::Axis;
use super::error::UrdfError;
use super::file::{Body, DynamicsPlace, File, FileJoint, Place};
use crate::xml::within_comment;

/// The first remark of a file that is written for another tool: when such a file is the robot's, its remarks go with the next.
pub const WRITTEN_BY: &str = "Written by didim export.";

/// What is written into a URDF, joint by joint.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfValues {
    /// The body of each link, in the frames of [`UrdfArm::to_toml`].
    pub bodies: Vec<LinkBody>,
    /// Viscous friction \[N·m·s/rad or N·s/m\], where the model has it; 0 is written in the place of any other.
    pub damping: Vec<Option<f64>>,
    /// Coulomb friction \[N·m or N\], likewise.
    pub friction: Vec<Option<f64>>,
}

/// A part of the text, and what stands there instead.
struct Edit {
    place: Range<usize>,
    text: String,
}

impl UrdfArm {
    /// Its file with other inertials, damping and friction, and with remarks in a comment at the begin.
    /// A link that a joint moves has the body of all that is fixed to it, whose own inertials go. What hangs on
    /// joints that are no part of the arm keeps its inertials, which are taken off.
    ///
    /// # Errors
    /// [`UrdfError`].
    pub fn with_values(
        &self,
        values: &UrdfValues,
        remarks: &[String],
    ) -> Result<String, UrdfError> {
        let text = &self.text;
        let file = File::read(text)?;
        let chain = file.chain(Some(&self.base), Some(&self.tip))?;
        let comment = comment(remarks, indent(text, &file.place) + "  ");
        let mut remarks = inside(text, &file.place, &comment);
        remarks.place.end += former_comment(&text[remarks.place.end..]);
        let mut edits = vec![remarks];
        for (number, (axis, placed)) in chain.axes.iter().zip(&self.placed).enumerate() {
            let name = || file.links[axis.carried[0].link].name.clone();
            let impossible = || UrdfError::NothingLeft { link: name() };
            let whole =
                values.bodies.get(number).and_then(Body::about_centre).ok_or_else(impossible)?;
            let own = without_held(axis, &whole.seen_from(&placed.frame().pose()));
            let own = own.ok_or_else(impossible)?.seen_from(&axis.pose.inverse());
            for (index, carried) in axis.carried.iter().enumerate() {
                let link = &file.links[carried.link];
                let tab = indent(text, &link.place) + "  ";
                match (&link.inertial, index, carried.is_held) {
                    // It would stay, and the link that carries it have it once more.
                    (Some(_), _, true) if carried.body.is_none() => {
                        return Err(UrdfError::ImpossibleHeld { link: link.name.clone() });
                    }
                    (Some(place), 0, _) => {
                        edits.push(Edit { place: place.clone(), text: own.element(&tab) });
                    }
                    (None, 0, _) => {
                        let inserted = format!("\n{tab}{}", own.element(&tab));
                        edits.push(inside(text, &link.place, &inserted));
                    }
                    (Some(place), _, false) => {
                        edits.push(Edit { place: with_line(text, place), text: String::new() });
                    }
                    _ => {}
                }
            }
            if let Some(joint) = file.joints.iter().find(|joint| joint.name == axis.name) {
                let of = |values: &[Option<f64>]| values.get(number).copied().flatten();
                let both = [of(&values.damping), of(&values.friction)];
                edits.extend(friction(text, joint, both));
            }
        }
        Ok(edited(text, edits))
    }
}

/// The body of an axis without what hangs on joints that are no part of the chain; none where nothing possible is left.
fn without_held(axis: &Axis, whole: &Body) -> Option<Body> {
    let mut rest = about_origin(whole);
    for held in axis.carried.iter().filter(|carried| carried.is_held) {
        let Some(body) = &held.body else { continue };
        let body = about_origin(body);
        rest.mass_kg -= body.mass_kg;
        rest.first_moment -= body.first_moment;
        rest.inertia -= body.inertia;
    }
    rest.is_possible().then(|| Body::about_centre(&rest))?
}

fn about_origin(body: &Body) -> LinkBody {
    let c = body.centre_m;
    let shift = Matrix3::identity() * c.norm_squared() - c * c.transpose();
    LinkBody {
        mass_kg: body.mass_kg,
        first_moment: c * body.mass_kg,
        inertia: body.inertia_kg_m2 + shift * body.mass_kg,
    }
}

/// Damping and friction of a joint, each where there is one.
fn friction(text: &str, joint: &FileJoint, values: [Option<f64>; 2]) -> Vec<Edit> {
    let stated = ["damping", "friction"].into_iter().zip(values);
    let attributes = |of: Vec<(&str, f64)>| -> String {
        of.iter().map(|(name, value)| format!(" {name}=\"{value:?}\"")).collect()
    };
    let Some(DynamicsPlace { whole, damping, friction }) = &joint.dynamics else {
        let new: Vec<_> = stated.filter_map(|(name, value)| Some((name, value?))).collect();
        if new.is_empty() {
            return Vec::new();
        }
        let tab = indent(text, &joint.place) + "  ";
        let element = format!("\n{tab}<dynamics{}/>", attributes(new));
        return vec![inside(text, &joint.place, &element)];
    };
    let (mut edits, mut new) = (Vec::new(), Vec::new());
    for ((name, value), place) in stated.zip([damping, friction]) {
        match (value, place) {
            (Some(value), Some(place)) => {
                edits.push(Edit { place: place.clone(), text: format!("{value:?}") });
            }
            (Some(value), None) => new.push((name, value)),
            // What the model lacks is in its other parameters.
            (None, Some(place)) => {
                edits.push(Edit { place: place.clone(), text: "0.0".to_owned() })
            }
            (None, None) => {}
        }
    }
    let at = whole.start + "<dynamics".len();
    edits.push(Edit { place: at..at, text: attributes(new) });
    edits
}

/// A comment on lines of its own.
fn comment(lines: &[String], tab: String) -> String {
    let lines = lines.iter().map(|line| format!("{tab}  {}\n", within_comment(line)));
    format!("\n{tab}<!--\n{}{tab}-->", lines.collect::<String>())
}

/// The length of the comment of an earlier export, where there is one.
fn former_comment(text: &str) -> usize {
    let inner = text.trim_start().strip_prefix("<!--");
    let own = inner.filter(|inner| inner.trim_start().starts_with(WRITTEN_BY));
    own.and_then(|_| text.find("-->")).map_or(0, |at| at + "-->".len())
}

/// The spaces before an element on its line.
fn indent(text: &str, place: &Place) -> String {
    let line = text[..place.whole.start].rsplit('\n').next().unwrap_or_default();
    line.chars().take_while(|of| of.is_whitespace()).collect()
}

/// New content at the begin of an element.
fn inside(text: &str, place: &Place, content: &str) -> Edit {
    let Range { start, end } = place.whole.clone();
    let element = &text[start..end];
    if let Some(at) = place.content {
        return Edit { place: at..at, text: content.to_owned() };
    }
    let tab = indent(text, place);
    match element.strip_suffix("/>") {
        Some(open) => {
            let name: String =
                open.chars().skip(1).take_while(|of| !of.is_whitespace() && *of != '/').collect();
            Edit { place: end - 2..end, text: format!(">{content}\n{tab}</{name}>") }
        }
        None => {
            let at = start + element.rfind("</").unwrap_or(element.len());
            Edit { place: at..at, text: format!("{content}\n{tab}") }
        }
    }
}

/// An element with the rest of its line, where that is blank.
fn with_line(text: &str, place: &Range<usize>) -> Range<usize> {
    let before = text[..place.start].trim_end_matches([' ', '\t']);
    let is_alone = text[place.end..].trim_start_matches([' ', '\t', '\r']).starts_with('\n');
    let above = before.strip_suffix('\n').map(|above| above.strip_suffix('\r').unwrap_or(above));
    above.filter(|_| is_alone).map_or(place.clone(), |above| above.len()..place.end)
}

/// The text with the edits, whose lines end as its own do.
fn edited(text: &str, mut edits: Vec<Edit>) -> String {
    let line_end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    edits.sort_by_key(|edit| edit.place.start);
    let (mut out, mut at) = (String::new(), 0);
    for Edit { place, text: new } in edits {
        out.push_str(&text[at..place.start]);
        out.push_str(&new.replace('\n', line_end));
        at = place.end;
    }
    out.push_str(&text[at..]);
    out
}
