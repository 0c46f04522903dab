//! EtherCAT slaves: the contents of their process data, and the cyclic datagrams that carry them.
//!
//! An ENI file contains both, as configured in the master. A capture of the start-up contains both,
//! as the master sent them to the slaves. Either is read to a [`Network`]. The neighbouring module
//! `compile_slaves` makes a plan from the network, of the same form as a plan from a DBC file. A
//! device description (ESI) lists the possible settings of a slave, not the master's choice, and is
//! not read.

mod common_objects;
mod eni;
mod error;
mod startup;

pub(super) use common_objects::encoding_of;
pub(super) use eni::read_eni;
pub use error::NetworkError;
pub(super) use startup::learn_network;

use super::eds::Object;
use super::field::Encoding;
use super::spec::SlaveSpec;

/// Data of a network that a layout needs: the slaves that the layout names, in the order of the
/// axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    pub(super) slaves: Vec<Slave>,
    pub(super) commands: Vec<Command>,
}

/// One EtherCAT slave of the network.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slave {
    /// Label of the slave for messages: its name, or its address.
    pub(super) name: String,
    pub(super) inputs: Area,
    pub(super) outputs: Area,
}

/// The process data of a slave in one direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) entries: Vec<Entry>,
    /// First bit of the area in the process image. The error is the reason why it is unknown, with
    /// the remedy.
    pub(super) first_bit: Result<u64, NetworkError>,
}

/// An object in the process data of a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) object: Object,
    /// First bit of the object, from the first bit of its area.
    pub(super) first_bit: u64,
    pub(super) bits: u64,
    /// Encoding of the object, if the file gives it.
    pub(super) encoding: Option<Encoding>,
}

/// A cyclic datagram of process data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Command {
    pub(super) command: u8,
    pub(super) address: u32,
    /// Length of the data \[bytes\].
    pub(super) length: u16,
    /// First bit of the datagram in the image of the inputs, and in the image of the outputs.
    pub(super) input_bit: u64,
    pub(super) output_bit: u64,
    /// Value of the working counter if every slave takes part.
    pub(super) expected_counter: Option<u16>,
    /// True if the frame of this datagram also carries the time of the distributed clock.
    pub(super) carries_clock: bool,
}

impl Area {
    /// Creates an area from its position and the entries of PDOs, in their order.
    fn from_entries(
        mapped: impl IntoIterator<Item = (Object, u64, Option<Encoding>)>,
        first_bit: Result<u64, NetworkError>,
    ) -> Self {
        let mut bits = 0;
        // Objects with an index below 1000h are gaps.
        let entries = mapped
            .into_iter()
            .map(|(object, own, encoding)| {
                let first_bit = bits;
                bits += own;
                Entry { object, first_bit, bits: own, encoding }
            })
            .filter(|e| e.object.index >= 0x1000);
        Self { entries: entries.collect(), first_bit }
    }

    fn from_unknown(why: NetworkError) -> Self {
        Self { entries: Vec::new(), first_bit: Err(why) }
    }
}

impl SlaveSpec {
    /// Returns the readable label.
    pub(super) fn label(&self) -> String {
        match (&self.name, self.address) {
            (Some(name), _) => name.clone(),
            (None, address) => address.map_or_else(String::new, |address| address.to_string()),
        }
    }
}
