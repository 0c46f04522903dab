//! Errors that refuse a device file.

use std::path::PathBuf;

/// Reason why an EDS or a DCF gives no plan. Every variant names the file as the layout names it;
/// lines count from 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EdsError {
    /// A line does not match the format.
    #[error("{}: line {line}: {reason}", file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// The line.
        line: usize,
        /// The problem and its correction.
        reason: String,
    },
    /// An entry has a value that cannot be used.
    #[error("{}: line {line}, [{section}] {key}: {reason}", file.display())]
    Entry {
        /// The file.
        file: PathBuf,
        /// The line.
        line: usize,
        /// The section.
        section: String,
        /// The key.
        key: String,
        /// The problem and its correction.
        reason: String,
    },
    /// A section or one of its keys is missing.
    #[error("{}: [{section}] has no {key}; {remedy}", file.display())]
    Missing {
        /// The file.
        file: PathBuf,
        /// The section.
        section: String,
        /// The missing key.
        key: &'static str,
        /// The remedy.
        remedy: &'static str,
    },
    /// No PDO carries an object of the layout.
    #[error(
        "{}: `{key}`: no {direction} of node {node} carries {object}; its {direction}s carry {}; \
         map it in the drive and in its DCF",
        file.display(), AttachedText(.mapped)
    )]
    NotMapped {
        /// The file.
        file: PathBuf,
        /// The key of the layout.
        key: &'static str,
        /// TPDO or RPDO.
        direction: &'static str,
        /// The node.
        node: u8,
        /// The object, `6064:00`.
        object: String,
        /// The mapped objects.
        mapped: Vec<String>,
    },
    /// A PDO carries the object but cannot be used.
    #[error("{}: [{section}], {pdo} of node {node}: {reason}", file.display())]
    Pdo {
        /// The file.
        file: PathBuf,
        /// The section.
        section: String,
        /// The PDO.
        pdo: String,
        /// The node.
        node: u8,
        /// The problem and its correction.
        reason: String,
    },
}

struct AttachedText<'a>(&'a [String]);

impl core::fmt::Display for AttachedText<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.0.is_empty() { f.write_str("nothing") } else { f.write_str(&self.0.join(" ")) }
    }
}
