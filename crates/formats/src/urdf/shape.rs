//! Shapes of the links of a URDF: boxes, cylinders, spheres, and meshes in other files.

use nalgebra::{IsometryMatrix3, Vector3};
use roxmltree::Node;

use super::element::{child_elements, number_or_zero, parse_origin, single_child, three_numbers};

/// Geometry of a shape, about the origin of its own frame.
#[derive(Clone, Debug, PartialEq)]
pub enum UrdfGeometry {
    /// A box.
    Box {
        /// Lengths of its sides along x, y and z \[m\].
        size_m: [f64; 3],
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius \[m\].
        radius_m: f64,
        /// Length \[m\].
        length_m: f64,
    },
    /// A sphere.
    Sphere {
        /// Radius \[m\].
        radius_m: f64,
    },
    /// A mesh in another file.
    Mesh {
        /// Its file, as the URDF names it.
        file: String,
        /// Factors of its coordinates along x, y and z \[m per unit of the file\].
        scale: [f64; 3],
    },
}

/// Shape of a link.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfShape {
    /// Name of its link in the URDF.
    pub link: String,
    /// Number of the driven joint that moves it; 0 for the base.
    pub number: usize,
    /// Its geometry.
    pub geometry: UrdfGeometry,
    /// Its frame in that of the link of the robot file. The base is link 0.
    pub pose: IsometryMatrix3<f64>,
}

/// A shape in the frame of its link, as the file has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LinkShape {
    pub(super) geometry: UrdfGeometry,
    pub(super) pose: IsometryMatrix3<f64>,
}

/// Returns the shapes of a `<link>`: those of its `<collision>` elements, or else of its
/// `<visual>` elements; `None` for one that cannot be read.
pub(super) fn link_shapes(link: Node<'_, '_>) -> Vec<Option<LinkShape>> {
    let shapes = |name| child_elements(link, name).map(parse_shape).collect::<Vec<_>>();
    let collisions = shapes("collision");
    if collisions.is_empty() { shapes("visual") } else { collisions }
}

/// Returns the shape of a `<collision>` or `<visual>`; `None` if it cannot be read.
pub(super) fn parse_shape(node: Node<'_, '_>) -> Option<LinkShape> {
    let geometry = single_child(node, "geometry").ok()??;
    let shape = |name| single_child(geometry, name).ok().flatten();
    let size = |node: Node<'_, '_>, name| number_or_zero(node, name).ok().filter(|of| *of > 0.0);
    let geometry = if let Some(ball) = shape("sphere") {
        UrdfGeometry::Sphere { radius_m: size(ball, "radius")? }
    } else if let Some(rod) = shape("cylinder") {
        UrdfGeometry::Cylinder { radius_m: size(rod, "radius")?, length_m: size(rod, "length")? }
    } else if let Some(mesh) = shape("mesh") {
        let scale = three_numbers(mesh, "scale").ok()?.unwrap_or(Vector3::repeat(1.0));
        let file = mesh.attribute("filename")?.trim();
        (!file.is_empty() && scale.iter().all(|of| *of != 0.0))
            .then(|| UrdfGeometry::Mesh { file: file.to_owned(), scale: scale.into() })?
    } else {
        let sides = three_numbers(shape("box")?, "size").ok()?.filter(|sides| sides.min() > 0.0)?;
        UrdfGeometry::Box { size_m: sides.into() }
    };
    Some(LinkShape { geometry, pose: parse_origin(node).ok()? })
}
