//! Finds the commit and the features that `didim --version` prints. The commit is that of the
//! environment, of a source archive or of git.

use std::process::Command;

/// Written by `git archive` (export-subst in .gitattributes); a checkout has the placeholder.
const ARCHIVED: &str = "COMMIT";
/// Printed for sources without git and without the file of an archive.
const UNKNOWN: &str = "unknown, as neither git nor DIDIM_COMMIT names it";
/// Digits of a commit that are printed.
const DIGITS: usize = 12;

fn main() {
    println!("cargo::rerun-if-env-changed=DIDIM_COMMIT");
    println!("cargo::rerun-if-changed={ARCHIVED}");
    println!("cargo::rerun-if-changed=build.rs");
    let commit = std::env::var("DIDIM_COMMIT").ok().or_else(archived).or_else(checked_out);
    let commit = commit.as_deref().filter(|commit| !commit.is_empty());
    let commit = commit.map_or(UNKNOWN, |commit| commit.get(..DIGITS).unwrap_or(commit));
    println!("cargo::rustc-env=DIDIM_BUILT_COMMIT={commit}");
    println!("cargo::rustc-env=DIDIM_BUILT_FEATURES={}", features());
}

/// Returns the names of the features of this build.
fn features() -> String {
    let name =
        |(key, _): (String, String)| key.strip_prefix("CARGO_FEATURE_").map(str::to_lowercase);
    let mut names: Vec<String> = std::env::vars().filter_map(name).collect();
    names.sort();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Returns the commit that `git archive` has written.
fn archived() -> Option<String> {
    let text = std::fs::read_to_string(ARCHIVED).ok()?;
    let commit = text.trim();
    commit.chars().all(|digit| digit.is_ascii_hexdigit()).then(|| commit.to_owned())
}

/// Returns the commit of the checkout that this folder is part of. Sources that were unpacked in
/// the checkout of another project have none.
fn checked_out() -> Option<String> {
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    // One line for each commit, checkout and reset.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    println!("cargo::rerun-if-changed={log}");
    git(&["rev-parse", "HEAD"])
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = output.status.success().then_some(output.stdout)?;
    Some(String::from_utf8(text).ok()?.trim().to_owned())
}
