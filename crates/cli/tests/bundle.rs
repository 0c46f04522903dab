//! `didim bundle`: what it packs, and that a replay of it gives the result of the recording.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use crate::program::{didim, json, repository, results, succeed};

const CELL: &str = "tests/data/stored/config/cells/tx40-cia402.toml";
const RECORDING: &str = "tests/data/stored/drive.mcap";

#[test]
fn a_replay_of_a_bundle_gives_the_result_of_its_recording() {
    let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
    let in_folder = |name: &str| folder.path().join(name);
    let (cell, recording, state) =
        (repository(CELL), repository(RECORDING), repository("tests/data/stored/state"));
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap();
    let journal = format!("{} didim[7]: starts\n{0} cron[8]: /usr/bin/didim\n", name.trim());
    fs::write(in_folder("journal"), journal).unwrap();
    let bundle = in_folder("arm.tar.zst");
    let said = succeed(&[
        &"bundle",
        &bundle,
        &"--cell",
        &cell,
        &"--state",
        &state,
        &"--runtime",
        &folder.path(),
        &"--result",
        &"0",
        &"--recording",
        &recording,
        &"--journal",
        &in_folder("journal"),
    ]);
    assert!(said.contains("without status.json: no service at"), "{said}");
    assert!(!said.contains("without result.json"), "{said}");
    let mode = fs::metadata(&bundle).unwrap().permissions().mode();
    assert_eq!(format!("{:o}", mode & 0o777), "600");

    // Another program reads it.
    let unpacked = in_folder("unpacked");
    fs::create_dir(&unpacked).unwrap();
    unpack(&bundle, &unpacked);
    assert_eq!(
        fs::read_to_string(unpacked.join("journal.txt")).unwrap(),
        "machine didim[7]: starts\n"
    );
    let result = fs::read(unpacked.join("result.json")).unwrap();
    assert_eq!(result, fs::read(state.join("result-00000000.json")).unwrap());
    let contents = json(&fs::read_to_string(unpacked.join("bundle.json")).unwrap());
    assert_eq!(contents["schema"], 1);
    assert!(contents["configuration"].as_array().unwrap().len() >= 3, "{contents}");

    // The cell of the bundle counts, wherever it is opened.
    let (first, second) = (in_folder("first"), in_folder("second"));
    succeed(&[&"replay", &"--cell", &cell, &"--state", &first, &recording]);
    succeed(&[&"replay", &"--cell", &"/nowhere.toml", &"--state", &second, &bundle]);
    assert!(!results(&first).is_empty());
    assert_eq!(results(&first), results(&second));
}

/// The whole history: the newest lines, the days and the compressed lines; and no secret, though
/// the folder of the results has one.
#[test]
fn a_bundle_has_the_complete_history_and_nothing_else_of_the_folder() {
    let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
    let state = folder.path().join("state");
    fs::create_dir(&state).unwrap();
    let line = format!("{{\"days\":\"{}\"}}\n", "0".repeat(1000));
    let history = [
        ("history.jsonl", "newest\n".to_owned()),
        ("history-days.jsonl", line.repeat(6 << 10)),
        ("history-00000003.jsonl.zst", "compressed".to_owned()),
    ];
    let events = "event\n".repeat(1 << 20);
    let others = [("password", "secret".to_owned()), ("events.jsonl", events)];
    for (name, content) in history.iter().chain(&others) {
        fs::write(state.join(name), content).unwrap();
    }
    let bundle = folder.path().join("arm.tar.zst");
    let said = succeed(&[
        &"bundle",
        &bundle,
        &"--cell",
        &repository(CELL),
        &"--state",
        &state,
        &"--runtime",
        &folder.path(),
    ]);
    assert!(
        said.contains("without the beginning of events.jsonl: it has more than 4 MB"),
        "{said}"
    );
    let unpacked = folder.path().join("unpacked");
    fs::create_dir(&unpacked).unwrap();
    unpack(&bundle, &unpacked);
    for (name, content) in &history {
        assert!(fs::read_to_string(unpacked.join(name)).unwrap() == *content, "{name}");
    }
    let mut names: Vec<String> = fs::read_dir(&unpacked)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort_unstable();
    let history = history.map(|(name, _)| name);
    let mut expected = ["bundle.json", "configuration", "events.jsonl"].to_vec();
    expected.extend(history);
    expected.sort_unstable();
    assert_eq!(names, expected);
}

fn unpack(bundle: &Path, folder: &Path) {
    let file = fs::File::open(bundle).unwrap();
    let decoder = ruzstd::decoding::StreamingDecoder::new(file).unwrap();
    tar::Archive::new(decoder).unpack(folder).unwrap();
}

/// What is asked for has to be there, and a cell cannot take any file along.
#[test]
fn what_a_bundle_cannot_have_is_named() {
    let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
    let bundle = folder.path().join("arm.tar.zst");
    let (state, passwd) = (folder.path().join("nosuch"), Path::new("/etc/passwd"));
    let cases: [(&str, &dyn AsRef<OsStr>, [&str; 2]); 3] = [
        ("--state", &state, ["nosuch", "--state"]),
        ("--result", &"77", ["result-00000077.json", "No such file"]),
        ("--recording", &passwd, ["/etc/passwd", "no MCAP recording"]),
    ];
    for (option, value, says) in cases {
        let output = didim(&[&"bundle", &bundle, &"--cell", &repository(CELL), &option, value]);
        assert_eq!(output.code, Some(1), "{}", output.stderr);
        assert!(says.iter().all(|words| output.stderr.contains(words)), "{}", output.stderr);
        assert!(!bundle.exists());
    }
    let cell = folder.path().join("cell.toml");
    let text = fs::read_to_string(repository(CELL)).unwrap();
    let dbc = text.lines().find(|line| line.starts_with("dbc = ")).unwrap();
    let text = text.replace(dbc, "dbc = \"/etc/passwd\"\n# password: hunter2");
    let config = format!("\"{}/", repository("tests/data/stored/config").display());
    fs::write(&cell, text.replace("\"../", &config)).unwrap();
    let said = succeed(&[&"bundle", &bundle, &"--cell", &cell, &"--runtime", &folder.path()]);
    assert!(said.contains("without /etc/passwd: "), "{said}");
    let unpacked = folder.path().join("unpacked");
    fs::create_dir(&unpacked).unwrap();
    unpack(&bundle, &unpacked);
    let packed = fs::read_to_string(unpacked.join("configuration/0-cell.toml")).unwrap();
    assert!(packed.contains("# password: \"removed\"") && !packed.contains("hunter2"), "{packed}");
}

#[test]
fn what_is_no_bundle_is_refused() {
    let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
    let cell = repository(CELL);
    let path = folder.path().join("arm.tar.zst");
    for content in [&b""[..], b"\x28\xb5\x2f\xfd", b"no archive at all"] {
        fs::write(&path, content).unwrap();
        let output = didim(&[&"replay", &"--cell", &cell, &path]);
        assert_eq!(output.code, Some(1), "{}", output.stderr);
        assert!(output.stderr.contains("not a bundle"), "{}", output.stderr);
    }
    let output = didim(&[&"bundle", &folder.path().join("arm.zip"), &"--cell", &cell]);
    assert_eq!(output.code, Some(2));
}

/// A link in a bundle of somebody else leads nowhere: as table of contents, `/dev/zero` would take
/// all memory.
#[test]
fn a_bundle_with_links_is_refused() {
    let folder = tempfile::Builder::new().prefix("didim-").tempdir().unwrap();
    let path = folder.path().join("arm.tar.zst");
    for kind in [tar::EntryType::Symlink, tar::EntryType::Link, tar::EntryType::Fifo] {
        let mut header = tar::Header::new_gnu();
        header.set_entry_type(kind);
        header.set_size(0);
        let mut archive = tar::Builder::new(Vec::new());
        archive.append_link(&mut header, "bundle.json", "/dev/zero").unwrap();
        let archive = archive.into_inner().unwrap();
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        fs::write(&path, ruzstd::encoding::compress_to_vec(archive.as_slice(), level)).unwrap();
        let output = didim(&[&"replay", &"--cell", &repository(CELL), &path]);
        assert_eq!(output.code, Some(1), "{kind:?}: {}", output.stderr);
        assert!(output.stderr.contains("`bundle.json`"), "{kind:?}: {}", output.stderr);
    }
}
