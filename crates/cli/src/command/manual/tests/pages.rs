//! Tests that the examples are existing commands, that pages refer to existing pages, and that
//! `docs` has what the program writes.

use std::collections::BTreeSet;
use std::path::Path;

use didim_dynamics::robot::Robot;

use super::super::commands::PAGES;
use super::super::glossary::PARAMETER_KINDS;
use super::super::{documents, man_pages};
use crate::command;

/// Collects the names of all commands and actions.
fn commands(command: &clap::Command, words: &str, found: &mut BTreeSet<String>) {
    found.insert(words.to_owned());
    for sub in
        command.get_subcommands().filter(|sub| sub.get_name() != "help" && !sub.is_hide_set())
    {
        commands(sub, format!("{words} {}", sub.get_name()).trim_start(), found);
    }
}

#[test]
fn every_command_has_its_examples_and_files() {
    let mut command_names = BTreeSet::new();
    commands(&command(), "", &mut command_names);
    let page_names: BTreeSet<String> = PAGES.iter().map(|page| page.command.to_owned()).collect();
    assert_eq!(page_names, command_names);
    assert_eq!(page_names.len(), PAGES.len());
}

#[test]
fn examples_are_commands_that_there_are() {
    for page in PAGES {
        assert!(!page.examples.is_empty(), "{}", page.command);
        for [line, _] in page.examples {
            let read = command().try_get_matches_from(line.split_whitespace());
            assert!(read.is_ok(), "{line}: {}", read.unwrap_err());
            assert!(line.starts_with(format!("didim {}", page.command).trim_end()), "{line}");
        }
    }
}

#[test]
fn docs_are_what_the_program_writes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (path, text) in documents().unwrap() {
        let written = std::fs::read_to_string(root.join(&path)).unwrap_or_default();
        assert!(
            written == text,
            "{path} is not what the program writes: `cargo run -- manual --out target/manual && cp \
            target/manual/docs/reference/*.md docs/reference`"
        );
        for linked in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            assert!(root.join("docs/reference").join(linked).is_file(), "{path}: {linked}");
        }
    }
}

/// Checks that every page named in a page exists, in any section.
#[test]
fn pages_refer_to_pages_that_there_are() {
    let pages = man_pages(command()).unwrap();
    let names: BTreeSet<String> =
        (pages.iter()).map(|(path, _)| path.rsplit('/').next().unwrap().to_owned()).collect();
    let mut referred = 0;
    for (path, text) in &pages {
        let text = text.replace("\\-", "-").replace(" (", "(");
        for (at, _) in text.match_indices("didim") {
            let name: String = text[at..]
                .chars()
                .take_while(|letter| letter.is_ascii_alphabetic() || *letter == '-')
                .collect();
            let section =
                text[at + name.len()..].strip_prefix('(').and_then(|rest| rest.chars().next());
            let Some(section) = section.filter(char::is_ascii_digit) else { continue };
            assert!(
                names.contains(&format!("{name}.{section}")),
                "{path} refers to {name}({section})"
            );
            referred += 1;
        }
        for part in ["NAME", "DESCRIPTION", "SEE ALSO"] {
            assert!(
                text.contains(&format!(".SH {part}\n").replace(" (", "(")),
                "{path} has no {part}"
            );
        }
        if path.ends_with(".1") {
            assert!(
                text.contains(".SH EXAMPLES\n") && text.contains(".SH EXIT STATUS\n"),
                "{path}"
            );
        }
    }
    assert!(referred > 50, "{referred}");
}

/// Uses an arm with every parameter kind.
#[test]
fn the_glossary_has_every_kind() {
    let joint = |number: u8| {
        format!(
            "[[joint]] # {number}\ntype = 'revolute'\nalpha_deg = 0.0\nd_m = 0.1\ntheta_deg = \
             0.0\nr_m = 0.0\ndrive_inertia = true\n\
             position_min_deg = -90.0\nposition_max_deg = 90.0\nvelocity_max_rad_s = \
             1.0\ntorque_max_nm = 9.0\n"
        )
    };
    let text = format!(
        "name = 'all'\ngravity_m_s2 = [0.0, 0.0, -9.81]\n{}{}[transmission]\nrows = [[10.0, 0.0], \
         [10.0, 10.0]]\n[friction]\nviscous = true\n\
         coulomb = true\noffset = true\nsign = {{ model = 'sign' }}\nquadratic = true\ncubic = \
         true\nasymmetric = true\nload = true\n\
         stribeck_rad_s = 0.1\nhysteresis_rad = 0.01\n",
        joint(1),
        joint(2)
    );
    let robot = Robot::from_toml(&text).unwrap();
    let kinds: BTreeSet<_> = robot.parameters().parameters().iter().map(|own| own.kind).collect();
    assert_eq!(kinds, PARAMETER_KINDS.into_iter().collect());
    let (_, page) =
        documents().unwrap().into_iter().find(|(path, _)| path.ends_with("parameters.md")).unwrap();
    for kind in PARAMETER_KINDS {
        assert!(page.contains(&format!("| `{}` |", kind.symbol())), "{kind:?}");
    }
}
