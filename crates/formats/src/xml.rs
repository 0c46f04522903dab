//! Text within XML.

/// A text within quotes.
pub(crate) fn escape_attribute(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// A line within a comment, where two hyphens may not stand together.
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
