//! Process data of EtherCAT, from a capture to samples, and what is said where there are none.
#![allow(clippy::float_cmp, clippy::print_stdout, reason = "what is compared is exact, and shown")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "numbers of tests are small"
)]

use core::time::Duration;
use std::path::{Path, PathBuf};

use crate::common::ethercat::{Datagram, Pcapng, START_NS, ethernet, registered};
use crate::expectation::Expectation;
use didim_drivers::assemble::{Assembler, Losses};
use didim_drivers::ethercat::Capture;
use didim_drivers::layout::{CompiledLayout, LayoutError, LayoutSpec};
use didim_drivers::samples::Samples;
use didim_drivers::source::{CaptureSource, Received, Source, SourceCounters, SourceError};
use didim_drivers::units::{DriveSpec, Scales};
use didim_dynamics::{JointSample, Reading};

const ENI: &str = include_str!("golden/ethercat/two_drives.eni.xml");
const TRAPS: &[u8] = include_bytes!("golden/ethercat/traps.pcapng");
const TWO_DRIVES: &[u8] = include_bytes!("golden/ethercat/two_drives.pcapng");

/// The layout of both drives; `network` says where it is described.
fn spec(network: &str) -> LayoutSpec {
    let text = format!(
        r#"
{network}
axes = 2
rate_hz = 1000.0
position = {{ object = "6064:00", unit = "count", valid = "instant" }}
torque = {{ object = "6077:00", unit = "count", valid = "instant" }}
reference = {{ object = "607A:00", unit = "count", valid = "next-sync" }}
status_word = "6041:00"
"#
    );
    toml::from_str(&text).unwrap()
}

fn by_eni() -> LayoutSpec {
    spec("eni = \"two_drives.eni.xml\"\nslaves = [{ name = \"Drive_1\" }, { address = 1002 }]")
}

fn by_startup() -> LayoutSpec {
    spec("startup = \"startup.pcapng\"\nslaves = [{ address = 1001 }, { address = 1002 }]")
}

fn layout() -> CompiledLayout {
    CompiledLayout::compile_eni(ENI, &by_eni()).unwrap()
}

fn learnt(capture: &Pcapng) -> Result<CompiledLayout, LayoutError> {
    let capture = Capture::new(capture.0.as_slice(), Path::new("startup.pcapng"));
    CompiledLayout::compile_startup(capture, &by_startup())
}

/// One count is 1 rad and 1 N·m, so that samples are counts.
fn assembler(layout: &CompiledLayout) -> Assembler {
    let text = "position = { scale = { rad_per_count = 1.0 }, sign = 1, zero = 0.0, wraps = \
        \"refuse\", provenance = \"a test\" }\ntorque = { scale = { nm_per_count = 1.0 }, sign = \
        1, provenance = \"a test\" }";
    let drive: DriveSpec = toml::from_str(text).unwrap();
    Assembler::new(layout.clone(), Scales::new(&[drive.clone(), drive], layout).unwrap())
}

type Read = (Vec<JointSample>, Losses, SourceCounters);

fn read(bytes: &[u8], layout: &CompiledLayout) -> Result<Read, SourceError> {
    let capture = Capture::new(bytes, Path::new("a.pcapng"));
    let source = CaptureSource::new(capture, Some(layout))?;
    let (frames, counters) = drain(source)?;
    let mut assembler = assembler(layout);
    let mut samples = Vec::new();
    for frame in &frames {
        assembler.handle_frame(frame);
        samples.extend(assembler.poll_sample());
    }
    assembler.handle_timeout(u64::MAX);
    samples.extend(assembler.poll_sample());
    Ok((samples, *assembler.losses(), counters))
}

fn drain(
    mut source: impl Source,
) -> Result<(Vec<didim_drivers::frame::Frame>, SourceCounters), SourceError> {
    let (mut frames, mut batch) = (Vec::new(), Vec::with_capacity(3));
    while source.receive(&mut batch, Duration::ZERO)? != Received::End {
        frames.append(&mut batch);
    }
    Ok((frames, source.counters()))
}

/// Rows of the truth: cycle, time of the distributed clock, drive, position, torque, target,
/// whether good.
fn truth(text: &str) -> Vec<[Option<i64>; 7]> {
    text.lines()
        .skip(1)
        .map(|line: &str| {
            let mut fields = line.split(',').map(|field| field.parse().ok());
            [(); 7].map(|()| fields.next().unwrap())
        })
        .collect()
}

/// How many rows of the truth the samples have, each compared.
#[track_caller]
fn compare(samples: &[JointSample], truth: &[[Option<i64>; 7]]) -> usize {
    let zero_ns = truth[0][1].unwrap();
    let mut compared = 0;
    for row in truth.iter().filter(|row| row[6] == Some(1)) {
        let [cycle, time_ns, drive, position, torque, ..] = row.map(Option::unwrap);
        let sample = samples.iter().find(|s| s.sequence == cycle as u64).unwrap();
        let axis = drive as usize - 1;
        assert_eq!(sample.stamp_ns - samples[0].stamp_ns, (time_ns - zero_ns) as u64, "{cycle}");
        assert_eq!(sample.motor_position_rad[axis], position as f64, "{cycle}");
        assert_eq!(sample.motor_torque_nm[axis], torque as f64, "{cycle}");
        let before = truth.iter().find(|r| r[0] == Some(cycle - 1) && r[2] == Some(drive));
        // Values of the cycle before, where their return was seen.
        let target = before.filter(|row| row[1].is_some()).map(|row| row[5].unwrap() as f64);
        let reference = sample.has_reference.then_some(sample.motor_reference_rad[axis]);
        assert_eq!(reference, target, "{cycle}");
        compared += 1;
    }
    compared
}

/// An object of the inputs that is a temperature, here the torque once more, is read in each cycle.
#[test]
fn an_object_of_the_inputs_may_be_a_reading() {
    let temperature = toml::from_str("object = \"6077:00\"\nunit = \"0.1 degC\"").unwrap();
    let spec = LayoutSpec { temperature: Some(temperature), ..by_eni() };
    let layout = CompiledLayout::compile_eni(ENI, &spec).unwrap();
    let (samples, losses, _) = read(TWO_DRIVES, &layout).unwrap();
    assert_eq!((samples.len(), losses.cycles.total()), (40, 0));
    for sample in &samples {
        for axis in 0..2 {
            let steps = sample.readings.get(Reading::Temperature, axis).unwrap();
            assert_eq!(f64::from(steps), sample.motor_torque_nm[axis]);
        }
    }
}

#[test]
fn a_capture_says_what_its_drives_said() {
    let truth = truth(include_str!("golden/ethercat/two_drives.csv"));
    let (samples, losses, counters) = read(TWO_DRIVES, &layout()).unwrap();
    assert_eq!((samples.len(), compare(&samples, &truth)), (40, 80));
    assert_eq!((losses.frames.total(), losses.cycles.total(), counters.passed_over), (0, 0, 0));
    assert_eq!(losses.samples_without_reference, 1, "the first cycle has none before it");
    assert_eq!(losses.frames_received, counters.frames);
}

#[test]
fn each_trap_is_counted_under_its_cause() {
    let truth = truth(include_str!("golden/ethercat/traps.csv"));
    let (samples, losses, counters) = read(TRAPS, &layout()).unwrap();
    assert_eq!((samples.len(), compare(&samples, &truth)), (17, 34));
    let cycles: Vec<_> = losses.cycles.by_cause().filter(|(_, count)| *count > 0).collect();
    assert_eq!(cycles, [("missing_sync", 1), ("safe_operational", 1), ("working_counter", 1)]);
    // The SYNC and the inputs of two drives, twice.
    assert_eq!(losses.frames.duplicate, 3);
    // A mailbox that was read.
    assert_eq!(counters.passed_over, 1);
    let accounted = losses.frames_used + losses.frames.total();
    assert_eq!(losses.frames_received - accounted, 2, "targets that no cycle follows");
}

/// As a source of samples, the way that logs and buses take.
#[test]
fn a_capture_goes_the_way_of_every_source() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("two.pcapng");
    std::fs::write(&path, TWO_DRIVES).unwrap();
    let source = CaptureSource::open(&path, Some(&layout())).unwrap();
    let samples = Samples::new(Box::new(source), assembler(&layout()), 5);
    assert_eq!(samples.map(Result::unwrap).count(), 40);
    let error = CaptureSource::open(&path, None).map(drop).unwrap_err().to_string();
    assert!(error.contains("two.pcapng") && error.contains("`eni`"), "{error}");
}

/// The network of the golden captures, configured drive by drive.
fn startup(inputs: &[u32]) -> Pcapng {
    let mut capture = Pcapng::new();
    for (drive, station) in [(0, 1001), (1, 1002)] {
        capture.pdos(station, 0x1C12, &[(0x1600, &[0x6040_0010, 0x607A_0020, 0x0000_0010])]);
        capture.pdos(station, 0x1C13, &[(0x1A00, inputs)]);
        let bytes = inputs.iter().map(|object| (object & 0xFF) as u16).sum::<u16>() / 8;
        capture.unit(station, 0, (0x0100_0000 + 8 * drive, 8), 2);
        capture.unit(station, 1, (0x0100_0010 + 12 * drive, bytes), 1);
    }
    capture
}

const INPUTS: [u32; 4] = [0x6041_0010, 0x6064_0020, 0x6077_0010, 0x60F4_0020];

/// A cycle: the time of the distributed clock, and process data.
fn cycle() -> [Datagram; 2] {
    [registered(14, 1001, 0x0910, &[0; 8]), process_data()]
}

fn process_data() -> Datagram {
    Datagram { command: 12, index: 7, address: 0x0100_0000, data: vec![0; 40], working_counter: 6 }
}

#[test]
fn a_start_up_shows_what_an_eni_file_does() {
    let mut capture = startup(&INPUTS);
    capture.exchange(START_NS, &cycle());
    let learnt = learnt(&capture).unwrap();
    assert_eq!(learnt.process_data(), layout().process_data());
    let samples_of = |layout: &CompiledLayout| read(TRAPS, layout).unwrap().0;
    assert_eq!(samples_of(&learnt), samples_of(&layout()));
}

/// Complete access: one transfer of all sub-indices, without the expedited form.
#[test]
fn a_mapping_in_one_transfer_is_read_too() {
    let mut capture = startup(&INPUTS[..2]);
    let mut transfer = vec![0x31, 0x00, 0x1A, 0, 18, 0, 0, 0, 4, 0];
    INPUTS.iter().for_each(|object| transfer.extend(object.to_le_bytes()));
    for station in [1001, 1002] {
        capture.sdo(station, &transfer, &[0x70, 0x00, 0x1A, 0, 0, 0, 0, 0]);
    }
    for (drive, station) in [(0, 1001), (1, 1002)] {
        capture.unit(station, 1, (0x0100_0010 + 12 * drive, 12), 1);
    }
    capture.exchange(START_NS, &cycle());
    assert_eq!(learnt(&capture).unwrap().process_data(), layout().process_data());
}

#[track_caller]
fn says(error: &impl ToString, parts: &[&str]) {
    let message = error.to_string();
    println!("{message}");
    for part in parts {
        assert!(message.contains(part), "should say {part:?}: {message}");
    }
}

#[test]
fn a_start_up_says_what_it_lacks() {
    // Position and no torque, as an AKD comes from the factory.
    let error = learnt(&startup(&[0x6041_0010, 0x6064_0020])).unwrap_err();
    says(
        &error,
        &["startup.pcapng", "torque.object", "6077:00", "6041:00, 6064:00", "1001", "PDO"],
    );
    let error = learnt(&startup(&INPUTS)).unwrap_err();
    says(&error, &["no cyclic datagram", "inputs of slave 1001"]);
    // It begins too late.
    let mut late = Pcapng::new();
    late.exchange(START_NS, &cycle());
    for capture in [&late, &Pcapng::new()] {
        says(&learnt(capture).unwrap_err(), &["before the master starts", "`eni`"]);
    }
    let mut only_one = Pcapng::new();
    only_one.pdos(1001, 0x1C13, &[(0x1A00, &INPUTS)]);
    says(&learnt(&only_one).unwrap_err(), &["no slave 1002", "it has 1001"]);
    only_one.download(1002, 0x1C13, 0, 1);
    says(&learnt(&only_one).unwrap_err(), &["1C13:01", "slave 1002", "ENI"]);
    only_one.pdos(1002, 0x1C13, &[(0x1A00, &INPUTS)]);
    says(&learnt(&only_one).unwrap_err(), &["1C12:00", "slave 1001"]);
    let names = spec("startup = \"a\"\nslaves = [{ name = \"A\" }, { address = 2 }]");
    let empty = Capture::new(&[][..], Path::new("a"));
    says(&CompiledLayout::compile_startup(empty, &names).unwrap_err(), &["A", "address"]);
}

#[test]
fn a_refused_download_changes_nothing() {
    let mut capture = startup(&INPUTS);
    let request = [0x23, 0x00, 0x1A, 3, 0x20, 0, 0x6C, 0x60];
    capture.sdo(1001, &request, &[0x80, 0x00, 0x1A, 3, 0, 0, 2, 6]);
    capture.exchange(START_NS, &cycle());
    assert_eq!(learnt(&capture).unwrap().process_data(), layout().process_data());
}

fn edited(from: &str, to: &str) -> Result<CompiledLayout, LayoutError> {
    assert!(ENI.contains(from), "{from}");
    CompiledLayout::compile_eni(&ENI.replace(from, to), &by_eni())
}

#[test]
fn an_eni_file_says_what_it_lacks() {
    let without = |from, to| edited(from, to).unwrap_err();
    says(
        &without("Drive_1", "Axis_1"),
        &["two_drives.eni.xml", "no slave Drive_1", "Axis_1 (1001)"],
    );
    says(
        &without("#x6077", "#x6074"),
        &["torque.object", "6077:00", "6074:00", "Drive_1", "export"],
    );
    says(&without("<Cnt>6</Cnt>", ""), &["working counter", "Cnt", "0x01000000"]);
    says(&without("<Cmd>12</Cmd>", "<Cmd>10</Cmd>"), &["no cyclic datagram", "outputs", "Drive_1"]);
    says(&without("<BitLength>96", "<BitLength>80"), &["line", "Recv", "80 bits", "96"]);
    says(&without("<PhysAddr>1002", "<PhysAddr>x"), &["line", "PhysAddr", "`x`"]);
    says(&without("EtherCATConfig", "EtherCATInfo"), &["EtherCATConfig"]);
    says(&without("</Config>", ""), &["two_drives.eni.xml", "export"]);
}

#[test]
fn an_object_of_a_vendor_needs_its_data_type() {
    let mut spec = by_eni();
    spec.torque.object = Some("2077:00".to_owned());
    let of_vendor = ENI.replace("#x6077", "#x2077");
    assert!(CompiledLayout::compile_eni(&of_vendor, &spec).is_ok());
    let untyped = of_vendor.replace("<DataType>INT</DataType></Entry>", "</Entry>");
    let error = CompiledLayout::compile_eni(&untyped, &spec).unwrap_err();
    says(&error, &["2077:00", "Drive_1", "signed", "DataType"]);
}

#[test]
fn keys_of_other_layouts_are_refused() {
    let single = spec("eni = \"a\"\nslaves = [{ name = \"Drive_1\" }]");
    says(&CompiledLayout::compile_eni(ENI, &single).unwrap_err(), &["slaves", "1 for 2 axes"]);
    let sync = spec("eni = \"a\"\nsync = \"SYNC\"\nslaves = [{ name = \"a\" }, { name = \"b\" }]");
    says(&CompiledLayout::compile_eni(ENI, &sync).unwrap_err(), &["`sync`"]);
    let both = spec("eni = \"a\"\nstartup = \"b\"\nslaves = [{ name = \"a\" }, { name = \"b\" }]");
    says(&CompiledLayout::compile_eni(ENI, &both).unwrap_err(), &["`eni`", "`startup`"]);
    let nameless = spec("eni = \"a\"\nslaves = [{}, { name = \"b\" }]");
    says(&CompiledLayout::compile_eni(ENI, &nameless).unwrap_err(), &["`name`", "`address`"]);
}

/// Each datagram of the master counts the slaves; where it is missing, it is the capture that says
/// why.
#[test]
fn a_capture_without_process_data_says_what_it_has() {
    let refusal = |capture: &Pcapng| read(&capture.0, &layout()).unwrap_err();
    let mut capture = Pcapng::new();
    says(
        &refusal(&capture),
        &["a.pcapng", "no cyclic process data in this capture", "none of 0 packets"],
    );
    capture.packet(START_NS, &ethernet(false, &[process_data()]));
    says(&refusal(&capture), &["none has come back", "both directions"]);
    let mailbox = registered(4, 1001, 0x1C00, &[0; 16]);
    capture.packet(START_NS, &ethernet(true, &[mailbox]));
    says(&refusal(&capture), &["1 datagrams of mailboxes", "none of process data", "OP"]);
    let other = Datagram { address: 0x0200_0000, ..process_data() };
    capture.packet(START_NS, &ethernet(true, &[other]));
    says(&refusal(&capture), &["1 datagrams of process data", "address", "ENI"]);
}

#[test]
fn what_is_no_capture_is_refused() {
    let refusal = |bytes: &[u8]| read(bytes, &layout()).unwrap_err();
    says(&refusal(b"(1.0) can0 123#"), &["a.pcapng", "no capture", "tcpdump"]);
    says(&refusal(b""), &["no capture"]);
    for cut in [17, TRAPS.len() - 1] {
        says(&refusal(&TRAPS[..cut]), &["a.pcapng", "cut off"]);
    }
    let mut damaged = TRAPS.to_vec();
    damaged[4] = 3;
    says(&refusal(&damaged), &["byte 0", "impossible length"]);
}

/// Stamps \[ns\] and Ethernet frames of a capture.
fn packets_of(capture: &[u8]) -> Vec<(u64, Vec<u8>)> {
    let mut capture = Capture::new(capture, Path::new("a"));
    let mut packets = Vec::new();
    while let Some(packet) = capture.next_packet().unwrap() {
        packets.push((packet.stamp_ns, packet.bytes.to_vec()));
    }
    packets
}

/// The form of a pcap file: its link type, stamps in ns in place of µs, big endian, and the most
/// bytes of a packet.
#[derive(Clone, Copy)]
struct PcapForm {
    link: u32,
    nanoseconds: bool,
    big: bool,
    snap: usize,
}

const ETHERNET: PcapForm = PcapForm { link: 1, nanoseconds: true, big: false, snap: 65_535 };

impl PcapForm {
    fn file(self, packets: &[(u64, Vec<u8>)]) -> Vec<u8> {
        let word = |word: u32| if self.big { word.to_be_bytes() } else { word.to_le_bytes() };
        let magic = if self.nanoseconds { 0xA1B2_3C4D } else { 0xA1B2_C3D4_u32 };
        let mut file = [magic, 0, 0, 0, self.snap as u32, self.link].map(word).concat();
        for (stamp_ns, bytes) in packets {
            let unit_ns = if self.nanoseconds { 1 } else { 1_000 };
            let fraction = (stamp_ns % 1_000_000_000) as u32 / unit_ns;
            let captured = &bytes[..bytes.len().min(self.snap)];
            let lengths = [captured.len() as u32, bytes.len() as u32];
            let header = [(stamp_ns / 1_000_000_000) as u32, fraction, lengths[0], lengths[1]];
            file.extend(header.map(word).concat());
            file.extend(captured);
        }
        file
    }
}

/// The classic format, either order of bytes, µs or ns: the same packets.
#[test]
fn pcap_says_what_pcapng_does() {
    let expected = read(TWO_DRIVES, &layout()).unwrap().0;
    for (nanoseconds, big) in [(false, false), (false, true), (true, false), (true, true)] {
        let file = PcapForm { nanoseconds, big, ..ETHERNET }.file(&packets_of(TWO_DRIVES));
        let samples = read(&file, &layout()).unwrap().0;
        let difference_ns = samples[0].stamp_ns.abs_diff(expected[0].stamp_ns);
        assert!(samples.len() == 40 && difference_ns < if nanoseconds { 1 } else { 1_000 });
        assert_eq!(samples[39].motor_position_rad, expected[39].motor_position_rad);
    }
}

/// A packet of Linux's interface `any`: kind of packet, kind of interface, length of the address,
/// address, EtherType.
fn cooked(frame: &[u8]) -> Vec<u8> {
    [&[0, 4, 0, 1, 0, 6], &frame[6..12], &[0, 0], &frame[12..]].concat()
}

/// Its version 2: EtherType, reserved, number and kind of the interface, kind of packet, length,
/// address.
fn cooked_2(frame: &[u8]) -> Vec<u8> {
    let address = [&[0, 0, 0, 0, 0, 2, 0, 1, 4, 6], &frame[6..12], &[0, 0]].concat();
    [&frame[12..14], &address, &frame[14..]].concat()
}

/// EtherCAT in UDP over IPv4.
fn udp(frame: &[u8]) -> Vec<u8> {
    let ip = [&[0x08, 0, 0x45][..], &[0; 8], &[17], &[0; 10]].concat();
    let header = [0x88, 0xA4, 0x88, 0xA4, 0, 0, 0, 0];
    [&frame[..12], &ip, &header, &frame[14..]].concat()
}

/// `tcpdump -i any` has a header of its own in place of that of Ethernet, and EtherCAT can be in
/// UDP: the samples are the same.
#[test]
fn other_headers_around_ethercat_give_the_same_samples() {
    let expected = read(TWO_DRIVES, &layout()).unwrap().0;
    let packets = packets_of(TWO_DRIVES);
    let with = |change: fn(&[u8]) -> Vec<u8>| {
        packets.iter().map(|(ns, bytes)| (*ns, change(bytes))).collect::<Vec<_>>()
    };
    for file in [
        PcapForm { link: 113, ..ETHERNET }.file(&with(cooked)),
        PcapForm { link: 276, ..ETHERNET }.file(&with(cooked_2)),
        ETHERNET.file(&with(udp)),
    ] {
        let samples = read(&file, &layout()).unwrap().0;
        assert_eq!(samples.len(), 40);
        for (sample, expected) in samples.iter().zip(&expected) {
            assert_eq!(sample.motor_position_rad, expected.motor_position_rad);
            assert_eq!(sample.motor_torque_nm, expected.motor_torque_nm);
            assert_eq!(sample.stamp_ns, expected.stamp_ns);
        }
    }
    let refusal = |form: PcapForm| read(&form.file(&packets), &layout()).unwrap_err();
    let count = packets.len();
    says(&refusal(PcapForm { snap: 32, ..ETHERNET }), &[&format!("of {count}"), "-s 0"]);
    says(&refusal(PcapForm { link: 105, ..ETHERNET }), &[&format!("none of {count}"), "Ethernet"]);
}

/// Small and the same every time: xorshift.
fn random(state: &mut u64) -> usize {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state >> 16) as usize
}

#[test]
fn no_corruption_makes_it_panic() {
    let layout = layout();
    let expected = Expectation::of("damaged-capture");
    let (most, fewest): (usize, usize) =
        (expected.get("most_samples"), expected.get("fewest_refused"));
    let mut seed = 0x9E37_79B9_7F4A_7C15;
    let mut refused = 0;
    for _ in 0..2_000 {
        let mut bytes = TRAPS.to_vec();
        bytes.truncate(bytes.len() - random(&mut seed) % 200);
        for _ in 0..=random(&mut seed) % 8 {
            let place = random(&mut seed) % bytes.len();
            bytes[place] = random(&mut seed) as u8;
        }
        match read(&bytes, &layout) {
            Ok((samples, ..)) => assert!(samples.len() <= most),
            Err(_) => refused += 1,
        }
    }
    assert!(refused >= fewest, "{refused}");
    let mut exchange = startup(&INPUTS);
    exchange.exchange(START_NS, &cycle());
    let mut refused = 0;
    for _ in 0..500 {
        let mut damaged = exchange.clone();
        for _ in 0..8 {
            let place = random(&mut seed) % damaged.0.len();
            damaged.0[place] = random(&mut seed) as u8;
        }
        refused += usize::from(learnt(&damaged).is_err());
        let mut eni = ENI.as_bytes().to_vec();
        for _ in 0..3 {
            let place = random(&mut seed) % eni.len();
            eni[place] = b"0#9<x/>1"[random(&mut seed) % 8];
        }
        let text = String::from_utf8(eni).unwrap();
        refused += usize::from(CompiledLayout::compile_eni(&text, &by_eni()).is_err());
    }
    assert!(refused >= fewest, "{refused}");
}
