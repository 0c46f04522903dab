//! Source for a capture. It reads at the speed of the caller, in constant memory.

use core::time::Duration;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use super::decode::Decoder;
use super::{EthercatError, TrafficSummary};
use crate::ethercat::Capture;
use crate::frame::Frame;
use crate::layout::CompiledLayout;
use crate::source::{
    InterfaceName, Received, Source, SourceCounters, SourceError, StampClock, capacity,
};

/// Name of the only interface of a capture.
const INTERFACE_NAME: &str = "ethercat";

/// Source of the process data of a capture (pcap, pcapng), as frames of a layout.
///
/// A call never waits and never returns [`Received::Silence`](crate::source::Received::Silence). If
/// the capture contains no process data of the layout, the source reports an error at its end.
#[derive(Debug)]
pub struct CaptureSource<R = BufReader<File>> {
    capture: Capture<R>,
    decoder: Decoder,
    cut_packets: u64,
    interfaces: Vec<InterfaceName>,
    has_ended: bool,
    /// Error that the next call returns, after the frames that precede it.
    failure: Option<EthercatError>,
    counters: SourceCounters,
}

impl CaptureSource {
    /// Opens a capture for a layout.
    ///
    /// # Errors
    /// [`EthercatError::NoPlan`] if the layout is not for EtherCAT; [`EthercatError::Capture`] if
    /// the capture cannot be read.
    pub fn open(path: &Path, layout: Option<&CompiledLayout>) -> Result<Self, EthercatError> {
        Self::new(Capture::open(path)?, layout)
    }
}

impl<R: BufRead> CaptureSource<R> {
    /// Creates a source from any reader, like [`CaptureSource::open`].
    ///
    /// # Errors
    /// [`EthercatError::NoPlan`] if the layout is not for EtherCAT.
    pub fn new(
        capture: Capture<R>,
        layout: Option<&CompiledLayout>,
    ) -> Result<Self, EthercatError> {
        let Some(plan) = layout.and_then(CompiledLayout::process_data) else {
            return Err(EthercatError::NoPlan { place: capture.path().display().to_string() });
        };
        Ok(Self {
            capture,
            decoder: Decoder::new(plan.clone()),
            cut_packets: 0,
            interfaces: InterfaceName::new(INTERFACE_NAME).into_iter().collect(),
            has_ended: false,
            failure: None,
            counters: SourceCounters::default(),
        })
    }

    /// Reads the next packet. Returns false at the end of the capture.
    fn advance(&mut self) -> Result<bool, EthercatError> {
        if let Some(packet) = self.capture.next_packet()? {
            self.cut_packets += u64::from(packet.is_cut);
            let used = self.decoder.handle_packet(packet.bytes, packet.stamp_ns);
            self.counters.passed_over += u64::from(!used);
            return Ok(true);
        }
        let seen = self.decoder.traffic();
        if seen.used_datagrams == 0 {
            let (cut_packets, other_packets) = (self.cut_packets, self.capture.passed_over());
            let seen = TrafficSummary { cut_packets, other_packets, ..seen };
            let path = self.capture.path().to_owned();
            return Err(EthercatError::NoProcessData { path, seen });
        }
        Ok(false)
    }
}

impl<R: BufRead + Send> Source for CaptureSource<R> {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        _timeout: Duration,
    ) -> Result<Received, SourceError> {
        if capacity(batch) == 0 {
            return Err(SourceError::NoRoom);
        }
        let before = batch.len();
        while capacity(batch) > 0 {
            if let Some(frame) = self.decoder.poll_frame() {
                self.counters.frames += 1;
                batch.push(frame);
                continue;
            }
            if self.has_ended {
                break;
            }
            match self.advance() {
                Ok(more) => self.has_ended = !more,
                Err(failure) => {
                    self.has_ended = true;
                    self.failure = Some(failure);
                }
            }
        }
        if batch.len() > before {
            return Ok(Received::Frames);
        }
        match self.failure.take() {
            Some(failure) => Err(failure.into()),
            None => Ok(Received::End),
        }
    }

    fn counters(&self) -> SourceCounters {
        let passed_over = self.counters.passed_over + self.capture.passed_over();
        SourceCounters { passed_over, ..self.counters }
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Own
    }
}
