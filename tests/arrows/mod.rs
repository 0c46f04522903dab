//! Arrows between files and rooms point down: no circle anywhere, and rooms use only those that the order
//! below has after them. Packages are walls that the compiler keeps; these are the walls inside them.

mod modules;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use modules::Package;

const PACKAGES: [&str; 8] = [
    "core/src",
    "drivers/src",
    "formats/src",
    "sim-fixtures/src",
    "src",
    "lab/src",
    "cli/src",
    "publish/src",
];

/// Folders with what stands in them, files and folders, from the top: each uses only what comes after it.
const ORDER: [(&str, &str); 10] = [
    (
        "core/src",
        "identification excitation feasibility simulation control dynamics trajectory regression signal robot numeric sample",
    ),
    (
        "core/src/identification",
        "friction cutoff cross_validation identify closed_loop equation_error torque_along gains payload prediction judgement observation given",
    ),
    ("drivers/src", "samples assemble source socket clock units layout ethercat frame"),
    ("src", "proposal check service report offline cell live archive signals files window text"),
    ("src/service", "metrics reload pipeline supervision status paths"),
    ("src/live", "worker acquire recording stream latency"),
    ("src/archive", "fleet drift store"),
    (
        "src/offline",
        "compare consistent difference advice excitation foretold gains payload predict stored log identify commanded limits still rate",
    ),
    (
        "cli/src",
        "lib baseline capture check compare convert demo export fleet gains history manual metrics new note payload predict reload replay robot run study \
         top window convert_frames identify advise design choices input stream sim outcome state status names terminal output error tell progress",
    ),
    ("publish/src", "main send cabinet link ledger message configuration"),
];

type Edges = BTreeMap<PathBuf, BTreeSet<PathBuf>>;

/// Of each package: its files, and those that each uses. Read once, for all tests.
static EDGES: LazyLock<BTreeMap<&str, Edges>> = LazyLock::new(|| {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let of = |package| (package, Package::read(&root.join(package)).edges());
    PACKAGES.map(of).into()
});

#[test]
fn no_files_use_each_other_in_a_circle() {
    let mut found = Vec::new();
    for (package, edges) in EDGES.iter() {
        for c in circles(edges) {
            println!("{package}: {c:?}");
            found.push(c);
        }
    }
    assert!(found.is_empty());
}

type Uses = BTreeMap<String, BTreeSet<String>>;

/// What stands in each folder of a package, files and folders, and what of it uses which other.
fn rooms(package: &str) -> BTreeMap<String, Uses> {
    let mut rooms: BTreeMap<String, Uses> = BTreeMap::new();
    for (file, others) in &EDGES[package] {
        for folder in file.ancestors().skip(1) {
            let inside = |file: &Path| {
                let first = file.strip_prefix(folder).ok()?.iter().next()?;
                Some(Path::new(first).file_stem()?.to_str()?.to_owned())
            };
            let room = inside(file).unwrap();
            let used =
                others.iter().filter_map(|other| inside(other)).filter(|other| *other != room);
            let path =
                Path::new(package).join(folder).to_str().unwrap().trim_end_matches('/').to_owned();
            rooms.entry(path).or_default().entry(room.clone()).or_default().extend(used);
        }
    }
    rooms
}

#[test]
fn no_rooms_use_each_other_in_a_circle() {
    let all: Vec<_> = PACKAGES.into_iter().flat_map(rooms).collect();
    assert!(all.len() > 40, "{}", all.len());
    let found = all.iter().flat_map(|(folder, uses)| {
        circles(uses).into_iter().map(move |circle| format!("{folder}: {circle:?}"))
    });
    let found: Vec<String> = found.collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn rooms_use_only_those_below_them() {
    let all: BTreeMap<String, Uses> = PACKAGES.into_iter().flat_map(rooms).collect();
    for (folder, order) in ORDER {
        let order: Vec<&str> = order.split_whitespace().collect();
        let uses = &all[folder];
        let stated: BTreeSet<&str> = order.iter().copied().collect();
        let handing_on = |room: &str| matches!(room, "lib" | "mod") && !stated.contains(room);
        let there = uses.keys().map(String::as_str).filter(|room| !handing_on(room));
        assert_eq!(stated, there.collect(), "{folder}: give every room its place");
        let place = |room: &str| order.iter().position(|other| *other == room);
        for (room, used) in uses.iter().filter(|(room, _)| place(room).is_some()) {
            let above: Vec<_> = used.iter().filter(|used| place(used) <= place(room)).collect();
            assert!(above.is_empty(), "{folder}/{room} uses {above:?}, which is above it");
        }
    }
}

/// A room that nobody is told of is not found.
#[test]
fn the_architecture_names_every_room() {
    let manual = include_str!("../../docs/architecture.md");
    let named: BTreeSet<&str> = manual.split('`').skip(1).step_by(2).collect();
    let inner =
        ["core/src/identification", "src/live", "src/archive", "src/service", "src/offline"];
    let mut looked_at = 0;
    for folder in PACKAGES.into_iter().chain(inner) {
        let inside = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        for entry in std::fs::read_dir(&inside).unwrap().map(Result::unwrap) {
            let room = entry.file_name().into_string().unwrap();
            if entry.path().is_dir() {
                assert!(
                    named.contains(room.as_str()),
                    "docs/architecture.md has nothing on {folder}/{room}"
                );
                looked_at += 1;
            }
        }
    }
    assert!(looked_at > 40, "{looked_at}");
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
