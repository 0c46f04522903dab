//! Every reader of bytes that come from outside, as a function of bytes.
//!
//! None may panic, hang or take memory by what a length says. What was read goes on to whatever
//! takes it next: frames to the assemblers of all shipped cells, the text of a DBC file to a
//! layout. The tests damage known files (`mod.rs`), and `fuzz/` looks further.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

use didim::analysis::StoredModel;
use didim::archive::drift::Baseline;
use didim::archive::store::{read_history, read_known};
use didim::cell::Cell;
use didim::service::status::parse_request;
use didim_drivers::ethercat::Capture;
use didim_drivers::frame::Frame;
use didim_drivers::layout::{CompiledLayout, DeviceContents, LayoutSpec};
use didim_drivers::source::{BlfSource, CaptureSource, McapSource, Received, Source, TextLog};
use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::Robot;
use didim_formats::{
    BagSpec, BagTime, MeshFolders, Side, UrdfArm, UrdfDrives, list_bag, read_bag, read_csv,
    read_motion, read_rows,
};
use didim_sim::Scenario;

/// A reader, with files of the repository that it reads.
pub(crate) struct Reader {
    pub(crate) name: &'static str,
    pub(crate) read: fn(&[u8]),
    pub(crate) files: &'static [&'static str],
}

/// All of them; what else each has read is in `fuzz/corpus/NAME`.
pub(crate) const READERS: [Reader; 20] = [
    Reader {
        name: "log",
        read: log,
        files: &[
            "drivers/tests/golden/all.asc",
            "drivers/tests/golden/all.log",
            "drivers/tests/golden/classic_v1_0.trc",
            "drivers/tests/golden/classic_v2_1.trc",
        ],
    },
    Reader {
        name: "binary_log",
        read: binary_log,
        files: &["drivers/tests/golden/all.blf", "drivers/tests/golden/small.blf"],
    },
    Reader { name: "recording", read: recording, files: &[] },
    Reader {
        name: "capture",
        read: capture,
        files: &[
            "drivers/tests/golden/ethercat/traps.pcapng",
            "drivers/tests/golden/ethercat/two_drives.pcapng",
        ],
    },
    Reader { name: "table", read: table, files: &["crates/formats/tests/golden/parquet.csv"] },
    Reader {
        name: "parquet",
        read: table,
        files: &[
            "crates/formats/tests/golden/parquet_own.parquet",
            "crates/formats/tests/golden/parquet_zstd.parquet",
        ],
    },
    Reader {
        name: "bag",
        read: bag,
        files: &[
            "crates/formats/tests/golden/bag_lz4.mcap",
            "crates/formats/tests/golden/bag_zstd.mcap",
        ],
    },
    Reader { name: "motion", read: motion, files: &[] },
    Reader { name: "urdf", read: urdf, files: &["crates/formats/tests/golden/export/panda.urdf"] },
    Reader { name: "mesh", read: mesh, files: &[] },
    Reader {
        name: "robot",
        read: robot,
        files: &["config/robots/tx40.toml", "config/robots/panda.toml"],
    },
    Reader {
        name: "cell",
        read: cell,
        files: &[
            "config/cells/tx40-cia402-eds.toml",
            "config/cells/piper.toml",
            "config/cells/tx40-ethercat.toml",
            "tests/data/kr300/cell.toml",
        ],
    },
    Reader {
        name: "dbc",
        read: dbc,
        files: &["config/dbc/packed_fd_six_axes.dbc", "drivers/tests/golden/odd.dbc"],
    },
    Reader { name: "device_file", read: device_file, files: &["config/eds/cia402_drive.eds"] },
    Reader { name: "eni", read: eni, files: &["drivers/tests/golden/ethercat/two_drives.eni.xml"] },
    Reader { name: "scenario", read: scenario, files: &["sim-fixtures/scenarios/tx40-paper.toml"] },
    Reader { name: "command", read: command, files: &[] },
    Reader { name: "history", read: history, files: &["tests/data/stored/state/history.jsonl"] },
    Reader { name: "baseline", read: baseline, files: &["tests/data/stored/state/baseline.json"] },
    Reader {
        name: "result",
        read: result,
        files: &["tests/data/stored/state/result-00000000.json"],
    },
];

pub(crate) fn repository(path: &str) -> PathBuf {
    // Of the tests, or of `fuzz/`, which is a package of its own.
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = package.parent().filter(|_| package.ends_with("fuzz")).unwrap_or(package);
    root.join(path)
}

/// An error says something, and not a whole file.
fn said(error: &dyn Display) {
    let text = error.to_string();
    assert!(!text.is_empty() && text.len() < 20_000, "{} bytes: {text:.200}", text.len());
}

fn message_of<T, E: Display>(read: Result<T, E>) -> Option<T> {
    read.map_err(|error| said(&error)).ok()
}

/// The cells that are shipped.
fn cells() -> &'static [Cell] {
    static CELLS: OnceLock<Vec<Cell>> = OnceLock::new();
    CELLS.get_or_init(|| {
        let names = ["tx40-packed-fd", "tx40-cia402", "piper", "openarm", "tx40-ethercat"];
        let path = |name| repository(&format!("config/cells/{name}.toml"));
        names.map(|name| Cell::read(&path(name)).unwrap()).into()
    })
}

/// What their layouts are made of, as their files say.
fn specs() -> &'static [LayoutSpec] {
    static SPECS: OnceLock<Vec<LayoutSpec>> = OnceLock::new();
    SPECS.get_or_init(|| {
        let cells = fs::read_dir(repository("config/cells")).unwrap();
        let spec = |file: PathBuf| {
            let cell: toml::Table = fs::read_to_string(file).unwrap().parse().unwrap();
            cell["bus"]["layout"].clone().try_into().unwrap()
        };
        cells.map(|entry| spec(entry.unwrap().path())).collect()
    })
}

/// As a file, where the reader takes nothing else.
fn with_file(name: &str, bytes: &[u8], read: impl FnOnce(&Path)) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    read(&path);
}

fn with_text(bytes: &[u8], read: impl FnOnce(&str)) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        read(text);
    }
}

/// To the end, also behind errors; then to every assembler. Each call takes a byte at least.
fn frames(mut source: impl Source, length: usize) {
    let (mut batch, mut all) = (Vec::with_capacity(64), Vec::<Frame>::new());
    let mut ended = false;
    for _ in 0..=length + 1 {
        match source.receive(&mut batch, Duration::ZERO) {
            Ok(Received::Frames) => all.append(&mut batch),
            Ok(Received::Silence) => panic!("a file is never silent"),
            Ok(Received::End) => {
                ended = true;
                break;
            }
            Err(error) => said(&error),
        }
    }
    assert!(ended, "no end after {length} calls");
    for cell in cells() {
        let mut assembler = cell.bus().unwrap().assembler();
        for frame in &all {
            assembler.handle_frame(frame);
            while assembler.poll_sample().is_some() {}
        }
        assembler.handle_timeout(u64::MAX);
        let _ = assembler.poll_sample();
    }
}

fn log(bytes: &[u8]) {
    frames(TextLog::new(bytes, Path::new("a.log"), &[]), bytes.len());
}

fn binary_log(bytes: &[u8]) {
    let length = bytes.len() as u64;
    if let Some(source) = message_of(BlfSource::new(bytes, length, Path::new("a.blf"), &[])) {
        frames(source, bytes.len());
    }
}

fn recording(bytes: &[u8]) {
    if let Some(source) = message_of(McapSource::new(bytes, Path::new("a.mcap"), &[])) {
        frames(source, bytes.len());
    }
}

fn capture(bytes: &[u8]) {
    let capture = || Capture::new(Cursor::new(bytes), Path::new("a.pcapng"));
    for cell in cells() {
        let source = CaptureSource::new(capture(), cell.bus().ok().map(|bus| &bus.layout));
        if let Some(source) = message_of(source) {
            frames(source, bytes.len());
        }
    }
    for spec in specs().iter().filter(|spec| !spec.slaves.is_empty()) {
        let mut spec = spec.clone();
        spec.eni = None;
        for (slave, address) in spec.slaves.iter_mut().zip(0x1001..) {
            (slave.name, slave.address) = (None, Some(address));
        }
        message_of(CompiledLayout::compile_startup(capture(), &spec));
    }
}

fn table(bytes: &[u8]) {
    with_file("a.csv", bytes, |path| {
        message_of(read_rows(path, None));
        message_of(read_csv(path, Some(500.0)));
    });
}

fn bag(bytes: &[u8]) {
    with_file("a.mcap", bytes, |path| {
        for topic in message_of(list_bag(path)).map(|contents| contents.topics).unwrap_or_default()
        {
            let joints = topic.joints.len();
            message_of(read_bag(
                path,
                &BagSpec {
                    joints: topic.joints,
                    topic: Some(topic.name),
                    rate_hz: 100.0,
                    side: Side::Joint,
                    torque_scales: vec![1.0; joints],
                    wraps: Vec::new(),
                    time: BagTime::Header,
                },
            ));
        }
    });
}

fn motion(bytes: &[u8]) {
    with_file("a.csv", bytes, |path| drop(message_of(read_motion(path))));
}

fn urdf(bytes: &[u8]) {
    with_text(bytes, |text| {
        let Some(arm) = message_of(UrdfArm::read(text, None, None)) else { return };
        arm.notes().iter().for_each(|note| said(note));
        let drives =
            UrdfDrives { joints: BTreeMap::new(), ..UrdfDrives::with_assumed_drives(arm.joints()) };
        robot(arm.to_toml(&drives).as_bytes());
    });
}

/// The ending of its name says what a mesh is.
fn mesh(bytes: &[u8]) {
    for name in ["a.stl", "a.obj", "a.dae"] {
        with_file(name, bytes, |path| {
            message_of(MeshFolders::new(path, &[]).read_points(name));
        });
    }
}

fn robot(bytes: &[u8]) {
    with_text(bytes, |text| {
        if let Some(robot) = message_of(Robot::from_toml(text)) {
            let _ = Model::new(&robot);
        }
    });
}

fn cell(bytes: &[u8]) {
    static PLACE: OnceLock<tempfile::TempDir> = OnceLock::new();
    // Robots and layouts lie where the cells say.
    let place = PLACE.get_or_init(|| {
        let place = tempfile::tempdir().unwrap();
        for folder in ["robots", "dbc", "eds", "eni"] {
            let source = repository(&format!("config/{folder}"));
            std::os::unix::fs::symlink(source, place.path().join(folder)).unwrap();
        }
        fs::create_dir(place.path().join("cells")).unwrap();
        place
    });
    let name = format!("{:?}.toml", std::thread::current().id());
    let path = place.path().join("cells").join(name);
    fs::write(&path, bytes).unwrap();
    message_of(Cell::read(&path));
}

fn dbc(bytes: &[u8]) {
    with_text(bytes, |text| {
        for spec in specs() {
            message_of(CompiledLayout::compile(text, spec));
        }
    });
}

fn device_file(bytes: &[u8]) {
    with_text(bytes, |text| {
        for is_dcf in [false, true] {
            message_of(DeviceContents::read(text, Path::new("a.eds"), is_dcf));
        }
        for spec in specs() {
            message_of(CompiledLayout::compile_nodes(&vec![text; spec.nodes.len()], spec));
        }
    });
}

fn eni(bytes: &[u8]) {
    with_text(bytes, |text| {
        for spec in specs() {
            message_of(CompiledLayout::compile_eni(text, spec));
        }
    });
}

fn scenario(bytes: &[u8]) {
    with_text(bytes, |text| {
        message_of(Scenario::from_toml(text, cells()[0].robot_as_described.clone()));
    });
}

fn command(bytes: &[u8]) {
    message_of(parse_request(bytes));
}

fn history(bytes: &[u8]) {
    with_file("history.jsonl", bytes, |path| {
        let folder = path.parent().unwrap();
        message_of(read_history(folder));
        let _ = read_known(folder, 0);
    });
}

fn baseline(bytes: &[u8]) {
    with_file("baseline.json", bytes, |path| {
        drop(message_of(Baseline::read(path.parent().unwrap())))
    });
}

fn result(bytes: &[u8]) {
    with_file("result.json", bytes, |path| {
        message_of(StoredModel::read_stored_model(path, cells()[0].clone()).map(drop));
    });
}
