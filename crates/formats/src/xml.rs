//! Text within XML.

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
    fn no_two_hyphens_stand_together() {
        for (line, within) in [("a-b", "a-b"), ("a--b", "a- -b"), ("---", "- - -"), ("", "")] {
            assert_eq!(within_comment(line), within);
        }
    }
}
