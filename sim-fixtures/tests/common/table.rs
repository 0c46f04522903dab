//! Tables of the documents: what was measured stands there, and stays true.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

const DOCUMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs");
/// Set to 1, the tables are written instead of compared.
const WRITE: &str = "DIDIM_WRITE_DOCS";

/// Whether the tables are written. A study that takes long runs as a whole only then; otherwise a part
/// of it says whether the table is still of this code.
pub(crate) fn writing() -> bool {
    std::env::var(WRITE).is_ok_and(|value| value == "1")
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
    whole: bool,
}

impl Column {
    /// A column in which everything is exact.
    pub(crate) fn exact(title: &'static str) -> Self {
        Self::within(title, 0.0)
    }

    /// A column of numbers that may differ by this much.
    pub(crate) fn within(title: &'static str, absolute: f64) -> Self {
        Self { title, absolute, relative: 0.0, whole: false }
    }

    /// A column of numbers that may differ by this share.
    pub(crate) fn share(title: &'static str, relative: f64) -> Self {
        Self { title, absolute: 0.0, relative, whole: false }
    }

    /// A column that takes the whole study.
    pub(crate) fn of_the_whole(title: &'static str) -> Self {
        Self { whole: true, ..Self::exact(title) }
    }

    /// Whether two cells agree, word by word.
    fn agrees(&self, found: &str, stated: &str) -> bool {
        if self.whole {
            return true;
        }
        let (found, stated): (Vec<_>, Vec<_>) =
            (found.split_whitespace().collect(), stated.split_whitespace().collect());
        found.len() == stated.len()
            && found.iter().zip(&stated).all(|(found, stated)| {
                match (found.parse::<f64>(), stated.parse::<f64>()) {
                    (Ok(found), Ok(stated)) => {
                        let allowed = self.absolute.max(self.relative * stated.abs());
                        // Numbers in decimal differ by the last bit more than they seem to.
                        (found - stated).abs() <= allowed + 1e-9
                    }
                    _ => found == stated,
                }
            })
    }
}

/// A table with its name in a document.
pub(crate) struct Table {
    /// The document's file in docs/.
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

    /// Compares the rows that there are with those of the document that begin with the same `keys` cells; where tables are
    /// written, these are the whole.
    ///
    /// # Panics
    /// When one is not there, or they differ by more than the columns allow.
    pub(crate) fn check_part(&self, keys: usize) {
        self.compare(Some(keys));
    }

    fn compare(&self, keys: Option<usize>) {
        let _lock = DOCUMENT_LOCK.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let path = Path::new(DOCUMENTS).join(self.document);
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
        let stated: Vec<Vec<&str>> = (document[start..stop].lines().skip(2))
            .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
            .collect();
        let mut wrong = String::new();
        assert!(!self.rows.is_empty(), "rows of {}", self.name);
        if keys.is_none() {
            assert_eq!(stated.len(), self.rows.len(), "rows of {}", self.name);
        }
        for (index, row) in self.rows.iter().enumerate() {
            let stated = match keys {
                None => &stated[index],
                Some(keys) => (stated.iter().find(|stated| stated[..keys] == row[..keys]))
                    .unwrap_or_else(|| panic!("docs/{} has no row {row:?}", self.document)),
            };
            assert_eq!(stated.len(), row.len(), "columns of {}", self.name);
            for ((cell, stated), column) in row.iter().zip(stated).zip(&self.columns) {
                if !column.agrees(cell, stated) {
                    writeln!(wrong, "{row:?}: {} is {cell}, not {stated}", column.title).unwrap();
                }
            }
        }
        assert!(
            wrong.is_empty(),
            "docs/{} differs in {}; if the change is meant, {WRITE}=1 writes it:\n{wrong}",
            self.document,
            self.name
        );
    }
}

/// Writes a figure beside the document, where the tables are written too.
pub(crate) fn write_figure(name: &str, svg: impl FnOnce() -> String) {
    let path = Path::new(DOCUMENTS).join("figures").join(name);
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
