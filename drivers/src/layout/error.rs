//! Errors that refuse a layout.

use std::fmt;

use crate::ethercat::CaptureError;

/// Reason why a DBC file and a layout give no plan. Every variant names the problem and its place;
/// `line` counts from 1 in the DBC file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// The text is not a DBC file.
    #[error("the DBC file does not parse{}: {detail}", FilePlace(*.line))]
    Syntax {
        /// Line number, if the parser reports it.
        line: Option<usize>,
        /// Message of the parser.
        detail: String,
    },
    /// An identifier has neither 11 bits nor, with bit 31 set, 29.
    #[error(
        "line {line} of the DBC file: {id} is not a CAN identifier (11 bits; or 29 bits with 2^31 \
        added)"
    )]
    IdOutOfRange {
        /// The line of the message.
        line: usize,
        /// The number in the file.
        id: u64,
    },
    /// Two messages have the same identifier: a frame cannot be assigned to one of them.
    #[error("the messages `{first}` and `{second}` of the DBC file have the same identifier {id}")]
    DuplicateId {
        /// The identifier in the notation of the DBC file.
        id: u32,
        /// One message.
        first: String,
        /// The other.
        second: String,
    },
    /// Two messages, or two signals of one message, have the same name.
    #[error("the DBC file has two of the name `{name}`")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// A message does not fit its frame format.
    #[error("message `{message}`{}: {reason}", FilePlace(*.line))]
    Format {
        /// The message.
        message: String,
        /// Its line.
        line: Option<usize>,
        /// The mismatch.
        reason: &'static str,
    },
    /// A signal is not named as `Message.Signal`.
    #[error("`{key} = \"{pattern}\"`: a signal is named `Message.Signal`")]
    Pattern {
        /// The key of the layout.
        key: &'static str,
        /// Its text.
        pattern: String,
    },
    /// The DBC file has no such message.
    #[error("`{key}`: the DBC file has no message `{message}`{}", SimilarNames(.similar))]
    NoMessage {
        /// The key of the layout.
        key: &'static str,
        /// The missing name.
        message: String,
        /// Similar names in the file.
        similar: Vec<String>,
    },
    /// The message has no such signal.
    #[error("`{key}`: message `{message}` has no signal `{signal}`{}", SimilarNames(.similar))]
    NoSignal {
        /// The key of the layout.
        key: &'static str,
        /// The message.
        message: String,
        /// The missing name.
        signal: String,
        /// Similar names in the message.
        similar: Vec<String>,
    },
    /// A signal cannot be read as the DBC file defines it.
    #[error("signal `{signal}`{}: {reason}", FilePlace(*.line))]
    Signal {
        /// `Message.Signal`.
        signal: String,
        /// Its line.
        line: Option<usize>,
        /// The problem and its correction.
        reason: String,
    },
    /// Two signals of the layout read the same bits.
    #[error(
        "`{first}` and `{second}` are the same bits of a frame; does a pattern lack `{{axis}}`?"
    )]
    Overlap {
        /// The quantity and the axis.
        first: String,
        /// The other.
        second: String,
    },
    /// A device file of the layout's nodes gives no plan.
    #[error(transparent)]
    Eds(#[from] super::eds::EdsError),
    /// The description of the layout's EtherCAT slaves gives no plan.
    #[error(transparent)]
    Network(#[from] super::slaves::NetworkError),
    /// A key of the layout has an invalid value.
    #[error("`{key}`: {reason}")]
    Key {
        /// The key.
        key: &'static str,
        /// The problem and its correction.
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
