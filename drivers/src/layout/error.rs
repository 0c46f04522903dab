//! Why a layout was refused.

use std::fmt;

use crate::ethercat::CaptureError;

/// Why a DBC file and a layout do not make a plan. Every variant names what is wrong and where;
/// `line` counts from 1 in the DBC file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// The text is not a DBC file.
    #[error("the DBC file does not parse{}: {detail}", At(*.line))]
    Syntax {
        /// The line, where the parser knows it.
        line: Option<usize>,
        /// What the parser says.
        detail: String,
    },
    /// An identifier is neither of 11 bits nor, with bit 31 set, of 29.
    #[error(
        "line {line} of the DBC file: {id} is not a CAN identifier (11 bits; or 29 bits with 2^31 added)"
    )]
    IdOutOfRange {
        /// The line of the message.
        line: usize,
        /// The number written there.
        id: u64,
    },
    /// Two messages have one identifier: which of them a frame is cannot be told.
    #[error("the messages `{first}` and `{second}` of the DBC file have the same identifier {id}")]
    DuplicateId {
        /// The identifier as the DBC file writes it.
        id: u32,
        /// One message.
        first: String,
        /// The other.
        second: String,
    },
    /// Two messages, or two signals of one message, have one name.
    #[error("the DBC file has two of the name `{name}`")]
    DuplicateName {
        /// The name.
        name: String,
    },
    /// A message does not fit its frame format.
    #[error("message `{message}`{}: {reason}", At(*.line))]
    Format {
        /// The message.
        message: String,
        /// Its line.
        line: Option<usize>,
        /// What does not fit.
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
    #[error("`{key}`: the DBC file has no message `{message}`{}", Similar(.similar))]
    NoMessage {
        /// The key of the layout.
        key: &'static str,
        /// The name looked for.
        message: String,
        /// Names in the file that are like it.
        similar: Vec<String>,
    },
    /// The message has no such signal.
    #[error("`{key}`: message `{message}` has no signal `{signal}`{}", Similar(.similar))]
    NoSignal {
        /// The key of the layout.
        key: &'static str,
        /// The message.
        message: String,
        /// The name looked for.
        signal: String,
        /// Names in the message that are like it.
        similar: Vec<String>,
    },
    /// A signal cannot be read as it stands in the DBC file.
    #[error("signal `{signal}`{}: {reason}", At(*.line))]
    Signal {
        /// `Message.Signal`.
        signal: String,
        /// Its line.
        line: Option<usize>,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// Two signals of the layout read the same bits.
    #[error(
        "`{first}` and `{second}` are the same bits of a frame; does a pattern lack `{{axis}}`?"
    )]
    Overlap {
        /// What is read, of which axis.
        first: String,
        /// The other.
        second: String,
    },
    /// A device file of the layout's nodes does not make a plan.
    #[error(transparent)]
    Eds(#[from] super::eds::EdsError),
    /// The description of the layout's EtherCAT slaves does not make a plan.
    #[error(transparent)]
    Network(#[from] super::slaves::NetworkError),
    /// A key of the layout has a value that makes no sense.
    #[error("`{key}`: {reason}")]
    Key {
        /// The key.
        key: &'static str,
        /// What is wrong, and what would be right.
        reason: String,
    },
}

impl From<CaptureError> for LayoutError {
    fn from(error: CaptureError) -> Self {
        Self::Network(error.into())
    }
}

struct At(Option<usize>);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(line) => write!(f, " (line {line} of the DBC file)"),
            None => Ok(()),
        }
    }
}

struct Similar<'a>(&'a [String]);

impl fmt::Display for Similar<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, name) in self.0.iter().enumerate() {
            write!(f, "{}`{name}`", if k == 0 { "; similar: " } else { ", " })?;
        }
        Ok(())
    }
}
