//! Lines of a file that are no record of this program.

use std::path::Path;

/// Lines of a file that a reader skips: incomplete, damaged, or of a later version.
#[derive(Debug, Default)]
pub(super) struct SkippedLines {
    /// Number of these lines.
    pub(super) count: usize,
    /// The first of them, counted from 1.
    first: Option<usize>,
}

impl SkippedLines {
    /// Adds a line, counted from 1.
    pub(super) fn add(&mut self, line: usize) {
        self.count += 1;
        self.first.get_or_insert(line);
    }

    /// Names them in the log, if there are any.
    pub(super) fn warn(&self, path: &Path) {
        if let Some(line) = self.first {
            tracing::warn!(
                "{}, line {line}: incomplete, damaged or of a later version; such lines are \
                 skipped: {}",
                path.display(),
                self.count
            );
        }
    }
}
