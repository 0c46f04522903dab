//! Errors that refuse the description of a network.

use std::path::PathBuf;

use crate::ethercat::CaptureError;

/// Reason why an ENI file, or a capture of the start-up, cannot be compiled to a plan. Every
/// variant names the file as the layout names it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// The file is not XML, or it is not an ENI file.
    #[error("{}: {problem}; export the ENI file of the master's configuration", file.display())]
    NotEni {
        /// Path of the file.
        file: PathBuf,
        /// Message of the parser, with the line.
        problem: String,
    },
    /// A value of the ENI cannot be used.
    #[error("{}: line {line}, {element}: {problem}; export the ENI file anew", file.display())]
    Value {
        /// Path of the file.
        file: PathBuf,
        /// Line number, from 1.
        line: u32,
        /// Name of the element.
        element: String,
        /// Problem with the value.
        problem: String,
    },
    /// The network has no slave with this name or address.
    #[error("{}: there is no slave {wanted}; it has {}; correct `slaves`, or take the file of this \
        arm", file.display(), ListedNames(.found))]
    NoSlave {
        /// Path of the file.
        file: PathBuf,
        /// Name or address that the layout requires.
        wanted: String,
        /// Names and addresses in the file.
        found: Vec<String>,
    },
    /// The capture does not show how a master configures slaves.
    #[error("{}: no master configures a slave in this capture; record from before the master \
        starts, or name its ENI file with `eni` in place of `startup`", file.display())]
    NoStartup {
        /// Path of the file.
        file: PathBuf,
    },
    /// The process data of a slave do not carry an object of the layout.
    #[error(
        "{}: `{key}`: the {whose} do not carry {object}; they carry {}; add it to the \
         PDO in the master's configuration, and export or record anew",
        file.display(), ListedNames(.mapped)
    )]
    NotMapped {
        /// Path of the file.
        file: PathBuf,
        /// Key of the layout that names the object.
        key: &'static str,
        /// Inputs or outputs, with the name of the slave.
        whose: String,
        /// Name of the object, such as `6077:00`.
        object: String,
        /// Objects that these process data carry.
        mapped: Vec<String>,
    },
    /// The capture of the start-up does not contain data that a slave needs.
    #[error(
        "{}: the capture does not hold {what} of slave {slave}; record from before the master \
         starts until the drives run, or name the ENI file in place of `startup`",
        file.display()
    )]
    NotLearnt {
        /// Path of the file.
        file: PathBuf,
        /// Name or address of the slave.
        slave: String,
        /// Data that are missing.
        what: String,
    },
    /// No cyclic datagram covers the process data of a slave.
    #[error(
        "{}: no cyclic datagram (LRD, LWR, LRW) goes over the {direction} of slave {slave}; \
        {remedy}",
        file.display()
    )]
    NotCyclic {
        /// Path of the file.
        file: PathBuf,
        /// Direction of the process data: inputs or outputs.
        direction: &'static str,
        /// Name or address of the slave.
        slave: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// The ENI file does not contain the expected working counter of a cyclic datagram.
    #[error(
        "{}: the cyclic datagram at address {address:#010X} has no expected working counter (Cnt). \
        Without it, inputs of a drive that did not answer look like good ones. Let the master \
        check working counters, and export again",
        file.display()
    )]
    NoCounter {
        /// Path of the file.
        file: PathBuf,
        /// Logical address of the datagram.
        address: u32,
    },
    /// An object cannot be read as it is mapped.
    #[error("{}: {object} of slave {slave}: {problem}", file.display())]
    Object {
        /// Path of the file.
        file: PathBuf,
        /// Name or address of the slave.
        slave: String,
        /// Name of the object.
        object: String,
        /// Problem with the object, and its remedy.
        problem: String,
    },
    /// The capture cannot be read.
    #[error("{problem}")]
    Capture {
        /// Problem with the capture, with the file and the remedy.
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
