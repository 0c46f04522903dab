//! Source for Linux SocketCAN. It receives from several interfaces, with stamps of the kernel or of
//! the hardware, and counts every dropped frame.

mod error;
mod link;
mod open;
mod options;

use core::time::Duration;

pub use error::SocketCanError;
use link::Link;
pub use link::LinkReport;
pub use options::{QUEUED_FRAME_BYTES, SocketCanOptions};

use super::listening::{Listening, receive};
use super::{
    InterfaceFaults, InterfaceName, MAX_INTERFACES, Received, Source, SourceCounters, SourceError,
    StampClock, capacity,
};
use crate::frame::Frame;
use crate::socket::wait_readable;

/// Source of the frames of one or more SocketCAN interfaces. It cannot send.
///
/// Frames of one interface keep their order. Frames of several interfaces are ordered by their
/// stamps if they are available at the same time.
///
/// If an interface goes down or vanishes, the source reports it once by an error and counts it. The
/// source receives nothing from this interface until it is back, and then uses it again without a
/// call.
#[derive(Debug)]
pub struct SocketCanSource {
    interfaces: Vec<InterfaceName>,
    links: Vec<Link>,
}

impl SocketCanSource {
    /// Opens the interfaces. Options and filters are in force before the first frame can arrive. An
    /// interface that is down is opened, too; the first call to receive reports that it is down.
    ///
    /// # Errors
    /// [`SocketCanError`]; every variant names the remedy.
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

    /// Returns the granted settings and the counters of each interface, in the order of the
    /// interfaces.
    pub fn links(&self) -> impl Iterator<Item = LinkReport> {
        self.links.iter().map(Link::report)
    }
}

impl Listening for SocketCanSource {
    /// Moves the available frames into the batch, the oldest stamp first.
    fn take_frames(&mut self, batch: &mut Vec<Frame>) -> bool {
        let before = batch.len();
        for link in &mut self.links {
            link.read_frames();
        }
        while capacity(batch) > 0 {
            let waiting = self.links.iter_mut().filter(|link| link.head_stamp().is_some());
            let Some(link) = waiting.min_by_key(|link| link.head_stamp()) else { break };
            batch.extend(link.take_frame());
            if link.may_have_older() {
                // Frames of this interface that still wait in the kernel may be older than the
                // frames of the other interfaces.
                break;
            }
        }
        batch.len() > before
    }

    fn take_failure(&mut self) -> Option<SourceError> {
        self.links.iter_mut().find_map(Link::take_failure).map(SourceError::from)
    }

    fn check_devices(&mut self) {
        self.links.iter_mut().for_each(Link::check_device);
    }

    fn retry_in(&self) -> Option<Duration> {
        self.links.iter().filter_map(Link::retry_in).min()
    }

    fn wait_readable(&self, at_most: Duration) -> Result<(), SourceError> {
        let sockets = self.links.iter().filter_map(Link::socket);
        wait_readable(sockets, at_most).map_err(|source| SocketCanError::Wait { source }.into())
    }
}

impl Source for SocketCanSource {
    fn receive(
        &mut self,
        batch: &mut Vec<Frame>,
        timeout: Duration,
    ) -> Result<Received, SourceError> {
        receive(self, batch, timeout)
    }

    fn counters(&self) -> SourceCounters {
        let counters = self.links.iter().map(|link| link.report().counters);
        counters.fold(SourceCounters::default(), SourceCounters::sum_with)
    }

    fn interfaces(&self) -> &[InterfaceName] {
        &self.interfaces
    }

    fn stamp_clock(&self) -> StampClock {
        StampClock::Realtime
    }

    fn receive_buffer_bytes(&self) -> Option<u32> {
        let granted = self.links().map(|link| link.receive_buffer_bytes);
        granted.filter(|bytes| *bytes > 0).min()
    }

    fn interface_faults(&self) -> InterfaceFaults {
        InterfaceFaults::new(self.links.iter().map(Link::fault))
    }
}
