//! The bus of a cell: the sources of its frames, and the meaning of the frames.

use std::path::Path;

use didim_drivers::assemble::Assembler;
use didim_drivers::layout::{CompiledLayout, Quantity};
use didim_drivers::source::InterfaceName;
use didim_drivers::units::{DriveSpec, Scales};
use didim_dynamics::Reading;

use super::file::BusSection;
use super::{BusAddress, CellError, Library, layout};

/// Texts of the layout's files. Each comes with its name in the stored copy.
type Texts = Vec<(String, String)>;

/// A bus, validated.
#[derive(Clone, Debug)]
pub struct CellBus {
    /// Sources of the frames.
    pub sources: Vec<BusAddress>,
    /// Receive buffer of each socket \[bytes\].
    pub receive_buffer_bytes: u32,
    /// Bit rate of the bus, if configured in the cell \[bit/s\].
    pub bitrate_bps: Option<u32>,
    /// Bit rate of the data phase of CAN FD frames, if configured \[bit/s\].
    pub data_bitrate_bps: Option<u32>,
    /// Meaning of the frames.
    pub layout: CompiledLayout,
    /// Configuration of the drives.
    pub drives: Vec<DriveSpec>,
    /// Conversion from drive units to SI.
    pub scales: Scales,
}

impl CellBus {
    /// Returns the CAN interfaces among its sources.
    pub fn interfaces(&self) -> Vec<InterfaceName> {
        let interface = |source: &BusAddress| match source {
            BusAddress::Can(name) => Some(*name),
            _ => None,
        };
        self.sources.iter().filter_map(interface).collect()
    }

    /// Reads the bus and the files that its layout names. `joints` is the joint count of the robot,
    /// if the robot could be read.
    pub(super) fn read(
        library: Library<'_>,
        cell: &Path,
        section: &BusSection,
        joints: Option<usize>,
    ) -> Result<(Self, Texts), CellError> {
        let (layout, texts) = layout::read(library, cell, &section.layout)?;
        if let Some(joints) = joints.filter(|joints| layout.axes() != *joints) {
            return Err(CellError::Axes { file: cell.to_path_buf(), axes: layout.axes(), joints });
        }
        check_kind(cell, &section.source, &layout)?;
        let torque_factor = section.torque_factor.unwrap_or(1.0);
        if !(torque_factor.is_finite() && torque_factor > 0.0) {
            let problem = format!("is {torque_factor}; use a factor above 0");
            let key = "bus.torque_factor".to_owned();
            return Err(CellError::Value { file: cell.to_path_buf(), line: None, key, problem });
        }
        let mut corrected = section.drives.clone();
        corrected.iter_mut().for_each(|drive| drive.torque.factor *= torque_factor);
        let scales = Scales::new(&corrected, &layout)
            .map_err(|source| CellError::Drives { file: cell.to_path_buf(), source })?;
        let folder = cell.parent().unwrap_or(Path::new(""));
        let bus = Self {
            sources: section.source.iter().map(|source| resolve_file(source, folder)).collect(),
            receive_buffer_bytes: section.receive_buffer_bytes,
            bitrate_bps: section.bitrate_bps,
            data_bitrate_bps: section.data_bitrate_bps,
            layout,
            drives: section.drives.clone(),
            scales,
        };
        Ok((bus, texts))
    }

    /// Returns true if the commands contain their control law.
    pub(super) fn states_law(&self) -> bool {
        self.layout.signal(Quantity::Reading(Reading::Stiffness), 0).is_some()
    }

    /// Returns the assembler that makes samples of its frames.
    pub fn assembler(&self) -> Assembler {
        Assembler::new(self.layout.clone(), self.scales.clone())
    }
}

/// Checks that buses and captures match the kind of layout. A log may be combined with any layout.
fn check_kind(
    cell: &Path,
    sources: &[BusAddress],
    layout: &CompiledLayout,
) -> Result<(), CellError> {
    let is_ethercat = layout.process_data().is_some();
    let problem = sources.iter().find_map(|source| match source {
        BusAddress::Can(_) if is_ethercat => Some(format!(
            "`{source}` is CAN, and the layout is of EtherCAT; write ethercat:INTERFACE or \
            pcap:FILE, or give the layout `dbc` or `nodes`"
        )),
        BusAddress::Pcap(_) | BusAddress::Ethercat(_) if !is_ethercat => Some(format!(
            "`{source}` is EtherCAT, and the layout is of CAN; give it `eni` or `startup`, and \
            `slaves`"
        )),
        _ => None,
    });
    problem.map_or(Ok(()), |problem| {
        let (file, key) = (cell.to_path_buf(), "bus.source".to_owned());
        Err(CellError::Value { file, line: None, key, problem })
    })
}

/// Resolves a file that a cell file names as a bus, relative to the cell file.
fn resolve_file(address: &BusAddress, folder: &Path) -> BusAddress {
    match address {
        BusAddress::Log(file) => BusAddress::Log(folder.join(file)),
        BusAddress::Pcap(file) => BusAddress::Pcap(folder.join(file)),
        other => other.clone(),
    }
}
