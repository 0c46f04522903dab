//! A key of a file, with the value that the data ask for.

use core::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Value to write into a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SettingValue {
    /// An integer.
    Integer(i64),
    /// A number.
    Number(f64),
    /// True or false.
    Truth(bool),
    /// A list of numbers, one for each axis.
    List(Vec<f64>),
    /// Rows of numbers, one for each motor.
    Rows(Vec<Vec<f64>>),
    /// A word.
    Word(String),
    /// A list of words.
    Words(Vec<String>),
}

impl fmt::Display for SettingValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => value.fmt(f),
            Self::Number(value) => value.fmt(f),
            Self::Truth(value) => value.fmt(f),
            Self::List(values) => write!(f, "{values:?}"),
            Self::Rows(rows) => write!(f, "{rows:?}"),
            Self::Word(word) => write!(f, "{word:?}"),
            Self::Words(words) => write!(f, "{words:?}"),
        }
    }
}

/// A key of a file, with the value that the data ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Setting {
    /// Name of the file.
    pub file: String,
    /// Line of the key, counted from 1; that of the section if the key is missing.
    pub line: usize,
    /// The key with its section. Entries of lists count from 1: `bus.drives[2].position.zero`.
    pub key: String,
    /// The value to write.
    pub value: SettingValue,
    /// Joint, configured value and value from the data, for the message.
    #[serde(skip)]
    pub explanation: String,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, key, value, explanation } = self;
        write!(f, "`{file}:{line} {key}`: {value} ({explanation})")
    }
}
