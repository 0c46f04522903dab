//! The mathematics has no clock, I/O, thread, process, environment, network or asynchrony: what it
//! computes follows from its arguments.
//!
//! All of these are in `std` alone; `core` and `alloc` have none. So the sources may name nothing
//! of `std` that is not listed here, call none of the macros of `std`'s prelude, and the package
//! may depend on nothing that is not listed here. (A list of what is forbidden would have holes:
//! clippy's `disallowed-types` takes no other.)

use std::fs;
use std::path::Path;

/// What the sources name of `std`.
const OF_STD: [&str; 5] = [
    // An ordered map is `alloc`'s: its order does not change from run to run, as a hash map's does.
    "std::collections::BTreeMap",
    // A value that is borrowed or owned, `alloc`'s as well.
    "std::borrow::Cow",
    // Asks the processor for its instruction sets.
    "std::arch::is_x86_feature_detected",
    // A value that is computed once.
    "std::sync::OnceLock",
    // A value of several owners, `alloc`'s as well.
    "std::sync::Arc",
];
/// Macros that need no path, and the words of asynchrony, of which a part is in `core`.
const FORBIDDEN: [&str; 12] = [
    "print",
    "println",
    "eprint",
    "eprintln",
    "dbg",
    "thread_local",
    "env",
    "option_env",
    "async",
    "await",
    "Future",
    "Waker",
];
/// The packages, with what each is built on: pure computation and the reading of text.
const PACKAGES: [(&str, &[&str]); 2] = [
    (
        "crates/dynamics",
        &["nalgebra", "rand_chacha", "rand_distr", "schemars", "serde", "thiserror", "toml"],
    ),
    (
        "crates/identification",
        &[
            "base64",
            "didim-dynamics",
            "nalgebra",
            "rand_chacha",
            "rand_distr",
            "schemars",
            "serde",
            "statrs",
            "thiserror",
            "toml",
        ],
    ),
];

/// Every Rust file below a folder.
fn sources(folder: &Path) -> Vec<(String, String)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push((path.display().to_string(), fs::read_to_string(&path).unwrap()));
        }
    }
    files
}

/// The code without comments, and with nothing between quotation marks.
fn code(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(next) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if next == '"' {
            string_length(rest)
        } else if rest.starts_with("r#\"") {
            rest.find("\"#").map_or(rest.len(), |end| end + 2)
        } else if let Some(quoted) =
            ["'\"'", "'\\\"'"].iter().find(|quoted| rest.starts_with(**quoted))
        {
            quoted.len()
        } else {
            0
        };
        if skipped == 0 {
            code.push(next);
            rest = &rest[next.len_utf8()..];
        } else {
            code.push(' ');
            rest = &rest[skipped..];
        }
    }
    code
}

/// Length of the string literal at the beginning.
fn string_length(text: &str) -> usize {
    let mut escaped = false;
    for (at, each) in text.char_indices().skip(1) {
        match each {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Names and punctuation.
fn tokens(code: &str) -> Vec<&str> {
    let is_name = |each: char| each.is_alphanumeric() || each == '_';
    let mut tokens = Vec::new();
    let mut rest = code.trim_start();
    while let Some(next) = rest.chars().next() {
        let end = if is_name(next) {
            rest.find(|each| !is_name(each)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            next.len_utf8()
        };
        tokens.push(&rest[..end]);
        rest = rest[end..].trim_start();
    }
    tokens
}

/// What code names that the mathematics must not.
fn faults(text: &str) -> Vec<String> {
    let code = code(text);
    let tokens = tokens(&code);
    let mut faults = Vec::new();
    for (at, token) in tokens.iter().enumerate() {
        if *token == "std" {
            // A path ends where no name follows, and a group or a glob has to be written out.
            let path = tokens[at..].iter().scan(false, |ended, token| {
                let goes_on = !*ended && (*token == "::" || token.starts_with(char::is_alphabetic));
                *ended = !goes_on;
                goes_on.then_some(*token)
            });
            // Beyond an allowed item comes what belongs to it.
            let path: String = path.collect();
            let allowed = |item: &&str| {
                path.strip_prefix(*item)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
            };
            if !OF_STD.iter().any(allowed) {
                faults.push(path);
            }
        } else if FORBIDDEN.contains(token) {
            faults.push((*token).to_owned());
        }
    }
    faults
}

#[test]
fn the_sources_use_neither_clock_nor_io() {
    for (package, _) in PACKAGES {
        let sources = sources(&root().join(package).join("src"));
        assert!(sources.len() > 50, "{package}: {} files", sources.len());
        for (file, text) in sources {
            assert_eq!(faults(&text), [""; 0], "{file}");
        }
    }
}

#[test]
fn the_packages_depend_on_nothing_else() {
    for (package, dependencies) in PACKAGES {
        let manifest = fs::read_to_string(root().join(package).join("Cargo.toml"));
        let manifest: toml::Table = manifest.unwrap().parse().unwrap();
        let names: Vec<&str> =
            manifest["dependencies"].as_table().unwrap().keys().map(String::as_str).collect();
        assert_eq!(names, dependencies, "{package}");
        let other = ["build-dependencies", "target"];
        assert!(other.iter().all(|key| !manifest.contains_key(*key)), "{manifest:?}");
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}
