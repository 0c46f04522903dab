//! Man pages and completions: the files of `config/` are what the program makes of its command line.
//!
//! `DIDIM_WRITE_GOLDEN=1` writes them anew.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use didim_cli::{Generated, completions, man_pages};

use crate::support::{Folder, didim, shipped};

/// Holds generated files against those of a folder of `config/`, of which there must be no others.
#[track_caller]
fn are_shipped(generated: &[Generated], folder: &str) {
    for (path, text) in generated {
        let path = shipped(path);
        if std::env::var_os("DIDIM_WRITE_GOLDEN").is_some() {
            std::fs::create_dir_all(Path::new(&path).parent().unwrap()).unwrap();
            std::fs::write(&path, text).unwrap();
        }
        let expected = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(*text == expected, "{path} is not what the program makes: DIDIM_WRITE_GOLDEN=1");
    }
    let made: BTreeSet<String> = generated.iter().map(|(path, _)| shipped(path)).collect();
    let mut there = BTreeSet::new();
    let mut folders = vec![shipped(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.to_str().unwrap().to_owned();
            if path.is_dir() {
                folders.push(name);
            } else {
                there.insert(name);
            }
        }
    }
    assert_eq!(there, made);
}

#[test]
fn man_pages_are_those_of_the_program() {
    let pages = man_pages().unwrap();
    are_shipped(&pages, "man");
    // One for the program and one for each command that its help lists.
    let help = didim(&["--help"]).done();
    let commands = help.split_once("Commands:").unwrap().1.split_once("Options:").unwrap().0;
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
    // And none refers to one that is not there.
    for (path, text) in &pages {
        let text = text.replace("\\-", "-");
        let referred = text.split_whitespace().filter_map(|word| word.strip_suffix("(1)"));
        referred.for_each(|name| assert!(has(name), "{path} refers to {name}(1)"));
    }
}

#[test]
fn completions_are_those_of_the_program() {
    are_shipped(&completions().unwrap(), "completions");
}

/// What bash offers behind `didim che` and behind `didim check --`.
#[test]
fn bash_completes() {
    // Not the shipped file, which may be being written.
    let folder = Folder::new();
    let (_, text) = completions().unwrap().into_iter().find(|(p, _)| p.contains("bash")).unwrap();
    let script = format!(
        "source {}; offer() {{ COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); \
         _didim didim \"${{@: -1}}\" \"${{@: -2:1}}\"; printf '%s ' \"${{COMPREPLY[@]}}\"; }}; \
         offer didim che; offer didim check --",
        folder.file("didim", &text)
    );
    let output = Command::new("bash").args(["--norc", "-c", &script]).output().unwrap();
    let offered = String::from_utf8_lossy(&output.stdout);
    let words: Vec<&str> = offered.split_whitespace().collect();
    assert_eq!(words, ["check", "--cell", "--elsewhere", "--json", "--help"], "{output:?}");
}

/// The pages are read by the program that shows them, without a complaint.
#[test]
#[ignore = "needs man (Debian: man-db): tests/run"]
fn man_reads_the_pages() {
    let folder = Folder::new();
    for (path, text) in man_pages().unwrap() {
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
