//! Text styles of the screen.

use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;

/// Text styles. Without colours only bold and dim are used.
#[derive(Clone, Copy)]
pub(super) struct TextStyles {
    pub(super) has_colour: bool,
}

impl TextStyles {
    pub(super) fn in_colour(self, colour: Color) -> Style {
        if self.has_colour { Style::new().fg(colour) } else { Style::new() }
    }

    pub(super) fn good_style(self) -> Style {
        self.in_colour(Color::Green)
    }

    pub(super) fn bad_style(self) -> Style {
        self.in_colour(Color::Red).add_modifier(Modifier::BOLD)
    }

    pub(super) fn name(self) -> Style {
        self.in_colour(Color::Cyan)
    }

    pub(super) fn heading(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }
}

/// Splits a text into words. A number and the next word, usually its unit, count as one word if
/// they fit a line.
fn split_words(text: &str, width: usize) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        match words.last_mut() {
            Some(last)
                if last.parse::<f64>().is_ok()
                    && last.chars().count() + 1 + word.chars().count() <= width =>
            {
                *last += " ";
                *last += word;
            }
            _ => words.push(word.to_owned()),
        }
    }
    words
}

/// Breaks a text between words into lines of at most `width` characters. The first line begins with
/// `lead`; the others have the same indent.
pub(super) fn wrap_lines(lead: &str, text: &str, style: Style, width: u16) -> Vec<Line<'static>> {
    let indent = lead.chars().count();
    let space = usize::from(width).saturating_sub(indent).max(8);
    let mut lines: Vec<String> = vec![String::new()];
    let mut used = 0;
    for word in split_words(text, space) {
        let mut word: Vec<char> = word.chars().collect();
        while !word.is_empty() {
            let gap = usize::from(used > 0);
            if used + gap + word.len() <= space || used == 0 {
                let rest = word.split_off(word.len().min(space));
                if let Some(line) = lines.last_mut() {
                    line.push_str(if gap == 1 { " " } else { "" });
                    line.extend(word.iter());
                }
                used += gap + word.len();
                word = rest;
                if word.is_empty() {
                    break;
                }
            }
            lines.push(String::new());
            used = 0;
        }
    }
    let lead_of = |k: usize| if k == 0 { lead.to_owned() } else { " ".repeat(indent) };
    let lines = lines.into_iter().enumerate();
    lines.map(|(k, line)| Line::styled(format!("{}{line}", lead_of(k)), style)).collect()
}
