//! The keys of a file, as manually maintained tables. The tests of this module check them against
//! the types that read the file.

use super::page::{Block, Page};

/// All keys of one kind of file.
pub(super) struct Reference {
    /// Name of its man page, in section 5.
    pub(super) name: &'static str,
    /// Name of its page in `docs`.
    pub(super) document: &'static str,
    /// Description in one line.
    pub(super) title: &'static str,
    pub(super) description: &'static [&'static str],
    pub(super) sections: &'static [&'static [Section]],
    /// Location on a machine with the package.
    pub(super) files: &'static [[&'static str; 2]],
    /// Man pages, and pages in `docs` with their titles.
    pub(super) see_also: &'static [[&'static str; 3]],
}

/// The keys of one table of the file, or of one of its possible forms.
pub(super) struct Section {
    pub(super) heading: &'static str,
    /// Path of the table, with numbers for the entries of lists: `bus.drives.0.position`. The tests
    /// use it to ask the reader of the file for its known keys there.
    #[cfg_attr(not(test), expect(dead_code, reason = "holds the keys to the types"))]
    pub(super) path: &'static str,
    pub(super) about: &'static str,
    pub(super) keys: &'static [Key],
    /// A part of a file with this table.
    pub(super) example: &'static str,
}

/// One key.
pub(super) struct Key {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    /// Unit; empty for a number without a unit, or for no number.
    pub(super) unit: &'static str,
    pub(super) presence: Presence,
    pub(super) meaning: &'static str,
}

/// Type of a key's value.
pub(super) enum Kind {
    Number,
    Integer,
    Switch,
    Text,
    File,
    Numbers,
    Texts,
    /// A table with its own section.
    Table,
    /// A list of such tables.
    Tables,
    /// One of these words.
    Word(&'static [&'static str]),
    /// This word, which distinguishes one form of the table from the others.
    Form(&'static str),
    /// Another type, in words.
    Other(&'static str),
}

/// Presence of a key: required, or the effect of leaving it out.
pub(super) enum Presence {
    Required,
    /// Value that applies if the key is left out, as written in the file.
    Default(&'static str),
    /// Effect of leaving the key out, in words.
    Optional(&'static str),
    /// One of several keys, of which the table has exactly one.
    Choice,
}

pub(super) const fn key(
    name: &'static str,
    kind: Kind,
    unit: &'static str,
    presence: Presence,
    meaning: &'static str,
) -> Key {
    Key { name, kind, unit, presence, meaning }
}

impl Reference {
    pub(super) fn sections(&self) -> impl Iterator<Item = &'static Section> {
        self.sections.iter().flat_map(|part| part.iter())
    }

    pub(super) fn page(&self) -> Page {
        let mut blocks: Vec<Block> =
            self.description.iter().map(|text| Block::Text((*text).to_owned())).collect();
        for section in self.sections() {
            blocks.push(Block::Heading(section.heading.to_owned()));
            blocks.push(Block::Text(section.about.to_owned()));
            blocks.push(Block::Table {
                head: ["key", "type", "unit", "default", "meaning"].map(str::to_owned).to_vec(),
                rows: section.keys.iter().map(Key::row).collect(),
            });
            blocks.push(Block::Example(section.example.to_owned()));
        }
        Page {
            name: self.name,
            section: 5,
            document: self.document,
            title: self.title,
            blocks,
            files: self.files,
            see_also: self.see_also,
        }
    }
}

impl Key {
    fn row(&self) -> Vec<String> {
        vec![
            format!("`{}`", self.name),
            self.kind.text(),
            self.unit.to_owned(),
            self.presence.text(),
            self.meaning.to_owned(),
        ]
    }
}

impl Kind {
    fn text(&self) -> String {
        match self {
            Self::Number => "number".to_owned(),
            Self::Integer => "whole number".to_owned(),
            Self::Switch => "`true` or `false`".to_owned(),
            Self::Text => "text".to_owned(),
            Self::File => "file name".to_owned(),
            Self::Numbers => "list of numbers".to_owned(),
            Self::Texts => "list of texts".to_owned(),
            Self::Table => "table".to_owned(),
            Self::Tables => "list of tables".to_owned(),
            Self::Word(words) => {
                let words: Vec<String> = words.iter().map(|word| format!("`\"{word}\"`")).collect();
                words.join(", ")
            }
            Self::Form(word) => format!("`\"{word}\"`"),
            Self::Other(text) => (*text).to_owned(),
        }
    }
}

impl Presence {
    fn text(&self) -> String {
        match self {
            Self::Required => "required".to_owned(),
            Self::Default(value) => format!("`{value}`"),
            Self::Optional(text) => (*text).to_owned(),
            Self::Choice => "one of these".to_owned(),
        }
    }
}
