//! Errors that refuse a device file.

use std::path::PathBuf;

/// Reason why an EDS or a DCF cannot be compiled to a plan. Every variant names the file as the
/// layout names it. Lines count from 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EdsError {
    /// A line does not match the format.
    #[error("{}: line {line}: {reason}", file.display())]
    Line {
        /// Path of the device file.
        file: PathBuf,
        /// Line number in the file.
        line: usize,
        /// Problem with the line, and its correction.
        reason: String,
    },
    /// An entry has a value that cannot be used.
    #[error("{}: line {line}, [{section}] {key}: {reason}", file.display())]
    Entry {
        /// Path of the device file.
        file: PathBuf,
        /// Line number in the file.
        line: usize,
        /// Section of the entry.
        section: String,
        /// Key of the entry.
        key: String,
        /// Problem with the value, and its correction.
        reason: String,
    },
    /// A section or one of its keys is missing.
    #[error("{}: [{section}] has no {key}; {remedy}", file.display())]
    Missing {
        /// Path of the device file.
        file: PathBuf,
        /// The missing section, or the section of the missing key.
        section: String,
        /// The missing key.
        key: &'static str,
        /// Remedy for the missing entry.
        remedy: &'static str,
    },
    /// No PDO carries an object of the layout.
    #[error(
        "{}: `{key}`: no {direction} of node {node} carries {object}; its {direction}s carry {}; \
         map it in the drive and in its DCF",
        file.display(), AttachedText(.mapped)
    )]
    NotMapped {
        /// Path of the device file.
        file: PathBuf,
        /// Key of the layout that names the object.
        key: &'static str,
        /// Kind of PDO: TPDO or RPDO.
        direction: &'static str,
        /// Number of the node.
        node: u8,
        /// Name of the object, such as `6064:00`.
        object: String,
        /// Objects that the PDOs of this kind carry.
        mapped: Vec<String>,
    },
    /// A PDO carries the object but cannot be used.
    #[error("{}: [{section}], {pdo} of node {node}: {reason}", file.display())]
    Pdo {
        /// Path of the device file.
        file: PathBuf,
        /// Section of the device file with the problem.
        section: String,
        /// Name of the PDO.
        pdo: String,
        /// Number of the node.
        node: u8,
        /// Problem with the PDO, and its correction.
        reason: String,
    },
}

struct AttachedText<'a>(&'a [String]);

impl core::fmt::Display for AttachedText<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.0.is_empty() { f.write_str("nothing") } else { f.write_str(&self.0.join(" ")) }
    }
}
