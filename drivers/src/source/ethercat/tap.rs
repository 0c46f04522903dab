//! Source for a tap on the wire: a packet socket that receives and cannot send.

use core::time::Duration;
use std::io;
use std::time::Instant;

use super::EthercatError;
use super::decode::Decoder;
use crate::clock::HardwareClock;
use crate::ethercat::ETHERCAT_TYPE;
use crate::frame::Frame;
use crate::layout::CompiledLayout;
use crate::socket::{PACKET_BYTES, ReceiveBuffer, Socket, clock_pair, device_state, wait_readable};
use crate::source::listening::{
    DropCounter, Listening, MAX_CALLS, ask_for_stamps_and_drops, realtime_now_ns, receive,
    set_receive_buffer, stamp_ns,
};
use crate::source::retry::{self, Retry};
use crate::source::{
    InterfaceFault, InterfaceFaults, InterfaceName, Received, Source, SourceCounters, SourceError,
    StampClock, capacity,
};

/// Source of the process data on an interface, as frames of a layout.
///
/// If the interface goes down or vanishes, the source reports it once by an error and counts it.
/// The source receives nothing until the interface is back, and then uses it again without a call.
pub struct TapSource {
    interface: [InterfaceName; 1],
    opened: Option<OpenedSocket>,
    /// True if packets can arrive.
    is_up: bool,
    /// Time of the next attempt to open the interface, while its socket is closed.
    retry: Retry,
    wanted_bytes: u32,
    granted_bytes: u32,
    buffer: ReceiveBuffer<PACKET_BYTES>,
    decoder: Decoder,
    drops: DropCounter,
    hardware_clock: Option<HardwareClock>,
    failure: Option<EthercatError>,
    counters: SourceCounters,
}

#[derive(Debug)]
struct OpenedSocket {
    socket: Socket,
    device: i32,
    granted_bytes: u32,
}

impl TapSource {
    /// Opens an interface for receiving, with the requested size of the receive buffer \[bytes\].
    /// If `waits` is true, a missing interface is reported like one that vanished, and opened as
    /// soon as it exists.
    ///
    /// # Errors
    /// [`EthercatError`]; every variant names the remedy.
    pub fn open(
        interface: InterfaceName,
        layout: &CompiledLayout,
        receive_buffer_bytes: u32,
        waits: bool,
    ) -> Result<Self, EthercatError> {
        let Some(plan) = layout.process_data() else {
            return Err(EthercatError::NoPlan { place: interface.to_string() });
        };
        let (opened, missing) = match open(interface, receive_buffer_bytes) {
            Ok(opened) => (Some(opened), None),
            Err(missing @ EthercatError::NoInterface { .. }) if waits => (None, Some(missing)),
            Err(error) => return Err(error),
        };
        Ok(Self {
            interface: [interface],
            is_up: opened.is_some(),
            retry: Retry::after_loss(Instant::now()),
            wanted_bytes: receive_buffer_bytes,
            granted_bytes: opened.as_ref().map_or(0, |opened| opened.granted_bytes),
            opened,
            buffer: ReceiveBuffer::new(),
            decoder: Decoder::new(plan.clone()),
            drops: DropCounter::default(),
            hardware_clock: None,
            counters: SourceCounters {
                link_down: u64::from(missing.is_some()),
                ..SourceCounters::default()
            },
            failure: missing,
        })
    }

    fn name(&self) -> InterfaceName {
        let [name] = self.interface;
        name
    }

    /// Reads packets from the kernel. Returns false if there are none or reading failed, and true
    /// if the caller should look again.
    fn read_packets(&mut self) -> bool {
        self.reopen_when_due();
        let Some(opened) = &self.opened else { return false };
        match self.buffer.fill(&opened.socket) {
            Ok(()) => {
                self.is_up = true;
                return true;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return true,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) if error.raw_os_error() == Some(libc::ENETDOWN) => self.went_down(),
            Err(source) => {
                let (interface, what) = (self.name(), "receive");
                self.failure = Some(EthercatError::System { interface, what, source });
            }
        }
        false
    }

    fn went_down(&mut self) {
        if std::mem::replace(&mut self.is_up, false) {
            self.counters.link_down += 1;
            self.failure = Some(EthercatError::Down { interface: self.name() });
        }
    }

    fn mark_interface_gone(&mut self) {
        self.counters.link_down += u64::from(self.is_up);
        self.is_up = false;
        self.opened = None;
        self.retry = Retry::after_loss(Instant::now());
        self.failure = Some(EthercatError::Gone { interface: self.name() });
    }

    fn reopen_when_due(&mut self) {
        if self.opened.is_some() || !self.retry.remaining(Instant::now()).is_zero() {
            return;
        }
        match open(self.name(), self.wanted_bytes) {
            Ok(opened) => {
                self.granted_bytes = opened.granted_bytes;
                self.opened = Some(opened);
                self.is_up = true;
                self.drops = DropCounter::default();
                self.hardware_clock = None;
                self.counters.reopened += 1;
            }
            Err(_) => self.retry = self.retry.after_failure(Instant::now()),
        }
    }
}

impl Listening for TapSource {
    fn take_frames(&mut self, batch: &mut Vec<Frame>) -> bool {
        let before = batch.len();
        let mut calls = 0;
        while capacity(batch) > 0 {
            if let Some(frame) = self.decoder.poll_frame() {
                self.counters.frames += 1;
                batch.push(frame);
            } else if let Some(message) = self.buffer.next_message() {
                if let Some(total) = message.control.drops {
                    self.counters.queue_drops += self.drops.advance(total);
                }
                let captured_ns = if self.decoder.has_clock() {
                    // This time is only the starting point of the stamps. The distributed clock
                    // gives the following stamps.
                    arrival_ns(message.control.software_ns)
                } else {
                    let stamp = stamp_ns(&message, &mut self.hardware_clock);
                    self.counters.stamped_late += u64::from(stamp.is_none());
                    stamp.unwrap_or_else(realtime_now_ns)
                };
                let used = self.decoder.handle_packet(message.bytes, captured_ns);
                self.counters.passed_over += u64::from(!used);
            } else if calls < MAX_CALLS && self.read_packets() {
                calls += 1;
            } else {
                break;
            }
        }
        batch.len() > before
    }

    fn take_failure(&mut self) -> Option<SourceError> {
        self.failure.take().map(SourceError::from)
    }

    fn check_devices(&mut self) {
        let Some(opened) = &self.opened else { return };
        match device_state(&opened.socket, self.name()) {
            Ok(now) if now.index == opened.device && now.is_up => self.is_up = true,
            Ok(now) if now.index == opened.device => self.went_down(),
            Ok(_) => self.mark_interface_gone(),
            Err(error) if error.raw_os_error() == Some(libc::ENODEV) => self.mark_interface_gone(),
            Err(_) => {}
        }
    }

    fn retry_in(&self) -> Option<Duration> {
        match &self.opened {
            None => Some(self.retry.remaining(Instant::now())),
            Some(_) => (!self.is_up).then_some(retry::FIRST_DELAY),
        }
    }

    fn wait_readable(&self, at_most: Duration) -> Result<(), SourceError> {
        let sockets = self.opened.iter().map(|opened| &opened.socket);
        wait_readable(sockets, at_most).map_err(|source| {
            let (interface, what) = (self.name(), "wait for packets");
            EthercatError::System { interface, what, source }.into()
        })
    }
}

impl Source for TapSource {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        receive(self, batch, timeout)
    }

    fn counters(&self) -> SourceCounters {
        self.counters
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interface
    }

    fn receive_buffer_bytes(&self) -> Option<u32> {
        Some(self.granted_bytes).filter(|bytes| *bytes > 0)
    }

    fn interface_faults(&self) -> InterfaceFaults {
        let fault = match self.opened {
            None => Some(InterfaceFault::Missing),
            Some(_) => (!self.is_up).then_some(InterfaceFault::Down),
        };
        InterfaceFaults::new([fault].into_iter())
    }

    /// Returns [`StampClock::Bus`] if the distributed clock gives the stamps.
    fn stamp_clock(&self) -> StampClock {
        if self.decoder.has_clock() { StampClock::Bus } else { StampClock::Realtime }
    }
}

impl core::fmt::Debug for TapSource {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} {:?}", self.name(), self.counters)
    }
}

/// Returns the arrival of a packet \[ns, CLOCK_BOOTTIME\] from its stamp on CLOCK_REALTIME. It may
/// have waited in the socket while the process was stopped or got no processor. A clock that was
/// set in the meantime makes this time too early, and never later than now.
fn arrival_ns(stamp_ns: Option<u64>) -> u64 {
    let now = clock_pair();
    let age_ns = stamp_ns.map_or(0, |stamp_ns| now.realtime_ns.saturating_sub(stamp_ns));
    now.monotonic_ns.saturating_sub(age_ns)
}

/// Creates a socket that receives from the interface. Every option is set before the first packet
/// can arrive.
fn open(interface: InterfaceName, wanted_bytes: u32) -> Result<OpenedSocket, EthercatError> {
    let failed = |what| {
        move |source: io::Error| match source.raw_os_error() {
            Some(libc::ENODEV) => EthercatError::NoInterface { interface },
            Some(libc::EPERM | libc::EACCES | libc::EAFNOSUPPORT) => {
                EthercatError::Permission { interface, source }
            }
            _ => EthercatError::System { interface, what, source },
        }
    };
    let socket = Socket::new_packet().map_err(failed("open a packet socket"))?;
    let device = device_state(&socket, interface).map_err(failed("find the device"))?.index;
    ask_for_stamps_and_drops(&socket).map_err(failed("ask for stamps"))?;
    let granted_bytes =
        set_receive_buffer(&socket, wanted_bytes).map_err(failed("set the receive buffer"))?;
    socket.bind_packets(device, ETHERCAT_TYPE).map_err(failed("bind"))?;
    Ok(OpenedSocket { socket, device, granted_bytes })
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::process::Command;

    use super::*;
    use crate::ethercat::Capture;

    const TEST: &str = "source::ethercat::tap::tests::a_tap_hears_the_wire_and_says_nothing";
    const INSIDE: &str = "DIDIM_TEST_INSIDE_A_NETWORK_OF_ITS_OWN";
    const PAIR: &str = "ip link add name tap0 type veth peer name tap1 && ip link set tap0 up && \
                        ip link set tap1 up";
    const ENI: &str = include_str!("../../../tests/golden/ethercat/two_drives.eni.xml");
    const CAPTURE: &[u8] = include_bytes!("../../../tests/golden/ethercat/two_drives.pcapng");
    const LAYOUT: &str = r#"
eni = "two_drives.eni.xml"
slaves = [{ name = "Drive_1" }, { name = "Drive_2" }]
axes = 2
rate_hz = 1000.0
position = { object = "6064:00", unit = "count", valid = "instant" }
torque = { object = "6077:00", unit = "count", valid = "instant" }
reference = { object = "607A:00", unit = "count", valid = "next-sync" }
"#;

    #[test]
    #[ignore = "needs a network of its own: tests/run"]
    fn a_tap_hears_the_wire_and_says_nothing() {
        if std::env::var_os(INSIDE).is_some() {
            return inside();
        }
        let run = format!("{PAIR} && exec \"$0\" --ignored --exact {TEST}");
        let mut command = Command::new("unshare");
        command.args(["-rn", "sh", "-c", &run]).arg(std::env::current_exe().unwrap());
        let finished = command.env(INSIDE, "1").output().unwrap();
        assert!(finished.status.success(), "{finished:?}");
        assert!(String::from_utf8_lossy(&finished.stdout).contains("1 passed"), "{finished:?}");
    }

    fn inside() {
        let layout = CompiledLayout::compile_eni(ENI, &toml::from_str(LAYOUT).unwrap()).unwrap();
        let open_tap =
            |name| TapSource::open(InterfaceName::new(name).unwrap(), &layout, 1 << 20, false);
        let mut tap = open_tap("tap0").unwrap();
        assert!(tap.receive_buffer_bytes() > Some(0) && tap.stamp_clock() == StampClock::Bus);
        let wire = Socket::new_packet().unwrap();
        let device = device_state(&wire, InterfaceName::new("tap1").unwrap()).unwrap().index;
        wire.bind_packets(device, ETHERCAT_TYPE).unwrap();
        let mut capture = Capture::new(CAPTURE, Path::new("a"));
        // The kernel begins to stamp packets a moment after the first socket asks for it.
        std::thread::sleep(Duration::from_millis(1_000));
        // Each cycle has a SYNC, inputs and outputs of two drives.
        let (mut frames, mut batch) = (Vec::new(), Vec::with_capacity(7));
        let mut sent = 0;
        while let Some(packet) = capture.next_packet().unwrap() {
            wire.send(packet.bytes).unwrap();
            sent += 1;
            if sent == 20 {
                tap.receive(&mut batch, Duration::from_millis(10)).unwrap();
                frames.append(&mut batch);
            }
        }
        // A packet that waits in the socket is read late, and keeps its own time.
        std::thread::sleep(Duration::from_millis(700));
        for _ in 0..1_000 {
            tap.receive(&mut batch, Duration::from_millis(10)).unwrap();
            frames.append(&mut batch);
            if frames.len() == 200 {
                break;
            }
        }
        assert_eq!(frames.len(), 200, "{:?}", tap.counters());
        let syncs: Vec<u64> =
            frames.iter().filter(|frame| frame.length == 0).map(|frame| frame.stamp_ns).collect();
        assert!(syncs.windows(2).all(|pair| pair[1] - pair[0] == 1_000_000), "{syncs:?}");
        assert_eq!((syncs.len(), tap.counters().passed_over, tap.counters().frames), (40, 0, 200));
        // The other end would have received any packet that the tap sends.
        let mut heard = ReceiveBuffer::<PACKET_BYTES>::new();
        assert_eq!(heard.fill(&wire).unwrap_err().kind(), io::ErrorKind::WouldBlock);

        let missing = open_tap("nothing0").unwrap_err().to_string();
        assert!(missing.contains("nothing0") && missing.contains("ip link"), "{missing}");
        // The loopback device of a new network is down.
        let mut down = open_tap("lo").unwrap();
        let error = down.receive(&mut batch, Duration::ZERO).unwrap_err();
        assert!(error.is_recoverable() && error.to_string().contains("lo is down"), "{error}");
        assert_eq!(down.receive(&mut batch, Duration::ZERO).unwrap(), Received::Silence);
        assert_eq!(down.counters().link_down, 1);
        assert_eq!(down.interface_faults().get(0), Some(InterfaceFault::Down));
        waits_for_its_interface(&layout);
    }

    /// An interface that is missing at the start is opened once it exists.
    fn waits_for_its_interface(layout: &CompiledLayout) {
        let mut batch = Vec::with_capacity(7);
        let name = InterfaceName::new("tap2").unwrap();
        let mut tap = TapSource::open(name, layout, 1 << 20, true).unwrap();
        let error = tap.receive(&mut batch, Duration::ZERO).unwrap_err();
        assert!(error.is_recoverable() && error.to_string().contains("tap2"), "{error}");
        assert_eq!(tap.interface_faults().get(0), Some(InterfaceFault::Missing));
        let pair = PAIR.replace("tap0", "tap2").replace("tap1", "tap3");
        assert!(Command::new("sh").args(["-c", &pair]).status().unwrap().success());
        for _ in 0..500 {
            let _ = tap.receive(&mut batch, Duration::from_millis(10));
            if tap.interface_faults().is_empty() {
                break;
            }
        }
        assert!(tap.interface_faults().is_empty(), "{:?}", tap.counters());
        assert_eq!((tap.counters().link_down, tap.counters().reopened), (1, 1));
        assert!(tap.receive_buffer_bytes() > Some(0));
    }
}
