//! State machine that converts packets to the frames of a plan.

use std::collections::VecDeque;

use super::TrafficSummary;
use super::clock::CycleClock;
use crate::ethercat::{AL_STATUS, BRD, Datagram, EthercatFrame};
use crate::frame::{Direction, Frame, FrameKind, MAX_PAYLOAD};
use crate::layout::{
    AL_STATUS_BITS, AssembledFrame, ProcessData, ProcessDatagram, SYNC_FRAME, WRONG_COUNTER,
};

/// Converter of packets to frames. Nothing is allocated after [`Decoder::new`].
#[derive(Debug)]
pub(super) struct Decoder {
    plan: ProcessData,
    /// Index that the master gave to the latest outgoing datagram, for each datagram of the plan.
    sent_indices: Vec<Option<u8>>,
    /// Frames with the latest outgoing outputs, for each datagram of the plan.
    sent_outputs: Vec<Vec<Frame>>,
    /// Latest AL status, combined by OR over all slaves.
    al_status: u8,
    clock: CycleClock,
    ready_frames: VecDeque<Frame>,
    traffic: TrafficSummary,
}

impl Decoder {
    pub(super) fn new(plan: ProcessData) -> Self {
        let frames = |datagram: &ProcessDatagram| datagram.inputs.len() + datagram.outputs.len();
        let most = 1 + plan.datagrams.iter().map(frames).sum::<usize>();
        let outputs = plan.datagrams.iter().map(|datagram| {
            datagram.outputs.iter().map(|gathered| build_frame(gathered, &[], None)).collect()
        });
        Self {
            sent_indices: vec![None; plan.datagrams.len()],
            sent_outputs: outputs.collect(),
            al_status: 0,
            clock: CycleClock::default(),
            ready_frames: VecDeque::with_capacity(most),
            traffic: TrafficSummary::default(),
            plan,
        }
    }

    /// Returns true if the distributed clock gives the stamps after the first one.
    pub(super) fn has_clock(&self) -> bool {
        self.plan.clock
    }

    pub(super) fn traffic(&self) -> TrafficSummary {
        self.traffic
    }

    /// Removes and returns the next frame that is ready, or returns `None`.
    pub(super) fn poll_frame(&mut self) -> Option<Frame> {
        self.ready_frames.pop_front()
    }

    /// Takes one packet, which was captured at `captured_ns`. Poll all frames before the next call,
    /// which drops the remaining ones. Returns false if the packet is neither an outgoing EtherCAT
    /// frame nor contains process data of the plan.
    pub(super) fn handle_packet(&mut self, packet: &[u8], captured_ns: u64) -> bool {
        self.ready_frames.clear();
        self.traffic.packets += 1;
        let Some(ethernet) = EthercatFrame::parse(packet) else { return false };
        self.traffic.count_frame(&ethernet);
        if !ethernet.is_returning {
            ethernet.datagrams().for_each(|datagram| self.goes_out(&datagram));
            return true;
        }
        // The clock and the status may follow the process data, so read the complete frame first.
        let (mut system, mut state) = (None, 0);
        for datagram in ethernet.datagrams() {
            self.traffic.count_returned(&datagram);
            if self.plan.clock {
                system = system.or(datagram.system_time());
            }
            if datagram.command == BRD
                && datagram.register() == AL_STATUS
                && datagram.working_counter > 0
                && let Some(status) = datagram.data.first()
            {
                self.al_status = status & AL_STATUS_BITS;
            }
            let expected = self.plan.find(&datagram).map(|(_, plan)| plan.expected_counter);
            if expected.is_some_and(|expected| expected != datagram.working_counter) {
                state |= WRONG_COUNTER;
            }
        }
        state |= self.al_status;
        let mut stamp_ns = None;
        for datagram in ethernet.datagrams() {
            let Some((number, plan)) = self.plan.find(&datagram) else { continue };
            let stamp_ns =
                *stamp_ns.get_or_insert_with(|| self.clock.stamp_ns(captured_ns, system));
            self.traffic.used_datagrams += 1;
            let frames = 1 + plan.inputs.len() + plan.outputs.len();
            if self.ready_frames.len() + frames > self.ready_frames.capacity() {
                // The frame contains the same datagram again.
                continue;
            }
            if number == 0 {
                self.ready_frames
                    .push_back(build_frame(&SYNC_FRAME, &[], None).with_stamp(stamp_ns));
            }
            for gathered in &plan.inputs {
                let inputs = build_frame(gathered, datagram.data, Some(state));
                self.ready_frames.push_back(inputs.with_stamp(stamp_ns));
            }
            let sent = self.sent_indices.get_mut(number).and_then(Option::take);
            if sent == Some(datagram.index) {
                let outputs = self.sent_outputs.get(number).into_iter().flatten();
                self.ready_frames.extend(outputs.map(|frame| frame.with_stamp(stamp_ns)));
            }
        }
        stamp_ns.is_some()
    }

    /// Stores the outputs of an outgoing datagram. They become frames only when the datagram
    /// returns, because only then the slaves have received them.
    fn goes_out(&mut self, datagram: &Datagram<'_>) {
        let Some((number, plan)) = self.plan.find(datagram) else { return };
        if let (Some(frames), Some(sent)) =
            (self.sent_outputs.get_mut(number), self.sent_indices.get_mut(number))
        {
            *sent = Some(datagram.index);
            for (place, gathered) in frames.iter_mut().zip(&plan.outputs) {
                *place = build_frame(gathered, datagram.data, None);
            }
        }
    }
}

impl ProcessData {
    /// Returns the datagram of the plan that matches a received one, and its index in the plan.
    fn find(&self, datagram: &Datagram<'_>) -> Option<(usize, &ProcessDatagram)> {
        self.datagrams.iter().enumerate().find(|(_, plan)| {
            plan.command == datagram.command
                && plan.address == datagram.address
                && plan.length == datagram.data.len()
        })
    }
}

/// Returns a frame assembled from the data of a datagram. If there is a state of the network, it is
/// the first byte.
fn build_frame(gathered: &AssembledFrame, data: &[u8], state: Option<u8>) -> Frame {
    let mut payload = [0; MAX_PAYLOAD];
    if let (Some(state), Some(first)) = (state, payload.first_mut()) {
        *first = state;
    }
    for (from, to, bytes) in &gathered.byte_ranges {
        let source = data.get(*from..).and_then(|rest| rest.get(..*bytes));
        let target = payload.get_mut(*to..).and_then(|rest| rest.get_mut(..*bytes));
        if let (Some(from), Some(to)) = (source, target) {
            to.copy_from_slice(from);
        }
    }
    let fd = FrameKind::Fd { bit_rate_switch: false, error_state_indicator: false };
    Frame {
        stamp_ns: 0,
        interface: 0,
        id: gathered.id,
        kind: if gathered.length == 0 { FrameKind::Classic } else { fd },
        direction: Direction::Received,
        length: gathered.length,
        payload,
    }
}
