//! Links and joints of a URDF file, strictly read.

use core::ops::Range;

use didim_identification::feasibility::Body as LinkBody;
use nalgebra::{IsometryMatrix3, Matrix3, Point3, SymmetricEigen, Vector3};
use roxmltree::{Document, Error as XmlError, Node};

use super::element::{
    angle_in_degrees, child_elements, line, name_attribute, number_of, number_or_zero,
    parse_origin, required_attribute, required_child, rough_quarter_turn, single_child,
    three_numbers, unread_attributes,
};
use super::error::UrdfError;
use super::limits::UrdfLimits;
use super::note::UrdfNote;
use super::shape::{LinkShape, UrdfGeometry, link_shapes, parse_shape};

/// Maximum number of links and of joints.
pub(super) const MAX_LINKS: usize = 1000;
/// Prefix of macros, and part of the name of their namespace.
const XACRO: &str = "xacro";

pub(super) struct UrdfFile {
    pub(super) name: String,
    pub(super) element: ElementPlace,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<FileJoint>,
    /// Notes on the file.
    pub(super) notes: Vec<UrdfNote>,
}

pub(super) struct Link {
    pub(super) name: String,
    pub(super) body: Inertial,
    /// Angle of its `<inertial>` that looks like degrees, if any.
    pub(super) body_angle_in_degrees: Option<String>,
    pub(super) element: ElementPlace,
    /// Place of its `<inertial>`.
    pub(super) inertial_range: Option<Range<usize>>,
    /// Capsules about its collision shapes, in the link's frame.
    pub(super) capsules: Vec<CollisionCapsule>,
    /// Its shapes: those for collisions, or else the visible ones; `None` for one that cannot be
    /// read.
    pub(super) shapes: Vec<Option<LinkShape>>,
}

/// A capsule about a shape: all points within a radius of a segment \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CollisionCapsule {
    pub(super) end_points: [Point3<f64>; 2],
    pub(super) radius_m: f64,
}

impl CollisionCapsule {
    /// Converts it to the frame in which its own frame has this pose.
    pub(super) fn seen_from(&self, pose: &IsometryMatrix3<f64>) -> Self {
        Self { end_points: self.end_points.map(|end| pose * end), ..*self }
    }
}

/// Place of an element in the text \[bytes\].
pub(super) struct ElementPlace {
    pub(super) range: Range<usize>,
    /// Beginning of its first content, if any.
    pub(super) content: Option<usize>,
}

/// Places of `<dynamics>` and the values of its attributes.
pub(super) struct DynamicsPlace {
    pub(super) range: Range<usize>,
    pub(super) damping: Option<Range<usize>>,
    pub(super) friction: Option<Range<usize>>,
}

/// Body of a link in the file.
pub(super) enum Inertial {
    /// The link has no `<inertial>`.
    Missing,
    /// An impossible body, and why.
    Impossible(String),
    /// A body, in the frame of the link.
    Body(Body),
}

/// A rigid body: mass, centre of mass, and inertia about that.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Body {
    pub(crate) mass_kg: f64,
    pub(crate) centre_m: Vector3<f64>,
    pub(crate) inertia_kg_m2: Matrix3<f64>,
}

pub(super) struct FileJoint {
    pub(super) name: String,
    pub(super) line: usize,
    pub(super) kind: JointType,
    /// Indices of the links.
    pub(super) parent: usize,
    pub(super) child: usize,
    /// The joint's frame in that of its parent.
    pub(super) origin: IsometryMatrix3<f64>,
    /// Angle of the origin that is printed with too few digits, if any.
    pub(super) rough_angle: Option<String>,
    /// Angle of the origin that looks like degrees, if any.
    pub(super) angle_in_degrees: Option<String>,
    /// Largest entry of the axis that was taken for 0, and the axis in the file.
    pub(super) cleaned_axis: Option<(f64, String)>,
    /// In the joint's frame, of length 1.
    pub(super) axis: Vector3<f64>,
    pub(super) limit: Option<FileLimit>,
    /// Viscous and Coulomb friction, where the file has them.
    pub(super) friction: Option<[f64; 2]>,
    /// The joint that it follows.
    pub(super) mimicked_joint: Option<String>,
    pub(super) element: ElementPlace,
    pub(super) dynamics: Option<DynamicsPlace>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JointType {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    Floating,
    Planar,
}

/// Limits as written in the file; missing values are 0.
#[derive(Clone, Copy)]
pub(super) struct FileLimit {
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) velocity: f64,
    pub(super) effort: f64,
}

impl Body {
    /// Converts a body about the origin of a link's frame; `None` without mass.
    pub(crate) fn about_centre(body: &LinkBody) -> Option<Self> {
        Some(Self {
            mass_kg: body.mass_kg,
            centre_m: body.centre_of_mass_m()?,
            inertia_kg_m2: body.inertia_about_centre()?,
        })
    }

    /// Writes it as an `<inertial>` on a line that begins with `tab`.
    pub(crate) fn inertial_element(&self, tab: &str) -> String {
        let [x, y, z]: [f64; 3] = self.centre_m.into();
        let j = |row, column| self.inertia_kg_m2[(row, column)];
        format!(
            "<inertial>\n{tab}  <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"0 0 0\"/>\n{tab}  <mass \
             value=\"{:?}\"/>\n\
             {tab}  <inertia ixx=\"{:?}\" ixy=\"{:?}\" ixz=\"{:?}\" iyy=\"{:?}\" iyz=\"{:?}\" \
             izz=\"{:?}\"/>\n{tab}</inertial>",
            self.mass_kg,
            j(0, 0),
            j(0, 1),
            j(0, 2),
            j(1, 1),
            j(1, 2),
            j(2, 2),
        )
    }

    /// Seen from the frame in which this one's has the pose.
    pub(super) fn seen_from(&self, pose: &IsometryMatrix3<f64>) -> Self {
        let rotation = pose.rotation;
        Self {
            mass_kg: self.mass_kg,
            centre_m: (pose * Point3::from(self.centre_m)).coords,
            inertia_kg_m2: rotation * self.inertia_kg_m2 * rotation.transpose(),
        }
    }

    /// Returns why no mass distribution is possible, if so.
    fn impossibility(&self) -> Option<String> {
        let moments = SymmetricEigen::new(self.inertia_kg_m2).eigenvalues;
        let (least, largest) = (moments.min(), moments.max());
        match () {
            () if self.mass_kg < 0.0 => Some(format!("a mass of {} kg", self.mass_kg)),
            () if least < -UrdfLimits::DEFAULT.triangle_excess * largest.abs() => {
                Some("an inertia that is not positive definite".to_owned())
            }
            () if 2.0 * largest > (1.0 + UrdfLimits::DEFAULT.triangle_excess) * moments.sum() => {
                Some(
                    "a principal moment of inertia larger than the sum of the two others"
                        .to_owned(),
                )
            }
            () if self.mass_kg == 0.0 && largest > 0.0 => {
                Some("an inertia without a mass".to_owned())
            }
            () => None,
        }
    }
}

impl Link {
    fn read(node: Node<'_, '_>, name: String) -> Result<Self, UrdfError> {
        let inertial = single_child(node, "inertial")?;
        let capsules = child_elements(node, "collision").filter_map(collision_capsule);
        Ok(Self {
            name,
            body: parse_inertial(node)?,
            body_angle_in_degrees: inertial.and_then(angle_in_degrees),
            element: element_place(node),
            inertial_range: inertial.map(|inertial| inertial.range()),
            capsules: capsules.collect(),
            shapes: link_shapes(node),
        })
    }
}

impl UrdfFile {
    pub(super) fn read(text: &str) -> Result<Self, UrdfError> {
        let document = Document::parse(text).map_err(|error| match error {
            // Without its name space it is not valid XML.
            XmlError::UnknownNamespace(prefix, at) if prefix == XACRO => {
                UrdfError::Xacro { what: "<xacro:…>".to_owned(), line: at.row as usize }
            }
            XmlError::DtdDetected => UrdfError::DocumentType,
            XmlError::NoRootNode if !text.contains('<') => UrdfError::Empty,
            other => UrdfError::Xml { problem: other.to_string() },
        })?;
        let root = document.root_element();
        if root.tag_name().name() != "robot" {
            let tag = root.tag_name().name().to_owned();
            return Err(UrdfError::NotARobot { found: tag, line: line(root) });
        }
        // A file that xacro has expanded may keep the name space.
        let is_macro = |node: &Node<'_, '_>| {
            let uri = node.tag_name().namespace();
            uri != node.default_namespace() && uri.is_some_and(|uri| uri.contains(XACRO))
        };
        if let Some(macros) = root.descendants().find(is_macro) {
            let problem = format!("<xacro:{}>", macros.tag_name().name());
            return Err(UrdfError::Xacro { what: problem, line: line(macros) });
        }
        // Xacro expressions may remain even if the elements that define them do not.
        let replaced = root.descendants().find_map(|node| {
            let values = node.attributes().map(|attribute| attribute.value());
            let mut expressions =
                values.filter(|value| value.contains("${") || value.contains("$("));
            expressions.next().map(|value| (node, value.to_owned()))
        });
        if let Some((node, what)) = replaced {
            return Err(UrdfError::Xacro { what, line: line(node) });
        }
        let name = root.attribute("name").filter(|name| !name.trim().is_empty());
        let missing = |what| UrdfError::Missing { element: "robot".into(), what, line: line(root) };
        let name = name.ok_or_else(|| missing("name"))?;
        let mut links: Vec<Link> = Vec::new();
        for node in child_elements(root, "link") {
            if links.len() == MAX_LINKS {
                return Err(UrdfError::TooLarge { line: line(node) });
            }
            let name = name_attribute(node)?;
            if links.iter().any(|link| link.name == name) {
                return Err(UrdfError::Twice {
                    what: format!("the link `{name}`"),
                    line: line(node),
                });
            }
            links.push(Link::read(node, name)?);
        }
        if links.is_empty() {
            return Err(missing("link"));
        }
        let mut joints: Vec<FileJoint> = Vec::new();
        for node in child_elements(root, "joint") {
            if joints.len() == MAX_LINKS {
                return Err(UrdfError::TooLarge { line: line(node) });
            }
            let joint = joint(node, &links)?;
            if joints.iter().any(|other| other.name == joint.name) {
                let problem = format!("the joint `{}`", joint.name);
                return Err(UrdfError::Twice { what: problem, line: joint.line });
            }
            joints.push(joint);
        }
        let (name, notes) = (name.to_owned(), unread_attributes(root));
        Ok(Self { name, element: element_place(root), links, joints, notes })
    }

    /// Returns the names of its links, for an error.
    pub(super) fn links_text(&self) -> String {
        self.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>().join(" ")
    }
}

fn element_place(node: Node<'_, '_>) -> ElementPlace {
    ElementPlace {
        range: node.range(),
        content: node.first_child().map(|first| first.range().start),
    }
}

/// Returns the capsule about a `<collision>`; `None` for a mesh or no shape: no identification
/// needs it.
fn collision_capsule(collision: Node<'_, '_>) -> Option<CollisionCapsule> {
    let LinkShape { geometry, pose } = parse_shape(collision)?;
    let (half, radius_m) = match geometry {
        UrdfGeometry::Sphere { radius_m } => (Vector3::zeros(), radius_m),
        UrdfGeometry::Cylinder { radius_m, length_m } => (Vector3::z() * 0.5 * length_m, radius_m),
        UrdfGeometry::Box { size_m } => {
            // The segment is along the longest side, through the middle of the others.
            let sides = Vector3::from(size_m);
            let (longest, length) = sides.argmax();
            let mut half = Vector3::zeros();
            half[longest] = 0.5 * length;
            (half, 0.5 * (sides - 2.0 * half).norm())
        }
        UrdfGeometry::Mesh { .. } => return None,
    };
    let capsule =
        CollisionCapsule { end_points: [Point3::from(-half), Point3::from(half)], radius_m };
    Some(capsule.seen_from(&pose))
}

fn parse_inertial(link: Node<'_, '_>) -> Result<Inertial, UrdfError> {
    let Some(node) = single_child(link, "inertial")? else { return Ok(Inertial::Missing) };
    let Some(mass) = single_child(node, "mass")? else {
        return Ok(Inertial::Impossible("no mass".to_owned()));
    };
    let mass_kg = number_of(mass, "value", required_attribute(mass, "value")?, "a number")?;
    let Some(tensor) = single_child(node, "inertia")? else {
        return Ok(Inertial::Impossible("no inertia".to_owned()));
    };
    let mut entries = [0.0; 6];
    for (entry, name) in entries.iter_mut().zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]) {
        // Some readers take a missing entry for 0 and drop the complete inertia.
        let Some(text) = tensor.attribute(name) else {
            return Ok(Inertial::Impossible(format!("no {name}")));
        };
        *entry = number_of(tensor, name, text, "a number")?;
    }
    let [xx, xy, xz, yy, yz, zz] = entries;
    let body = Body {
        mass_kg,
        centre_m: Vector3::zeros(),
        inertia_kg_m2: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
    };
    Ok(match body.impossibility() {
        Some(problem) => Inertial::Impossible(problem),
        None => Inertial::Body(body.seen_from(&parse_origin(node)?)),
    })
}

/// Takes entries that rounding left for 0. Returns the axis of length 1, and the largest of them.
fn clean_axis(axis: Vector3<f64>) -> (Vector3<f64>, f64) {
    let is_rounding = |entry: f64| entry.abs() < UrdfLimits::DEFAULT.zero_axis_entry;
    let left_out = axis.iter().copied().filter(|entry| is_rounding(*entry));
    let largest = left_out.fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    if largest == 0.0 {
        return (axis, largest);
    }
    (axis.map(|entry| if is_rounding(entry) { 0.0 } else { entry }).normalize(), largest)
}

fn joint(node: Node<'_, '_>, links: &[Link]) -> Result<FileJoint, UrdfError> {
    let (name, line) = (name_attribute(node)?, line(node));
    let kind = match required_attribute(node, "type")? {
        "revolute" => JointType::Revolute,
        "continuous" => JointType::Continuous,
        "prismatic" => JointType::Prismatic,
        "fixed" => JointType::Fixed,
        "floating" => JointType::Floating,
        "planar" => JointType::Planar,
        other => {
            return Err(UrdfError::UnknownType { joint: name, found: other.to_owned(), line });
        }
    };
    let link = |end: &'static str| -> Result<usize, UrdfError> {
        let wanted = required_attribute(required_child(node, end)?, "link")?;
        let unknown = || UrdfError::UnknownLink {
            joint: name.clone(),
            link: wanted.to_owned(),
            available: links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>().join(" "),
            line,
        };
        links.iter().position(|link| link.name == wanted).ok_or_else(unknown)
    };
    let (parent, child_link) = (link("parent")?, link("child")?);
    // Exporters write a zero axis for joints that do not move.
    let moving = Some(node).filter(|_| kind != JointType::Fixed);
    let part = |name: &'static str| moving.map_or(Ok(None), |node| single_child(node, name));
    let axis = part("axis")?.map(|axis| Ok((three_numbers(axis, "xyz")?, axis.attribute("xyz"))));
    let (configured, text) = axis.transpose()?.unwrap_or_default();
    let axis = configured.unwrap_or_else(Vector3::x);
    let largest = axis.amax();
    let text = text.unwrap_or_default().to_owned();
    if largest == 0.0 {
        return Err(UrdfError::ZeroAxis { joint: name, text, line });
    }
    let (axis, left_out) = clean_axis((axis / largest).normalize());
    let is_noted = left_out > UrdfLimits::DEFAULT.noted_angle_rad;
    let limit = part("limit")?
        .map(|limit| {
            Ok(FileLimit {
                lower: number_or_zero(limit, "lower")?,
                upper: number_or_zero(limit, "upper")?,
                velocity: number_or_zero(limit, "velocity")?,
                effort: number_or_zero(limit, "effort")?,
            })
        })
        .transpose()?;
    let friction = part("dynamics")?
        .map(|dynamics| {
            Ok([number_or_zero(dynamics, "damping")?, number_or_zero(dynamics, "friction")?])
        })
        .transpose()?;
    let dynamics = part("dynamics")?.map(|dynamics| {
        let value = |name| Some(dynamics.attribute_node(name)?.range_value());
        let [damping, friction] = [value("damping"), value("friction")];
        DynamicsPlace { range: dynamics.range(), damping, friction }
    });
    let mimics = part("mimic")?.map(|mimic| required_attribute(mimic, "joint").map(str::to_owned));
    Ok(FileJoint {
        origin: parse_origin(node)?,
        rough_angle: rough_quarter_turn(node),
        angle_in_degrees: angle_in_degrees(node),
        cleaned_axis: is_noted.then_some((left_out, text)),
        mimicked_joint: mimics.transpose()?,
        name,
        line,
        kind,
        parent,
        child: child_link,
        axis,
        limit,
        friction,
        element: element_place(node),
        dynamics,
    })
}
