//! The device on a real virtual CAN interface, heard by the service's own source.
//!
//! Needs interfaces named by `DIDIM_VCAN` (as in `DIDIM_VCAN=vcan0,vcan1`), up and with the MTU of
//! CAN FD.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use crate::common::{cia402, packed, scenario};
use didim_drivers::frame::Frame;
use didim_drivers::layout::CompiledLayout;
use didim_drivers::source::{InterfaceName, Received, SocketCanOptions, SocketCanSource, Source};
use didim_drivers::units::Scales;
use didim_sim::{
    Fault, FaultAction, Pace, PlaybackConfig, SinkError, SocketCanSink, VirtualDevice, play,
};

/// The interface to test on.
fn vcan() -> String {
    let names = std::env::var("DIDIM_VCAN").expect("DIDIM_VCAN names the interfaces: tests/run");
    names.split(',').next().unwrap().to_owned()
}

fn device((layout, scales): (CompiledLayout, Scales)) -> VirtualDevice {
    let playback = PlaybackConfig { lead_in_s: 0.02, tail_s: 0.02, cycles: Some(1) };
    let error = Fault { cycle: 3, action: FaultAction::ErrorFrame { class: 0x20 } };
    let scenario = scenario().with_playback(playback).unwrap().with_faults(vec![error]);
    VirtualDevice::new(&scenario, layout, scales, 0).unwrap()
}

/// What was sent is what is heard, but for stamps and direction.
#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn what_is_sent_on_an_interface_is_heard() {
    let interface = vcan();
    for bus in [packed(), cia402()] {
        let names = [InterfaceName::new(&interface).unwrap()];
        let mut source = SocketCanSource::open(&names, &SocketCanOptions::default()).unwrap();
        let mut sink = SocketCanSink::open(&interface).unwrap();
        let mut sending = device(bus.clone());
        let mut expected = Vec::new();
        let mut matching = device(bus);
        let mut batch: Vec<Frame> = Vec::with_capacity(64);
        let mut heard: Vec<Frame> = Vec::new();
        for _ in 0..10 {
            let mut frames = Vec::new();
            matching.poll_cycle(&mut frames).unwrap();
            expected.extend(frames);
            let mut frames = Vec::new();
            sending.poll_cycle(&mut frames).unwrap();
            for frame in &frames {
                didim_sim::Sink::send(&mut sink, frame).unwrap();
            }
        }
        while heard.len() < expected.len() {
            batch.clear();
            let received = source.receive(&mut batch, Duration::from_secs(2)).unwrap();
            assert_eq!(received, Received::Frames, "{} of {}", heard.len(), expected.len());
            heard.append(&mut batch.clone());
        }
        for (heard, sent) in heard.iter().zip(&expected) {
            assert_eq!((heard.id, heard.kind, heard.data()), (sent.id, sent.kind, sent.data()));
        }
    }
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn it_plays_on_an_interface() {
    let interface = vcan();
    let mut sink = SocketCanSink::open(&interface).unwrap();
    let mut device = device(cia402());
    let stop = AtomicBool::new(false);
    let played = play(&mut device, &mut sink, Pace::Unpaced, &stop).unwrap();
    assert_eq!(played.frames, 13 * device.cycle_count() + 1);
}

#[test]
#[ignore = "needs a CAN bus: tests/run"]
fn an_interface_that_is_not_there_is_named() {
    let error = SocketCanSink::open("nocan7").unwrap_err();
    assert!(matches!(error, SinkError::Open { .. }));
    assert!(error.to_string().contains("nocan7"), "{error}");
}
