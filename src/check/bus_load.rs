//! Check of the bus capacity for the frames of the layout.

use didim_drivers::frame::FrameId;
use didim_drivers::layout::{CompiledLayout, Role};

use super::finding::Finding;
use super::limits::CheckLimits;
use super::wire;
use crate::cell::{BusAddress, Cell, CellBus};
use crate::text::significant_digits;

const BITRATE_KEY: &str = "bus.bitrate_bps";

pub(super) fn check(cell: &Cell, bus: &CellBus, findings: &mut Vec<Finding>) {
    let buses = bus.sources.iter().filter(|source| matches!(source, BusAddress::Can(_))).count();
    if buses == 0 {
        return;
    }
    let has_fd = bus.layout.messages().iter().any(|message| message.format.is_fd);
    let Some(bitrate) = bus.bitrate_bps else {
        findings.push(Finding::note(
            BITRATE_KEY,
            "is not given, so the bus load is not checked".to_owned(),
            "give the bit rate of the bus, such as 1000000",
        ));
        return;
    };
    let bitrate = f64::from(bitrate);
    let data_bitrate = bus.data_bitrate_bps.map_or(bitrate, f64::from);
    #[expect(clippy::cast_precision_loss, reason = "at most 16 interfaces")]
    let load = load(&bus.layout, bitrate, data_bitrate) / buses as f64;
    let percent = significant_digits(100.0 * load, 3);
    let rate = significant_digits(cell.sample_rate_hz(), 4);
    let rates = match (has_fd, bus.data_bitrate_bps) {
        (true, Some(data)) => format!("{} and {} Mbit/s", bitrate * 1e-6, f64::from(data) * 1e-6),
        (true, None) => format!("{} Mbit/s without a faster data phase", bitrate * 1e-6),
        (false, _) => format!("{} Mbit/s", bitrate * 1e-6),
    };
    let split =
        if buses > 1 { format!(", evenly split over {buses} buses") } else { String::new() };
    let problem = format!(
        "the layout's {} messages at {rate} Hz take {percent} % of {rates}{split} with worst-case \
         bit stuffing",
        bus.layout.messages().iter().filter(|message| message.role != Role::Reading).count()
    );
    let remedy = if has_fd && bus.data_bitrate_bps.is_none() {
        "give `bus.data_bitrate_bps` if the frames switch their bit rate; else lower the rate of \
         the bus cycle, or use more buses"
    } else {
        "lower the rate of the bus cycle, raise the bit rate, or use packed CAN FD frames or more \
         buses"
    };
    if load > 1.0 {
        findings.push(Finding::error(BITRATE_KEY, problem, remedy));
    } else if load > CheckLimits::DEFAULT.max_bus_load {
        findings.push(Finding::warning(BITRATE_KEY, problem, remedy));
    }
}

/// Returns the share of time for which the layout's messages occupy the bus, in the worst case.
/// Each message is sent once per cycle. Messages that only contain additional readings are rare and
/// do not count. Frames that the layout does not use add to this load.
fn load(layout: &CompiledLayout, bitrate_bps: f64, data_bitrate_bps: f64) -> f64 {
    let seconds: f64 = layout
        .messages()
        .iter()
        .filter(|message| message.role != Role::Reading)
        .map(|message| bits(message.format.id, message.format.is_fd, message.format.wire_length()))
        .map(|bits| bits.duration_s(bitrate_bps, data_bitrate_bps))
        .sum();
    seconds * 1e9 / layout.period_ns()
}

fn bits(id: FrameId, fd: bool, bytes: u8) -> wire::FrameBits {
    if fd { wire::fd_bits(id, bytes) } else { wire::classic_bits(id, bytes) }
}
