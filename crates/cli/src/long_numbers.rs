//! Numbers in messages with more digits than a value has.

use std::borrow::Cow;

/// Longest number that is written digit by digit \[characters\]. 17 significant digits with a point
/// and some zeros fit, and so does every 64-bit integer.
const LONGEST_NUMBER: usize = 24;

/// Writes the numbers of a text that are longer than any 17 significant digits with an exponent:
/// `1e-308` in place of a point and 307 zeros. Digits that are part of a word, as in the name of a
/// file, stay.
pub(super) fn shorten_numbers(text: &str) -> Cow<'_, str> {
    let mut shortened = String::new();
    let mut rest = text;
    while let Some((before, number, after)) = next_number(rest) {
        shortened.push_str(before);
        let is_in_word =
            before.ends_with(is_word) || after.trim_start_matches('.').starts_with(is_word);
        match number.parse::<f64>() {
            Ok(value) if number.len() > LONGEST_NUMBER && !is_in_word => {
                shortened.push_str(&format!("{value:e}"));
            }
            _ => shortened.push_str(number),
        }
        rest = after;
    }
    match shortened.len() + rest.len() == text.len() {
        true => Cow::Borrowed(text),
        false => Cow::Owned(shortened + rest),
    }
}

/// Divides a text at its first number. A point at the end of the number is part of the sentence.
fn next_number(text: &str) -> Option<(&str, &str, &str)> {
    let start = text.find(|c: char| c.is_ascii_digit())?;
    let (before, number) = text.split_at(start);
    let end = number.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(number.len());
    let end = number.split_at(end).0.trim_end_matches('.').len();
    let (number, after) = number.split_at(end);
    Some((before, number, after))
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '/'
}

#[cfg(test)]
mod tests {
    use super::shorten_numbers;

    #[test]
    fn numbers_have_no_more_digits_than_a_value() {
        for (text, expected) in [
            (format!("limit {} s.", 1e300), "limit 1e300 s."),
            (format!("= {}", -1.25e-308), "= -1.25e-308"),
            (format!("({}, {})", 1e154, 2.5), "(1e154, 2.5)"),
            (format!("{}.", f64::MAX), "1.7976931348623157e308."),
        ] {
            assert_eq!(shorten_numbers(&text), expected);
        }
    }

    #[test]
    fn words_and_exact_numbers_stay() {
        for text in [
            "run_1234567890123456789012345.csv: 18446744073709551615 bytes, 0.1234567890123456789",
            "/data/00000000000000000000000000000001/a.csv",
            "1234567890123456789012345.csv has 1.2.3 and ends with 7.",
            "no number",
        ] {
            assert_eq!(shorten_numbers(text), text);
        }
    }
}
