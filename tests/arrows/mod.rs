//! Arrows between files and rooms point down: no circle anywhere, and rooms use only those that the
//! order below has after them. Packages are walls that the compiler keeps; these are the walls
//! inside them.

mod modules;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use modules::Package;

const PACKAGES: [&str; 10] = [
    "crates/dynamics/src",
    "crates/identification/src",
    "drivers/src",
    "crates/formats/src",
    "sim-fixtures/src",
    "src",
    "crates/lab/src",
    "crates/cli/src",
    "crates/publish/src",
    "crates/python/src",
];

/// Folders with what stands in them, files and folders, from the top: each uses only what comes
/// after it.
const ORDER: [(&str, &str); 15] = [
    ("crates/dynamics/src", "simulation control dynamics trajectory robot numeric sample"),
    (
        "crates/identification/src",
        "external_torque identification excitation feasibility regression signal stored_value \
        parallel",
    ),
    (
        "crates/identification/src/identification",
        "friction cutoff cross_validation identify closed_loop equation_error torque_along gains \
        payload prediction judgement observation problem",
    ),
    ("drivers/src", "samples assemble source socket std_clock clock units layout ethercat frame"),
    (
        "src",
        "proposal check service report analysis cell live archive signals files window text \
         threads seeds",
    ),
    (
        "src/service",
        "machine_faults metrics reload pipeline contact_model limits supervision status paths",
    ),
    (
        "src/live",
        "worker acquire external_torque recording stream latency pause limits real_time_options \
         window_options",
    ),
    ("src/archive", "results events fleet drift store skipped_lines"),
    (
        "src/analysis",
        "export torque_difference external_torque excitation gains payload predict result_lines \
        stored_model recordings choices recording_file counted bus_log identify screening",
    ),
    ("crates/lab/src", "lib report study comparison"),
    (
        "crates/cli/src",
        "lib command bundle stored_result choices first_posture input stream outcome state \
        required_uses torque_joints frame next names terminal output error notes progress \
        long_numbers",
    ),
    (
        "crates/cli/src/command",
        "service compare completions convert export external_torque fleet gains groups history \
         manual new payload predict robot state study convert_frames identify advise design sim",
    ),
    (
        "crates/cli/src/command/service",
        "baseline bundle capture check demo metrics note reload report replay run top window \
         status",
    ),
    ("crates/python/src", "lib result recording cell rows work logging errors words"),
    ("crates/publish/src", "main send cabinet link ledger message configuration"),
];

type Edges = BTreeMap<PathBuf, BTreeSet<PathBuf>>;

/// Of each package: its files, and those that each uses. Read once, for all tests.
static EDGES: LazyLock<BTreeMap<&str, Edges>> = LazyLock::new(|| {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let package_edges = |package| (package, Package::read(&root.join(package)).edges());
    PACKAGES.map(package_edges).into()
});

#[test]
fn no_files_use_each_other_in_a_circle() {
    let mut problems = Vec::new();
    for (package, edges) in EDGES.iter() {
        for c in circles(edges) {
            println!("{package}: {c:?}");
            problems.push(c);
        }
    }
    assert!(problems.is_empty());
}

type Uses = BTreeMap<String, BTreeSet<String>>;

/// What stands in each folder of a package, files and folders, and what of it uses which other.
fn rooms(package: &str) -> BTreeMap<String, Uses> {
    let mut rooms: BTreeMap<String, Uses> = BTreeMap::new();
    for (file, others) in &EDGES[package] {
        for folder in file.ancestors().skip(1) {
            fn inside(file: &Path, folder: &&Path) -> Option<String> {
                let first = file.strip_prefix(*folder).ok()?.iter().next()?;
                Some(Path::new(first).file_stem()?.to_str()?.to_owned())
            }
            let file_folder = inside(file, &folder).unwrap();
            let used = others
                .iter()
                .filter_map(|other| inside(other, &folder))
                .filter(|other| *other != file_folder);
            let path =
                Path::new(package).join(folder).to_str().unwrap().trim_end_matches('/').to_owned();
            rooms.entry(path).or_default().entry(file_folder.clone()).or_default().extend(used);
        }
    }
    rooms
}

#[test]
fn no_rooms_use_each_other_in_a_circle() {
    let folders: Vec<_> = PACKAGES.into_iter().flat_map(rooms).collect();
    assert!(folders.len() > 40, "{}", folders.len());
    let problems = folders.iter().flat_map(|(folder, uses)| {
        circles(uses).into_iter().map(move |circle| format!("{folder}: {circle:?}"))
    });
    let problems: Vec<String> = problems.collect();
    assert!(problems.is_empty(), "{problems:#?}");
}

#[test]
fn rooms_use_only_those_below_them() {
    let folders: BTreeMap<String, Uses> = PACKAGES.into_iter().flat_map(rooms).collect();
    for (folder, order) in ORDER {
        let order: Vec<&str> = order.split_whitespace().collect();
        let uses = &folders[folder];
        let declared: BTreeSet<&str> = order.iter().copied().collect();
        let handing_on = |space: &str| matches!(space, "lib" | "mod") && !declared.contains(space);
        let present = uses.keys().map(String::as_str).filter(|space| !handing_on(space));
        assert_eq!(declared, present.collect(), "{folder}: give every folder its place");
        let place = |space: &str| order.iter().position(|other| *other == space);
        for (space, used) in uses.iter().filter(|(folder, _)| place(folder).is_some()) {
            let above: Vec<_> = used.iter().filter(|used| place(used) <= place(space)).collect();
            assert!(above.is_empty(), "{folder}/{space} uses {above:?}, which is above it");
        }
    }
}

/// A room that the table does not list is not found.
#[test]
fn the_architecture_names_every_room() {
    let manual = include_str!("../../docs/development/architecture.md");
    let named: BTreeSet<&str> = manual.split('`').skip(1).step_by(2).collect();
    let inner = [
        "crates/identification/src/identification",
        "src/live",
        "src/archive",
        "src/service",
        "src/analysis",
    ];
    let mut inspected = 0;
    for folder in PACKAGES.into_iter().chain(inner) {
        let inside = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        for entry in std::fs::read_dir(&inside).unwrap().map(Result::unwrap) {
            let folder = entry.file_name().into_string().unwrap();
            if entry.path().is_dir() {
                assert!(
                    named.contains(folder.as_str()),
                    "docs/development/architecture.md has nothing on {folder}/{folder}"
                );
                inspected += 1;
            }
        }
    }
    assert!(inspected > 40, "{inspected}");
}

/// Sets of more than one, each of which leads to every other one (Tarjan's strongly connected
/// components, by reachability: the graphs are small).
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
    let groups: BTreeSet<BTreeSet<T>> = edges
        .keys()
        .map(|at: &T| -> BTreeSet<T> {
            let back = reached[at]
                .iter()
                .filter(|other| reached.get(other).is_some_and(|of_other| of_other.contains(at)));
            back.cloned().collect()
        })
        .filter(|c| c.len() > 1)
        .collect();
    groups.into_iter().collect()
}
