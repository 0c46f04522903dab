//! Linux SocketCAN as a source: several interfaces, kernel or hardware stamps, every drop counted.

mod error;
mod link;
mod open;
mod options;

use core::time::Duration;
use std::time::Instant;

pub use error::SocketCanError;
use link::Link;
pub use link::LinkReport;
pub use options::{QUEUED_FRAME_BYTES, SocketCanOptions};

use super::{
    InterfaceName, MAX_INTERFACES, Received, Source, SourceCounters, SourceError, StampClock, room,
};
use crate::frame::Frame;
use crate::socket::wait_readable;

/// The longest single wait, so that a caller without a timeout still notices an interface that
/// went away without a word.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Frames of one or more SocketCAN interfaces. It cannot send.
///
/// Frames of one interface keep their order; those of several are merged by their stamps as far
/// as they were there at the same time.
///
/// An interface that goes down or away is reported once by an error, counted, and silent until it
/// is back; it is then taken up again without being asked.
#[derive(Debug)]
pub struct SocketCanSource {
    interfaces: Vec<InterfaceName>,
    links: Vec<Link>,
}

impl SocketCanSource {
    /// Opens the interfaces. Options and filters are in force before the first frame can arrive.
    /// An interface that is down is opened all the same; the first call to receive reports it.
    ///
    /// # Errors
    /// See [`SocketCanError`]: every variant says what to do.
    pub fn open(
        interfaces: &[InterfaceName],
        options: &SocketCanOptions,
    ) -> Result<Self, SocketCanError> {
        if interfaces.is_empty() || interfaces.len() > MAX_INTERFACES {
            return Err(SocketCanError::InterfaceCount { count: interfaces.len() });
        }
        let mut links: Vec<Link> = Vec::with_capacity(interfaces.len());
        for (index, name) in (0..).zip(interfaces) {
            if links.iter().any(|link| link.name() == *name) {
                return Err(SocketCanError::Twice { interface: *name });
            }
            links.push(Link::open(*name, index, options)?);
        }
        Ok(Self { interfaces: interfaces.to_vec(), links })
    }

    /// What was granted and counted per interface, in their order.
    pub fn links(&self) -> impl Iterator<Item = LinkReport> {
        self.links.iter().map(Link::report)
    }

    /// Moves frames into the batch, oldest stamp first; returns whether there were any.
    fn merge(&mut self, batch: &mut Vec<Frame>) -> bool {
        let before = batch.len();
        for link in &mut self.links {
            link.fill();
        }
        while room(batch) > 0 {
            let waiting = self.links.iter_mut().filter(|link| link.head().is_some());
            let Some(link) = waiting.min_by_key(|link| link.head()) else { break };
            batch.extend(link.take());
            if link.may_have_older() {
                // What still waits in the kernel may be older than the other interfaces' frames.
                break;
            }
        }
        batch.len() > before
    }

    fn failure(&mut self) -> Option<SourceError> {
        self.links.iter_mut().find_map(Link::take_failure).map(SourceError::from)
    }
}

impl Source for SocketCanSource {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        if room(batch) == 0 {
            return Err(SourceError::NoRoom);
        }
        let started = Instant::now();
        let mut waited = false;
        loop {
            if let Some(failure) = self.failure() {
                return Err(failure);
            }
            if self.merge(batch) {
                return Ok(Received::Frames);
            }
            let left = timeout.saturating_sub(started.elapsed());
            if waited || left.is_zero() {
                // Silence is when the state of the interfaces is worth a look.
                self.links.iter_mut().for_each(Link::supervise);
            }
            if let Some(failure) = self.failure() {
                return Err(failure);
            }
            if left.is_zero() {
                return Ok(Received::Silence);
            }
            let wait = self.links.iter().filter_map(Link::retry_in).fold(LONGEST_WAIT, Ord::min);
            let sockets = self.links.iter().filter_map(Link::socket);
            wait_readable(sockets, left.min(wait))
                .map_err(|source| SocketCanError::Wait { source })?;
            waited = true;
        }
    }

    fn counters(&self) -> SourceCounters {
        let counters = self.links.iter().map(|link| link.report().counters);
        counters.fold(SourceCounters::default(), SourceCounters::plus)
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Realtime
    }
}
