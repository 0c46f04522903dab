//! What the commands print, held against what they printed before.
//!
//! `DIDIM_WRITE_GOLDEN=1` writes the files anew; look at the difference before it is committed.

use std::fs::File;
use std::path::Path;
use std::time::{Duration, UNIX_EPOCH};

use super::support::{Folder, data, didim, packed_cell, shipped};

/// Holds a text against the file of this name.
#[track_caller]
pub(crate) fn golden(name: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/command_line/golden").join(name);
    if std::env::var_os("DIDIM_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap();
    for (line, (found, expected)) in text.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "{}:{}", path.display(), line + 1);
    }
    assert_eq!(text.lines().count(), expected.lines().count(), "{}", path.display());
}

#[test]
fn identify_prints_what_it_printed() {
    let (cell, input) = (packed_cell(), &data().packed_log);
    // The log has no date: that of its file is printed.
    let noon = UNIX_EPOCH + Duration::from_secs(1_709_294_400);
    File::options().append(true).open(input).unwrap().set_modified(noon).unwrap();
    for method in ["idim-ls", "didim"] {
        let command = ["identify", "--cell", &cell, "--input", input, "--method", method];
        golden(&format!("identify-{method}.txt"), &didim(&command).done());
    }
}

/// Every shipped cell, wherever it runs: whether there is a bus here is not the cell's.
#[test]
fn check_prints_what_it_printed() {
    let mut cells = 0;
    for entry in std::fs::read_dir(shipped("cells")).unwrap() {
        let cell = entry.unwrap().path();
        let name = cell.file_stem().unwrap().to_str().unwrap().to_owned();
        let text = didim(&["check", "--cell", cell.to_str().unwrap(), "--other-machine"]).done();
        assert!(text.contains("\nthe configuration is valid"), "{text}");
        golden(&format!("check-{name}.txt"), &text.replace(&shipped("cells"), "config/cells"));
        cells += 1;
    }
    assert!(cells > 3);
}

#[test]
fn demo_prints_what_it_printed() {
    let folder = Folder::new();
    let figure = folder.path("figure.svg");
    let text = didim(&["demo", "--fast", "--figure", &figure]).done();
    golden("demo.txt", &text.replace(&figure, "figure.svg"));
    // A report changes nothing of it, and is that of `identify`.
    let report = folder.path("report.html");
    let output = didim(&["demo", "--fast", "--figure", &figure, "--report", &report]).done();
    assert_eq!(output, format!("{text}report: {report}\n"));
    let html = std::fs::read_to_string(&report).unwrap();
    for part in ["<h2>Parameters</h2>", "of the stream", "class=\"sigmas\""] {
        assert!(html.contains(part), "{part}");
    }
}
