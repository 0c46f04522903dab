//! Output for terminals: lines that fit the width, and colours.

use std::io::IsTerminal;

use clap::builder::styling::{AnsiColor, Style};
use didim_dynamics::robot::is_hidden;

use super::CliError;
use super::output::{print, refuses_colour};

/// Default line width in characters, for an output without a width, such as a pipe or a file.
const DEFAULT_WIDTH: usize = 80;
/// Maximum line width: wider plots and sentences are hard to read.
const MAX_WIDTH: usize = 120;
/// Minimum line width.
const MIN_WIDTH: usize = 40;

/// Returns the line width of text for people on standard output, in characters.
pub(super) fn width() -> usize {
    terminal_width().unwrap_or(DEFAULT_WIDTH).clamp(MIN_WIDTH, MAX_WIDTH)
}

/// Returns the maximum line width of a table in characters: unlimited if standard output is no
/// terminal.
pub(super) fn max_line_width() -> usize {
    terminal_width().unwrap_or(usize::MAX)
}

/// Returns the width of the terminal on standard output, which no line should exceed.
fn terminal_width() -> Option<usize> {
    let (_, columns) = console::Term::stdout().size_checked()?;
    Some(usize::from(columns)).filter(|columns| *columns > 0)
}

/// Returns true if output to a stream is coloured: the stream is a terminal that supports colours,
/// and `NO_COLOR` does not forbid them.
pub(super) fn has_colours(stream: &impl IsTerminal) -> bool {
    let dumb = std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
    stream.is_terminal() && !dumb && !refuses_colour(std::env::var_os("NO_COLOR").as_deref())
}

const RED: Style = AnsiColor::Red.on_default().bold();
const YELLOW: Style = AnsiColor::Yellow.on_default();
const GREEN: Style = AnsiColor::Green.on_default();

/// Coloured phrases. They are coloured at the beginning of a line or after two spaces.
const COLOURED_PHRASES: [(&str, Style); 15] = [
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

/// Prints a text for people. A terminal gets colours and lines of its width; other outputs get the
/// unchanged text.
///
/// # Errors
/// See [`print`].
pub(super) fn print_for_terminal(text: &str) -> Result<(), CliError> {
    let text = &without_hidden(text);
    let fitted = terminal_width().map(|columns| wrap_text(text, columns.max(MIN_WIDTH)));
    let text = fitted.as_deref().unwrap_or(text);
    if has_colours(&std::io::stdout()) { print(&add_colours(text)) } else { print(text) }
}

/// Replaces what a terminal would obey and nobody would see, as files that were changed by hand may
/// have it.
fn without_hidden(text: &str) -> String {
    let is_shown = |each: char| matches!(each, '\n' | '\t') || !is_hidden(each);
    text.chars().map(|each| if is_shown(each) { each } else { '\u{fffd}' }).collect()
}

fn add_colours(text: &str) -> String {
    let mut painted = String::new();
    let mut rest = text;
    let mut at_begin = true;
    while !rest.is_empty() {
        let coloured =
            COLOURED_PHRASES.iter().find(|(words, _)| at_begin && rest.starts_with(words));
        if let Some((words, style)) = coloured {
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

/// Breaks a text into lines of at most `columns` characters. A longer line is broken between words.
/// Its continuation is indented to its last column, or by four characters if that column begins in
/// the right half of the line.
fn wrap_text(text: &str, columns: usize) -> String {
    let mut fitted = String::new();
    for line in text.split_inclusive('\n') {
        let (own, end) = line.strip_suffix('\n').map_or((line, ""), |own| (own, "\n"));
        if own.chars().count() <= columns {
            fitted += own;
        } else {
            fitted += &wrap_line(own, columns);
        }
        fitted += end;
    }
    fitted
}

fn wrap_line(line: &str, columns: usize) -> String {
    let indent = match line.rfind("  ") {
        Some(at) => line[..at].chars().count() + 2,
        None => 2,
    };
    let indent = if indent > columns / 2 { 4 } else { indent };
    let mut broken = String::new();
    let mut width = 0;
    for (k, word) in line.split(' ').enumerate() {
        let length = word.chars().count();
        // A word that is longer than a line, such as a path, is not broken.
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
    fn what_a_terminal_would_obey_is_replaced() {
        assert_eq!(without_hidden("a\u{1b}[2Jb\u{202e}c\td\n"), "a\u{fffd}[2Jb\u{fffd}c\td\n");
    }

    #[test]
    fn long_lines_are_broken_between_words_below_their_last_column() {
        let text = "ab\n  key  one two three four five six seven eight nine ten\n";
        let expected = "ab\n  key  one two three four five six seven\n       eight nine ten\n";
        assert_eq!(wrap_text(text, 40), expected);
        assert_eq!(wrap_text(text, 80), text);
        let path = format!("x {}", "y".repeat(60));
        assert_eq!(wrap_text(&path, 40), path, "a word is not broken");
        let plain = "one two three four five six seven eight nine ten";
        assert_eq!(wrap_text(plain, 40), "one two three four five six seven eight\n  nine ten");
    }

    #[test]
    fn what_must_be_seen_has_a_colour_where_it_stands_alone() {
        let text = "verdict: NOT applicable\n  - no error\n0  7  ALARM fc3\nerrors\n";
        let (red, end) = (RED.render().to_string(), RED.render_reset().to_string());
        let expected = format!(
            "{red}verdict: NOT applicable{end}\n  - no error\n0  7  {red}ALARM{end} \
            fc3\n{red}errors{end}\n"
        );
        assert_eq!(add_colours(text), expected);
    }
}
