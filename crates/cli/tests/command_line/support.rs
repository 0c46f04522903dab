//! Running the program, and the data it is run on.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// What a run of the program left behind.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs the program, with nothing on its stdin and no `RUST_LOG`.
pub(crate) fn didim(arguments: &[&str]) -> Outcome {
    let output = Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

impl Outcome {
    /// It did its work: what it printed.
    #[track_caller]
    pub(crate) fn done(self) -> String {
        assert_eq!(self.code, Some(0), "{self:#?}");
        self.stdout
    }

    /// It ended with this code, and stderr has every one of these; stdout may have its say too.
    #[track_caller]
    pub(crate) fn says(self, code: i32, says: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:#?}");
        for part in says {
            assert!(self.stderr.contains(part), "should say {part:?}:\n{}", self.stderr);
        }
    }

    /// It refused with this code, and stderr has every one of these.
    #[track_caller]
    pub(crate) fn refused(self, code: i32, says: &[&str]) -> String {
        assert_eq!(self.code, Some(code), "{self:#?}");
        assert_eq!(self.stdout, "", "a refusal prints nothing on stdout: {self:#?}");
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        for part in says {
            assert!(self.stderr.contains(part), "should say {part:?}:\n{}", self.stderr);
        }
        println!("{}", self.stderr);
        self.stderr
    }
}

/// The shipped configuration.
pub(crate) fn shipped(path: &str) -> String {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../config"))
        .join(path)
        .to_str()
        .unwrap()
        .to_owned()
}

/// The cell of the packed CAN FD frames, 5 kHz.
pub(crate) fn packed_cell() -> String {
    shipped("cells/tx40-packed-fd.toml")
}

/// The cell of the CiA 402 drives, 500 Hz.
pub(crate) fn cia402_cell() -> String {
    shipped("cells/tx40-cia402.toml")
}

/// Recordings of the simulated arm, made once.
pub(crate) struct Data {
    /// The whole motion in packed CAN FD frames, 5 kHz.
    pub(crate) packed_log: String,
    /// The same as CSV.
    pub(crate) packed_csv: String,
    /// The whole motion by CiA 402 drives, 500 Hz.
    pub(crate) cia402_log: String,
}

/// The recordings. The program writes whole files only and the same bytes every time, so that
/// another run of the tests in the same folder does no harm.
pub(crate) fn data() -> &'static Data {
    static DATA: OnceLock<Data> = OnceLock::new();
    DATA.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command_line");
        std::fs::create_dir_all(&folder).unwrap();
        let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        let data = Data {
            packed_log: file("packed.log"),
            packed_csv: file("packed.csv"),
            cia402_log: file("cia402.log"),
        };
        for (cell, log) in [(packed_cell(), &data.packed_log), (cia402_cell(), &data.cia402_log)] {
            didim(&["sim", "--cell", &cell, "--bus", &format!("log:{log}")]).done();
        }
        didim(&["convert", "--cell", &packed_cell(), &data.packed_log, &data.packed_csv]).done();
        data
    })
}

/// The first `lines` lines of a file.
pub(crate) fn head(file: &str, lines: usize) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    text.split_inclusive('\n').take(lines).collect()
}

/// A folder of a test's own, removed at its end.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        // Not named as the program's own temporary files are.
        let named = tempfile::Builder::new().prefix("command_line-").to_owned();
        Self(named.tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap())
    }

    /// The path of a file in it, which need not exist.
    pub(crate) fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    /// A new file in it.
    pub(crate) fn file(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// The names of what is in it, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// A copy of the shipped configuration that a test may damage.
pub(crate) struct Configuration(Folder);

impl Configuration {
    pub(crate) fn new() -> Self {
        let folder = Folder::new();
        for part in ["cells", "robots", "dbc", "eds", "eni"] {
            std::fs::create_dir(folder.path(part)).unwrap();
            for entry in std::fs::read_dir(shipped(part)).unwrap() {
                let entry = entry.unwrap();
                let name = entry.file_name().into_string().unwrap();
                std::fs::copy(entry.path(), folder.path(&format!("{part}/{name}"))).unwrap();
            }
        }
        Self(folder)
    }

    /// The shipped configuration with one edit.
    pub(crate) fn with_edit(file: &str, from: &str, to: &str) -> Self {
        let configuration = Self::new();
        configuration.edit(file, from, to);
        configuration
    }

    pub(crate) fn path(&self, file: &str) -> String {
        self.0.path(file)
    }

    /// Replaces the first occurrence; gives the line, from 1, on which it begins.
    #[track_caller]
    pub(crate) fn edit(&self, file: &str, from: &str, to: &str) -> usize {
        let path = PathBuf::from(self.path(file));
        let text = std::fs::read_to_string(&path).unwrap();
        let start = text.find(from).unwrap_or_else(|| panic!("{file} has no {from:?}"));
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        1 + text[..start].matches('\n').count()
    }

    /// The cell of the packed CAN FD frames.
    pub(crate) fn packed_cell(&self) -> String {
        self.path("cells/tx40-packed-fd.toml")
    }
}
