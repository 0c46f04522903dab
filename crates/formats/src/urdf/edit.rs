//! A URDF with other bodies and friction; everything else is unchanged.

use core::ops::Range;

use didim_identification::feasibility::Body as LinkBody;
use nalgebra::Matrix3;

use super::UrdfArm;
use super::chain::ChainAxis;
use super::error::UrdfError;
use super::file::{Body, DynamicsPlace, ElementPlace, FileJoint, UrdfFile};
use crate::xml::within_comment;

/// First remark of a file for another tool. If such a file is the robot's, the next export replaces
/// its remarks.
pub const WRITTEN_BY: &str = "Written by didim export.";

/// Values to write into a URDF, joint by joint.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfValues {
    /// Body of each link, in the frames of [`UrdfArm::to_toml`].
    pub link_bodies: Vec<LinkBody>,
    /// Viscous friction \[N·m·s/rad or N·s/m\]; `None` if the model has none, and then 0 replaces
    /// the value of the file.
    pub damping: Vec<Option<f64>>,
    /// Coulomb friction \[N·m or N\], likewise.
    pub friction: Vec<Option<f64>>,
}

/// A part of the text and its replacement.
struct TextEdit {
    text_range: Range<usize>,
    text: String,
}

impl UrdfArm {
    /// Returns its file with other inertials, damping and friction, and with remarks in a comment
    /// at the beginning. The link of a moving joint gets the body of all links fixed to it, whose
    /// own inertials are removed. Links on joints outside the arm keep their inertials, which are
    /// subtracted from the body of the link that carries them.
    ///
    /// # Errors
    /// [`UrdfError`].
    pub fn with_values(
        &self,
        values: &UrdfValues,
        remarks: &[String],
    ) -> Result<String, UrdfError> {
        let text = &self.text;
        let file = UrdfFile::read(text)?;
        let chain = file.chain(Some(&self.base), Some(&self.tip))?;
        let comment = comment_lines(remarks, indent_of(text, &file.element) + "  ");
        let mut remarks = insert_inside(text, &file.element, &comment);
        remarks.text_range.end += former_comment(&text[remarks.text_range.end..]);
        let mut edits = vec![remarks];
        for (number, (axis, placed)) in chain.axes.iter().zip(&self.link_parameters).enumerate() {
            let name = || file.links[axis.attached_links[0].link].name.clone();
            let impossible = || UrdfError::NothingLeft { link: name() };
            let body = values
                .link_bodies
                .get(number)
                .and_then(Body::about_centre)
                .ok_or_else(impossible)?;
            let own_body = without_held(axis, &body.seen_from(&placed.frame().pose()));
            let own_body = own_body.ok_or_else(impossible)?.seen_from(&axis.pose.inverse());
            for (index, attached) in axis.attached_links.iter().enumerate() {
                let link = &file.links[attached.link];
                let tab = indent_of(text, &link.element) + "  ";
                match (&link.inertial_range, index, attached.is_off_chain) {
                    // Its inertial would remain, and the carrying link would contain it a second
                    // time.
                    (Some(_), _, true) if attached.body.is_none() => {
                        return Err(UrdfError::ImpossibleHeld { link: link.name.clone() });
                    }
                    (Some(place), 0, _) => {
                        edits.push(TextEdit {
                            text_range: place.clone(),
                            text: own_body.inertial_element(&tab),
                        });
                    }
                    (None, 0, _) => {
                        let inserted = format!("\n{tab}{}", own_body.inertial_element(&tab));
                        edits.push(insert_inside(text, &link.element, &inserted));
                    }
                    (Some(place), _, false) => {
                        edits.push(TextEdit {
                            text_range: with_line(text, place),
                            text: String::new(),
                        });
                    }
                    _ => {}
                }
            }
            if let Some(joint) = file.joints.iter().find(|joint| joint.name == axis.name) {
                let value_of = |values: &[Option<f64>]| values.get(number).copied().flatten();
                let both = [value_of(&values.damping), value_of(&values.friction)];
                edits.extend(friction(text, joint, both));
            }
        }
        Ok(apply_edits(text, edits))
    }
}

/// Returns the body of an axis without links on joints outside the chain; `None` if the rest is not
/// physically consistent.
fn without_held(axis: &ChainAxis, complete: &Body) -> Option<Body> {
    let mut rest = about_origin(complete);
    for fixed_link in axis.attached_links.iter().filter(|attached| attached.is_off_chain) {
        let Some(body) = &fixed_link.body else { continue };
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

/// Writes damping and friction of a joint, each if there is one.
fn friction(text: &str, joint: &FileJoint, values: [Option<f64>; 2]) -> Vec<TextEdit> {
    let attributes_of = ["damping", "friction"].into_iter().zip(values);
    let attributes = |of: Vec<(&str, f64)>| -> String {
        of.iter().map(|(name, value)| format!(" {name}=\"{value:?}\"")).collect()
    };
    let Some(DynamicsPlace { range: complete, damping, friction }) = &joint.dynamics else {
        let new: Vec<_> = attributes_of.filter_map(|(name, value)| Some((name, value?))).collect();
        if new.is_empty() {
            return Vec::new();
        }
        let tab = indent_of(text, &joint.element) + "  ";
        let element = format!("\n{tab}<dynamics{}/>", attributes(new));
        return vec![insert_inside(text, &joint.element, &element)];
    };
    let (mut edits, mut new) = (Vec::new(), Vec::new());
    for ((name, value), place) in attributes_of.zip([damping, friction]) {
        match (value, place) {
            (Some(value), Some(place)) => {
                edits.push(TextEdit { text_range: place.clone(), text: format!("{value:?}") });
            }
            (Some(value), None) => new.push((name, value)),
            // Effects that the model does not have are contained in its other parameters.
            (None, Some(place)) => {
                edits.push(TextEdit { text_range: place.clone(), text: "0.0".to_owned() })
            }
            (None, None) => {}
        }
    }
    let insert_at = complete.start + "<dynamics".len();
    edits.push(TextEdit { text_range: insert_at..insert_at, text: attributes(new) });
    edits
}

/// Writes a comment on its own lines.
fn comment_lines(lines: &[String], tab: String) -> String {
    let lines = lines.iter().map(|line| format!("{tab}  {}\n", within_comment(line)));
    format!("\n{tab}<!--\n{}{tab}-->", lines.collect::<String>())
}

/// Returns the length of the comment of an earlier export, if any.
fn former_comment(text: &str) -> usize {
    let inner = text.trim_start().strip_prefix("<!--");
    let comment = inner.filter(|inner| inner.trim_start().starts_with(WRITTEN_BY));
    comment.and_then(|_| text.find("-->")).map_or(0, |at| at + "-->".len())
}

/// Returns the spaces before an element on its line.
fn indent_of(text: &str, place: &ElementPlace) -> String {
    let line = text[..place.range.start].rsplit('\n').next().unwrap_or_default();
    line.chars().take_while(|of| of.is_whitespace()).collect()
}

/// Inserts content at the beginning of an element.
fn insert_inside(text: &str, place: &ElementPlace, content: &str) -> TextEdit {
    let Range { start, end } = place.range.clone();
    let element = &text[start..end];
    if let Some(at) = place.content {
        return TextEdit { text_range: at..at, text: content.to_owned() };
    }
    let tab = indent_of(text, place);
    match element.strip_suffix("/>") {
        Some(open) => {
            let name: String =
                open.chars().skip(1).take_while(|of| !of.is_whitespace() && *of != '/').collect();
            TextEdit { text_range: end - 2..end, text: format!(">{content}\n{tab}</{name}>") }
        }
        None => {
            let insert_at = start + element.rfind("</").unwrap_or(element.len());
            TextEdit { text_range: insert_at..insert_at, text: format!("{content}\n{tab}") }
        }
    }
}

/// Extends the range of an element to its whole line if the rest of the line is blank.
fn with_line(text: &str, place: &Range<usize>) -> Range<usize> {
    let before = text[..place.start].trim_end_matches([' ', '\t']);
    let is_alone = text[place.end..].trim_start_matches([' ', '\t', '\r']).starts_with('\n');
    let above = before.strip_suffix('\n').map(|above| above.strip_suffix('\r').unwrap_or(above));
    above.filter(|_| is_alone).map_or(place.clone(), |above| above.len()..place.end)
}

/// Applies the edits to the text, with its line endings.
fn apply_edits(text: &str, mut edits: Vec<TextEdit>) -> String {
    let line_end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    edits.sort_by_key(|edit| edit.text_range.start);
    let (mut out, mut at) = (String::new(), 0);
    for TextEdit { text_range: place, text: new } in edits {
        out.push_str(&text[at..place.start]);
        out.push_str(&new.replace('\n', line_end));
        at = place.end;
    }
    out.push_str(&text[at..]);
    out
}
