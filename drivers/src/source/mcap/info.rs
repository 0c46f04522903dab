//! Description of a recording in the file itself: the metadata record `didim`.

use std::collections::BTreeMap;

use super::bytes::ByteReader;
use crate::source::InterfaceName;

/// Name of the metadata record.
pub const METADATA_NAME: &str = "didim";

/// Longest metadata record that is read \[bytes\].
const MAX_METADATA: usize = 1 << 20;

const VERSION_KEY: &str = "version";
const CELL_KEY: &str = "cell";
const CONFIGURATION_KEY: &str = "configuration";
const OFFSET_KEY: &str = "offset_ns";
const INTERFACES_KEY: &str = "interfaces";
const RUN_KEY: &str = "run";

/// Origin of the frames, and the time base of their stamps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct McapInfo {
    /// Version of the program that wrote the file.
    pub version: String,
    /// Name of the cell.
    pub cell: String,
    /// Hash of the cell's configuration.
    pub configuration: String,
    /// Identifier of the recorder's run. Stamps and sequence numbers of two runs are unrelated.
    pub recorder_run: String,
    /// Difference between `log_time` and the stamp of a message \[ns\], modulo 2⁶⁴.
    pub offset_ns: i64,
    /// Interfaces, in the order of their indices in the frames.
    pub interfaces: Vec<InterfaceName>,
    /// Additional entries of the program that wrote the file.
    pub additional_entries: BTreeMap<String, String>,
}

impl McapInfo {
    pub(super) fn to_map(&self) -> BTreeMap<String, String> {
        let names: Vec<&str> = self.interfaces.iter().map(InterfaceName::as_str).collect();
        let mut map = self.additional_entries.clone();
        map.extend(
            [
                (VERSION_KEY, self.version.clone()),
                (CELL_KEY, self.cell.clone()),
                (CONFIGURATION_KEY, self.configuration.clone()),
                (RUN_KEY, self.recorder_run.clone()),
                (OFFSET_KEY, self.offset_ns.to_string()),
                (INTERFACES_KEY, names.join(" ")),
            ]
            .map(|(key, value)| (key.to_owned(), value)),
        );
        map
    }

    /// Reads the body of a metadata record. Returns `None` if it belongs to another program or is
    /// malformed.
    pub(super) fn read(body: &[u8]) -> Option<Self> {
        let mut bytes = ByteReader(body.get(..body.len().min(MAX_METADATA))?);
        if bytes.take_text()? != METADATA_NAME {
            return None;
        }
        let (mut pairs, mut info, mut offset) =
            (ByteReader(bytes.take_block()?), Self::default(), None);
        while !pairs.0.is_empty() {
            let (key, value) = (pairs.take_text()?, pairs.take_text()?.to_owned());
            match key {
                VERSION_KEY => info.version = value,
                CELL_KEY => info.cell = value,
                CONFIGURATION_KEY => info.configuration = value,
                RUN_KEY => info.recorder_run = value,
                OFFSET_KEY => offset = value.parse().ok(),
                INTERFACES_KEY => {
                    let names = value.split_whitespace();
                    info.interfaces =
                        names.map(InterfaceName::new).collect::<Result<_, _>>().ok()?;
                }
                _ => drop(info.additional_entries.insert(key.to_owned(), value)),
            }
        }
        info.offset_ns = offset?;
        (info.interfaces.len() <= crate::source::MAX_INTERFACES).then_some(info)
    }

    /// Returns the stamp \[ns\] of a message from its `log_time`.
    pub fn stamp_ns(&self, log_time: u64) -> u64 {
        log_time.wrapping_sub(self.offset_ns.cast_unsigned())
    }

    /// Returns the `log_time` \[ns\] of a message from its stamp.
    pub fn log_time(&self, stamp_ns: u64) -> u64 {
        stamp_ns.wrapping_add(self.offset_ns.cast_unsigned())
    }
}
