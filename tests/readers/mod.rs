//! Damaged files: no reader of bytes from outside panics, hangs, or says nothing.
//!
//! Damage with a fixed seed to known files and to what `fuzz/corpus` has. Text is damaged by
//! fields, so that what is behind the first of them is read as well.

mod list;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};

use list::{READERS, Reader, repository};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Damaged forms of each file.
const DAMAGED: usize = 200;

/// What a field becomes.
const FIELDS: [&str; 18] = [
    "",
    "0",
    "-1",
    "1",
    "255",
    "65536",
    "4294967296",
    "18446744073709551616",
    "-0.0",
    "1e400",
    "NaN",
    "inf",
    "nonsense",
    "\u{1b}[31m",
    "%n%s",
    "ü",
    "\0",
    "[[[[",
];

struct Corrupter(ChaCha8Rng);

impl Corrupter {
    fn below(&mut self, bound: usize) -> usize {
        usize::try_from(self.0.next_u64() % u64::try_from(bound.max(1)).unwrap()).unwrap()
    }

    fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(3) {
            match std::str::from_utf8(&bytes) {
                Ok(text) if self.below(4) > 0 => bytes = self.damaged_text(text).into_bytes(),
                _ => self.corrupt(&mut bytes),
            }
        }
        bytes
    }

    /// A field replaced; or a line left out, doubled, moved or cut.
    fn damaged_text(&mut self, text: &str) -> String {
        let mut lines: Vec<String> = text.split_inclusive('\n').map(str::to_owned).collect();
        if lines.is_empty() {
            return String::new();
        }
        let (at, other) = (self.below(lines.len()), self.below(lines.len()));
        match self.below(8) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(other, lines[at].clone()),
            2 => lines.swap(at, other),
            3 => {
                let cut = self.below(lines[at].len());
                let cut = lines[at].floor_char_boundary(cut);
                lines[at].truncate(cut);
            }
            _ => {
                let is_field = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '_' | '+');
                let line = &lines[at];
                let mut begins: Vec<usize> = Vec::new();
                let mut before = false;
                for (place, c) in line.char_indices() {
                    if is_field(c) && !before {
                        begins.push(place);
                    }
                    before = is_field(c);
                }
                let Some(&begin) = begins.get(self.below(begins.len())) else {
                    return lines.concat();
                };
                let length = line[begin..].find(|c| !is_field(c)).unwrap_or(line.len() - begin);
                let field = FIELDS[self.below(FIELDS.len())];
                lines[at].replace_range(begin..begin + length, field);
            }
        }
        lines.concat()
    }

    /// Bits, integers with a meaning of their own, a piece out or in twice, an end too soon.
    fn corrupt(&mut self, bytes: &mut Vec<u8>) {
        if bytes.is_empty() {
            return bytes.push(0);
        }
        let place = self.below(bytes.len());
        let length = self.below(64.min(bytes.len() - place)) + 1;
        match self.below(6) {
            0 => bytes[place] ^= 1 << self.below(8),
            1 => bytes[place..place + length].fill([0, 0x7F, 0x80, 0xFF][self.below(4)]),
            2 => drop(bytes.drain(place..place + length)),
            3 => {
                let piece = bytes[place..place + length].to_vec();
                bytes.splice(place..place, piece);
            }
            4 => bytes.truncate(place),
            _ => bytes[place] = u8::try_from(self.below(256)).unwrap(),
        }
    }
}

/// What a reader is known to have read: the repository's files, and what was found by `fuzz/`.
fn known_files(reader: &Reader) -> Vec<(String, Vec<u8>)> {
    let mut paths: Vec<_> = reader.files.iter().map(|file| repository(file)).collect();
    let folder = repository("fuzz/corpus").join(reader.name);
    paths.extend(fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path()));
    paths.sort();
    let read = |path: std::path::PathBuf| (path.display().to_string(), fs::read(&path).unwrap());
    paths.into_iter().map(read).collect()
}

fn damaged_files_are_refused(name: &str) {
    let reader = READERS.iter().find(|reader| reader.name == name).unwrap();
    let files = known_files(reader);
    assert!(!files.is_empty(), "{name} has no file");
    let mut corrupt = Corrupter(ChaCha8Rng::seed_from_u64(19));
    for (path, bytes) in files {
        (reader.read)(&bytes);
        for number in 0..DAMAGED {
            let damaged = corrupt.damaged(&bytes);
            if catch_unwind(AssertUnwindSafe(|| (reader.read)(&damaged))).is_err() {
                let input = std::env::temp_dir().join(format!("didim-{name}-{number}"));
                fs::write(&input, &damaged).unwrap();
                panic!("{path}, damaged {number} times: see above; kept as {}", input.display());
            }
        }
    }
}

macro_rules! tests {
    ($($name:ident),* $(,)?) => {
        $(#[test]
        fn $name() {
            damaged_files_are_refused(stringify!($name));
        })*

        #[test]
        fn every_reader_is_tested() {
            assert!(READERS.iter().map(|reader| reader.name).eq([$(stringify!($name)),*]));
        }
    };
}

tests!(
    log,
    binary_log,
    recording,
    capture,
    table,
    parquet,
    bag,
    motion,
    urdf,
    mesh,
    robot,
    cell,
    dbc,
    device_file,
    eni,
    scenario,
    command,
    history,
    baseline,
    result,
);
