//! Suggestions for unknown keys.

use core::fmt;

/// Similarity above which a name is suggested for another one (1 is equal).
const MIN_SIMILARITY: f64 = 0.5;

/// The known name that is most similar to an unknown one. It is appended to the parser's message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Suggestion {
    known_names: Option<String>,
    /// True if the message ends with a line break.
    in_a_line_of_its_own: bool,
}

impl Suggestion {
    /// Parses the parser's message. The unknown name comes first, in backticks. The known names
    /// follow, also in backticks.
    pub(super) fn parse(message: &str) -> Self {
        if !message.contains("unknown field `") && !message.contains("unknown variant `") {
            return Self { known_names: None, in_a_line_of_its_own: false };
        }
        let start = message.find("unknown ").unwrap_or(0);
        let mut names = message[start..].split('`').skip(1).step_by(2);
        let unknown = names.next().unwrap_or_default();
        let similar = names
            .map(|known_names| {
                (strsim::normalized_damerau_levenshtein(unknown, known_names), known_names)
            })
            .filter(|(likeness, _)| *likeness >= MIN_SIMILARITY)
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(a.1)));
        Self {
            known_names: similar.map(|(_, known_value)| known_value.to_owned()),
            in_a_line_of_its_own: message.ends_with('\n'),
        }
    }
}

impl Suggestion {
    /// Parses the message of a TOML error, which is shown with a line break after it.
    pub(super) fn from_message(message: &str) -> Self {
        Self { in_a_line_of_its_own: true, ..Self::parse(message) }
    }
}

impl fmt::Display for Suggestion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(known_names) = &self.known_names else { return Ok(()) };
        let lead = if self.in_a_line_of_its_own { "" } else { "; " };
        write!(f, "{lead}did you mean `{known_names}`?")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_known_name_is_suggested() {
        for (message, suggestion) in [
            ("unknown field `sorce`, expected one of `name`, `source`", "; did you mean `source`?"),
            ("line 3: unknown variant `idim_ls`, expected `idim-ls`", "; did you mean `idim-ls`?"),
            ("unknown field `sorce`, expected `source`\n", "did you mean `source`?"),
            ("unknown field `qqq`, expected one of `name`, `source`", ""),
            ("missing field `name`", ""),
        ] {
            assert_eq!(Suggestion::parse(message).to_string(), suggestion, "{message}");
        }
    }
}
