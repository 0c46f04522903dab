//! Lines of a device file: sections, and entries `key=value` (CiA 306-1).
//!
//! Names are compared without regard to case. All sections are read; `dictionary` takes from them
//! what it needs.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::EdsError;

/// The longest device file that is read \[bytes\].
pub const MAX_DEVICE_FILE_BYTES: usize = 8 << 20;

/// One entry `key=value`, with its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry<'a> {
    pub(super) value: &'a str,
    pub(super) line: usize,
}

/// One section: its name as written in the file, its line, and its entries by their names in lower
/// case.
#[derive(Clone, Debug, Default)]
pub(super) struct Section<'a> {
    pub(super) name: &'a str,
    line: usize,
    entries: BTreeMap<String, Entry<'a>>,
}

impl<'a> Section<'a> {
    /// Returns an entry, or `None` if it is missing or empty. `key` is in lower case.
    pub(super) fn get(&self, key: &str) -> Option<Entry<'a>> {
        self.entries.get(key).copied().filter(|entry| !entry.value.is_empty())
    }
}

/// All sections of a file by their names in lower case.
pub(super) type Sections<'a> = BTreeMap<String, Section<'a>>;

/// Parses all lines of a file.
///
/// # Errors
/// [`EdsError::Line`] if a line does not match the format, or repeats a section or an entry.
pub(super) fn parse<'a>(text: &'a str, file: &Path) -> Result<Sections<'a>, EdsError> {
    let refuse = |line, reason: String| EdsError::Line { file: file.to_owned(), line, reason };
    if text.len() > MAX_DEVICE_FILE_BYTES {
        return Err(refuse(
            1,
            format!("the file is longer than {MAX_DEVICE_FILE_BYTES} bytes; is it an EDS?"),
        ));
    }
    let mut sections = Sections::new();
    let mut current = None;
    for (line, text) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        let text = text.trim();
        if text.is_empty() || text.starts_with(';') {
            continue;
        }
        if let Some(rest) = text.strip_prefix('[') {
            let Some(name) = rest.strip_suffix(']').map(str::trim).filter(|name| !name.is_empty())
            else {
                return Err(refuse(line, "a section is written [name], alone".to_owned()));
            };
            let key = name.to_lowercase();
            let section = Section { name, line, entries: BTreeMap::new() };
            if let Some(first) = sections.insert(key.clone(), section) {
                let reason = format!("[{name}] is there already, in line {}", first.line);
                return Err(refuse(line, format!("{reason}; remove one of them")));
            }
            current = Some(key);
            continue;
        }
        let Some((key, value)) = text.split_once('=') else {
            let reason = "neither [section] nor key=value nor a comment after ;";
            return Err(refuse(line, reason.to_owned()));
        };
        let Some(section) = current.as_ref().and_then(|name| sections.get_mut(name)) else {
            return Err(refuse(line, "an entry before the first [section]".to_owned()));
        };
        let key = key.trim().to_lowercase();
        let entry = Entry { value: value.trim(), line };
        if let Some(first) = section.entries.insert(key, entry) {
            let reason = format!("the entry of line {} again; remove one of them", first.line);
            return Err(refuse(line, reason));
        }
    }
    Ok(sections)
}
