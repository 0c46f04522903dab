//! Kinds of files by their first bytes, and files of other tools that are not read.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::text_kind::TextKind;

/// Number of bytes that are inspected: those of a container, and those of a text.
const INSPECTED_BYTES: u64 = 16 * 1024;
const MAGIC_BYTES: usize = 128;

/// First bytes of an SQLite database, whose only use here is a bag.
pub(crate) const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";

/// First bytes of files that are not read, each with its name and the remedy.
const CONTAINERS: [(&[u8], &str, &str); 11] = [
    (
        b"#ROSBAG V2.0",
        "a ROS 1 bag",
        "write it as a ROS 2 bag: `rosbags-convert --src FILE --dst FOLDER` (pip install rosbags)",
    ),
    (
        b"MDF ",
        "an ASAM MDF file",
        "write it as CSV, or the frames of a bus as ASC, with asammdf (pip install asammdf)",
    ),
    (
        SQLITE_MAGIC,
        "an SQLite database",
        "if it is a ROS 2 bag, describe it as [data.bag] of the cell, or give it as --bag",
    ),
    (
        b"timestamp,arbitration_id,",
        "a table of frames by python-can",
        "write it as a log: `python -m can.logconvert FILE frames.log` (pip install python-can)",
    ),
    (b"ARROW1", "an Arrow file (Feather)", ARROW_REMEDY),
    (b"FEA1", "a Feather file", ARROW_REMEDY),
    (
        b"TDSm",
        "a TDMS file of LabVIEW",
        "write it as CSV (pip install npTDMS pandas): python3 -c \"import sys, nptdms as n; \
        f = n.TdmsFile.read(sys.argv[1]); d = f.as_dataframe(); c = f.groups()[0].channels()[0]; \
        'wf_increment' in c.properties and d.insert(0, 'time_s', c.time_track()); \
        d.to_csv(sys.argv[2], index=False)\" FILE run.csv",
    ),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd", "decompress it: `zstd -d FILE`"),
    (b"\xfd7zXZ\0", "compressed by xz", "decompress it: `xz -d FILE`"),
    (b"BZh", "compressed by bzip2", "decompress it: `bunzip2 FILE`"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "extract it, and give the file in it"),
];

/// Command that writes an Arrow file as Parquet.
const ARROW_REMEDY: &str = "write it as Parquet (pip install pandas pyarrow): python3 -c \
    \"import sys, pandas as p; p.read_feather(sys.argv[1]).to_parquet(sys.argv[2])\" FILE \
    run.parquet";

/// A kind of file with named arrays, which NumPy can write as CSV.
struct ArrayFile {
    magic: &'static [u8],
    name: &'static str,
    /// Python module that reads it, and its package in the Python package index.
    module: &'static str,
    package: &'static str,
    /// Python expression of a dictionary of arrays from the file `p`.
    arrays: &'static str,
}

/// First bytes of a ZIP file, which an NPZ file is.
const ZIP_MAGIC: &[u8] = b"PK\x03\x04";

const ARRAY_FILES: [ArrayFile; 4] = [
    ArrayFile {
        magic: b"\x89HDF\r\n\x1a\n",
        name: "an HDF5 file, as MATLAB 7.3 writes them, too",
        module: "h5py",
        package: "h5py",
        arrays: "(lambda f, d: f.visititems(lambda k, v: d.update({k: n.array(v)}) \
            if hasattr(v, 'dtype') else None) or d)(h5py.File(p), {})",
    },
    ArrayFile {
        magic: b"MATLAB 5.0 MAT-file",
        name: "a MAT file",
        module: "scipy.io",
        package: "scipy",
        arrays: "{k: v for k, v in scipy.io.loadmat(p).items() if k[0] != '_'}",
    },
    ArrayFile {
        magic: b"\x93NUMPY",
        name: "a NumPy array",
        module: "numpy",
        package: "numpy",
        arrays: "{'column': n.load(p)}",
    },
    ArrayFile {
        magic: ZIP_MAGIC,
        name: "a NumPy archive (NPZ)",
        module: "numpy",
        package: "numpy",
        arrays: "dict(n.load(p))",
    },
];

impl ArrayFile {
    /// Returns the command that writes the arrays of a file as a table: those with as many rows as
    /// the longest one, each column with the name of its array and its number.
    fn conversion(&self, path: &Path) -> String {
        let Self { module, arrays, .. } = self;
        let [from, to] = [path.to_owned(), path.with_extension("csv")].map(quoted_for_shell);
        format!(
            "python3 -c \"import sys, numpy as n, {module}; p, o = sys.argv[1:]; \
            d = {{k: v for k, v in ({arrays}).items() if v.dtype.kind in 'fiu' and v.ndim in (1, \
            2) and v.size}}; r = max(max(v.shape) for v in d.values()); c = {{k: (v if v.shape[0] \
            == r else v.T).reshape(r, -1) for k, v in d.items() if r in v.shape}}; n.savetxt(o, \
            n.hstack(list(c.values())), fmt='%.17g', delimiter=',', comments='', \
            header=','.join(k if v.shape[1] == 1 else f'{{k}}_{{j + 1}}' for k, v in c.items() \
            for j in range(v.shape[1])))\" {from} {to}"
        )
    }
}

/// Quotes a path for a shell, if it has other characters than those of plain file names.
fn quoted_for_shell(path: PathBuf) -> String {
    let text = path.to_string_lossy();
    let is_plain = |c: char| c.is_alphanumeric() || "_-./".contains(c);
    match text.chars().all(is_plain) {
        true => text.into_owned(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// Returns true if a file begins with these bytes.
pub(crate) fn begins_with(path: &Path, magic: &[u8]) -> bool {
    let mut begin = vec![0; magic.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok() && begin == magic
}

/// Returns what a file is and the remedy, if it is a file of another tool that is not read, or a
/// text that is no recording.
pub fn foreign_container(path: &Path) -> Option<String> {
    let mut begin = Vec::new();
    File::open(path).and_then(|file| file.take(INSPECTED_BYTES).read_to_end(&mut begin)).ok()?;
    // The end of the inspected bytes can divide a character.
    let text = begin.utf8_chunks().next().map_or("", |chunk| chunk.valid());
    if let Some(kind) = TextKind::detect(text).filter(|kind| kind.is_no_recording())
        && (!text.is_empty() || begin.is_empty())
    {
        return Some(format!("this is {kind}, not a recording; name the file of the signals"));
    }
    begin.truncate(MAGIC_BYTES);
    let is_zip = begin.starts_with(ZIP_MAGIC);
    let is_array = |file: &&ArrayFile| {
        begin.starts_with(file.magic) && (!is_zip || is_numpy_archive(&begin, path))
    };
    if let Some(file) = ARRAY_FILES.iter().find(is_array) {
        let (name, package, command) = (file.name, file.package, file.conversion(path));
        return Some(format!(
            "this is {name}, which is not read; write its arrays as CSV (pip install {package}): \
            {command}"
        ));
    }
    let (name, remedy) = if is_zip {
        zip_content(&begin, path)
    } else {
        let found = CONTAINERS.iter().find(|(magic, ..)| begin.starts_with(magic))?;
        (found.1, found.2)
    };
    Some(format!("this is {name}, which is not read; {remedy}"))
}

/// Returns true if the first entry of a ZIP file is an array, or its own name is that of an NPZ.
fn is_numpy_archive(begin: &[u8], path: &Path) -> bool {
    holds(begin, b".npy") || path.extension().is_some_and(|own| own == "npz")
}

/// Returns the kind of another ZIP file by the name of its first entry, or by its own name.
fn zip_content(begin: &[u8], path: &Path) -> (&'static str, &'static str) {
    let is_xlsx = path.extension().is_some_and(|own| own == "xlsx");
    let entries: [&[u8]; 3] = [b"[Content_Types].xml", b"_rels/", b"xl/"];
    match is_xlsx || entries.iter().any(|entry| holds(begin, entry)) {
        true => ("a spreadsheet (XLSX)", "save it as CSV (UTF-8)"),
        false => ("a ZIP archive", "extract it, and give the file in it"),
    }
}

fn holds(begin: &[u8], part: &[u8]) -> bool {
    begin.windows(part.len()).any(|window| window == part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_another_tool_is_named_with_its_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let said = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            foreign_container(&path)
        };
        for (magic, name, remedy) in CONTAINERS {
            let said = said(&[magic, b"rest"].concat()).unwrap();
            assert!(said.contains(name) && said.contains(remedy), "{said}");
        }
        for file in &ARRAY_FILES {
            let said = said(&[file.magic, b"rest q.npy"].concat()).unwrap();
            let command = format!(": {}", file.conversion(&path));
            assert!(said.contains(file.name) && said.ends_with(&command), "{said}");
        }
        let zip = |entry: &[u8]| said(&[&b"PK\x03\x04"[..], &[0; 26], entry].concat()).unwrap();
        assert!(zip(b"q.npy").contains("NPZ"));
        assert!(zip(b"[Content_Types].xml").contains("XLSX"));
        assert!(zip(b"a.csv").contains("ZIP"));
        for (text, kind) in [
            (&b""[..], TextKind::Empty),
            (b"<robot name=\"a\">", TextKind::Urdf),
            (b"name = \"a\"\nrobot = \"a.urdf\"\n", TextKind::Cell),
        ] {
            assert!(said(text).unwrap().contains(&kind.to_string()), "{kind}");
        }
        for read in [&b"time_s,a\n"[..], b"\x89MCAP0\r\n", b"PAR1", b"\x1f\x8b"] {
            assert_eq!(said(read), None);
        }
        assert_eq!(foreign_container(folder.path()), None);
    }
}
