//! Kinds of files by their first bytes, and files of other tools that are not read.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// Number of bytes that are inspected.
const INSPECTED_BYTES: u64 = 128;

/// First bytes of an SQLite database, whose only use here is a bag.
pub(crate) const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";

/// First bytes of files that are not read, each with its name and the remedy.
const CONTAINERS: [(&[u8], &str, &str); 12] = [
    (
        b"#ROSBAG V2.0",
        "a ROS 1 bag",
        "write it as a ROS 2 bag: `rosbags-convert --src FILE --dst FOLDER` (pip install rosbags)",
    ),
    (
        b"LOGG",
        "a binary log of Vector's tools (BLF)",
        "write it as ASC: `python -m can.logconvert FILE log.asc` (pip install python-can)",
    ),
    (
        b"MDF ",
        "an ASAM MDF file",
        "write it as CSV, or the frames of a bus as ASC, with asammdf (pip install asammdf)",
    ),
    (
        b"\x89HDF\r\n\x1a\n",
        "an HDF5 file, as MATLAB 7.3 writes them, too",
        "write its signals as CSV, for example with h5py and numpy.savetxt",
    ),
    (
        b"MATLAB 5.0 MAT-file",
        "a MAT file",
        "write its signals as CSV: writetable in MATLAB, or scipy.io.loadmat and numpy.savetxt",
    ),
    (b"\x93NUMPY", "a NumPy array", "write it as CSV with numpy.savetxt"),
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
    (b"\x28\xb5\x2f\xfd", "compressed by zstd", "decompress it: `zstd -d FILE`"),
    (b"\xfd7zXZ\0", "compressed by xz", "decompress it: `xz -d FILE`"),
    (b"BZh", "compressed by bzip2", "decompress it: `bunzip2 FILE`"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "extract it, and give the file in it"),
];

/// Returns true if a file begins with these bytes.
pub(crate) fn begins_with(path: &Path, magic: &[u8]) -> bool {
    let mut begin = vec![0; magic.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok() && begin == magic
}

/// Returns what a file is and the remedy, if it is a file of another tool that is not read.
pub fn foreign_container(path: &Path) -> Option<String> {
    let mut begin = Vec::new();
    File::open(path).and_then(|file| file.take(INSPECTED_BYTES).read_to_end(&mut begin)).ok()?;
    let (name, remedy) = if begin.starts_with(b"PK\x03\x04") {
        zip_content(&begin, path)
    } else {
        let found = CONTAINERS.iter().find(|(magic, ..)| begin.starts_with(magic))?;
        (found.1, found.2)
    };
    Some(format!("this is {name}, which is not read; {remedy}"))
}

/// Returns the kind of a ZIP file by the name of its first entry, or by its own name.
fn zip_content(begin: &[u8], path: &Path) -> (&'static str, &'static str) {
    let holds = |part: &[u8]| begin.windows(part.len()).any(|window| window == part);
    let is = |extension: &str| path.extension().is_some_and(|own| own == extension);
    if holds(b".npy") || is("npz") {
        ("a NumPy archive (NPZ)", "write its arrays as CSV with numpy.savetxt")
    } else if holds(b"[Content_Types].xml") || holds(b"_rels/") || holds(b"xl/") || is("xlsx") {
        ("a spreadsheet (XLSX)", "save it as CSV (UTF-8)")
    } else {
        ("a ZIP archive", "extract it, and give the file in it")
    }
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
        let zip = |entry: &[u8]| said(&[&b"PK\x03\x04"[..], &[0; 26], entry].concat()).unwrap();
        assert!(zip(b"q.npy").contains("NPZ"));
        assert!(zip(b"[Content_Types].xml").contains("XLSX"));
        assert!(zip(b"a.csv").contains("ZIP"));
        for read in [&b"time_s,a\n"[..], b"\x89MCAP0\r\n", b"PAR1", b"\x1f\x8b", b""] {
            assert_eq!(said(read), None);
        }
        assert_eq!(foreign_container(folder.path()), None);
    }
}
