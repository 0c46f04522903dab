//! Check of the cell's buses and their receive buffers.

use super::finding::Finding;
use super::limits::CheckLimits;
use super::machine::Machine;
use crate::cell::{BusAddress, Cell, CellBus};
use crate::text::significant_digits;

/// Receive buffer space per queued frame, in the kernel's accounting \[bytes\].
const QUEUED_FRAME_BYTES: f64 = 768.0;
/// The MTU of a CAN FD interface (CANFD_MTU) \[bytes\].
const FD_MTU: u32 = 72;

const SOURCE_KEY: &str = "bus.source";
const BUFFER_KEY: &str = "bus.receive_buffer_bytes";

pub(super) fn check(cell: &Cell, bus: &CellBus, machine: &Machine, findings: &mut Vec<Finding>) {
    let mut listens = false;
    for source in &bus.sources {
        match source {
            BusAddress::Can(name) => {
                listens = true;
                interface(bus, machine, name.as_str(), findings);
            }
            BusAddress::Log(file) | BusAddress::Pcap(file) if !file.is_file() => {
                findings.push(Finding::error(
                    SOURCE_KEY,
                    format!("{source}: there is no such file"),
                    "correct the path, which is relative to the cell file",
                ))
            }
            BusAddress::Log(_) | BusAddress::Pcap(_) => {}
            BusAddress::Ethercat(name) => check_tap(machine, name.as_str(), findings),
            BusAddress::InProcess => findings.push(Finding::error(
                SOURCE_KEY,
                format!("{source}: not a bus of `didim run`"),
                "write can:INTERFACE, ethercat:INTERFACE, log:FILE or pcap:FILE",
            )),
        }
    }
    if listens {
        receive_buffer(cell, bus, machine, findings);
    }
}

/// Checks the interface at an EtherCAT tap.
fn check_tap(machine: &Machine, name: &str, findings: &mut Vec<Finding>) {
    let place = format!("ethercat:{name}");
    findings.extend(match machine.interface(name) {
        None => Some(Finding::error(
            SOURCE_KEY,
            format!("{place}: there is no such interface on this machine"),
            "`ip link` lists those there are; for a cell of another machine: --other-machine",
        )),
        Some(interface) if interface.is_can => Some(Finding::error(
            SOURCE_KEY,
            format!("{place}: a CAN interface"),
            "name the Ethernet interface at the tap",
        )),
        Some(interface) if !interface.is_up => Some(Finding::warning(
            SOURCE_KEY,
            format!("{place}: the interface is down; no frame comes until it is up"),
            format!("ip link set {name} up"),
        )),
        Some(_) => None,
    });
}

fn interface(bus: &CellBus, machine: &Machine, name: &str, findings: &mut Vec<Finding>) {
    let Some(interface) = machine.interface(name) else {
        let interfaces = machine.can_interfaces();
        let interfaces =
            if interfaces.is_empty() { "none".to_owned() } else { interfaces.join(" ") };
        findings.push(Finding::error(
            SOURCE_KEY,
            format!("can:{name}: there is no such interface on this machine"),
            format!(
                "CAN interfaces here: {interfaces}; for a cell of another machine: --other-machine"
            ),
        ));
        return;
    };
    if !interface.is_can {
        findings.push(Finding::error(
            SOURCE_KEY,
            format!("can:{name}: not a CAN interface"),
            format!("CAN interfaces here: {}", machine.can_interfaces().join(" ")),
        ));
        return;
    }
    if !interface.is_up {
        findings.push(Finding::warning(
            SOURCE_KEY,
            format!("can:{name}: the interface is down; no frame comes until it is up"),
            format!("set its bit rate, then ip link set {name} up"),
        ));
    }
    let has_fd = bus.layout.messages().iter().any(|message| message.format.is_fd);
    if has_fd && interface.mtu < FD_MTU {
        findings.push(Finding::error(
            SOURCE_KEY,
            format!(
                "can:{name}: the layout has CAN FD frames, the interface carries frames of {} \
                 bytes only",
                interface.mtu
            ),
            format!("ip link set {name} down; ip link set {name} mtu {FD_MTU} fd on …; then up"),
        ));
    }
}

/// Checks that the socket's buffer holds enough seconds of bus data, and that the kernel grants its
/// size.
fn receive_buffer(cell: &Cell, bus: &CellBus, machine: &Machine, findings: &mut Vec<Finding>) {
    #[expect(clippy::cast_precision_loss, reason = "at most 64 messages")]
    let frames_per_second = bus.layout.messages().len() as f64 * cell.sample_rate_hz();
    let seconds = |bytes: u64| {
        #[expect(clippy::cast_precision_loss, reason = "a size of memory")]
        let frames = bytes as f64 / QUEUED_FRAME_BYTES;
        frames / frames_per_second
    };
    let asked = u64::from(bus.receive_buffer_bytes);
    // The kernel grants twice the requested size, so half of the buffer is requested.
    let granted = machine.rmem_max().map_or(asked, |most| asked.min(most.saturating_mul(2)));
    let holds = significant_digits(seconds(granted), 2);
    if granted < asked {
        let problem = format!(
            "{asked} bytes are requested, net.core.rmem_max allows {granted}: {holds} s of frames"
        );
        findings.push(Finding::warning(
            BUFFER_KEY,
            problem,
            format!("sysctl net.core.rmem_max={}, or give the service CAP_NET_ADMIN", asked / 2),
        ));
    } else if seconds(granted) < CheckLimits::DEFAULT.thread_delay_s {
        let needed = CheckLimits::DEFAULT.thread_delay_s * frames_per_second * QUEUED_FRAME_BYTES;
        findings.push(Finding::warning(
            BUFFER_KEY,
            format!("{granted} bytes hold {holds} s of frames: a busy machine loses some"),
            format!("request at least {needed:.0} bytes"),
        ));
    }
}
