//! Text within XML, and XML that other tools read although it is not well-formed.

use core::ops::Range;

use roxmltree::{Document, Error};

/// Maximum number of prefixes that are declared for a file. Convention: no file has as many.
const MAX_PREFIXES: usize = 64;
/// Prefix of macros. A file that has it is not expanded yet.
const MACRO_PREFIX: &str = "xacro";

/// Parts of a document before its content.
struct Prolog {
    /// Place of the declaration (`<?xml …?>`).
    declaration: Option<Range<usize>>,
    /// Beginning of the root element.
    root: usize,
}

/// Converts a document that readers of robots accept into well-formed XML, with the same lines. A
/// declaration that is not at the beginning, or states another encoding than that of the text, is
/// blanked out. Prefixes are declared.
pub(crate) fn normalise(text: &str) -> String {
    let mut text = text.to_owned();
    if let Some(declaration) = prolog(&text).declaration {
        let is_first = text[..declaration.start].trim_start_matches('\u{feff}').is_empty();
        let declared = text[declaration.clone()].to_ascii_lowercase();
        if !is_first || declared.contains("encoding") && !declared.contains("utf-8") {
            let blank = |letter: char| if letter == '\n' { '\n' } else { ' ' };
            let blanks: String = text[declaration.clone()].chars().map(blank).collect();
            text.replace_range(declaration, &blanks);
        }
    }
    for _ in 0..MAX_PREFIXES {
        let prefix = match Document::parse(&text) {
            Err(Error::UnknownNamespace(prefix, _)) if prefix != MACRO_PREFIX => prefix,
            _ => break,
        };
        let root = prolog(&text).root;
        let name = text[root..].find([' ', '\t', '\r', '\n', '/', '>']);
        let Some(name) = name else { break };
        text.insert_str(root + name, &format!(" xmlns:{prefix}=\"urn:undeclared:{prefix}\""));
    }
    text
}

fn prolog(text: &str) -> Prolog {
    let mut prolog = Prolog { declaration: None, root: 0 };
    loop {
        let rest = &text[prolog.root..];
        let start = prolog.root + rest.find('<').unwrap_or(rest.len());
        let rest = &text[start..];
        let end = match () {
            () if rest.starts_with("<!--") => "-->",
            () if rest.starts_with("<?") => "?>",
            () if rest.starts_with("<!") => ">",
            () => "",
        };
        let length = rest.find(end).unwrap_or(rest.len()) + end.len();
        let part = start..(start + length).min(text.len());
        if rest.starts_with("<?xml") && rest[5..].starts_with(char::is_whitespace) {
            prolog.declaration = Some(part.clone());
        }
        prolog.root = part.end;
        if end.is_empty() || rest.is_empty() {
            return prolog;
        }
    }
}

/// Escapes text for an attribute.
pub(crate) fn escape_attribute(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Converts a line to the content of a comment, which may not contain two hyphens in a row.
pub(crate) fn within_comment(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    for letter in line.chars() {
        if letter == '-' && text.ends_with('-') {
            text.push(' ');
        }
        text.push(letter);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_that_is_not_well_formed_becomes_so() {
        for (text, expected) in [
            ("<a/>", "<a/>"),
            ("<?xml version=\"1.0\"?><a/>", "<?xml version=\"1.0\"?><a/>"),
            ("\n<?xml\tversion=\"1.0\"?><a/>", "\n                     <a/>"),
            ("\n<?xml v=\"1\"?>\n<a/>", "\n             \n<a/>"),
            ("<?xml encoding=\"x\"?><a/>", "                    <a/>"),
            ("<?xml encoding=\"UTF-8\"?><a/>", "<?xml encoding=\"UTF-8\"?><a/>"),
            ("<!-- <x> --><p:a/>", "<!-- <x> --><p:a xmlns:p=\"urn:undeclared:p\"/>"),
            ("<a><xacro:b/></a>", "<a><xacro:b/></a>"),
            ("<!-- ", "<!-- "),
            ("", ""),
        ] {
            assert_eq!(normalise(text), expected);
        }
        let two = normalise("<a>\n<p:b q:c=\"1\"/></a>");
        assert!(Document::parse(&two).is_ok() && two.lines().count() == 2, "{two}");
    }

    #[test]
    fn no_two_hyphens_stand_together() {
        for (line, within) in [("a-b", "a-b"), ("a--b", "a- -b"), ("---", "- - -"), ("", "")] {
            assert_eq!(within_comment(line), within);
        }
    }
}
