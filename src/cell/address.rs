//! Address of a bus, such as `can:vcan0`, `log:file.log`, `pcap:file.pcapng`, `ethercat:eth1` or
//! `inproc:`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use didim_drivers::source::{InterfaceName, InterfaceNameError};
use serde::Deserialize;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};

/// One bus, as written in cell files and on the command line.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum BusAddress {
    /// A SocketCAN interface.
    Can(InterfaceName),
    /// A candump log.
    Log(PathBuf),
    /// An EtherCAT capture.
    Pcap(PathBuf),
    /// An interface that is connected to an EtherCAT tap.
    Ethercat(InterfaceName),
    /// The bus inside this process, used by the simulated arm.
    InProcess,
}

/// Error when a bus address cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusAddressError {
    /// The address does not start with a known scheme. Use one of the known schemes.
    #[error(
        "`{0}` is not a bus; write can:INTERFACE, ethercat:INTERFACE, log:FILE, pcap:FILE or \
        inproc:"
    )]
    Scheme(String),
    /// The part after the scheme is missing or not allowed.
    #[error("`{address}` is not a bus: {reason}")]
    Name {
        /// Address as written.
        address: String,
        /// Problem with the name.
        reason: &'static str,
    },
    /// The name is not valid for an interface.
    #[error("`{address}` is not a bus: {source}")]
    Interface {
        /// Address as written.
        address: String,
        /// Problem with the name.
        source: InterfaceNameError,
    },
}

impl FromStr for BusAddress {
    type Err = BusAddressError;

    fn from_str(address: &str) -> Result<Self, Self::Err> {
        let name = |reason| BusAddressError::Name { address: address.to_owned(), reason };
        let interface_name = |interface| {
            InterfaceName::new(interface).map_err(|source| BusAddressError::Interface {
                address: address.to_owned(),
                source,
            })
        };
        match address.split_once(':') {
            Some(("can", "")) => Err(name("the interface's name is missing, as in can:can0")),
            Some(("can", interface)) => interface_name(interface).map(Self::Can),
            Some(("ethercat", "")) => {
                Err(name("the interface's name is missing, as in ethercat:eth1"))
            }
            Some(("ethercat", interface)) => interface_name(interface).map(Self::Ethercat),
            Some(("log", "")) => Err(name("the file's name is missing, as in log:drive.log")),
            Some(("log", file)) => Ok(Self::Log(PathBuf::from(file))),
            Some(("pcap", "")) => Err(name("the file's name is missing, as in pcap:tap.pcapng")),
            Some(("pcap", file)) => Ok(Self::Pcap(PathBuf::from(file))),
            Some(("inproc", "")) => Ok(Self::InProcess),
            Some(("inproc", _)) => Err(name("nothing may follow inproc:")),
            _ => Err(BusAddressError::Scheme(address.to_owned())),
        }
    }
}

impl TryFrom<String> for BusAddress {
    type Error = BusAddressError;

    fn try_from(address: String) -> Result<Self, Self::Error> {
        address.parse()
    }
}

/// Parses one bus or a list of buses. An untagged enum would not report the problem with an
/// address.
pub(super) fn one_or_more<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<BusAddress>, D::Error> {
    struct OneOrMore;

    impl<'de> Visitor<'de> for OneOrMore {
        type Value = Vec<BusAddress>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(
                "a bus, can:INTERFACE, ethercat:INTERFACE, log:FILE, pcap:FILE or inproc:, \
                or a list",
            )
        }

        fn visit_str<E: Error>(self, address: &str) -> Result<Self::Value, E> {
            address.parse().map(|bus| vec![bus]).map_err(E::custom)
        }

        fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(list))
        }
    }

    deserializer.deserialize_any(OneOrMore)
}

impl fmt::Display for BusAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Can(interface) => write!(f, "can:{interface}"),
            Self::Log(file) => write!(f, "log:{}", file.display()),
            Self::Ethercat(interface) => write!(f, "ethercat:{interface}"),
            Self::Pcap(file) => write!(f, "pcap:{}", file.display()),
            Self::InProcess => f.write_str("inproc:"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_and_printed_alike() {
        for text in
            ["can:vcan0", "ethercat:eth1", "log:/tmp/a b.log", "pcap:/tmp/a b.pcapng", "inproc:"]
        {
            assert_eq!(text.parse::<BusAddress>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn bad_addresses_say_what_to_write() {
        for (text, expected) in [
            ("vcan0", "can:INTERFACE"),
            ("can:", "is missing"),
            ("can:a/b", "a/b"),
            ("can:an-interface-name-too-long", "15"),
            ("log:", "is missing"),
            ("pcap:", "is missing"),
            ("ethercat:", "is missing"),
            ("ethercat:a/b", "a/b"),
            ("inproc:x", "nothing may follow"),
            ("tcp:host", "can:INTERFACE"),
        ] {
            let message = text.parse::<BusAddress>().unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains(text), "{message}");
        }
    }
}
