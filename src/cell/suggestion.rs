//! Suggestions for unknown keys.

use core::fmt;

/// How alike two names are to be suggested for one another (1 is equal).
const SIMILAR: f64 = 0.5;

/// The known name that is most like the unknown one, as a remark behind the parser's message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Instead {
    known: Option<String>,
    /// The message ends with a line break of its own.
    in_a_line_of_its_own: bool,
}

impl Instead {
    /// Reads the parser's message: the unknown name comes first, in backticks, as do the known ones
    /// after it.
    pub(super) fn of(message: &str) -> Self {
        if !message.contains("unknown field `") && !message.contains("unknown variant `") {
            return Self { known: None, in_a_line_of_its_own: false };
        }
        let at = message.find("unknown ").unwrap_or(0);
        let mut names = message[at..].split('`').skip(1).step_by(2);
        let unknown = names.next().unwrap_or_default();
        let similar = names
            .map(|known| (strsim::normalized_damerau_levenshtein(unknown, known), known))
            .filter(|(likeness, _)| *likeness >= SIMILAR)
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(a.1)));
        Self {
            known: similar.map(|(_, known)| known.to_owned()),
            in_a_line_of_its_own: message.ends_with('\n'),
        }
    }
}

impl Instead {
    /// Of the message of a TOML error, which is shown with a line break behind it.
    pub(super) fn below(message: &str) -> Self {
        Self { in_a_line_of_its_own: true, ..Self::of(message) }
    }
}

impl fmt::Display for Instead {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(known) = &self.known else { return Ok(()) };
        let lead = if self.in_a_line_of_its_own { "" } else { "; " };
        write!(f, "{lead}did you mean `{known}`?")
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
            assert_eq!(Instead::of(message).to_string(), suggestion, "{message}");
        }
    }
}
