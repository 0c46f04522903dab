//! Faults of a bag.

use std::path::PathBuf;

use crate::uniform::TimesError;

/// Reason why a bag cannot be read as a measurement. Every variant names the file; times are those
/// of the messages \[s\].
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The file cannot be opened or read: check the path and its permissions.
    #[error("{}: {source}; check the path and the permissions", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Neither MCAP nor SQLite, damaged or too long a record. Record or convert it again.
    #[error(
        "{}: {problem}; is it a bag, and whole? `ros2 bag convert` writes others anew",
        file.display()
    )]
    Format {
        /// The file.
        file: PathBuf,
        /// Error of the reader.
        problem: String,
    },
    /// A bag in SQLite, and a build without the feature `sqlite`: take the package, or build with
    /// it.
    #[error(
        "{}: a bag in SQLite. The Debian package reads it, and so does a build with `cargo build \
        --release --features sqlite`. Or convert it: `ros2 bag convert` to the storage mcap",
        file.display()
    )]
    Sqlite {
        /// The file.
        file: PathBuf,
    },
    /// A folder without a bag.
    #[error("{}: there is no .mcap or .db3 file in it; give a bag", folder.display())]
    NoFile {
        /// The folder.
        folder: PathBuf,
    },
    /// A split bag without one of its files.
    #[error("{}: file number {expected} of the split bag is missing; copy it whole, or give one of \
        its files", folder.display())]
    FileMissing {
        /// The folder.
        folder: PathBuf,
        /// The number.
        expected: u64,
    },
    /// A message is no JointState, although its type says so.
    #[error("{}: message {number} of {topic} is malformed; record it again", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Its number in the topic, from 1.
        number: usize,
    },
    /// No topic has all these joints in one message.
    #[error(
        "{}: no topic has all of the joints {wanted} in its messages; found {found}",
        file.display()
    )]
    NoTopic {
        /// The file.
        file: PathBuf,
        /// The requested joints.
        wanted: String,
        /// Topics of joint states, with their joints.
        found: String,
    },
    /// Several topics have these joints. Name one.
    #[error(
        "{}: several topics have these joints: {topics}; name one as `topic` in [data.bag]",
        file.display()
    )]
    Topics {
        /// The file.
        file: PathBuf,
        /// The topics.
        topics: String,
    },
    /// No message has positions or efforts.
    #[error("{}: none of {messages} messages on {topic} has positions and efforts of all joints, \
        and the first has no {what} of joint {joint}. Simulated drives and those without a torque \
        or a current leave `effort` empty or NaN: nothing can be identified without it. Record \
        what the drives themselves tell, as `topic` in [data.bag] where it is another one",
        file.display()
    )]
    Missing {
        /// The file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Number of messages.
        messages: usize,
        /// The joint's name.
        joint: String,
        /// `position` or `effort`.
        what: &'static str,
    },
    /// Two publishers send different states of a joint alternately.
    #[error("{}: joint {joint} on {topic} jumps to and fro in {jumps} of {messages} messages: two \
        publishers send different states of it, as a joint_state_publisher next to the drives \
        does. Record with one of them alone, or name the `topic` that is of the drives in \
        [data.bag]", file.display())]
    TwoPublishers {
        /// The file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// The joint's name.
        joint: String,
        /// Number of jumps.
        jumps: usize,
        /// Number of messages.
        messages: usize,
    },
    /// Messages with efforts and messages without alternate: two publishers.
    #[error("{}: {without_effort} of {messages} messages on {topic} have no effort, and \
        alternate with others. Two publishers send on this topic, as a joint_state_publisher \
        next to the drives does. Record with one of them alone, or name the `topic` that is of \
        the drives in [data.bag]", file.display())]
    AlternatingEfforts {
        /// The file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Number of messages without an effort.
        without_effort: usize,
        /// Number of messages with all joints.
        messages: usize,
    },
    /// The file is of another kind, such as a compressed bag.
    #[error("{}: {container}", file.display())]
    Container {
        /// The file.
        file: PathBuf,
        /// Its kind, and the tool that converts it.
        container: String,
    },
    /// The times of the messages do not form a record.
    #[error("{}: {source}", file.display())]
    Times {
        /// The file.
        file: PathBuf,
        /// Fault of the times.
        source: TimesError,
    },
    /// More samples than the free memory holds. Free some, or cut the bag.
    #[error("{}: more than {samples} samples, for which memory is free; free some, or cut the bag",
        file.display())]
    TooLong {
        /// The file.
        file: PathBuf,
        /// Number of samples that fit.
        samples: usize,
    },
}
