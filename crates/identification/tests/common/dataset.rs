//! The real recording of a TX40, which is not part of the project.

use std::path::{Path, PathBuf};

/// The folder of the data sets, which are not part of the project.
#[expect(clippy::expect_used, reason = "tests/run starts no test on data that are not there")]
pub(crate) fn datasets() -> PathBuf {
    std::env::var("DIDIM_DATASETS").expect("DIDIM_DATASETS names the folder of the data").into()
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
