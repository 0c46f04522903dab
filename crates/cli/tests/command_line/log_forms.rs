//! The same frames in the forms in which people have them give the same samples.

use std::fmt::Write as _;
use std::fs;

use didim::analysis::read_log;
use didim::cell::Cell;
use didim_drivers::source::InterfaceName;
use didim_formats::{Piece, Record};

use super::support::{Folder, cia402_cell, data, didim};
use crate::bag_writer::Bag;

/// A frame of a candump log: its stamp \[s\], identifier and data in hexadecimal digits.
struct LoggedFrame<'a> {
    stamp: &'a str,
    id: &'a str,
    data: &'a str,
}

impl<'a> LoggedFrame<'a> {
    fn parse(line: &'a str) -> Self {
        let mut fields = line.split(' ');
        let stamp = fields.next().unwrap().trim_matches(['(', ')']);
        let (id, data) = fields.nth(1).unwrap().split_once('#').unwrap();
        Self { stamp, id, data }
    }
}

fn frames(log: &str) -> Vec<LoggedFrame<'_>> {
    log.lines().map(LoggedFrame::parse).collect()
}

fn spaced(data: &str) -> String {
    let pairs = data.as_bytes().chunks(2).map(|pair| std::str::from_utf8(pair).unwrap());
    pairs.collect::<Vec<_>>().join(" ")
}

fn record(file: &str, interfaces: &[&str]) -> Record {
    let cell = Cell::read(cia402_cell().as_ref()).unwrap();
    let names: Vec<_> = interfaces.iter().map(|name| InterfaceName::new(name).unwrap()).collect();
    read_log(file.as_ref(), &cell, &names).unwrap()
}

fn signals(record: &Record) -> Vec<&didim_dynamics::Signals> {
    record.segments.iter().map(|Piece { measurement, .. }| &measurement.signals).collect()
}

#[test]
fn the_form_of_a_log_does_not_change_its_samples() {
    let folder = Folder::new();
    let text = fs::read_to_string(&data().cia402_log).unwrap();
    let plain = record(&data().cia402_log, &[]);
    let (mut screen, mut asc, mut fd) = (String::new(), String::new(), String::new());
    for LoggedFrame { stamp, id, data } in frames(&text) {
        let (length, data) = (data.len() / 2, spaced(data));
        writeln!(screen, " ({stamp})  vcan0  {id}   [{length}]  {data}").unwrap();
        writeln!(asc, "   {stamp} 1  {id}             Rx   d {length} {data}  ID = 1").unwrap();
        writeln!(
            fd,
            "   {stamp} CANFD   1 Rx  {id}  Name  0 0 {length}  {length} {data}  1 1 200000"
        )
        .unwrap();
    }
    let fd = format!("date Mon Nov 23 10:00:00.000 am 2026\nbase hex  timestamps absolute\n{fd}");
    // The last line is cut off. The frame in it is that of the last cycle, which gives no sample.
    let cut = &text[..text.len() - 3];
    for (name, form) in [("a.txt", &screen[..]), ("a.asc", &asc), ("fd.asc", &fd), ("b.log", cut)] {
        let file = folder.path(name);
        fs::write(&file, form).unwrap();
        let read = record(&file, &[]);
        let [first, complete] =
            [&read, &plain].map(|record| signals(record)[0].position_rad[0].len());
        assert!(complete - first <= usize::from(name == "b.log"), "{name}: {first} of {complete}");
        if first == complete {
            assert_eq!(signals(&read), signals(&plain), "{name}");
        }
    }
    let file = folder.path("frames.mcap");
    let mut bag = Bag::create(file.as_ref());
    for frame in frames(&text) {
        let ns: u64 = frame.stamp.replace('.', "").parse().unwrap();
        let digits = frame.stamp.split_once('.').unwrap().1.len();
        let ns = ns * 10_u64.pow(9 - u32::try_from(digits).unwrap());
        let id = u32::from_str_radix(frame.id, 16).unwrap();
        let data = spaced(frame.data);
        let data = data.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap());
        bag.can_frame("/from_can_bus", ns, id, &data.collect::<Vec<_>>());
    }
    bag.finish();
    assert_eq!(signals(&record(&file, &[])), signals(&plain));
}

/// Two arms of one kind have the same identifiers, on two buses that were recorded together.
#[test]
fn the_interface_of_an_arm_is_chosen() {
    let folder = Folder::new();
    let text = fs::read_to_string(&data().cia402_log).unwrap();
    let plain = record(&data().cia402_log, &[]);
    let interface = text.split(' ').nth(1).unwrap();
    let other = text.replace(&format!(" {interface} "), " can9 ").replace("#00", "#01");
    let both: String =
        text.lines().zip(other.lines()).map(|(one, other)| format!("{one}\n{other}\n")).collect();
    let file = folder.path("both.log");
    fs::write(&file, both.replace(&format!(" {interface} "), " can8 ")).unwrap();
    assert_eq!(signals(&record(&file, &["can8"])), signals(&plain));
    let cell = cia402_cell();
    let identify = ["identify", "--cell", &cell, "--input", &file];
    didim(&identify).refused(1, &["can8 can9", "--interface"]);
    didim(&[&identify[..], &["--interface", "can7"]].concat()).refused(1, &["can7", "can8 can9"]);
    // The cell names its own interface, `vcan0`.
    fs::write(&file, both.replace(&format!(" {interface} "), " vcan0 ")).unwrap();
    assert_eq!(signals(&record(&file, &[])), signals(&plain));
}

/// A loss that costs no sample is counted all the same.
#[test]
fn frames_that_are_not_used_are_counted() {
    let folder = Folder::new();
    let text = fs::read_to_string(&data().cia402_log).unwrap();
    let mut short = 0;
    let with_short_frames = text.lines().enumerate().map(|(number, line)| {
        let (head, payload) = line.split_once('#').unwrap();
        if number % 100 == 50 && payload.len() == 16 {
            short += 1;
            return format!("{head}#{}\n{line}\n", &payload[..8]);
        }
        format!("{line}\n")
    });
    let file = folder.path("short.log");
    fs::write(&file, with_short_frames.collect::<String>()).unwrap();
    let read = record(&file, &[]);
    assert_eq!(signals(&read), signals(&record(&data().cia402_log, &[])));
    assert_eq!(read.unused_frames.get("wrong_length"), Some(&short));
    let cell = cia402_cell();
    let identify = ["identify", "--method", "idim-ls", "--cell", &cell, "--input", &file, "--json"];
    let json: serde_json::Value = serde_json::from_str(&didim(&identify).done()).unwrap();
    assert_eq!(json["unused_frames"]["wrong_length"], short);
}
