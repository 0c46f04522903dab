//! Part of a study's runs, for one of several machines.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};

/// One of several equal parts of a study, written as `0/4` to `3/4`. Only the grid of the plan
/// determines the part of a run, so additional seeds do not move a run to another part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    index: u32,
    of: u32,
}

/// Error for a text that does not name a part. The message shows the correct form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a part of a study is I/N, with N from 1 to {} and I from 0 to N − 1", Shard::MAX_PARTS)]
pub struct NotAShard;

impl Shard {
    /// Part that contains all runs.
    pub const COMPLETE: Self = Self { index: 0, of: 1 };
    /// Maximum number of parts.
    const MAX_PARTS: u32 = 100_000;

    /// Returns true if the part contains all runs.
    pub fn is_whole(&self) -> bool {
        *self == Self::COMPLETE
    }

    /// Returns the index of the part, from 0.
    pub(super) fn index(self) -> u32 {
        self.index
    }

    /// Returns the number of parts.
    pub(super) fn part_count(self) -> u32 {
        self.of
    }

    /// Returns the part that contains a simulated experiment, given its number in the order of the
    /// study.
    pub(super) fn shard_of_experiment(self, experiment: u64) -> Self {
        let index = u32::try_from(experiment % u64::from(self.of)).unwrap_or_default();
        Self { index, ..self }
    }
}

impl FromStr for Shard {
    type Err = NotAShard;

    fn from_str(text: &str) -> Result<Self, NotAShard> {
        let (index, of) = text.split_once('/').ok_or(NotAShard)?;
        let [index, of] = [index.parse(), of.parse()].map(|number| number.unwrap_or(u32::MAX));
        let shard = Self { index, of };
        if index < of && of <= Self::MAX_PARTS { Ok(shard) } else { Err(NotAShard) }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl TryFrom<String> for Shard {
    type Error = NotAShard;

    fn try_from(text: String) -> Result<Self, NotAShard> {
        text.parse()
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_counted_from_zero() {
        for text in ["0/1", "3/4", "99999/100000"] {
            assert_eq!(text.parse::<Shard>().unwrap().to_string(), text);
        }
        assert!("0/1".parse::<Shard>().unwrap().is_whole());
        for text in ["", "1", "4/4", "0/0", "-1/4", "1/4/2", "0/100001", "a/b"] {
            assert_eq!(text.parse::<Shard>(), Err(NotAShard), "{text}");
        }
        let part: Shard = "1/3".parse().unwrap();
        let having = (0..6).filter(|experiment| part.shard_of_experiment(*experiment) == part);
        assert_eq!(having.collect::<Vec<_>>(), [1, 4]);
    }
}
