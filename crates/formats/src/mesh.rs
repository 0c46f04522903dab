//! Meshes that a URDF names: where their files are, and the points of their surfaces.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Error, ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use mesh_loader::{Loader, Scene};
use roxmltree::{Document, Node};

use crate::guarded::catch_panic;

/// Maximum size of a mesh \[bytes\]. A visual mesh of a link has some megabytes.
const MAX_MESH_BYTES: u64 = 64 << 20;

/// Error when the mesh of a link cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// No file of this name. Remedy: state the folder of the packages.
    #[error("{name}: no such file")]
    Missing {
        /// The name in the URDF.
        name: String,
    },
    /// The file cannot be read. Remedy: check its permissions and its format.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The cause.
        source: Error,
    },
    /// The file is damaged, or in a format that is not read. Remedy: save it as STL.
    #[error("{}: {problem}; save it as STL", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The problem.
        problem: String,
    },
}

impl MeshError {
    /// Returns true if no file was found.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing { .. })
    }
}

/// Folders in which the meshes of a URDF are searched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshFolders {
    /// Configured folders, then the folder of the URDF and those above it.
    folders: Vec<PathBuf>,
}

impl MeshFolders {
    /// Creates the search for the meshes of a URDF, first in these folders.
    pub fn new(urdf: &Path, packages: &[PathBuf]) -> Self {
        let file = std::path::absolute(urdf).unwrap_or_else(|_| urdf.to_path_buf());
        let above = file.ancestors().skip(1).map(Path::to_path_buf);
        Self { folders: packages.iter().cloned().chain(above).collect() }
    }

    /// Returns the file of a mesh: `package://NAME/PATH` is PATH in a folder of that name, or in
    /// one of the folders; a relative path is in one of the folders.
    fn find(&self, name: &str) -> Option<PathBuf> {
        let packaged = name.strip_prefix("package://").or_else(|| name.strip_prefix("model://"));
        let plain = name.strip_prefix("file://").unwrap_or(name);
        let inner = packaged.and_then(|path| path.split_once('/')).map(|(_, inner)| inner);
        let paths = [Some(packaged.unwrap_or(plain)), inner];
        // The folder of the package has precedence over a path without it.
        let candidates = paths
            .iter()
            .flatten()
            .flat_map(|path| self.folders.iter().map(move |folder| folder.join(path)));
        candidates.into_iter().find(|file| file.is_file())
    }

    /// Reads the points of a mesh, without repetitions, in the unit of the file.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn read_points(&self, name: &str) -> Result<Vec<[f64; 3]>, MeshError> {
        let file = self.find(name).ok_or_else(|| MeshError::Missing { name: name.to_owned() })?;
        let bytes =
            read_bounded(&file).map_err(|source| MeshError::Io { file: file.clone(), source })?;
        let unreadable = |problem: String| MeshError::Unreadable { file: file.clone(), problem };
        check_instances(&file, &bytes).map_err(|problem| unreadable(problem.to_owned()))?;
        let scene = catch_panic(
            || parse(&file, &bytes).map_err(|of| unreadable(of.to_string())),
            unreadable,
        )?;
        let points: BTreeSet<[u32; 3]> = (scene.meshes.iter())
            .flat_map(|mesh| &mesh.vertices)
            .map(|point| point.map(|of| (of + 0.0).to_bits()))
            .collect();
        let points: Vec<[f64; 3]> =
            points.into_iter().map(|of| of.map(|bits| f64::from(f32::from_bits(bits)))).collect();
        match () {
            () if points.is_empty() => Err(unreadable("it has no points".to_owned())),
            () if points.iter().flatten().any(|of| !of.is_finite()) => {
                Err(unreadable("a coordinate is no finite number".to_owned()))
            }
            () => Ok(points),
        }
    }
}

fn read_bounded(file: &Path) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    File::open(file)?.take(MAX_MESH_BYTES + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MAX_MESH_BYTES {
        true => Err(Error::other(format!("it has more than {} MB", MAX_MESH_BYTES >> 20))),
        false => Ok(bytes),
    }
}

/// Parses a mesh. Materials in other files have no effect on its points, and are not read.
fn parse(file: &Path, bytes: &[u8]) -> Result<Scene, Error> {
    let others = |_: &Path| Err(Error::from(ErrorKind::NotFound));
    Loader::default().load_from_slice_with_reader(bytes, file, others)
}

/// Refuses a COLLADA scene that the reader would place wrongly. It gives each geometry one place
/// alone, skips bodies with bones and parts by reference, and applies the unit and the outer nodes
/// before the inner ones.
fn check_instances(file: &Path, bytes: &[u8]) -> Result<(), &'static str> {
    if !file.extension().is_some_and(|of| of.eq_ignore_ascii_case("dae")) {
        return Ok(());
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return Ok(()) };
    let Ok(document) = Document::parse(text) else { return Ok(()) };
    let is_metre = |unit: Node<'_, '_>| unit.attribute("meter").is_none_or(is_one);
    let in_metres =
        document.descendants().filter(|of| of.tag_name().name() == "unit").all(is_metre);
    let mut placed = BTreeSet::new();
    for node in document.descendants() {
        match node.tag_name().name() {
            "instance_geometry" if !placed.insert(node.attribute("url")) => {
                return Err("it uses a geometry in several places, which is not read");
            }
            "instance_node" | "instance_controller" => {
                return Err("it has parts by reference, which are not read");
            }
            "node" if !in_metres && node.children().any(is_shift) => {
                return Err("it moves parts in another unit than metres, which is not read");
            }
            "node" if is_placed(node) && node.ancestors().skip(1).any(is_placed) => {
                return Err("it has moved parts in moved parts, which are not read");
            }
            _ => {}
        }
    }
    Ok(())
}

fn is_one(text: &str) -> bool {
    text.trim().parse().is_ok_and(|value: f64| (value - 1.0).abs() < f64::EPSILON)
}

/// Returns the numbers of an element; unreadable ones are NaN.
fn numbers(node: Node<'_, '_>) -> Vec<f64> {
    let words = node.text().unwrap_or_default().split_whitespace();
    words.map(|word| word.parse().unwrap_or(f64::NAN)).collect()
}

/// Returns true for an element that moves its node.
fn is_shift(node: Node<'_, '_>) -> bool {
    let numbers = numbers(node);
    match node.tag_name().name() {
        "matrix" => [3, 7, 11].iter().any(|place| numbers.get(*place) != Some(&0.0)),
        "translate" => numbers.iter().any(|number| *number != 0.0),
        _ => false,
    }
}

/// Returns true for a node that is moved, rotated or scaled.
fn is_placed(node: Node<'_, '_>) -> bool {
    node.tag_name().name() == "node" && node.children().any(is_transform)
}

fn is_transform(node: Node<'_, '_>) -> bool {
    let numbers = numbers(node);
    let is_unit = |(place, number): (usize, &f64)| {
        let expected = if place % 5 == 0 { 1.0 } else { 0.0 };
        (number - expected).abs() < f64::EPSILON
    };
    match node.tag_name().name() {
        "matrix" => !numbers.iter().enumerate().all(is_unit),
        "translate" => numbers.iter().any(|number| *number != 0.0),
        "rotate" => numbers.get(3) != Some(&0.0),
        "scale" => numbers.iter().any(|number| (number - 1.0).abs() >= f64::EPSILON),
        "lookat" | "skew" => true,
        _ => false,
    }
}
