//! EtherCAT slaves: what their process data carry, and which cyclic datagrams they go by.
//!
//! An ENI file says both, as the master was configured; a capture of the start-up holds both, as the
//! master told the slaves. Either is read to a [`Network`], and `compile_slaves` beside this room makes
//! the same plan of it as of a DBC file. A device description (ESI) says what a slave could do, not
//! what the master chose, and is not read.

mod eni;
mod error;
mod known;
mod startup;

pub(super) use eni::read_eni;
pub use error::NetworkError;
pub(super) use known::encoding_of;
pub(super) use startup::learn;

use super::eds::Object;
use super::field::Encoding;
use super::spec::SlaveSpec;

/// What a layout needs of a network: the slaves that it names, in the order of the axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    pub(super) slaves: Vec<Slave>,
    pub(super) commands: Vec<Command>,
}

/// One slave.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slave {
    /// As people call it: its name, or its address.
    pub(super) name: String,
    pub(super) inputs: Area,
    pub(super) outputs: Area,
}

/// The process data of a slave in one direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) entries: Vec<Entry>,
    /// Its first bit in the process image; or why it is not known, with the remedy.
    pub(super) first_bit: Result<u64, NetworkError>,
}

/// An object of an area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) object: Object,
    /// After the first of its area.
    pub(super) first_bit: u64,
    pub(super) bits: u64,
    /// What the file says that it is.
    pub(super) encoding: Option<Encoding>,
}

/// A cyclic datagram of process data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Command {
    pub(super) command: u8,
    pub(super) address: u32,
    /// \[bytes\]
    pub(super) length: u16,
    /// Its first bit in the image of the inputs, and in that of the outputs.
    pub(super) input_bit: u64,
    pub(super) output_bit: u64,
    /// The working counter when every slave takes part.
    pub(super) expected: Option<u16>,
    /// Whether its frame has the distributed clock's time too.
    pub(super) with_clock: bool,
}

impl Area {
    /// The entries of PDOs, one behind the other, and where the area lies.
    fn of(
        mapped: impl IntoIterator<Item = (Object, u64, Option<Encoding>)>,
        first_bit: Result<u64, NetworkError>,
    ) -> Self {
        let mut bits = 0;
        let place = |(object, own, encoding)| {
            let first_bit = bits;
            bits += own;
            Entry { object, first_bit, bits: own, encoding }
        };
        // Objects below 1000h are gaps.
        let entries = mapped.into_iter().map(place).filter(|e| e.object.index >= 0x1000);
        Self { entries: entries.collect(), first_bit }
    }

    fn unknown(why: NetworkError) -> Self {
        Self { entries: Vec::new(), first_bit: Err(why) }
    }
}

impl SlaveSpec {
    /// As people call it.
    pub(super) fn label(&self) -> String {
        match (&self.name, self.address) {
            (Some(name), _) => name.clone(),
            (None, address) => address.map_or_else(String::new, |address| address.to_string()),
        }
    }
}
