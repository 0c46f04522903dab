//! Arrows between files and rooms point down: no circle anywhere, and the service's rooms use only those
//! below them. Packages are walls that the compiler keeps; these are the walls inside them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod modules;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use modules::Package;

const PACKAGES: [&str; 7] =
    ["core/src", "drivers/src", "formats/src", "sim-fixtures/src", "src", "lab/src", "cli/src"];

fn edges(package: &str) -> BTreeMap<PathBuf, BTreeSet<PathBuf>> {
    Package::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(package)).edges()
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let mut found = Vec::new();
    for package in PACKAGES {
        for c in circles(&edges(package)) {
            println!("{package}: {c:?}");
            found.push(c);
        }
    }
    assert!(found.is_empty());
}

/// Sets of more than one, each of which leads to every other one (Tarjan's strongly connected components, by
/// reachability: the graphs are small).
fn circles<T: Ord + Clone>(edges: &BTreeMap<T, BTreeSet<T>>) -> Vec<BTreeSet<T>> {
    let reachable = |from: &T| {
        let mut seen = BTreeSet::new();
        let mut waiting = vec![from.clone()];
        while let Some(at) = waiting.pop() {
            for next in edges.get(&at).into_iter().flatten() {
                if seen.insert(next.clone()) {
                    waiting.push(next.clone());
                }
            }
        }
        seen
    };
    let reached: BTreeMap<&T, BTreeSet<T>> = edges.keys().map(|at| (at, reachable(at))).collect();
    let circle = |at: &T| -> BTreeSet<T> {
        let back = reached[at]
            .iter()
            .filter(|other| reached.get(other).is_some_and(|of_other| of_other.contains(at)));
        back.cloned().collect()
    };
    let found: BTreeSet<BTreeSet<T>> = edges.keys().map(circle).filter(|c| c.len() > 1).collect();
    found.into_iter().collect()
}
