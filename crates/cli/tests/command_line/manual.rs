//! Man pages and completions, as the program makes them of its command line.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use didim_cli::{command, completions, documents, man_pages, schemas};

use super::support::{Folder, didim};

/// What the program writes is what it makes, and nothing else.
#[test]
fn the_program_writes_its_pages_and_completions() {
    let folder = Folder::new();
    let out = folder.path("manual");
    didim(&["manual", "--out", &out]).done();
    let pages = man_pages(command()).unwrap().into_iter().chain(documents().unwrap());
    let others = completions(command()).unwrap().into_iter().chain(schemas());
    let made: BTreeMap<String, String> = pages.chain(others).collect();
    let mut written = BTreeMap::new();
    let mut folders = vec![Path::new(&out).to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(&out).unwrap().to_str().unwrap().to_owned();
                written.insert(name, std::fs::read_to_string(&path).unwrap());
            }
        }
    }
    assert_eq!(written, made);
    assert!(made.len() > 20, "{:?}", made.keys());
}

#[test]
fn every_command_has_a_page() {
    let pages = man_pages(command()).unwrap();
    // One for the program and one for each command that its help lists.
    let help = didim(&["--help"]).done();
    let commands = help.split_once("Start here:").unwrap().1.split_once("Options:").unwrap().0;
    let commands = commands.lines().filter_map(|line| line.strip_prefix("  "));
    let commands: Vec<&str> = commands
        .filter(|line| !line.starts_with(' '))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.contains(&"check") && commands.contains(&"metrics"), "{commands:?}");
    let has = |name: &str| pages.iter().any(|(path, _)| *path == format!("man/{name}.1"));
    for name in commands {
        assert!(has(&format!("didim-{name}")), "no page of {name}");
    }
    assert!(has("didim-baseline-set"), "actions have options of their own");
}

/// What bash offers behind `didim che` and behind `didim check --`.
#[test]
fn bash_completes() {
    // Not the shipped file, which may be being written.
    let folder = Folder::new();
    let (_, text) =
        completions(command()).unwrap().into_iter().find(|(p, _)| p.contains("bash")).unwrap();
    let script = format!(
        "source {}; offer() {{ COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); \
         _didim didim \"${{@: -1}}\" \"${{@: -2:1}}\"; printf '%s ' \"${{COMPREPLY[@]}}\"; }}; \
         offer didim che; offer didim check --; offer didim identify --method c; \
         offer didim compare --methods d",
        folder.file("didim", &text)
    );
    let output = Command::new("bash").args(["--norc", "-c", &script]).output().unwrap();
    let offered = String::from_utf8_lossy(&output.stdout);
    let words: Vec<&str> = offered.split_whitespace().collect();
    let options = ["check", "--cell", "--other-machine", "--json", "--help"];
    assert_eq!(words, [&options[..], &["clie", "cloe", "didim"]].concat(), "{output:?}");
}

/// An option that takes one of a few names: every shell offers them, and `--help` says what they
/// are.
#[test]
fn names_are_known_to_help_and_to_every_shell() {
    for (path, text) in completions(command()).unwrap() {
        for name in ["idim-iv", "closed-loop output error", "mjcf", "acquisition"] {
            // Bash offers names without their meaning.
            let said = path.contains("bash") && name.contains(' ');
            assert!(said || text.contains(name), "{path} does not know {name}");
        }
    }
    for words in [&["identify", "--help"][..], &["demo", "--help"], &["compare", "--help"]] {
        let help = didim(words).done();
        assert!(help.contains("idim-iv:") && help.contains("closed-loop output error"), "{help}");
    }
}

/// The pages are read by the program that shows them, without a complaint.
#[test]
#[ignore = "needs man (Debian: man-db): tests/run"]
fn man_reads_the_pages() {
    let folder = Folder::new();
    for (path, text) in man_pages(command()).unwrap() {
        let file = folder.file(path.rsplit('/').next().unwrap(), &text);
        let output = Command::new("man")
            .args(["--warnings", "--local-file", &file])
            .env("MANWIDTH", "80")
            .env("MANROFFOPT", "-ww")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{path}: {said}");
        assert!(output.stdout.len() > 200, "{path}");
    }
}
