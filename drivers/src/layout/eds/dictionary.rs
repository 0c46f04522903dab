//! Object dictionary of one node, read from its device file.

use std::path::Path;

use super::error::EdsError;
use super::ini::{self, Entry, Section, Sections};
use super::number;
use crate::layout::Encoding;

/// Value of an object, and its position in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::layout) struct Value {
    pub(in crate::layout) number: u64,
    section: String,
    key: &'static str,
    line: usize,
}

/// A device file for one node.
#[derive(Debug)]
pub(in crate::layout) struct Dictionary<'a> {
    pub(in crate::layout) file: &'a Path,
    pub(in crate::layout) node: u8,
    /// True if the file is a DCF, whose entries `ParameterValue` apply.
    is_dcf: bool,
    sections: Sections<'a>,
}

impl<'a> Dictionary<'a> {
    pub(in crate::layout) fn parse(
        text: &'a str,
        file: &'a Path,
        node: u8,
        configured: bool,
    ) -> Result<Self, EdsError> {
        let dictionary = Self { file, node, is_dcf: configured, sections: ini::parse(text, file)? };
        dictionary.check_node()?;
        Ok(dictionary)
    }

    /// Returns the number of the node for which a DCF was made, if the file contains it.
    pub(in crate::layout) fn commissioned_node(
        text: &'a str,
        file: &'a Path,
    ) -> Result<Option<u8>, EdsError> {
        // Any number of the node serves, because none of the values that are read here depends on
        // it.
        let dictionary = Self { file, node: 1, is_dcf: true, sections: ini::parse(text, file)? };
        let Some(found) = dictionary.made_for()? else { return Ok(None) };
        match u8::try_from(found.number) {
            Ok(node @ 1..=127) => Ok(Some(node)),
            _ => {
                let reason =
                    format!("NodeID is {}, no node's number; correct it: 1 to 127", found.number);
                Err(dictionary.value_error(&found, reason))
            }
        }
    }

    /// Returns the number of the node for which a DCF was made. The standard spells
    /// the name of its section with one m; both spellings are accepted.
    fn made_for(&self) -> Result<Option<Value>, EdsError> {
        let section = ["devicecomissioning", "devicecommissioning"]
            .into_iter()
            .find_map(|name| self.sections.get(name));
        let Some(section) = section.filter(|_| self.is_dcf) else { return Ok(None) };
        let Some(entry) = section.get("nodeid") else { return Ok(None) };
        self.parse_number(section, "NodeID", entry).map(Some)
    }

    /// Checks that a DCF was made for this node.
    fn check_node(&self) -> Result<(), EdsError> {
        let Some(found) = self.made_for()? else { return Ok(()) };
        if found.number == u64::from(self.node) {
            return Ok(());
        }
        let reason = format!(
            "the file was made for node {}, the layout has `node_id = {}`; correct one of them",
            found.number, self.node
        );
        Err(self.value_error(&found, reason))
    }

    /// Returns true if an object has this index.
    pub(in crate::layout) fn has_object(&self, index: u16) -> bool {
        self.sections.contains_key(&format!("{index:04x}"))
            || self.sections.contains_key(&format!("{index:04x}sub0"))
    }

    /// Returns the indices of the existing objects from `first` to `last`, in ascending order.
    pub(in crate::layout) fn existing_indices(
        &self,
        first: u16,
        last: u16,
    ) -> impl Iterator<Item = u16> {
        (first..=last).filter(|index| self.has_object(*index))
    }

    /// Returns the value of an object, or `None` if the file does not contain it.
    pub(in crate::layout) fn value(&self, index: u16, sub: u8) -> Result<Option<Value>, EdsError> {
        if let Some(section) = self.section(index, sub) {
            return self.value_in(section);
        }
        let Some(parent) = self.sections.get(&format!("{index:04x}")) else { return Ok(None) };
        let Some(count) = parent.get("compactsubobj") else { return Ok(None) };
        // One section contains the values of all compact sub-objects, with their decimal numbers as
        // keys.
        let count = self.parse_number(parent, "CompactSubObj", count)?;
        if sub == 0 {
            return Ok(Some(count));
        }
        if u64::from(sub) > count.number {
            return Ok(None);
        }
        let values = self.sections.get(&format!("{index:04x}value"));
        match values.and_then(|values| Some((values, values.get(&sub.to_string())?))) {
            Some((values, entry)) => self.parse_number(values, "value", entry).map(Some),
            None => self.value_in(parent),
        }
    }

    /// Returns the value of an object that the file must contain.
    pub(in crate::layout) fn required_value(
        &self,
        index: u16,
        sub: u8,
        remedy: &'static str,
    ) -> Result<Value, EdsError> {
        self.value(index, sub)?.ok_or_else(|| EdsError::Missing {
            file: self.file.to_owned(),
            section: name(index, sub),
            key: if self.is_dcf { "ParameterValue or DefaultValue" } else { "DefaultValue" },
            remedy,
        })
    }

    /// Returns the encoding of an object and its number of bits.
    pub(in crate::layout) fn data_type(
        &self,
        index: u16,
        sub: u8,
    ) -> Result<(Encoding, u64), EdsError> {
        let missing = || EdsError::Missing {
            file: self.file.to_owned(),
            section: name(index, sub),
            key: "DataType",
            remedy: "take the device file that belongs to the drive's firmware",
        };
        let section = self
            .section(index, sub)
            .or_else(|| {
                let parent = self.sections.get(&format!("{index:04x}"))?;
                parent.get("compactsubobj").is_some().then_some(parent)
            })
            .ok_or_else(missing)?;
        let entry = section.get("datatype").ok_or_else(missing)?;
        let value = self.parse_number(section, "DataType", entry)?;
        let encoding = match value.number {
            0x01 => (Encoding::Unsigned, 1),
            0x02 => (Encoding::Signed, 8),
            0x03 => (Encoding::Signed, 16),
            0x04 => (Encoding::Signed, 32),
            0x05 => (Encoding::Unsigned, 8),
            0x06 => (Encoding::Unsigned, 16),
            0x07 => (Encoding::Unsigned, 32),
            0x08 => (Encoding::Float32, 32),
            0x10 => (Encoding::Signed, 24),
            0x11 => (Encoding::Float64, 64),
            0x12 => (Encoding::Signed, 40),
            0x13 => (Encoding::Signed, 48),
            0x16 => (Encoding::Unsigned, 24),
            0x18 => (Encoding::Unsigned, 40),
            0x19 => (Encoding::Unsigned, 48),
            other => {
                let reason = format!(
                    "type 0x{other:04X} is no number that can be read exactly: an integer of up to \
                     48 bits, REAL32 or REAL64"
                );
                return Err(self.value_error(&value, reason));
            }
        };
        Ok(encoding)
    }

    /// Returns the error for a value, with its place in the file.
    pub(in crate::layout) fn value_error(&self, value: &Value, reason: String) -> EdsError {
        EdsError::Entry {
            file: self.file.to_owned(),
            line: value.line,
            section: value.section.clone(),
            key: value.key.to_owned(),
            reason,
        }
    }

    /// Returns the section of a sub-object. An object without sub-objects is its own sub-object 0.
    fn section(&self, index: u16, sub: u8) -> Option<&Section<'a>> {
        let section = self.sections.get(&format!("{index:04x}sub{sub:x}"));
        section.or_else(|| {
            let parent = self.sections.get(&format!("{index:04x}")).filter(|_| sub == 0)?;
            let simple = parent.get("subnumber").is_none() && parent.get("compactsubobj").is_none();
            simple.then_some(parent)
        })
    }

    fn value_in(&self, section: &Section<'a>) -> Result<Option<Value>, EdsError> {
        let configured = self.is_dcf.then(|| section.get("parametervalue")).flatten();
        if let Some(entry) = configured {
            return self.parse_number(section, "ParameterValue", entry).map(Some);
        }
        let Some(entry) = section.get("defaultvalue") else { return Ok(None) };
        self.parse_number(section, "DefaultValue", entry).map(Some)
    }

    fn parse_number(
        &self,
        section: &Section<'a>,
        key: &'static str,
        entry: Entry<'a>,
    ) -> Result<Value, EdsError> {
        let value_with =
            |number| Value { number, section: section.name.to_owned(), key, line: entry.line };
        number::parse(entry.value, self.node)
            .map(value_with)
            .map_err(|reason| self.value_error(&value_with(0), reason))
    }
}

/// Returns the name of a sub-object's section.
pub(in crate::layout) fn name(index: u16, sub: u8) -> String {
    format!("{index:04X}sub{sub:X}")
}
