//! Every path of the repository that its documents and its comments name is there.

use std::fs;
use std::path::{Path, PathBuf};

const FOLDERS: [&str; 8] =
    ["benches", "config", "crates", "docs", "drivers", "sim-fixtures", "src", "tests"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What in a text looks like a path into one of the repository's folders.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split(|each: char| !(each.is_ascii_alphanumeric() || "/._-".contains(each)));
    let words = words.map(|word| word.trim_end_matches(['.', '-']));
    words.filter(|word| {
        let inside = word.split_once('/').is_some_and(|(first, rest)| {
            FOLDERS.contains(&first) && rest.starts_with(|each: char| each.is_ascii_lowercase())
        });
        // `src/drivers`: the one or the other.
        inside
            && word.split('/').filter(|part| FOLDERS.contains(part)).count()
                < word.split('/').count()
    })
}

fn collect(folder: &Path, ending: &str, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, ending, files);
        } else if path.to_str().unwrap().ends_with(ending) {
            files.push(path);
        }
    }
}

/// Files of that ending in the repository's folders, and their texts.
fn texts(ending: &str) -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    FOLDERS.iter().for_each(|folder| collect(&root().join(folder), ending, &mut files));
    files
        .into_iter()
        .map(|file: PathBuf| {
            let text = fs::read_to_string(&file).unwrap();
            (file, text)
        })
        .collect()
}

#[test]
fn of_documents() {
    let readme = root().join("README.md");
    let mut documents = texts(".md");
    documents.push((readme.clone(), fs::read_to_string(readme).unwrap()));
    let named = documents.iter().flat_map(|(file, text)| paths(text).map(move |path| (file, path)));
    let named: Vec<_> = named.collect();
    assert!(named.len() > 50, "{named:?}");
    let missing: Vec<_> = named.iter().filter(|(_, path)| !root().join(path).exists()).collect();
    assert!(missing.is_empty(), "{missing:#?}");
}

/// Of the repository, or of the comment's own package.
#[test]
fn of_comments() {
    let sources = texts(".rs");
    let comments = sources.iter().flat_map(|(file, text)| {
        let lines = text.lines().filter_map(|line| line.trim_start().strip_prefix("//"));
        lines.flat_map(paths).map(move |path| (file, path))
    });
    let named: Vec<_> = comments.collect();
    assert!(named.len() > 10, "{named:?}");
    let is_there = |file: &Path, path: &str| {
        let package = file.ancestors().skip(1).find(|folder| folder.join("Cargo.toml").exists());
        root().join(path).exists() || package.unwrap().join(path).exists()
    };
    let missing: Vec<_> = named.iter().filter(|(file, path)| !is_there(file, path)).collect();
    assert!(missing.is_empty(), "{missing:#?}");
}
