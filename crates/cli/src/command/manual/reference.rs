//! The reference page of a file: a Markdown text with tables of keys. The tables are generated from
//! the schema of the type that reads the file.

use schemars::schema_for;

use didim::cell::CellFile;
use didim_dynamics::robot::Robot;

use super::page::{Block, Page};
use super::schema::{FileSchema, Key};

/// Reference of one kind of file.
pub(super) struct Reference {
    /// Name of the man page in section 5, and of the schema file.
    pub(super) name: &'static str,
    /// File name of the page in `docs/reference`.
    document: &'static str,
    /// The page without its tables. A line `<!-- keys: PATH form=WORD only=KEY,… -->` is replaced
    /// by a table of the keys at the path.
    text: &'static str,
    pub(super) schema: FileSchema,
    /// Locations of the file on a machine with the package, each with a description.
    files: &'static [[&'static str; 2]],
    /// Related man pages: name of the man page, page in `docs`, and title of that page.
    see_also: &'static [[&'static str; 3]],
}

/// Section of the page about a table of the file, or about one of the possible forms of the table.
#[derive(Clone, Copy, Default)]
pub(super) struct Section<'a> {
    /// Path of the table, with numbers for the entries of lists: `bus.drives.0.position`.
    pub(super) path: &'a str,
    /// The word that distinguishes this form of the table.
    pub(super) form: Option<&'a str>,
    /// The keys that this section describes; all if empty.
    selected_keys: &'a str,
}

/// Returns the reference of the cell file.
pub(super) fn cell_file() -> Reference {
    Reference {
        name: "didim-cell",
        document: "cell-file.md",
        text: include_str!("cell.md"),
        schema: FileSchema::new(schema_for!(CellFile)),
        files: &[
            ["/etc/didim/cell.toml", "the cell of the service"],
            ["/usr/share/didim/config/cells", "examples"],
            ["/usr/share/didim/schema/didim-cell.schema.json", "JSON Schema for editors"],
        ],
        see_also: &[
            ["didim-robot(5)", "robot-file.md", "robot file"],
            ["didim-parameters(7)", "parameters.md", "names of parameters"],
            ["didim-new(1)", "../guide/cell.md", "cell guide"],
            ["didim-check(1)", "../method/README.md", "methods"],
        ],
    }
}

/// Returns the reference of the robot file.
pub(super) fn robot_file() -> Reference {
    Reference {
        name: "didim-robot",
        document: "robot-file.md",
        text: include_str!("robot.md"),
        schema: FileSchema::new(Robot::file_schema()),
        files: &[
            [
                "/usr/share/didim/config/robots",
                "robot files of arms whose dimensions are published",
            ],
            ["/usr/share/didim/schema/didim-robot.schema.json", "JSON Schema for editors"],
        ],
        see_also: &[
            ["didim-cell(5)", "cell-file.md", "cell file"],
            ["didim-parameters(7)", "parameters.md", "names of parameters"],
            ["didim-robot(1)", "../guide/export.md", "export guide"],
        ],
    }
}

impl Reference {
    /// Returns the title, which is the first line of the text.
    pub(super) fn title(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches("# ")
    }

    /// Returns the blocks of the page. Each block that is a table comes with its section.
    ///
    /// # Errors
    /// The schema does not have the table of a section.
    pub(super) fn blocks(&self) -> Result<Vec<(Block, Option<Section<'static>>)>, String> {
        let mut blocks = Vec::new();
        let mut lines = self.text.lines().skip(1).filter(|line| !line.is_empty());
        while let Some(line) = lines.next() {
            if let Some(text) = line.strip_prefix("## ") {
                blocks.push((Block::Heading(text.to_owned()), None));
            } else if let Some(text) = line.strip_prefix("<!-- keys:") {
                let section = Section::parse(text.trim_end_matches("-->"));
                blocks.push((self.table(section)?, Some(section)));
            } else if line == "```toml" {
                let example: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
                blocks.push((Block::Example(example.join("\n")), None));
            } else {
                blocks.push((Block::Text(line.to_owned()), None));
            }
        }
        Ok(blocks)
    }

    /// Returns the keys of a section.
    ///
    /// # Errors
    /// The schema does not have the table of the section.
    pub(super) fn keys(&self, section: Section<'_>) -> Result<Vec<Key>, String> {
        let mut keys = self.schema.keys(section.path, section.form)?;
        if !section.selected_keys.is_empty() {
            keys.retain(|key| section.selected_keys.split(',').any(|name| name == key.name));
        }
        Ok(keys)
    }

    fn table(&self, section: Section<'_>) -> Result<Block, String> {
        Ok(Block::Table {
            head: ["key", "type", "unit", "default", "meaning"].map(str::to_owned).to_vec(),
            rows: self.keys(section)?.into_iter().map(Key::row).collect(),
        })
    }

    /// Returns the page.
    ///
    /// # Errors
    /// See [`Reference::blocks`].
    pub(super) fn page(&self) -> Result<Page, String> {
        Ok(Page {
            name: self.name,
            section: 5,
            document: self.document,
            title: self.title(),
            blocks: self.blocks()?.into_iter().map(|(block, _)| block).collect(),
            files: self.files,
            see_also: self.see_also,
        })
    }
}

impl<'a> Section<'a> {
    fn parse(text: &'a str) -> Self {
        let mut section = Self::default();
        for word in text.split_whitespace() {
            match word.split_once('=') {
                Some(("form", form)) => section.form = Some(form),
                Some(("only", keys)) => section.selected_keys = keys,
                _ => section.path = word,
            }
        }
        section
    }
}
