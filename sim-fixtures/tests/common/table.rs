//! Tables of the documents: what was measured stands there, and stays true.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The folder of the documents, relative to the root of the repository.
const DOCUMENTS: &str = "docs/evidence";
/// Set to 1, the tables are written instead of compared.
const WRITE: &str = "DIDIM_WRITE_DOCS";

/// Whether the tables are written. A study that takes long runs as a whole only then; otherwise a
/// part of it says whether the table is still of this code.
pub(crate) fn writing() -> bool {
    std::env::var(WRITE).is_ok_and(|value| value == "1")
}

/// Returns the path of a file among the documents.
fn document_path(name: &str) -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder =
        package.ancestors().map(|folder| folder.join(DOCUMENTS)).find(|path| path.is_dir());
    folder.expect("the repository has the folder of the documents").join(name)
}

/// Tests run side by side and write one file.
static DOCUMENT_LOCK: Mutex<()> = Mutex::new(());

/// A column: its title, and how far its numbers may be from those in the document.
pub(crate) struct Column {
    pub(crate) title: &'static str,
    /// In the unit of the column.
    pub(crate) absolute: f64,
    /// As a share of the number.
    pub(crate) relative: f64,
    /// Known to the whole study alone: written, and not compared.
    complete: bool,
}

impl Column {
    /// A column in which everything is exact.
    pub(crate) fn exact(title: &'static str) -> Self {
        Self::within(title, 0.0)
    }

    /// A column of numbers that may differ by this much.
    pub(crate) fn within(title: &'static str, absolute: f64) -> Self {
        Self { title, absolute, relative: 0.0, complete: false }
    }

    /// A column of numbers that may differ by this share.
    pub(crate) fn share(title: &'static str, relative: f64) -> Self {
        Self { title, absolute: 0.0, relative, complete: false }
    }

    /// A column that takes the whole study.
    pub(crate) fn of_the_whole(title: &'static str) -> Self {
        Self { complete: true, ..Self::exact(title) }
    }

    /// Whether two cells agree, word by word.
    fn agrees(&self, found: &str, configured: &str) -> bool {
        if self.complete {
            return true;
        }
        let (found, configured_value): (Vec<_>, Vec<_>) =
            (found.split_whitespace().collect(), configured.split_whitespace().collect());
        found.len() == configured_value.len()
            && found.iter().zip(&configured_value).all(|(found, configured_value)| {
                match (found.parse::<f64>(), configured_value.parse::<f64>()) {
                    (Ok(found), Ok(configured_value)) => {
                        let allowed = self.absolute.max(self.relative * configured_value.abs());
                        // Numbers in decimal differ by the last bit more than they seem to.
                        (found - configured_value).abs() <= allowed + 1e-9
                    }
                    _ => found == configured_value,
                }
            })
    }
}

/// A table with its name in a document.
pub(crate) struct Table {
    /// The document's file in docs/evidence.
    pub(crate) document: &'static str,
    pub(crate) name: &'static str,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    /// In Markdown.
    pub(crate) fn markdown(&self) -> String {
        let mut text = String::new();
        let titles: Vec<_> = self.columns.iter().map(|column| column.title).collect();
        writeln!(text, "| {} |", titles.join(" | ")).unwrap();
        writeln!(text, "|{}", "---|".repeat(titles.len())).unwrap();
        for row in &self.rows {
            writeln!(text, "| {} |", row.join(" | ")).unwrap();
        }
        text
    }

    /// Compares the table with the document's, or writes it there.
    ///
    /// # Panics
    /// When they differ by more than the columns allow.
    pub(crate) fn check(&self) {
        self.compare(None);
    }

    /// Compares the rows that there are with those of the document that begin with the same `keys`
    /// cells; where tables are written, these are the whole.
    ///
    /// # Panics
    /// When one is not there, or they differ by more than the columns allow.
    pub(crate) fn check_part(&self, keys: usize) {
        self.compare(Some(keys));
    }

    fn compare(&self, keys: Option<usize>) {
        let _lock = DOCUMENT_LOCK.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let path = document_path(self.document);
        let document = std::fs::read_to_string(&path).unwrap();
        let begin = format!("<!-- {} -->\n", self.name);
        let end = format!("<!-- end of {} -->", self.name);
        let start = document.find(&begin).expect("the document has no such table") + begin.len();
        let stop = document.find(&end).expect("the document's table has no end");
        if writing() {
            let text = format!("{}{}{}", &document[..start], self.markdown(), &document[stop..]);
            std::fs::write(path, text).unwrap();
            return;
        }
        let rows: Vec<Vec<&str>> = (document[start..stop].lines().skip(2))
            .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
            .collect();
        let mut wrong = String::new();
        assert!(!self.rows.is_empty(), "rows of {}", self.name);
        if keys.is_none() {
            assert_eq!(rows.len(), self.rows.len(), "rows of {}", self.name);
        }
        for (index, row) in self.rows.iter().enumerate() {
            let stated_row = match keys {
                None => &rows[index],
                Some(keys) => (rows.iter().find(|configured| configured[..keys] == row[..keys]))
                    .unwrap_or_else(|| panic!("{DOCUMENTS}/{} has no row {row:?}", self.document)),
            };
            assert_eq!(stated_row.len(), row.len(), "columns of {}", self.name);
            for ((cell, expected), column) in row.iter().zip(stated_row).zip(&self.columns) {
                if !column.agrees(cell, expected) {
                    writeln!(wrong, "{row:?}: {} is {cell}, not {expected}", column.title).unwrap();
                }
            }
        }
        assert!(
            wrong.is_empty(),
            "{DOCUMENTS}/{} differs in {}; if the change is meant, {WRITE}=1 writes it:\n{wrong}",
            self.document,
            self.name
        );
    }
}

/// Writes a figure next to the document, where the tables are written too.
pub(crate) fn write_figure(name: &str, svg: impl FnOnce() -> String) {
    let path = document_path("figures").join(name);
    if writing() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, svg()).unwrap();
    } else {
        assert!(path.is_file(), "{} is missing; {WRITE}=1 writes it", path.display());
    }
}

#[test]
fn numbers_may_differ_by_their_tolerance_and_words_may_not() {
    let column = Column::within("largest mean", 0.05);
    assert!(column.agrees("0.31 fc1", "0.35 fc1"));
    assert!(!column.agrees("0.31 fc1", "0.37 fc1"));
    assert!(!column.agrees("0.31 fc1", "0.31 fc2"));
    assert!(!column.agrees("0.31", "0.31 fc2"));
    assert!(!column.agrees("NaN", "0.31"));
    assert!(Column::share("deviation", 0.01).agrees("201", "200"));
    assert!(!Column::exact("runs").agrees("39", "40"));
    assert!(Column::of_the_whole("runs").agrees("1", "40"));
}
