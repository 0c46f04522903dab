//! Elements of a URDF and their values.

use core::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use nalgebra::{IsometryMatrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::error::UrdfError;
use super::limits::UrdfLimits;
use super::note::{UnreadAttribute, UrdfNote};

/// The elements that are read, with those of their attributes that have a meaning.
const READ_ATTRIBUTES: [(&str, &str); 13] = [
    ("robot", "name version"),
    ("link", "name type"),
    ("inertial", ""),
    ("mass", "value"),
    ("inertia", "ixx ixy ixz iyy iyz izz"),
    ("joint", "name type"),
    ("origin", "xyz rpy quat_xyzw"),
    ("parent", "link"),
    ("child", "link"),
    ("axis", "xyz"),
    ("limit", "lower upper velocity effort"),
    ("dynamics", "damping friction"),
    ("mimic", "joint multiplier offset"),
];

pub(super) fn line(node: Node<'_, '_>) -> usize {
    node.document().text_pos_at(node.range().start).row as usize
}

pub(super) fn child_elements<'a, 'i>(
    node: Node<'a, 'i>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'i>> {
    let namespace = node.document().root_element().default_namespace();
    node.children().filter(move |child: &Node<'a, 'i>| {
        let tag = child.tag_name();
        child.is_element() && tag.name() == name && tag.namespace() == namespace
    })
}

/// Returns the single child of a name, if there is one.
pub(super) fn single_child<'a, 'i>(
    node: Node<'a, 'i>,
    name: &'static str,
) -> Result<Option<Node<'a, 'i>>, UrdfError> {
    let mut elements = child_elements(node, name);
    let first = elements.next();
    match elements.next() {
        Some(second) => {
            let problem = format!("<{name}> of <{}>", node.tag_name().name());
            Err(UrdfError::Twice { what: problem, line: line(second) })
        }
        None => Ok(first),
    }
}

pub(super) fn required_child<'a, 'i>(
    node: Node<'a, 'i>,
    name: &'static str,
) -> Result<Node<'a, 'i>, UrdfError> {
    let element = node.tag_name().name().to_owned();
    let missing = || UrdfError::Missing { element, what: name, line: line(node) };
    single_child(node, name)?.ok_or_else(missing)
}

pub(super) fn required_attribute<'a>(
    node: Node<'a, '_>,
    name: &'static str,
) -> Result<&'a str, UrdfError> {
    let element = node.tag_name().name().to_owned();
    let missing = || UrdfError::Missing { element, what: name, line: line(node) };
    node.attribute(name).ok_or_else(missing)
}

pub(super) fn name_attribute(node: Node<'_, '_>) -> Result<String, UrdfError> {
    required_attribute(node, "name").map(str::to_owned)
}

pub(super) fn number_of(
    node: Node<'_, '_>,
    attribute: &'static str,
    text: &str,
    expected: &'static str,
) -> Result<f64, UrdfError> {
    let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let wrong =
        || UrdfError::Number { text: text.to_owned(), attribute, expected, line: line(node) };
    number.ok_or_else(wrong)
}

/// Returns a number, or 0 if it is missing.
pub(super) fn number_or_zero(node: Node<'_, '_>, name: &'static str) -> Result<f64, UrdfError> {
    node.attribute(name).map_or(Ok(0.0), |text| number_of(node, name, text, "a number"))
}

/// Returns numbers, if they are given.
fn numbers<const N: usize>(
    node: Node<'_, '_>,
    name: &'static str,
    expected: &'static str,
) -> Result<Option<[f64; N]>, UrdfError> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    let values: Vec<f64> = text
        .split_whitespace()
        .map(|part| number_of(node, name, part, expected))
        .collect::<Result<_, _>>()?;
    let wrong = |_| UrdfError::Number {
        text: text.to_owned(),
        attribute: name,
        expected,
        line: line(node),
    };
    values.try_into().map(Some).map_err(wrong)
}

/// Returns three numbers, if they are given.
pub(super) fn three_numbers(
    node: Node<'_, '_>,
    name: &'static str,
) -> Result<Option<Vector3<f64>>, UrdfError> {
    Ok(numbers(node, name, "three numbers")?.map(|xyz: [f64; 3]| xyz.into()))
}

/// Returns the exact quarter turn of a printed one: 1.5708 and 3.1416.
fn quarter_turn(angle_rad: f64) -> f64 {
    let quarter = FRAC_PI_2 * (angle_rad / FRAC_PI_2).round();
    if (angle_rad - quarter).abs() < UrdfLimits::DEFAULT.printed_angle_rad {
        quarter
    } else {
        angle_rad
    }
}

/// Roll, pitch and yaw are about fixed axes: R = Rz Ry Rx. Version 1.1 has quaternions, too.
pub(super) fn parse_origin(node: Node<'_, '_>) -> Result<IsometryMatrix3<f64>, UrdfError> {
    let Some(origin) = single_child(node, "origin")? else {
        return Ok(IsometryMatrix3::identity());
    };
    let place = three_numbers(origin, "xyz")?.unwrap_or_default();
    let rotation = match (three_numbers(origin, "rpy")?, quaternion(origin)?) {
        (Some(_), Some(_)) => {
            let what = "the rotation of <origin> (`rpy` and `quat_xyzw`)".to_owned();
            return Err(UrdfError::Twice { what, line: line(origin) });
        }
        (None, Some(rotation)) => rotation.to_rotation_matrix(),
        (angles, None) => {
            let angles = angles.unwrap_or_default().map(quarter_turn);
            Rotation3::from_euler_angles(angles.x, angles.y, angles.z)
        }
    };
    Ok(IsometryMatrix3::from_parts(Translation3::from(place), rotation))
}

/// Returns an angle of the `<origin>` that has too few digits to be a quarter turn, such as 3.14.
pub(super) fn rough_quarter_turn(node: Node<'_, '_>) -> Option<String> {
    let rpy = single_child(node, "origin").ok()??.attribute("rpy")?;
    rpy.split_whitespace().find(|text| is_rough_quarter_turn(text)).map(str::to_owned)
}

/// Returns true for a number beyond `most_rad` that is whole, as degrees are and radians are not.
pub(super) fn is_whole_degrees(value: f64, most_rad: f64) -> bool {
    value.abs() > most_rad && value.fract() == 0.0
}

/// Returns an angle of the `<origin>` that looks like degrees, such as 90.
pub(super) fn angle_in_degrees(node: Node<'_, '_>) -> Option<String> {
    let rpy = single_child(node, "origin").ok()??.attribute("rpy")?;
    let most_rad = UrdfLimits::DEFAULT.whole_degrees_rad;
    let is_degrees =
        |text: &&str| text.parse().is_ok_and(|angle| is_whole_degrees(angle, most_rad));
    rpy.split_whitespace().find(is_degrees).map(str::to_owned)
}

fn is_rough_quarter_turn(text: &str) -> bool {
    let angle: f64 = text.parse().unwrap_or_default();
    let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let quarter = FRAC_PI_2 * (angle / FRAC_PI_2).round();
    let range = UrdfLimits::DEFAULT.printed_angle_rad..UrdfLimits::DEFAULT.rough_angle_rad;
    let is_close = quarter != 0.0 && range.contains(&(angle - quarter).abs());
    is_close && decimals <= UrdfLimits::DEFAULT.rough_decimals
}

/// Returns the quaternion of an `<origin>`, if it has one. Printed quarter turns are exact ones.
fn quaternion(origin: Node<'_, '_>) -> Result<Option<UnitQuaternion<f64>>, UrdfError> {
    let (attribute, expected) = ("quat_xyzw", "a quaternion of length 1");
    let Some(xyzw) = numbers::<4>(origin, attribute, expected)? else { return Ok(None) };
    let printed = Quaternion::from(xyzw);
    if (printed.norm() - 1.0).abs() > UrdfLimits::DEFAULT.quaternion_length {
        let text = origin.attribute(attribute).unwrap_or_default().to_owned();
        return Err(UrdfError::Number { text, attribute, expected, line: line(origin) });
    }
    Ok(Some(UnitQuaternion::from_quaternion(Quaternion::from(xyzw.map(exact_entry)))))
}

/// Returns the exact entry of a quaternion of quarter turns for a printed one.
fn exact_entry(entry: f64) -> f64 {
    let sizes = [0.0, 0.5, FRAC_1_SQRT_2];
    let close = |size: &f64| (entry.abs() - size).abs() < UrdfLimits::DEFAULT.printed_angle_rad;
    sizes.into_iter().find(close).map_or(entry, |size| size.copysign(entry))
}

/// Returns notes on the attributes that are not read, of the elements that the arm is read from.
/// An element of another name, and an attribute with a prefix, belong to other tools.
pub(super) fn unread_attributes(root: Node<'_, '_>) -> Vec<UrdfNote> {
    let mut unread: Vec<UnreadAttribute> = Vec::new();
    let links = child_elements(root, "link").flat_map(|link| {
        let inertials = child_elements(link, "inertial");
        core::iter::once(link).chain(inertials.flat_map(|node| node.descendants()))
    });
    let joints = child_elements(root, "joint")
        .flat_map(|joint| core::iter::once(joint).chain(joint.children().filter(Node::is_element)));
    for node in core::iter::once(root).chain(links).chain(joints) {
        let element = node.tag_name().name();
        let Some((_, read)) = READ_ATTRIBUTES.iter().find(|(name, _)| *name == element) else {
            continue;
        };
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            let name = attribute.name();
            if read.split(' ').any(|other| other == name) {
                continue;
            }
            let same =
                |other: &&mut UnreadAttribute| other.element == element && other.attribute == name;
            match unread.iter_mut().find(same) {
                Some(first) => first.places += 1,
                None => unread.push(UnreadAttribute {
                    element: element.to_owned(),
                    attribute: name.to_owned(),
                    line: line(node),
                    places: 1,
                }),
            }
        }
    }
    unread.into_iter().map(UrdfNote::UnreadAttribute).collect()
}
