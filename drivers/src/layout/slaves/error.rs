//! Errors that refuse the description of a network.

use std::path::PathBuf;

use crate::ethercat::CaptureError;

/// Reason why an ENI file, or a start-up, gives no plan. Every variant names the file as the layout
/// names it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// The file is not XML, or not an ENI.
    #[error("{}: {problem}; export the ENI file of the master's configuration", file.display())]
    NotEni {
        /// The file.
        file: PathBuf,
        /// Message of the parser, with its line.
        problem: String,
    },
    /// A value of the ENI cannot be used.
    #[error("{}: line {line}, {element}: {problem}; export the ENI file anew", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// Line number, from 1.
        line: u32,
        /// The element.
        element: String,
        /// The problem.
        problem: String,
    },
    /// No such slave.
    #[error("{}: there is no slave {wanted}; it has {}; correct `slaves`, or take the file of this \
        arm", file.display(), ListedNames(.found))]
    NoSlave {
        /// The file.
        file: PathBuf,
        /// Name or address that the layout requires.
        wanted: String,
        /// Names and addresses in the file.
        found: Vec<String>,
    },
    /// The process data of a slave do not carry an object of the layout.
    #[error(
        "{}: `{key}`: the {whose} do not carry {object}; they carry {}; add it to the \
         PDO in the master's configuration, and export or record anew",
        file.display(), ListedNames(.mapped)
    )]
    NotMapped {
        /// The file.
        file: PathBuf,
        /// The key of the layout.
        key: &'static str,
        /// Inputs or outputs, and the slave.
        whose: String,
        /// The object, `6077:00`.
        object: String,
        /// The mapped objects.
        mapped: Vec<String>,
    },
    /// The start-up does not contain data that a slave needs.
    #[error(
        "{}: the capture does not hold {what} of slave {slave}; record from before the master \
         starts until the drives run, or name the ENI file in place of `startup`",
        file.display()
    )]
    NotLearnt {
        /// The file.
        file: PathBuf,
        /// The slave.
        slave: String,
        /// The missing part.
        what: String,
    },
    /// No cyclic datagram covers the process data of a slave.
    #[error(
        "{}: no cyclic datagram (LRD, LWR, LRW) goes over the {direction} of slave {slave}; \
        {remedy}",
        file.display()
    )]
    NotCyclic {
        /// The file.
        file: PathBuf,
        /// Inputs or outputs.
        direction: &'static str,
        /// The slave.
        slave: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// The expected working counter is missing.
    #[error(
        "{}: the cyclic datagram at address {address:#010X} has no expected working counter (Cnt). \
        Without it, inputs of a drive that did not answer look like good ones. Let the master \
        check working counters, and export again",
        file.display()
    )]
    NoCounter {
        /// The file.
        file: PathBuf,
        /// The logical address.
        address: u32,
    },
    /// An object cannot be read with its mapping.
    #[error("{}: {object} of slave {slave}: {problem}", file.display())]
    Object {
        /// The file.
        file: PathBuf,
        /// The slave.
        slave: String,
        /// The object.
        object: String,
        /// The problem and its remedy.
        problem: String,
    },
    /// The capture cannot be read.
    #[error("{problem}")]
    Capture {
        /// The problem, with the file and the remedy.
        problem: String,
    },
}

impl From<CaptureError> for NetworkError {
    fn from(error: CaptureError) -> Self {
        Self::Capture { problem: error.to_string() }
    }
}

struct ListedNames<'a>(&'a [String]);

impl core::fmt::Display for ListedNames<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.0.is_empty() { f.write_str("nothing") } else { f.write_str(&self.0.join(", ")) }
    }
}
