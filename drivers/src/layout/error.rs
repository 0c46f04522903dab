//! Errors that refuse a layout.

use std::fmt;

use crate::ethercat::CaptureError;

/// Reason why a DBC file and a layout cannot be compiled to a plan. Every variant names the problem
/// and its place. `line` counts from 1 in the DBC file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// The text is not a DBC file.
    #[error("the DBC file does not parse{}: {detail}", FilePlace(*.line))]
    Syntax {
        /// Line number in the DBC file, if the parser reports it.
        line: Option<usize>,
        /// Message of the parser.
        detail: String,
    },
    /// An identifier fits neither 11 bits nor, with bit 31 set, 29 bits.
    #[error(
        "line {line} of the DBC file: the identifier {id} of message `{message}` has more than 11 \
        bits; one of 29 bits has 2^31 added (bit 31), as {}",
        with_extended_bit(*.id)
    )]
    IdOutOfRange {
        /// Line of the message in the DBC file.
        line: usize,
        /// Name of the message; empty without one.
        message: String,
        /// Identifier in the DBC file.
        id: u64,
    },
    /// Two messages have the same identifier, so it is not clear to which of them a frame belongs.
    #[error("the messages `{first}` and `{second}` of the DBC file have the same identifier {id}")]
    DuplicateId {
        /// The identifier in the notation of the DBC file.
        id: u32,
        /// Name of one message.
        first: String,
        /// Name of the other message.
        second: String,
    },
    /// Two messages, or two signals of one message, have the same name.
    #[error("the DBC file has two of the name `{name}`")]
    DuplicateName {
        /// Name that occurs twice.
        name: String,
    },
    /// A message contradicts its frame format.
    #[error("message `{message}`{}: {reason}", FilePlace(*.line))]
    Format {
        /// Name of the message.
        message: String,
        /// Line of the message in the DBC file.
        line: Option<usize>,
        /// Description of the contradiction.
        reason: &'static str,
    },
    /// A signal is not named as `Message.Signal`.
    #[error("`{key} = \"{pattern}\"`: a signal is named `Message.Signal`")]
    Pattern {
        /// Key of the layout that names the signal.
        key: &'static str,
        /// Value of the key.
        pattern: String,
    },
    /// The DBC file has no message of this name.
    #[error("`{key}`: the DBC file has no message `{message}`{}", SimilarNames(.similar))]
    NoMessage {
        /// Key of the layout that names the message.
        key: &'static str,
        /// Name of the missing message.
        message: String,
        /// Similar names of messages in the DBC file.
        similar: Vec<String>,
    },
    /// The message has no signal of this name.
    #[error("`{key}`: message `{message}` has no signal `{signal}`{}", SimilarNames(.similar))]
    NoSignal {
        /// Key of the layout that names the signal.
        key: &'static str,
        /// Name of the message.
        message: String,
        /// Name of the missing signal.
        signal: String,
        /// Similar names of signals of the message.
        similar: Vec<String>,
    },
    /// A signal cannot be read as the DBC file defines it.
    #[error("signal `{signal}`{}: {reason}", FilePlace(*.line))]
    Signal {
        /// Name of the signal, as `Message.Signal`.
        signal: String,
        /// Line of the signal in the DBC file.
        line: Option<usize>,
        /// Problem with the signal, and its correction.
        reason: String,
    },
    /// Two signals of the layout read the same bits.
    #[error(
        "`{first}` and `{second}` are the same bits of a frame; does a pattern lack `{{axis}}`?"
    )]
    Overlap {
        /// Quantity and axis of one signal.
        first: String,
        /// Quantity and axis of the other signal.
        second: String,
    },
    /// A device file of the layout's nodes cannot be compiled to a plan.
    #[error(transparent)]
    Eds(#[from] super::eds::EdsError),
    /// The description of the layout's EtherCAT slaves cannot be compiled to a plan.
    #[error(transparent)]
    Network(#[from] super::slaves::NetworkError),
    /// A key of the layout has an invalid value.
    #[error("`{key}`: {reason}")]
    Key {
        /// Key of the layout.
        key: &'static str,
        /// Problem with the value, and its correction.
        reason: String,
    },
}

impl From<CaptureError> for LayoutError {
    fn from(error: CaptureError) -> Self {
        Self::Network(error.into())
    }
}

struct FilePlace(Option<usize>);

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(line) => write!(f, " (line {line} of the DBC file)"),
            None => Ok(()),
        }
    }
}

struct SimilarNames<'a>(&'a [String]);

impl fmt::Display for SimilarNames<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, name) in self.0.iter().enumerate() {
            write!(f, "{}`{name}`", if k == 0 { "; similar: " } else { ", " })?;
        }
        Ok(())
    }
}

/// Returns the number by which a DBC file names an identifier of 29 bits.
fn with_extended_bit(id: u64) -> u64 {
    (id & 0x1FFF_FFFF) | 1 << 31
}
