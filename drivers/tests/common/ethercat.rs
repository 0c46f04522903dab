//! Captures of EtherCAT, as a test makes them up: pcapng with stamps in nanoseconds.
#![allow(clippy::cast_possible_truncation, reason = "captures of tests are small")]

/// The start of every capture's time \[ns\].
pub(crate) const START_NS: u64 = 1_700_000_000_000_000_000;

/// A datagram but for whether others follow.
#[derive(Clone, Debug)]
pub(crate) struct Datagram {
    pub(crate) command: u8,
    pub(crate) index: u8,
    pub(crate) address: u32,
    pub(crate) data: Vec<u8>,
    pub(crate) working_counter: u16,
}

/// To a station's register.
pub(crate) fn registered(command: u8, station: u16, register: u16, data: &[u8]) -> Datagram {
    let address = u32::from(register) << 16 | u32::from(station);
    Datagram { command, index: 0, address, data: data.to_vec(), working_counter: 1 }
}

/// An Ethernet frame, on its way out or back.
pub(crate) fn ethernet(returning: bool, datagrams: &[Datagram]) -> Vec<u8> {
    let mut body = Vec::new();
    for (k, datagram) in datagrams.iter().enumerate() {
        let more = if k + 1 < datagrams.len() { 0x8000 } else { 0 };
        let Datagram { command, index, address, data, working_counter } = datagram;
        body.extend([*command, *index]);
        body.extend(address.to_le_bytes());
        body.extend((data.len() as u16 | more).to_le_bytes());
        body.extend([0, 0]);
        body.extend(data);
        body.extend(if returning { *working_counter } else { 0 }.to_le_bytes());
    }
    let source = if returning { 0x02 } else { 0x00 };
    let mut frame = vec![0xFF; 6];
    frame.extend([source, 0x1B, 0x21, 0xAA, 0xBB, 0xCC, 0x88, 0xA4]);
    frame.extend((body.len() as u16 | 0x1000).to_le_bytes());
    frame.extend(body);
    frame.resize(frame.len().max(60), 0);
    frame
}

/// A capture in memory.
#[derive(Clone, Debug)]
pub(crate) struct Pcapng(pub(crate) Vec<u8>);

impl Pcapng {
    pub(crate) fn new() -> Self {
        let mut capture = Self(Vec::new());
        let section = [0x4D, 0x3C, 0x2B, 0x1A, 1, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255];
        capture.block(0x0A0D_0D0A, &section);
        // Ethernet, 65535 bytes of a packet, stamps in ns.
        capture.block(1, &[1, 0, 0, 0, 255, 255, 0, 0, 9, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0]);
        capture
    }

    fn block(&mut self, kind: u32, body: &[u8]) {
        let length = 12 + body.len().next_multiple_of(4) as u32;
        self.0.extend(kind.to_le_bytes());
        self.0.extend(length.to_le_bytes());
        self.0.extend(body);
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(length.to_le_bytes());
    }

    pub(crate) fn packet(&mut self, stamp_ns: u64, packet: &[u8]) {
        let length = (packet.len() as u32).to_le_bytes();
        let mut body = vec![0; 4];
        body.extend(((stamp_ns >> 32) as u32).to_le_bytes());
        body.extend((stamp_ns as u32).to_le_bytes());
        body.extend([length, length].concat());
        body.extend(packet);
        self.block(6, &body);
    }

    /// Datagrams that go out and come back.
    pub(crate) fn exchange(&mut self, stamp_ns: u64, datagrams: &[Datagram]) {
        self.packet(stamp_ns, &ethernet(false, datagrams));
        self.packet(stamp_ns + 20_000, &ethernet(true, datagrams));
    }

    /// An SDO in one message: what is asked, and what a slave answers.
    pub(crate) fn sdo(&mut self, station: u16, request: &[u8], response: &[u8]) {
        for (command, register, service, body) in
            [(5, 0x1800, 2_u16, request), (4, 0x1C00, 3, response)]
        {
            let mut message = (body.len() as u16 + 2).to_le_bytes().to_vec();
            message.extend([0, 0, 0, 0x13]);
            message.extend((service << 12).to_le_bytes());
            message.extend(body);
            self.exchange(START_NS, &[registered(command, station, register, &message)]);
        }
    }

    /// A value written to an object, and confirmed.
    pub(crate) fn download(&mut self, station: u16, index: u16, sub: u8, value: u32) {
        let [low, high] = index.to_le_bytes();
        let value = value.to_le_bytes();
        let request = [&[0x23, low, high, sub][..], &value].concat();
        self.sdo(station, &request, &[0x60, low, high, sub, 0, 0, 0, 0]);
    }

    /// PDOs, each with its objects as index, sub-index and bits in one number, and their
    /// assignment.
    pub(crate) fn pdos(&mut self, station: u16, assignment: u16, pdos: &[(u16, &[u32])]) {
        for (pdo, objects) in pdos {
            self.download(station, *pdo, 0, 0);
            for (sub, object) in (1..).zip(*objects) {
                self.download(station, *pdo, sub, *object);
            }
            self.download(station, *pdo, 0, objects.len() as u32);
        }
        for (sub, (pdo, _)) in (1..).zip(pdos) {
            self.download(station, assignment, sub, (*pdo).into());
        }
        self.download(station, assignment, 0, pdos.len() as u32);
    }

    /// A memory management unit over whole bytes: 1 reads, 2 writes.
    pub(crate) fn unit(
        &mut self,
        station: u16,
        number: u16,
        (address, bytes): (u32, u16),
        kind: u8,
    ) {
        let mut unit = address.to_le_bytes().to_vec();
        unit.extend(bytes.to_le_bytes());
        unit.extend([0, 7, 0, 0x11, 0, kind, 1, 0, 0, 0]);
        self.exchange(START_NS, &[registered(5, station, 0x0600 + 16 * number, &unit)]);
    }
}
