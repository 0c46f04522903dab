//! The SocketCAN source on real virtual CAN interfaces.
//!
//! Needs two of them, named by `DIDIM_VCAN` (as in `DIDIM_VCAN=vcan0,vcan1`), up and with the MTU
//! of CAN FD, and root for the tests that take an interface away. Run with one test thread: they
//! share the bus.

use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::conformance::{Rig, conforms, interfaces, number, numbered, take};
use crate::expectation::Expectation;
use didim_drivers::clock::{ClockChange, ClockMap};
use didim_drivers::frame::{Direction, Frame, FrameId};
use didim_drivers::socket::clock_pair;
use didim_drivers::source::{
    InterfaceFault, InterfaceName, QUEUED_FRAME_BYTES, Received, SocketCanError, SocketCanOptions,
    SocketCanSource, Source, SourceError,
};
use socketcan::{CanAnyFrame, CanFdSocket, Socket};

/// The interfaces to test on.
fn vcan() -> Vec<InterfaceName> {
    let names = std::env::var("DIDIM_VCAN").expect("DIDIM_VCAN names the interfaces: tests/run");
    let names: Vec<&str> = names.split(',').collect();
    assert_eq!(names.len(), 2, "DIDIM_VCAN must name two interfaces");
    interfaces(&names)
}

/// A device on the bus, which is what the source under test is not.
struct Device(CanFdSocket);

impl Device {
    fn on_interface(interface: InterfaceName) -> Self {
        Self(CanFdSocket::open(interface.as_str()).unwrap())
    }

    fn send(&self, frame: &Frame) {
        let frame = CanAnyFrame::try_from(frame).unwrap();
        self.0.write_frame_insist(&frame).unwrap();
    }
}

/// Lets the kernel deliver what was sent: under load it does so a little later, in a thread of
/// its own.
fn settle() {
    thread::sleep(Duration::from_millis(50));
}

fn open(interfaces: &[InterfaceName]) -> SocketCanSource {
    SocketCanSource::open(interfaces, &SocketCanOptions::default()).unwrap()
}

fn ip(arguments: &str) {
    let status = Command::new("ip").args(arguments.split(' ')).status().unwrap();
    assert!(status.success(), "ip {arguments}");
}

fn receive(source: &mut SocketCanSource) -> Result<Received, SourceError> {
    source.receive(&mut Vec::with_capacity(64), Duration::from_millis(50))
}

/// Waits until the source gives a result that is not silence.
fn until_not_silent(source: &mut SocketCanSource) -> Result<Received, SourceError> {
    let give_up = Instant::now() + Duration::from_secs(10);
    loop {
        match receive(source) {
            Ok(Received::Silence) => assert!(Instant::now() < give_up, "silent for ten seconds"),
            other => return other,
        }
    }
}

struct Vcan(Vec<InterfaceName>);

impl Rig for Vcan {
    const LIVE: bool = true;
    const ENDS: bool = false;
    const KEEPS_STAMPS: bool = false;

    fn bring(&self, _: &[InterfaceName], frames: &[Frame]) -> Box<dyn Source> {
        let source = open(&self.0);
        let devices: Vec<Device> = self.0.iter().map(|name| Device::on_interface(*name)).collect();
        let frames = frames.to_vec();
        thread::spawn(move || {
            for frame in frames {
                devices[usize::from(frame.interface)].send(&frame);
            }
        });
        Box::new(source)
    }
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn socketcan_conforms() {
    let names = vcan();
    conforms(&Vcan(names));
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn an_error_frame_on_the_bus_is_seen_and_counted() {
    let names = vcan();
    let options = SocketCanOptions { ids: Some(vec![]), ..SocketCanOptions::default() };
    let mut source = SocketCanSource::open(&names[..1], &options).unwrap();
    let sent = Frame::error(0x40, &[0; 8]).unwrap();
    Device::on_interface(names[0]).send(&sent);
    let seen = take(&mut source, 1)[0];
    assert!(seen.is_error());
    assert_eq!((seen.id, seen.data()), (sent.id, sent.data()));
    let expected = Expectation::of("error-frame-on-the-interface");
    expected.assert_eq("error_frames", &source.counters().error_frames);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn stamps_are_the_kernels_and_never_run_backwards() {
    let names = vcan();
    let mut source = open(&names[..1]);
    let device = Device::on_interface(names[0]);
    let now = || u64::try_from(SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos());
    let before = now().unwrap();
    for frame in numbered(500) {
        device.send(&frame);
    }
    let after = now().unwrap();
    // Stamped when they arrived, not when they are read.
    thread::sleep(Duration::from_millis(50));
    let frames = take(&mut source, 500);
    let stamps: Vec<u64> = frames.iter().map(|frame| frame.stamp_ns).collect();
    assert!(stamps.is_sorted());
    assert!(stamps[0] >= before && stamps[499] <= after, "{before} {stamps:?} {after}");
    assert_eq!(source.counters().stamped_late, 0);
    assert!(frames.iter().all(|frame| frame.direction == Direction::Transmitted));

    let mut map = ClockMap::new(clock_pair());
    assert_eq!(map.handle_pair(clock_pair()), ClockChange::None);
    let mapped: Vec<u64> = stamps.iter().map(|stamp| map.map(*stamp)).collect();
    assert!(mapped.is_sorted());
    assert_eq!(mapped[499] - mapped[0], stamps[499] - stamps[0]);
    assert_eq!((map.counters().future_stamps, map.counters().held_back), (0, 0));
}

/// Ends a background thread also when the test fails.
struct Stop<'a>(&'a AtomicBool);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn filters_are_in_force_before_the_first_frame() {
    let names = vcan();
    let device = Device::on_interface(names[0]);
    let (wanted, alike) = (FrameId::Standard(0x181), FrameId::Extended(0x181));
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let stopping = Stop(&stop);
        // The bus is busy with other frames while the source opens.
        let flood = scope.spawn(|| {
            let device = Device::on_interface(names[0]);
            let (mut sent, other) = (0u64, Frame::classic(FrameId::Standard(0x182), &[]).unwrap());
            while !stop.load(Ordering::Relaxed) {
                device.send(&other);
                sent += 1;
                thread::yield_now();
            }
            sent
        });
        for _ in 0..20 {
            let ids = Some(vec![wanted]);
            let options = SocketCanOptions { ids, ..SocketCanOptions::default() };
            let mut source = SocketCanSource::open(&names[..1], &options).unwrap();
            device.send(&Frame::classic(alike, &[1]).unwrap());
            device.send(&Frame::remote(wanted, 0).unwrap());
            device.send(&Frame::classic(wanted, &[2]).unwrap());
            device.send(&Frame::fd(wanted, true, &[3]).unwrap());
            let seen: Vec<u8> = take(&mut source, 2).iter().map(|f| f.data()[0]).collect();
            assert_eq!(seen, [2, 3]);
            assert_eq!(receive(&mut source).unwrap(), Received::Silence);
            assert_eq!(source.counters().passed_over, 0);
        }
        drop(stopping);
        assert!(flood.join().unwrap() > 20);
    });
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn the_receive_buffer_is_what_it_says() {
    let names = vcan();
    let wanted = 64 * QUEUED_FRAME_BYTES;
    let options = SocketCanOptions { receive_buffer_bytes: wanted, ..SocketCanOptions::default() };
    let mut source = SocketCanSource::open(&names[..1], &options).unwrap();
    let granted = source.links().next().unwrap().receive_buffer_bytes;
    assert!(granted.abs_diff(wanted) <= 1, "{granted} of {wanted} bytes");
    // A busy kernel delivers later. What one socket has had, every other one was given.
    let mut witness = open(&names[..1]);
    let device = Device::on_interface(names[0]);
    for frame in numbered(500) {
        device.send(&frame);
    }
    assert_eq!(take(&mut witness, 500).len(), 500);
    let mut frames = 0;
    while receive(&mut source).unwrap() == Received::Frames {
        frames = source.counters().frames;
    }
    let expected = u64::from(granted / QUEUED_FRAME_BYTES);
    assert!(frames.abs_diff(expected) <= 2, "{frames} frames were kept, expected {expected}");
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_receive_buffer_that_was_not_granted_is_reported() {
    // Again as a user without CAP_NET_ADMIN.
    let child = Command::new("setpriv")
        .args(["--reuid", "65534", "--clear-groups", "--inh-caps=-all"])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "socketcan::child_without_privilege", "--ignored"])
        .output()
        .unwrap();
    assert!(child.status.success(), "{child:?}");
}

#[test]
#[ignore = "the other process of a test"]
fn child_without_privilege() {
    let names = vcan();
    let most = std::fs::read_to_string("/proc/sys/net/core/rmem_max").unwrap();
    let most: u32 = most.trim().parse().unwrap();
    let options =
        SocketCanOptions { receive_buffer_bytes: 8 * most, ..SocketCanOptions::default() };
    let mut source = SocketCanSource::open(&names[..1], &options).unwrap();
    let granted = source.links().next().unwrap().receive_buffer_bytes;
    assert_eq!(granted, 2 * most);
    // CAN needs no privilege otherwise.
    Device::on_interface(names[0]).send(&numbered(1)[0]);
    take(&mut source, 1);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn every_dropped_frame_is_counted() {
    let names = vcan();
    let options = SocketCanOptions { receive_buffer_bytes: 8 << 10, ..SocketCanOptions::default() };
    let mut source = SocketCanSource::open(&names[..1], &options).unwrap();
    let device = Device::on_interface(names[0]);
    let frames = numbered(3_000);
    let (mut batch, mut next, mut missing) = (Vec::with_capacity(64), 0, 0);
    let mut read_all = |source: &mut SocketCanSource| {
        while source.receive(&mut batch, Duration::from_millis(50)).unwrap() == Received::Frames {
            for frame in batch.drain(..) {
                missing += u64::from(number(&frame) - next);
                next = number(&frame) + 1;
            }
        }
        (next, missing)
    };
    for (n, chunk) in frames.chunks(100).enumerate() {
        for frame in chunk {
            device.send(frame);
        }
        if n % 3 == 2 {
            read_all(&mut source);
        }
    }
    // The kernel tells of the last drops with one frame more.
    device.send(&Frame::classic(FrameId::Standard(0x181), &3_000u32.to_le_bytes()).unwrap());
    let (next, missing) = read_all(&mut source);
    assert_eq!(next, 3_001);
    let counters = source.counters();
    assert!(missing > 1_000, "only {missing} frames were dropped");
    assert_eq!(counters.queue_drops, missing);
    let expected = Expectation::of("buffer-overflow");
    let both = counters.frames + counters.queue_drops;
    expected.assert_eq("frames_and_queue_drops", &both);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn nothing_is_ever_sent() {
    let names = vcan();
    let mut listener = open(&names);
    let mut source = open(&names);
    assert_eq!(receive(&mut source).unwrap(), Received::Silence);
    ip(&format!("link set {} down", names[1]));
    assert!(until_not_silent(&mut source).is_err());
    ip(&format!("link set {} up", names[1]));
    assert_eq!(receive(&mut source).unwrap(), Received::Silence);
    drop(source);
    assert!(until_not_silent(&mut listener).is_err());
    assert_eq!(receive(&mut listener).unwrap(), Received::Silence);
    assert_eq!(listener.counters().frames, 0);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn many_frames_are_taken_by_one_call() {
    let names = vcan();
    let mut source = open(&names[..1]);
    let device = Device::on_interface(names[0]);
    for frame in numbered(64) {
        device.send(&frame);
    }
    settle();
    let mut batch = Vec::with_capacity(100);
    assert_eq!(source.receive(&mut batch, Duration::ZERO).unwrap(), Received::Frames);
    assert_eq!(batch.iter().map(number).collect::<Vec<_>>(), (0..64).collect::<Vec<_>>());
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn two_interfaces_come_merged_by_their_stamps() {
    let names = vcan();
    let mut source = open(&names);
    let devices = [Device::on_interface(names[0]), Device::on_interface(names[1])];
    for (n, frame) in numbered(400).iter().enumerate() {
        devices[n / 3 % 2].send(frame);
    }
    settle();
    let seen = take(&mut source, 400);
    assert_eq!(seen.iter().map(number).collect::<Vec<_>>(), (0..400).collect::<Vec<_>>());
    let expected: Vec<u8> = (0..400).map(|n| (n / 3 % 2) as u8).collect();
    assert_eq!(seen.iter().map(|frame| frame.interface).collect::<Vec<_>>(), expected);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_link_that_goes_down_is_reported_once_and_taken_up_again() {
    let names = vcan();
    let name = names[0];
    let mut source = open(&names);
    for round in 1..=3 {
        ip(&format!("link set {name} down"));
        let error = until_not_silent(&mut source).unwrap_err();
        assert!(error.is_recoverable(), "{error}");
        assert!(matches!(
            error,
            SourceError::SocketCan(SocketCanError::Down { interface }) if interface == name
        ));
        assert!(!source.links().next().unwrap().is_up);
        // The other interface is still heard, and the news is not repeated.
        Device::on_interface(names[1]).send(&numbered(1)[0]);
        assert_eq!(take(&mut source, 1)[0].interface, 1);
        assert_eq!(receive(&mut source).unwrap(), Received::Silence);

        ip(&format!("link set {name} up"));
        if round != 2 {
            assert_eq!(receive(&mut source).unwrap(), Received::Silence);
            assert!(source.links().next().unwrap().is_up);
        }
        Device::on_interface(name).send(&numbered(1)[0]);
        assert_eq!(take(&mut source, 1)[0].interface, 0);
        assert!(source.links().next().unwrap().is_up);
        assert_eq!(source.counters().link_down, round);
    }
    assert_eq!(source.counters().reopened, 0);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn frames_of_before_the_link_went_down_are_not_lost_and_not_taken_for_its_recovery() {
    let names = vcan();
    let name = names[0];
    let mut source = open(&names[..1]);
    let device = Device::on_interface(name);
    for frame in numbered(3) {
        device.send(&frame);
    }
    settle();
    ip(&format!("link set {name} down"));
    assert_eq!(take(&mut source, 3).iter().map(number).collect::<Vec<_>>(), [0, 1, 2]);
    let error = receive(&mut source).unwrap_err();
    assert!(matches!(error, SourceError::SocketCan(SocketCanError::Down { .. })), "{error}");
    for _ in 0..3 {
        assert_eq!(receive(&mut source).unwrap(), Received::Silence);
    }
    assert_eq!(source.counters().link_down, 1);
    ip(&format!("link set {name} up"));
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn frames_of_before_the_interface_was_deleted_are_not_lost() {
    let names = vcan();
    let name = names[0];
    let mut source = open(&names[..1]);
    let device = Device::on_interface(name);
    for frame in numbered(3) {
        device.send(&frame);
    }
    settle();
    ip(&format!("link delete {name}"));
    assert_eq!(take(&mut source, 3).iter().map(number).collect::<Vec<_>>(), [0, 1, 2]);
    let error = receive(&mut source).unwrap_err();
    assert!(matches!(error, SourceError::SocketCan(SocketCanError::Gone { .. })), "{error}");
    assert_eq!(source.counters().link_down, 1);
    ip(&format!("link add {name} type vcan"));
    ip(&format!("link set {name} mtu 72"));
    ip(&format!("link set {name} up"));
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn an_interface_replaced_by_another_of_its_name_is_opened_again() {
    let names = vcan();
    let name = names[0];
    let mut source = open(&names[..1]);
    ip(&format!("link set {name} down"));
    // The old device lives on: its socket will never say a word.
    ip(&format!("link set {name} name vcan_old"));
    ip(&format!("link add {name} type vcan"));
    ip(&format!("link set {name} mtu 72"));
    ip(&format!("link set {name} up"));
    let give_up = Instant::now() + Duration::from_secs(5);
    while source.counters().reopened == 0 {
        assert!(Instant::now() < give_up, "{source:?}");
        let _ = receive(&mut source);
    }
    ip("link delete vcan_old");
    Device::on_interface(name).send(&numbered(1)[0]);
    take(&mut source, 1);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn a_link_that_is_down_at_the_start_is_reported_and_taken_up() {
    let names = vcan();
    let name = names[0];
    ip(&format!("link set {name} down"));
    let mut source = open(&names[..1]);
    let error = until_not_silent(&mut source).unwrap_err();
    assert!(matches!(error, SourceError::SocketCan(SocketCanError::Down { .. })), "{error}");
    ip(&format!("link set {name} up"));
    Device::on_interface(name).send(&numbered(1)[0]);
    take(&mut source, 1);
    assert_eq!(source.counters().link_down, 1);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn an_interface_that_is_missing_at_the_start_is_opened_once_it_exists() {
    let names = vcan();
    let name = names[0];
    ip(&format!("link delete {name}"));
    let options = SocketCanOptions { waits_for_interfaces: true, ..SocketCanOptions::default() };
    let mut source = SocketCanSource::open(&names, &options).unwrap();
    let error = until_not_silent(&mut source).unwrap_err();
    assert!(error.is_recoverable() && error.to_string().contains(name.as_str()), "{error}");
    assert_eq!(source.interface_faults().get(0), Some(InterfaceFault::Missing));
    Device::on_interface(names[1]).send(&numbered(1)[0]);
    assert_eq!(take(&mut source, 1)[0].interface, 1);
    ip(&format!("link add {name} type vcan"));
    ip(&format!("link set {name} mtu 72"));
    ip(&format!("link set {name} up"));
    let give_up = Instant::now() + Duration::from_secs(5);
    while !source.interface_faults().is_empty() {
        assert!(Instant::now() < give_up, "{source:?}");
        let _ = receive(&mut source);
    }
    Device::on_interface(name).send(&numbered(1)[0]);
    assert_eq!(take(&mut source, 1)[0].interface, 0);
    assert_eq!((source.counters().link_down, source.counters().reopened), (1, 1));
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn an_interface_deleted_and_made_again_is_opened_again() {
    let names = vcan();
    let name = names[0];
    let mut source = open(&names);
    for round in 1..=2 {
        ip(&format!("link delete {name}"));
        let mut gone = false;
        while !gone {
            let error = until_not_silent(&mut source).unwrap_err();
            assert!(error.is_recoverable(), "{error}");
            gone = matches!(error, SourceError::SocketCan(SocketCanError::Gone { .. }));
        }
        Device::on_interface(names[1]).send(&numbered(1)[0]);
        assert_eq!(take(&mut source, 1)[0].interface, 1);
        thread::sleep(Duration::from_millis(100));
        assert_eq!(receive(&mut source).unwrap(), Received::Silence);

        ip(&format!("link add {name} type vcan"));
        ip(&format!("link set {name} mtu 72"));
        ip(&format!("link set {name} up"));
        let give_up = Instant::now() + Duration::from_secs(5);
        while source.counters().reopened < round || !source.links().next().unwrap().is_up {
            assert!(Instant::now() < give_up, "{source:?}");
            // It may be found while it is still down, or with the small MTU.
            let _ = receive(&mut source);
        }
        Device::on_interface(name).send(&numbered(1)[0]);
        assert_eq!(take(&mut source, 1)[0].interface, 0);
        let of_each: u64 = Expectation::of("interface-deleted").get("link_down");
        assert_eq!(source.counters().link_down, round * of_each);
    }
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn what_cannot_be_opened_is_named_with_its_remedy() {
    let names = vcan();
    let options = SocketCanOptions::default();
    fn refused(names: &[InterfaceName], parts: &[&str], options: &SocketCanOptions) {
        let error = SocketCanSource::open(names, options).unwrap_err();
        let text = error.to_string();
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    }
    let (first, second) = (names[0].as_str(), names[1].as_str());
    refused(
        &interfaces(&["can77"]),
        &["no interface can77", first, second, "ip link add can77"],
        &options,
    );
    refused(&interfaces(&["lo"]), &["lo is not a CAN interface", first], &options);
    refused(&[names[0], names[0]], &["twice"], &options);
    refused(&[], &["0 interfaces"], &options);

    ip(&format!("link set {first} down"));
    ip(&format!("link set {first} mtu 16"));
    ip(&format!("link set {first} up"));
    let fd = SocketCanSource::open(&names[..1], &options);
    let classic = SocketCanOptions { accepts_fd: false, ..SocketCanOptions::default() };
    let mut source = SocketCanSource::open(&names[..1], &classic).unwrap();
    Device::on_interface(names[0]).send(&numbered(1)[0]);
    take(&mut source, 1);
    drop(source);
    ip(&format!("link set {first} down"));
    ip(&format!("link set {first} mtu 72"));
    ip(&format!("link set {first} up"));
    let text = fd.unwrap_err().to_string();
    assert!(text.contains("classic frames only") && text.contains("mtu 72"), "{text}");
}
