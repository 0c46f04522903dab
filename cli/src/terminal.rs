//! What a terminal is shown: lines of its width, and colours.

use std::io::IsTerminal;

use clap::builder::styling::{AnsiColor, Style};

use super::CliError;
use super::output::{print, refuses_colour};

/// Characters of a line where nobody says how many there are: a pipe, a file.
const USUAL: usize = 80;
/// A plot or a sentence is read badly beyond that.
const MOST: usize = 120;
/// The narrowest that lines are made for.
const LEAST: usize = 40;

/// The width of lines for people on standard output.
pub(super) fn width() -> usize {
    own_width().unwrap_or(USUAL).clamp(LEAST, MOST)
}

/// Characters of a line that a table may have: any number where standard output is no terminal.
pub(super) fn line() -> usize {
    own_width().unwrap_or(usize::MAX)
}

/// Of a terminal on standard output, which no line should leave.
fn own_width() -> Option<usize> {
    let size = rustix::termios::tcgetwinsize(std::io::stdout()).ok()?;
    Some(usize::from(size.ws_col)).filter(|columns| *columns > 0)
}

/// Whether a stream gets colours: a terminal that has them, of somebody who has not refused them.
pub(super) fn coloured(stream: &impl IsTerminal) -> bool {
    let dumb = std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
    stream.is_terminal() && !dumb && !refuses_colour(std::env::var_os("NO_COLOR").as_deref())
}

const RED: Style = AnsiColor::Red.on_default().bold();
const YELLOW: Style = AnsiColor::Yellow.on_default();
const GREEN: Style = AnsiColor::Green.on_default();

/// What is coloured, where it stands at the beginning of a line, or behind two spaces.
const COLOURED: [(&str, Style); 15] = [
    ("verdict: applicable", GREEN),
    ("verdict: NOT applicable", RED),
    ("the configuration is valid", GREEN),
    ("the configuration is not suitable", RED),
    ("this machine is suitable", GREEN),
    ("this machine is not suitable", RED),
    ("error\n", RED),
    ("errors\n", RED),
    ("warning\n", YELLOW),
    ("warnings\n", YELLOW),
    ("alarm: ", RED),
    ("ALARM ", RED),
    ("outside: ", YELLOW),
    ("in band", GREEN),
    ("NO  ", RED),
];

/// Prints a text for people: in colours and in lines of its width on a terminal, as it is elsewhere.
///
/// # Errors
/// See [`print`].
pub(super) fn show(text: &str) -> Result<(), CliError> {
    let fitted = own_width().map(|columns| fitted(text, columns.max(LEAST)));
    let text = fitted.as_deref().unwrap_or(text);
    if coloured(&std::io::stdout()) { print(&painted(text)) } else { print(text) }
}

fn painted(text: &str) -> String {
    let mut painted = String::new();
    let mut rest = text;
    let mut at_begin = true;
    while !rest.is_empty() {
        let found = COLOURED.iter().find(|(words, _)| at_begin && rest.starts_with(words));
        if let Some((words, style)) = found {
            let shown = words.trim_end();
            painted += &format!("{style}{shown}{style:#}{}", &words[shown.len()..]);
            rest = &rest[words.len()..];
            at_begin = words.ends_with('\n');
            continue;
        }
        let mut characters = rest.chars();
        let Some(next) = characters.next() else { break };
        painted.push(next);
        rest = characters.as_str();
        at_begin = next == '\n' || painted.ends_with("  ");
    }
    painted
}

/// The text in lines of so many characters at most: longer ones are broken between words, and go on below their last
/// column, as far as that leaves room.
fn fitted(text: &str, columns: usize) -> String {
    let mut fitted = String::new();
    for line in text.split_inclusive('\n') {
        let (own, end) = line.strip_suffix('\n').map_or((line, ""), |own| (own, "\n"));
        if own.chars().count() <= columns {
            fitted += own;
        } else {
            fitted += &broken(own, columns);
        }
        fitted += end;
    }
    fitted
}

fn broken(line: &str, columns: usize) -> String {
    let indent = match line.rfind("  ") {
        Some(at) => line[..at].chars().count() + 2,
        None => 2,
    };
    let indent = if indent > columns / 2 { 4 } else { indent };
    let mut broken = String::new();
    let mut width = 0;
    for (k, word) in line.split(' ').enumerate() {
        let length = word.chars().count();
        // What is longer than a line, as a path, is left to the terminal.
        if k > 0 && width + 1 + length > columns && width > indent {
            broken.truncate(broken.trim_end().len());
            broken += &format!("\n{}", " ".repeat(indent));
            width = indent;
        } else if k > 0 {
            broken.push(' ');
            width += 1;
        }
        broken += word;
        width += length;
    }
    broken
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_broken_between_words_below_their_last_column() {
        let text = "ab\n  key  one two three four five six seven eight nine ten\n";
        let expected = "ab\n  key  one two three four five six seven\n       eight nine ten\n";
        assert_eq!(fitted(text, 40), expected);
        assert_eq!(fitted(text, 80), text);
        let path = format!("x {}", "y".repeat(60));
        assert_eq!(fitted(&path, 40), path, "a word is not broken");
        let plain = "one two three four five six seven eight nine ten";
        assert_eq!(fitted(plain, 40), "one two three four five six seven eight\n  nine ten");
    }

    #[test]
    fn what_must_be_seen_has_a_colour_where_it_stands_alone() {
        let text = "verdict: NOT applicable\n  - no error\n0  7  ALARM fc3\nerrors\n";
        let (red, end) = (RED.render().to_string(), RED.render_reset().to_string());
        let expected = format!(
            "{red}verdict: NOT applicable{end}\n  - no error\n0  7  {red}ALARM{end} fc3\n{red}errors{end}\n"
        );
        assert_eq!(painted(text), expected);
    }
}
