//! `didim study`: a study that was interrupted, and one on other threads, gives the same files.

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::support::{Folder, didim, packed_cell, shipped};

/// Files that a study writes next to its runs.
const DERIVED: [&str; 8] = [
    "applicable.svg",
    "converged.svg",
    "rms-deviation.svg",
    "simulations.svg",
    "study.json",
    "study.md",
    "torque-deviation.svg",
    "wrongly-accepted.svg",
];

fn smoke() -> String {
    shipped("studies/smoke.toml")
}

fn study(plan: &str, out: &str, jobs: &str) -> String {
    didim(&["study", "--plan", plan, "--out", out, "--jobs", jobs]).done()
}

/// The smoke study in one go on one thread; made once.
fn complete_study() -> &'static str {
    static COMPLETE: OnceLock<String> = OnceLock::new();
    COMPLETE.get_or_init(|| {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("smoke-study");
        let _ = std::fs::remove_dir_all(&out);
        let out = out.to_str().unwrap().to_owned();
        let text = study(&smoke(), &out, "1");
        assert!(text.contains("12 runs added") && text.contains("on 1 threads"), "{text}");
        out
    })
}

fn read(folder: &str, file: &str) -> String {
    std::fs::read_to_string(Path::new(folder).join(file)).unwrap()
}

#[track_caller]
fn assert_same_files(folder: &str) {
    for file in DERIVED {
        assert_eq!(read(folder, file), read(complete_study(), file), "{file}");
    }
}

fn runs(folder: &str) -> Vec<String> {
    let mut lines: Vec<String> = read(folder, "runs.jsonl").lines().map(str::to_owned).collect();
    lines.sort();
    lines
}

#[test]
fn runs_and_figures_are_what_a_known_truth_says() {
    let json: Value = serde_json::from_str(&read(complete_study(), "study.json")).unwrap();
    assert_eq!((&json["runs"], &json["planned"]), (&12.into(), &12.into()));
    let cells = json["cells"].as_array().unwrap();
    let cell = |error: &str, method: &str| {
        let matching = cells.iter().find(|cell| {
            cell["levels"] == serde_json::json!(["low", error]) && cell["method"] == method
        });
        matching.unwrap()
    };
    let deviation = |cell: &Value| cell["figures"]["torque_deviation_median"].as_f64().unwrap();
    for method in ["idim-ls", "didim"] {
        assert!(deviation(cell("none", method)) < 1e-4);
        // Every torque is 5 % too large, and so is the model.
        assert!((deviation(cell("all gains 5 %", method)) - 0.05).abs() < 2e-3);
    }
    // The described controller makes other torques of the recorded motion. Its error decides for
    // the method that simulates, and only explains for the other.
    assert_eq!(cell("all gains 5 %", "idim-ls")["rightly_refused"], 0);
    assert_eq!(cell("all gains 5 %", "didim")["rightly_refused"], 1);
    // Two methods on two by two cells, and the legend's classes.
    let svg = read(complete_study(), "applicable.svg");
    assert_eq!(svg.matches("<rect class=\"c").count(), 8 + 7);
}

/// What is torn was not written; the rest is not run again.
#[test]
fn an_interrupted_study_goes_on_and_ends_the_same() {
    let folder = Folder::new();
    let out = folder.path("out");
    std::fs::create_dir(&out).unwrap();
    let lines = read(complete_study(), "runs.jsonl");
    let fifth = lines.match_indices('\n').nth(4).unwrap().0;
    std::fs::write(Path::new(&out).join("runs.jsonl"), &lines[..fifth + 100]).unwrap();
    let text = study(&smoke(), &out, "3");
    assert!(text.contains("8 runs added") && text.contains("on 3 threads"), "{text}");
    assert_same_files(&out);
    assert_eq!(runs(&out), runs(complete_study()));
    // What is torn within a character, a τ say, is no less torn.
    let path = Path::new(&out).join("runs.jsonl");
    let torn = [std::fs::read(&path).unwrap(), b"{\"message\":\"\xcf".to_vec()].concat();
    std::fs::write(&path, torn).unwrap();
    // Another time there is nothing to do.
    assert!(study(&smoke(), &out, "2").contains("0 runs added"));
    assert_same_files(&out);
}

#[test]
fn an_interrupt_ends_the_study_and_keeps_its_runs() {
    let folder = Folder::new();
    let out = folder.path("out");
    let child = Command::new(env!("CARGO_BIN_EXE_didim"))
        .args(["study", "--plan", &smoke(), "--out", &out, "--jobs", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let path = Path::new(&out).join("runs.jsonl");
    let written = || std::fs::read_to_string(&path).is_ok_and(|text| text.lines().count() > 1);
    while !written() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no run in a minute");
        std::thread::sleep(Duration::from_millis(5));
    }
    let id = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(id, rustix::process::Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("of 12 runs; the same command continues from there"), "{stderr}");
    assert!(output.stdout.is_empty());
    assert!(read(&out, "study.md").contains("of 12 runs: 4 cells of the grid"));
    study(&smoke(), &out, "2");
    assert_same_files(&out);
}

/// A plan of the test's own.
struct Plan(Folder);

impl Plan {
    /// The smoke study with edits.
    #[track_caller]
    fn with_edits(edits: &[(&str, &str)]) -> Self {
        let folder = Folder::new();
        let mut text = std::fs::read_to_string(smoke()).unwrap();
        text = text.replacen("../cells/tx40-packed-fd.toml", &packed_cell(), 1);
        for (from, to) in edits {
            assert!(text.contains(from), "the plan has no {from:?}");
            text = text.replacen(from, to, 1);
        }
        folder.file("plan.toml", &text);
        Self(folder)
    }

    fn path(&self) -> String {
        self.0.path("plan.toml")
    }
}

#[test]
fn one_json_object_and_more_seeds_go_on_from_those_that_are_there() {
    let few = [
        ("seeds = 2", "seeds = 1"),
        ("[[axis.level]]\nname = \"high\"", "[[axis.level]]\nname = \"more\""),
    ];
    let first = Plan::with_edits(&few);
    let out = first.0.path("out");
    let command = |plan: &Plan| didim(&["study", "--plan", &plan.path(), "--out", &out, "--json"]);
    let text = command(&first).done();
    assert_eq!((text.matches('\n').count(), text.ends_with('\n')), (1, true), "{text}");
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["runs"], 8);
    // The runs of before are as they were; those of seeds that nobody wants any more do not count.
    let before = runs(&out);
    let two = Plan::with_edits(&few[1..]);
    let json: Value = serde_json::from_str(&command(&two).done()).unwrap();
    assert_eq!(json["runs"], 12);
    assert!(before.iter().all(|line| runs(&out).contains(line)));
    let json: Value = serde_json::from_str(&command(&first).done()).unwrap();
    assert_eq!(json["runs"], 8);
}

#[test]
fn a_folder_belongs_to_one_study() {
    let folder = Folder::new();
    let out = folder.path("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::copy(
        Path::new(complete_study()).join("runs.jsonl"),
        Path::new(&out).join("runs.jsonl"),
    )
    .unwrap();
    let before = folder.names();
    for (from, to, what) in [
        ("name = \"smoke\"", "name = \"other\"", "the name differs"),
        ("start = \"idim-ls\"", "start = \"nominal\"", "the plan differs"),
    ] {
        let plan = Plan::with_edits(&[(from, to)]);
        didim(&["study", "--plan", &plan.path(), "--out", &out])
            .refused(1, &["runs.jsonl", "another study", what, "choose another folder"]);
    }
    assert_eq!(folder.names(), before);
    // What is not a study's is left as it is.
    let strange = folder.path("strange");
    std::fs::create_dir(&strange).unwrap();
    for text in ["a note without an end", "a note\nwithout an end"] {
        std::fs::write(Path::new(&strange).join("runs.jsonl"), text).unwrap();
        didim(&["study", "--plan", &smoke(), "--out", &strange])
            .refused(1, &["runs.jsonl", "not that of a study", "choose another folder"]);
        assert_eq!(read(&strange, "runs.jsonl"), text);
    }
    let damaged = read(&out, "runs.jsonl").replacen("\"seed\":1", "\"seed\":x", 1);
    std::fs::write(Path::new(&out).join("runs.jsonl"), damaged).unwrap();
    didim(&["study", "--plan", &smoke(), "--out", &out])
        .refused(1, &["runs.jsonl: line 2", "remove that line"]);
}

/// Three processes with a part each, put together in whatever order: what one machine makes of the
/// same plan.
#[test]
fn parts_of_a_study_put_together_are_the_study() {
    let plan = Plan::with_edits(&[
        ("seeds = 2", "seeds = 1"),
        ("[[method]]\nmethod = \"didim\"\nseeds = 1\nstart = \"idim-ls\"\n", ""),
    ]);
    let path = plan.path();
    let out = |name: &str| plan.0.path(name);
    let parts = ["0/3", "1/3", "2/3"];
    let folders = ["zero", "one", "two"].map(out);
    let begun = parts.iter().zip(&folders).map(|(part, folder)| {
        Command::new(env!("CARGO_BIN_EXE_didim"))
            .args(["study", "--plan", &path, "--shard", part, "--out", folder, "--jobs", "1"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap()
    });
    let begun: Vec<_> = begun.collect();
    for (child, of) in begun.into_iter().zip(["2 of 2", "1 of 1", "1 of 1"]) {
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success() && said.contains(&format!("{of} runs in")), "{said}");
    }
    study(&path, &out("whole"), "1");

    let merge = |from: &[&str], into: &str| {
        let into = out(into);
        let command = [&["study", "--plan", &path, "--out", &into, "--merge"], from].concat();
        didim(&command)
    };
    let [zero, one, two] = folders.each_ref().map(String::as_str);
    merge(&[two, zero], "all").refused(1, &["1 of part 1/3", "name their folders too"]);
    assert!(!Path::new(&out("all")).exists(), "nothing is written");
    // Another time with what is there already.
    for _ in 0..2 {
        merge(&[two, zero, one, zero], "all").done();
        for file in DERIVED {
            assert_eq!(read(&out("all"), file), read(&out("whole"), file), "{file}");
        }
        assert_eq!(runs(&out("all")), runs(&out("whole")));
    }
    assert!(study(&path, &out("all"), "1").contains("0 runs added"));

    let edited = |from: &str, to: &str| {
        let text = read(zero, "runs.jsonl");
        assert!(text.contains(from), "{text}");
        let name = out("edited");
        std::fs::create_dir_all(&name).unwrap();
        std::fs::write(Path::new(&name).join("runs.jsonl"), text.replacen(from, to, 1)).unwrap();
        name
    };
    let differs = edited("\"simulations\":0", "\"simulations\":1");
    let says = ["edited", "idim-ls, seed 1, low, none: differs", "zero"];
    merge(&[zero, one, two, &differs], "all").refused(1, &says);
    let other = edited("\"0/3\"", "\"0/2\"");
    merge(&[zero, &other], "all").refused(1, &["edited", "one of 2 parts", "of one division"]);
    let stranger = edited("\"plan_sha256\":\"", "\"plan_sha256\":\"0");
    merge(&[zero, &stranger], "all").refused(1, &["another study, the plan differs"]);
    merge(&[zero, &out("nowhere")], "all").refused(1, &["nowhere", "--shard"]);
    let study = ["study", "--plan", &path, "--out", zero, "--shard"];
    didim(&[&study[..], &["1/3"]].concat()).refused(1, &["the part differs", "0/3"]);
    didim(&[&study[..], &["3/3"]].concat()).refused(2, &["I/N", "from 0 to N"]);
}

/// Each mistake is named with file and key, before anything is simulated or written.
#[test]
fn mistakes_in_a_plan_are_named() {
    let gains = "torque_gain = [1.05, 1.05, 1.05, 1.05, 1.05, 1.05]";
    let cases: [(&str, &str, &[&str]); 15] = [
        ("scenario =", "scenarios =", &["line 4", "unknown field `scenarios`"]),
        ("seeds = 2", "seeds = -2", &["line 8", "seeds = -2"]),
        ("seeds = 2", "seeds = 0", &["method \"idim-ls\", seeds", "at least 1"]),
        ("seeds = 2", "seeds = 20000000", &["`max_runs`", "80000004 runs in 4 cells", "100000"]),
        ("seeds = 2", "seeds = 2\nstart = \"nominal\"", &["start", "leave it out"]),
        ("start = \"idim-ls\"", "nominal_deviation = 0.1", &["start = \"nominal\""]),
        ("method = \"didim\"", "method = \"idim-ls\"", &["`method.name`", "is there twice"]),
        ("method = \"didim\"", "method = \"dydim\"", &["line 11", "dydim"]),
        ("name = \"low\"", "name = \"high\"", &["axis \"noise\"", "\"high\" is there twice"]),
        ("name = \"low\"", "name = \"low\"\npayloads = 1", &["payloads", "unknown field"]),
        (gains, "torque_gain = [1.05]", &["error of the model = all gains 5 %", "torque_gain"]),
        (
            "name = \"low\"",
            "name = \"low\"\nunmodelled = {}",
            &["level \"all gains 5 %\", unmodelled", "axis \"noise\" sets it too"],
        ),
        ("name = \"low\"", "name = \"low\"\nbandwidth = 0.0", &["bandwidth", "not above 0"]),
        ("\"tx40-paper\"", "\"nowhere.toml\"", &["nowhere.toml", "No such file", "tx40-physical"]),
        ("\"tx40-paper\"", "\"tx40-physical\"", &["robot `tx40-physical`", "`tx40`"]),
    ];
    for (from, to, says) in cases {
        let plan = Plan::with_edits(&[(from, to)]);
        let says = [&["plan.toml"], says].concat();
        let out = plan.0.path("out");
        didim(&["study", "--plan", &plan.path(), "--out", &out]).refused(78, &says);
        assert!(!Path::new(&out).exists(), "{to}");
    }
    for (cell, says) in [
        ("tx40-cia402.toml", ["scenario tx40-paper", "5000 samples/s, the cell's bus 500"]),
        ("nowhere.toml", ["`cell`", "nowhere.toml"]),
    ] {
        let plan = Plan::with_edits(&[("tx40-packed-fd.toml", cell)]);
        let out = plan.0.path("out");
        didim(&["study", "--plan", &plan.path(), "--out", &out]).refused(78, &says);
    }
}
