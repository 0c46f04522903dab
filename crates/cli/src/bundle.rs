//! The archive of `didim bundle`: configuration, status, history, a result and a recording in one
//! file, which `didim replay` opens.

use std::fs::{self, File};
use std::io::{self, Cursor, Read as _};
use std::path::{Path, PathBuf};

use ruzstd::decoding::StreamingDecoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use serde::{Deserialize, Serialize};
use tempfile::TempDir;

use super::CliError;
use didim::cell::{Cell, Library};

/// Ending of a bundle's name.
pub(crate) const ENDING: &str = ".tar.zst";
/// Maximum size of a bundle before its compression \[bytes\]. It is packed in memory.
pub(crate) const MAX_BYTES: u64 = 256 << 20;
/// Name of the table of contents in the archive.
const CONTENTS: &str = "bundle.json";
/// Name of the recording in the archive.
pub(crate) const RECORDING: &str = "recording.mcap";
/// Name of the journal in the archive.
pub(crate) const JOURNAL: &str = "journal.txt";
/// Version of the table of contents.
const SCHEMA: u32 = 1;

/// Table of contents of a bundle.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Contents {
    schema: u32,
    /// Version of the program that packed it.
    pub(crate) version: String,
    /// Release of the kernel.
    pub(crate) kernel: String,
    /// Architecture of the processor.
    pub(crate) processor: String,
    /// Path of the cell file on its machine.
    pub(crate) cell: PathBuf,
    /// Files of the configuration: their paths on the machine and their names in the archive.
    pub(crate) configuration: Vec<(PathBuf, String)>,
    /// Parts that could not be packed, each with its reason.
    pub(crate) left_out: Vec<(String, String)>,
}

/// A bundle that is being packed.
#[derive(Default)]
pub(crate) struct Bundle {
    pub(crate) contents: Contents,
    members: Vec<(String, Vec<u8>)>,
}

impl Bundle {
    /// Adds a file.
    pub(crate) fn add(&mut self, name: &str, content: Vec<u8>) {
        self.members.push((name.to_owned(), content));
    }

    /// Adds a part, or the reason why it is missing.
    pub(crate) fn add_or_explain(&mut self, name: &str, part: Result<Vec<u8>, String>) {
        match part {
            Ok(content) => self.add(name, content),
            Err(why) => self.contents.left_out.push((name.to_owned(), why)),
        }
    }

    /// Adds the files of the configuration. Their paths are kept in the table of contents.
    pub(crate) fn add_configuration(&mut self, files: Vec<(PathBuf, String)>) {
        for (number, (path, text)) in files.into_iter().enumerate() {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            let name = format!("configuration/{number}-{file}");
            self.add(&name, text.into_bytes());
            self.contents.configuration.push((path, name));
        }
    }

    /// Removes secrets from TOML files and the journal, the name of the machine from the journal
    /// and the reasons, and names of users in paths from all texts. A cell may have the name of the
    /// machine as another word.
    pub(crate) fn remove_secrets(&mut self, machine: &str) {
        let mut users = Users::default();
        for (name, content) in &mut self.members {
            if [".mcap", ".zst"].iter().any(|ending| name.ends_with(ending)) {
                continue;
            }
            // A damaged file is taken for text as far as it is.
            let text = String::from_utf8_lossy(content);
            let text = match name.as_str() {
                JOURNAL => without_word(&without_secrets(&text), machine),
                // A message of a DBC file may be called after a token.
                name if name.ends_with(".toml") => without_secrets(&text),
                _ => text.into_owned(),
            };
            *content = users.remove_from(&text).into_bytes();
        }
        let paths = self.contents.configuration.iter_mut().map(|(path, _)| path);
        for path in paths.chain([&mut self.contents.cell]) {
            *path = users.remove_from(&path.to_string_lossy()).into();
        }
        for (part, why) in &mut self.contents.left_out {
            *part = users.remove_from(part);
            *why = users.remove_from(&without_word(&without_secrets(why), machine));
        }
    }

    /// Packs and compresses all parts.
    ///
    /// # Errors
    /// The parts exceed [`MAX_BYTES`].
    pub(crate) fn pack(mut self) -> Result<Vec<u8>, CliError> {
        self.contents.schema = SCHEMA;
        let contents = serde_json::to_vec_pretty(&self.contents).map_err(CliError::from_failure)?;
        self.members.insert(0, (CONTENTS.to_owned(), contents));
        let size: u64 = self.members.iter().map(|(_, content)| content.len() as u64).sum();
        if size > MAX_BYTES {
            let why = format!(
                "the bundle would have {} MB before compression, more than {} MB; choose a \
                 shorter recording",
                size >> 20,
                MAX_BYTES >> 20
            );
            return Err(CliError::from_failure(why));
        }
        let mut archive = tar::Builder::new(Vec::new());
        for (name, content) in &self.members {
            let mut header = tar::Header::new_gnu();
            header.set_size(content.len() as u64);
            header.set_mode(0o644);
            archive
                .append_data(&mut header, name, content.as_slice())
                .map_err(CliError::from_failure)?;
        }
        let archive = archive.into_inner().map_err(CliError::from_failure)?;
        Ok(compress_to_vec(archive.as_slice(), CompressionLevel::Fastest))
    }
}

/// Words that name a secret, before its value.
const SECRETS: [&str; 10] = [
    "password",
    "passwd",
    "passphrase",
    "pwd",
    "secret",
    "token",
    "api_key",
    "apikey",
    "credential",
    "bearer",
];

/// Replaces values of secrets to the end of their line.
fn without_secrets(text: &str) -> String {
    let mut remaining = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let Some(begin) = begin_of_secret(line) else {
            remaining += line;
            continue;
        };
        // A table in one line goes on after a value in quotes.
        let value = line[begin..].trim_start();
        let quote = value.chars().next().filter(|first| matches!(first, '"' | '\''));
        let end = quote.and_then(|quote| Some(value[1..].find(quote)? + 2));
        let rest = end.map_or("\n", |end| &value[end..]);
        remaining += &format!("{} \"removed\"{rest}", &line[..begin]);
    }
    remaining
}

/// Returns the place after the sign that follows the first word for a secret.
fn begin_of_secret(line: &str) -> Option<usize> {
    let lower = line.to_ascii_lowercase();
    let words = SECRETS.iter().filter_map(|word| Some(lower.find(word)? + word.len()));
    let signs = words.filter_map(|end| Some(end + line[end..].find(['=', ':'])? + 1));
    signs.min()
}

/// Replaces the name of the machine where it stands as a word.
fn without_word(text: &str, name: &str) -> String {
    if name.is_empty() {
        return text.to_owned();
    }
    let is_word =
        |each: Option<char>| each.is_some_and(|each| each.is_alphanumeric() || each == '_');
    let (mut rest, mut replaced) = (text, String::with_capacity(text.len()));
    while let Some((before, after)) = rest.split_once(name) {
        let begun = before.chars().next_back().or_else(|| replaced.chars().next_back());
        let is_name = !is_word(begun) && !is_word(after.chars().next());
        replaced += before;
        replaced += if is_name { "machine" } else { name };
        rest = after;
    }
    replaced + rest
}

/// Users whose folders are named. Each keeps a name of its own.
#[derive(Default)]
struct Users(Vec<String>);

impl Users {
    /// Replaces the names of users in paths of their folders.
    fn remove_from(&mut self, text: &str) -> String {
        let is_of_name =
            |each: char| each.is_ascii_alphanumeric() || matches!(each, '.' | '_' | '-');
        let mut parts = text.split("/home/");
        let mut replaced = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let end = part.find(|each: char| !is_of_name(each)).unwrap_or(part.len());
            let (name, rest) = part.split_at(end);
            let number = self.0.iter().position(|other| other == name).unwrap_or_else(|| {
                self.0.push(name.to_owned());
                self.0.len() - 1
            });
            replaced += &format!("/home/user{}{rest}", number + 1);
        }
        replaced
    }
}

/// A bundle whose files are in a temporary folder.
pub(crate) struct OpenedBundle {
    file: PathBuf,
    folder: TempDir,
    contents: Contents,
}

impl OpenedBundle {
    /// Unpacks a bundle. Returns `None` for a file that is none by its name.
    ///
    /// # Errors
    /// The archive is damaged, too large, or of a newer version.
    pub(crate) fn open_if_bundle(file: &Path) -> Result<Option<Self>, CliError> {
        if !file.as_os_str().as_encoded_bytes().ends_with(ENDING.as_bytes()) {
            return Ok(None);
        }
        let refused = |cause: &dyn std::fmt::Display| {
            CliError::in_file(file, format!("not a bundle of `didim bundle`: {cause}"))
        };
        let compressed = File::open(file).map_err(|cause| CliError::in_file(file, cause))?;
        let decoder = StreamingDecoder::new(compressed).map_err(|cause| refused(&cause))?;
        let mut archive = Vec::new();
        let limit = 2 * MAX_BYTES;
        decoder.take(limit).read_to_end(&mut archive).map_err(|cause| refused(&cause))?;
        if archive.len() as u64 == limit {
            return Err(refused(&"it is too large"));
        }
        let folder = tempfile::Builder::new().prefix("didim-").tempdir();
        let folder = folder.map_err(CliError::from_failure)?;
        unpack(archive, folder.path()).map_err(|cause| refused(&cause))?;
        let text = fs::read_to_string(folder.path().join(CONTENTS));
        let text = text.map_err(|cause| refused(&cause))?;
        let contents: Contents = serde_json::from_str(&text).map_err(|cause| refused(&cause))?;
        if contents.schema != SCHEMA {
            return Err(refused(&format!("schema {} instead of {SCHEMA}", contents.schema)));
        }
        Ok(Some(Self { file: file.to_owned(), folder, contents }))
    }

    /// Reads the cell from the files of the bundle, under the paths of its machine.
    ///
    /// # Errors
    /// A file is missing, or the cell is invalid.
    pub(crate) fn cell(&self) -> Result<Cell, CliError> {
        let mut files = Vec::new();
        for (path, name) in &self.contents.configuration {
            let plain = Path::new(name)
                .components()
                .all(|part| matches!(part, std::path::Component::Normal(_)));
            let inside = self.folder.path().join(name);
            let text = plain.then(|| fs::read_to_string(inside)).transpose();
            let text = text.map_err(|cause| CliError::in_file(&self.file, cause))?;
            files.push((path.to_string_lossy(), text.unwrap_or_default()));
        }
        let texts: Vec<(&str, &str)> =
            files.iter().map(|(path, text)| (path.as_ref(), text.as_str())).collect();
        let cell = &self.contents.cell;
        Cell::from_library(Library::Texts(&texts), cell)
            .and_then(|read| read.require_decided(cell))
            .map_err(CliError::from_configuration)
    }

    /// Returns the path of the unpacked recording.
    ///
    /// # Errors
    /// The bundle has none.
    pub(crate) fn recording(&self) -> Result<PathBuf, CliError> {
        let path = self.folder.path().join(RECORDING);
        path.is_file().then_some(path).ok_or_else(|| {
            let why = "the bundle has no recording; pack it with --recording FILE";
            CliError::in_file(&self.file, why)
        })
    }
}

/// Unpacks the files of an archive. A link could lead to any file of this machine.
fn unpack(archive: Vec<u8>, folder: &Path) -> io::Result<()> {
    for member in tar::Archive::new(Cursor::new(archive)).entries()? {
        let mut member = member?;
        let kind = member.header().entry_type();
        // `unpack_in` returns false for a path that leads out of the folder.
        if !(kind.is_file() || kind.is_dir()) || !member.unpack_in(folder)? {
            let name = String::from_utf8_lossy(&member.path_bytes()).into_owned();
            return Err(io::Error::other(format!("`{name}` in it is not a file of a bundle")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bundle_has_no_secret_and_no_name() {
        let text = "# Password: hunter2\nbroker_password = \"hunter2\"\nrobot = \
            \"/home/me/arm.urdf\"\nat arm-7, not arm-71 or charm-7\n";
        assert_eq!(
            Users::default().remove_from(&without_word(&without_secrets(text), "arm-7")),
            "# Password: \"removed\"\nbroker_password = \"removed\"\nrobot = \
             \"/home/user1/arm.urdf\"\nat machine, not arm-71 or charm-7\n"
        );
        assert_eq!(without_word("a b", ""), "a b");
        let table = "bus = { token = 'a', address = \"can:can0\" }\n";
        assert_eq!(
            without_secrets(table),
            "bus = { token = \"removed\", address = \"can:can0\" }\n"
        );
        let mut users = Users::default();
        let paths = ["'/home/a.b/x' /home/c", "/home/c/y"].map(|text| users.remove_from(text));
        assert_eq!(paths, ["'/home/user1/x' /home/user2", "/home/user2/y"]);
    }

    /// A machine with the name of a key, and a frame with the name of a secret.
    #[test]
    fn a_configuration_can_still_be_read() {
        let (cell, dbc) = ("robot = \"tx40.toml\"\n", "SG_ Token : 0|8@1+ (1,0)\n");
        let mut bundle = Bundle::default();
        bundle.add_configuration(vec![
            ("/etc/didim/cell.toml".into(), cell.to_owned()),
            ("/etc/didim/arm.dbc".into(), dbc.to_owned()),
        ]);
        bundle.add(JOURNAL, b"robot didim[2]: starts\n".to_vec());
        bundle.remove_secrets("robot");
        let texts = bundle.members.iter().map(|(_, content)| content.as_slice());
        let expected = [cell, dbc, "machine didim[2]: starts\n"].map(str::as_bytes);
        assert!(texts.eq(expected));
    }
}
