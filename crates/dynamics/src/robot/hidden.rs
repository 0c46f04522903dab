//! Characters that a reader cannot see.

use core::ops::RangeInclusive;

/// Characters of the category "format" (Cf), and the separators of lines and paragraphs, in Unicode
/// 16. They are invisible, change the direction of the text after them, or break the line.
const FORMAT: [RangeInclusive<char>; 20] = [
    '\u{AD}'..='\u{AD}',
    '\u{600}'..='\u{605}',
    '\u{61C}'..='\u{61C}',
    '\u{6DD}'..='\u{6DD}',
    '\u{70F}'..='\u{70F}',
    '\u{890}'..='\u{891}',
    '\u{8E2}'..='\u{8E2}',
    '\u{180E}'..='\u{180E}',
    '\u{200B}'..='\u{200F}',
    '\u{2028}'..='\u{202E}',
    '\u{2060}'..='\u{2064}',
    '\u{2066}'..='\u{206F}',
    '\u{FEFF}'..='\u{FEFF}',
    '\u{FFF9}'..='\u{FFFB}',
    '\u{110BD}'..='\u{110BD}',
    '\u{110CD}'..='\u{110CD}',
    '\u{13430}'..='\u{1343F}',
    '\u{1BCA0}'..='\u{1BCA3}',
    '\u{1D173}'..='\u{1D17A}',
    '\u{E0001}'..='\u{E007F}',
];

/// Returns true for control and format characters.
pub fn is_hidden(character: char) -> bool {
    character.is_control() || FORMAT.iter().any(|range| range.contains(&character))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_seen_is_hidden() {
        let hidden =
            "\n\u{1b}\u{85}\u{ad}\u{200b}\u{200f}\u{202e}\u{2029}\u{2066}\u{feff}\u{e0041}";
        assert!(hidden.chars().all(is_hidden));
        assert!(!"aZ9 ü·№Ω日本語ไทย—…".chars().any(is_hidden));
    }
}
