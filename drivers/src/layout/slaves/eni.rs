//! ENI files (ETG.2100), which contain the network as configured in the master.

use std::path::Path;

use roxmltree::{Document, Node};

use super::super::eds::Object;
use super::super::field::Encoding;
use super::super::spec::SlaveSpec;
use super::{Area, Command, Network, NetworkError, Slave};
use crate::ethercat::{ARMW, FRMW, LRD, LRW, LWR, SYSTEM_TIME};

/// An ENI file, and its name for error messages.
struct Eni<'a> {
    file: &'a Path,
}

/// Kind of a cyclic datagram.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Kind {
    ProcessData(Command),
    /// Datagram with the time of the distributed clock.
    Clock,
    Other,
}

/// Reads the slaves that a layout names, and the cyclic datagrams.
pub(in crate::layout) fn read_eni(
    text: &str,
    file: &Path,
    wanted: &[SlaveSpec],
) -> Result<Network, NetworkError> {
    let eni = Eni { file };
    let not_eni = |problem: String| NetworkError::NotEni { file: file.to_owned(), problem };
    let document = Document::parse(text).map_err(|error| not_eni(error.to_string()))?;
    let root = document.root_element();
    let config = child(root, "Config").filter(|_| root.has_tag_name("EtherCATConfig"));
    let config = config.ok_or_else(|| not_eni("it has no EtherCATConfig with a Config".into()))?;
    let slaves: Vec<(String, u16, Node<'_, '_>)> = children(config, "Slave")
        .map(|slave| {
            let info = eni.required_child(slave, "Info")?;
            let name = text_of(eni.required_child(info, "Name")?).to_owned();
            let address = eni.parse_number(eni.required_child(info, "PhysAddr")?)?;
            Ok::<_, NetworkError>((name, address, slave))
        })
        .collect::<Result<_, _>>()?;
    let slaves = wanted
        .iter()
        .map(|spec: &SlaveSpec| {
            let is = |(name, address, _): &&(String, u16, _)| {
                spec.name.as_ref().is_none_or(|wanted| wanted == name)
                    && spec.address.is_none_or(|wanted| wanted == *address)
            };
            let mut matching = slaves.iter().filter(is);
            let (Some((name, _, node)), None) = (matching.next(), matching.next()) else {
                let names = slaves.iter().map(|(name, address, _)| format!("{name} ({address})"));
                let (file, wanted) = (file.to_owned(), spec.label());
                return Err(NetworkError::NoSlave { file, wanted, found: names.collect() });
            };
            let [inputs, outputs] = [("TxPdo", "Recv", "Inputs"), ("RxPdo", "Send", "Outputs")]
                .map(|kind| eni.slave_area(*node, name, kind));
            Ok(Slave { name: name.clone(), inputs: inputs?, outputs: outputs? })
        })
        .collect::<Result<_, _>>()?;
    Ok(Network { slaves, commands: eni.commands(config)? })
}

impl Eni<'_> {
    /// Returns the process data of a slave in one direction. Its PDOs are in the order of the
    /// slave's sync managers.
    fn slave_area(
        &self,
        slave: Node<'_, '_>,
        name: &str,
        (pdo_tag, place_tag, kind): (&'static str, &'static str, &str),
    ) -> Result<Area, NetworkError> {
        let missing = || NetworkError::NotCyclic {
            file: self.file.to_owned(),
            direction: if kind == "Inputs" { "inputs" } else { "outputs" },
            slave: name.to_owned(),
            remedy: "give it PDOs in the master's configuration, and export anew",
        };
        let Some(data) = child(slave, "ProcessData") else {
            return Ok(Area::from_unknown(missing()));
        };
        let all_pdos: Vec<Node<'_, '_>> = children(data, pdo_tag).collect();
        let managers = data.children().filter(|node| {
            let tag = node.tag_name().name();
            let number = tag.strip_prefix("Sm").filter(|rest| !rest.is_empty());
            number.is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_digit()))
                && child(*node, "Type").is_some_and(|node| text_of(node) == kind)
        });
        let assigned: Vec<Node<'_, '_>> =
            managers.flat_map(|node| children(node, "Pdo").collect::<Vec<_>>()).collect();
        let mut pdos = Vec::new();
        for number in &assigned {
            let index: u16 = self.parse_number(*number)?;
            let is = |pdo: &Node<'_, '_>| {
                child(*pdo, "Index").is_some_and(|own| self.parse_number::<u16>(own) == Ok(index))
            };
            let pdo = all_pdos.iter().copied().find(is);
            pdos.push(pdo.ok_or_else(|| {
                self.value_error(*number, format!("PDO {index:04X} is assigned and not described"))
            })?);
        }
        if assigned.is_empty() {
            pdos = all_pdos.into_iter().filter(|pdo| pdo.has_attribute("Sm")).collect();
        }
        let mut entries = Vec::new();
        for entry in pdos.into_iter().flat_map(|pdo| children(pdo, "Entry").collect::<Vec<_>>()) {
            let index = self.parse_number(self.required_child(entry, "Index")?)?;
            let sub = child(entry, "SubIndex").map_or(Ok(0), |node| self.parse_number(node))?;
            let bits: u16 = self.parse_number(self.required_child(entry, "BitLen")?)?;
            let encoding = child(entry, "DataType").and_then(|node| data_type(text_of(node)));
            entries.push((Object { index, sub_index: sub }, u64::from(bits), encoding));
        }
        let mut places = children(data, place_tag);
        let Some(place) = places.next() else {
            return Ok(Area::from_entries(entries, Err(missing())));
        };
        if let Some(second) = places.next() {
            return Err(self.value_error(second, "one area is read for each direction".into()));
        }
        let start: u32 = self.parse_number(self.required_child(place, "BitStart")?)?;
        let length: u32 = self.parse_number(self.required_child(place, "BitLength")?)?;
        let mapped: u64 = entries.iter().map(|(_, bits, _)| bits).sum();
        if mapped.next_multiple_of(8) != u64::from(length).next_multiple_of(8) {
            let problem = format!("{length} bits, and the PDOs of the slave have {mapped}");
            return Err(self.value_error(place, problem));
        }
        Ok(Area::from_entries(entries, Ok(start.into())))
    }

    /// Returns the datagrams of process data that the master sends in OP, in the order of sending.
    fn commands(&self, config: Node<'_, '_>) -> Result<Vec<Command>, NetworkError> {
        let mut commands = Vec::new();
        for frame in children(config, "Cyclic").flat_map(|cyclic| children(cyclic, "Frame")) {
            let of_frame = children(frame, "Cmd").map(|node| self.command(node));
            let of_frame: Vec<_> = of_frame.collect::<Result<_, _>>()?;
            let with_clock = of_frame.contains(&Kind::Clock);
            commands.extend(of_frame.into_iter().filter_map(|kind| match kind {
                Kind::ProcessData(command) => {
                    Some(Command { carries_clock: with_clock, ..command })
                }
                Kind::Clock | Kind::Other => None,
            }));
        }
        Ok(commands)
    }

    fn command(&self, node: Node<'_, '_>) -> Result<Kind, NetworkError> {
        let mut states = children(node, "State").map(text_of).peekable();
        let in_operation = states.peek().is_none() || states.any(|state| state == "OP");
        let command: u8 = self.parse_number(self.required_child(node, "Cmd")?)?;
        if in_operation && matches!(command, ARMW | FRMW) {
            let register: u16 = self.parse_number(self.required_child(node, "Ado")?)?;
            return Ok(if register == SYSTEM_TIME { Kind::Clock } else { Kind::Other });
        }
        if !in_operation || !matches!(command, LRD | LWR | LRW) {
            return Ok(Kind::Other);
        }
        let length = match (child(node, "DataLength"), child(node, "Data")) {
            (Some(length), _) => self.parse_number(length)?,
            (None, Some(data)) => u16::try_from(text_of(data).len() / 2).unwrap_or(u16::MAX),
            (None, None) => return Err(self.value_error(node, "has no DataLength".into())),
        };
        let image = |tag| child(node, tag).map_or(Ok(0), |node| self.parse_number::<u32>(node));
        Ok(Kind::ProcessData(Command {
            command,
            address: self.parse_number(self.required_child(node, "Addr")?)?,
            length,
            input_bit: 8 * u64::from(image("InputOffs")?),
            output_bit: 8 * u64::from(image("OutputOffs")?),
            expected_counter: child(node, "Cnt")
                .map(|count| self.parse_number(count))
                .transpose()?,
            carries_clock: false,
        }))
    }

    fn required_child<'n, 'd>(
        &self,
        node: Node<'n, 'd>,
        tag: &str,
    ) -> Result<Node<'n, 'd>, NetworkError> {
        child(node, tag).ok_or_else(|| self.value_error(node, format!("has no {tag}")))
    }

    /// Parses a decimal number, or a hexadecimal number such as `#x6064`.
    fn parse_number<T: TryFrom<u64>>(&self, node: Node<'_, '_>) -> Result<T, NetworkError> {
        let text = text_of(node);
        let parsed = match text.strip_prefix("#x").or_else(|| text.strip_prefix("0x")) {
            Some(digits) => u64::from_str_radix(digits, 16),
            None => text.parse(),
        };
        let number = parsed.ok().and_then(|number| T::try_from(number).ok());
        number.ok_or_else(|| {
            self.value_error(node, format!("`{text}` is no number that it could have"))
        })
    }

    fn value_error(&self, node: Node<'_, '_>, problem: String) -> NetworkError {
        let line = node.document().text_pos_at(node.range().start).row;
        let element = node.tag_name().name().to_owned();
        NetworkError::Value { file: self.file.to_owned(), line, element, problem }
    }
}

/// Returns the encoding of a data type, or `None` if its values are not numbers.
fn data_type(name: &str) -> Option<Encoding> {
    match name {
        "SINT" | "INT" | "DINT" | "LINT" => Some(Encoding::Signed),
        "BOOL" | "BYTE" | "WORD" | "DWORD" | "USINT" | "UINT" | "UDINT" | "ULINT" => {
            Some(Encoding::Unsigned)
        }
        "REAL" => Some(Encoding::Float32),
        "LREAL" => Some(Encoding::Float64),
        _ => None,
    }
}

fn child<'n, 'd>(node: Node<'n, 'd>, tag: &str) -> Option<Node<'n, 'd>> {
    node.children().find(|node| node.has_tag_name(tag))
}

fn children<'n, 'd: 'n>(
    node: Node<'n, 'd>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'n, 'd>> {
    node.children().filter(move |node| node.has_tag_name(tag))
}

fn text_of<'n>(node: Node<'n, '_>) -> &'n str {
    node.text().unwrap_or_default().trim()
}
