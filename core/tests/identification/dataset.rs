//! The real recording of a TX40, which is not part of the project.

use std::path::{Path, PathBuf};

/// The folder of the data sets, which are not part of the project.
#[expect(clippy::print_stdout, reason = "says why a test did nothing")]
pub(crate) fn datasets() -> Option<PathBuf> {
    let folder = std::env::var("DIDIM_DATASETS").ok().map(PathBuf::from);
    if folder.is_none() {
        println!("SKIPPED: DIDIM_DATASETS is not set");
    }
    folder
}

/// The six columns of a table with a header.
pub(crate) fn columns(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut columns = vec![Vec::new(); 6];
    for line in text.lines().skip(1) {
        for (column, field) in columns.iter_mut().zip(line.split(',')) {
            column.push(field.trim().parse().unwrap());
        }
    }
    columns
}
