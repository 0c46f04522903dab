//! Kind of a text file, for a message about a file that was given in place of another.

use core::fmt;

/// Kind of a text file, by its beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextKind {
    /// The file has no text.
    Empty,
    /// A URDF.
    Urdf,
    /// Another XML file.
    Xml,
    /// JSON, as stored results are.
    Json,
    /// A cell file.
    Cell,
    /// A robot file.
    Robot,
    /// A table: its first line has names or values with separators.
    Table,
}

/// Beginnings of lines that only a cell file has.
const CELL_LINES: [&str; 5] = ["[data]", "[bus]", "[bus.layout]", "[identification]", "robot ="];
/// Beginning of a line that every robot file has.
const ROBOT_LINE: &str = "[[joint]]";

impl TextKind {
    /// Detects the kind of a text from its beginning. Returns `None` for any other text.
    pub fn detect(begin: &str) -> Option<Self> {
        let text = begin.trim_start_matches('\u{feff}').trim_start();
        let has_line = |start: &str| text.lines().any(|line| line.trim_start().starts_with(start));
        let first_line = text.lines().next().unwrap_or_default();
        let separators = first_line.matches([',', ';', '\t']).count();
        match text.chars().next() {
            None => Some(Self::Empty),
            Some('<') if text.contains("<robot") => Some(Self::Urdf),
            Some('<') => Some(Self::Xml),
            Some('{') => Some(Self::Json),
            Some(_) if has_line(ROBOT_LINE) => Some(Self::Robot),
            Some(_) if CELL_LINES.iter().any(|line| has_line(line)) => Some(Self::Cell),
            Some(_) if separators > 1 && !first_line.contains('=') => Some(Self::Table),
            Some(_) => None,
        }
    }

    /// Returns true if a recording cannot be a text of this kind.
    pub fn is_no_recording(self) -> bool {
        self != Self::Table
    }
}

impl fmt::Display for TextKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Empty => "an empty file",
            Self::Urdf => "a URDF",
            Self::Xml => "an XML file",
            Self::Json => "a JSON file, as a stored result is",
            Self::Cell => "a cell file",
            Self::Robot => "a robot file",
            Self::Table => "a table of signals",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::TextKind::{self, Cell, Empty, Json, Robot, Table, Urdf, Xml};

    #[test]
    fn each_kind_is_detected() {
        for (text, kind) in [
            ("", Some(Empty)),
            (" \n\n", Some(Empty)),
            ("\u{feff}<?xml version=\"1.0\"?>\n<robot name=\"a\">", Some(Urdf)),
            ("<mujoco/>", Some(Xml)),
            ("{\"schema\": 2}", Some(Json)),
            ("# an arm\nname = \"a\"\n\n[[joint]] # 1\n", Some(Robot)),
            ("# found\nname = \"a\"\nrobot = \"a.urdf\"\n", Some(Cell)),
            ("[data]\nrate_hz = 100.0\n", Some(Cell)),
            ("time,q1,q2\n0,1,2\n", Some(Table)),
            ("time q1 q2\n0 1 2\n", None),
            ("(1.0) can0 123#11\n", None),
            ("name = [1, 2, 3]\n", None),
        ] {
            assert_eq!(TextKind::detect(text), kind, "{text:?}");
        }
    }
}
