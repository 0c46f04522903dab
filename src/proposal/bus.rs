//! Parts of a proposed cell that are common to all buses: the interface, the rate, the gains of the
//! drives and the windows.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use didim_drivers::frame::{Frame, FrameId};
use didim_drivers::source::Received;
use didim_formats::mean_rate_hz;

use super::draft::Draft;
use super::evidence::ProposalError;
use super::limits::ProposalLimits;
use super::plausible::round_rate;
use super::value::{Guess, quote_text};
use crate::live::recording::open_log;

/// Number of stamps of a log that determine its rate.
const RATE_STAMPS: usize = 20_000;
const BATCH_FRAMES: usize = 4096;
/// Number of frames of a log in which nodes are looked for.
const NODE_FRAMES: usize = 100_000;
/// Identifiers of the first TPDO of nodes 1 and 127 (CiA 301).
const FIRST_TPDO: u16 = 0x181;
const LAST_TPDO: u16 = 0x1FF;
/// Question about the time at which a torque is valid, if it is unknown whether the torque was
/// measured.
pub(super) const VALIDITY_QUESTION: &str = "\"instant\" if it is measured; { held = { hold_us = …, \
    delay_us = … } } if it is a command, usually for one cycle of the controller";

/// Proposes the interface and the windows.
pub(super) fn propose_bus_and_windows(draft: &mut Draft<'_>) {
    let why = "the first interface of a machine; didim only listens";
    draft.add_entry("bus", "source", Guess::assumed(quote_text("can:can0"), why));
    let trigger = "{ by = \"motion\", velocity_threshold_rad_s = 0.5, idle_s = 0.5 }";
    draft.add_entry(
        "window",
        "trigger",
        Guess::assumed(trigger.to_owned(), "motion of a motor opens it, rest closes it"),
    );
    draft.add_entry(
        "window",
        "min_s",
        Guess::assumed("3.0".to_owned(), "shorter motions are not identified"),
    );
    draft.add_entry("window", "max_s", Guess::assumed("60.0".to_owned(), "bounds the memory"));
}

/// Proposes the gains of each drive. The units of the signals determine some of them; `unit`
/// returns the unit in lower case.
pub(super) fn drives(
    draft: &mut Draft<'_>,
    axes: usize,
    unit: impl Fn(&Draft<'_>, &str, usize) -> Option<String>,
) {
    for axis in 1..=axes {
        let section = format!("bus.drives.{axis}");
        let named = "the unit in the DBC file";
        let scale = match unit(draft, "position", axis).as_deref() {
            Some("rad") => Guess::from_file(quote_text("rad"), named),
            Some("deg" | "°") => Guess::from_file(quote_text("deg"), named),
            Some("rev" | "revs" | "turn" | "turns") => Guess::from_file(quote_text("rev"), named),
            _ => Guess::without_value(
                "{ counts_per_revolution = … } of the motor, { rad_per_count = … } or \"rad\"",
            ),
        };
        draft.add_entry(&section, "position.scale", scale);
        draft.add_entry(
            &section,
            "position.sign",
            Guess::without_value(
                "1 if it counts in the positive direction of the robot file, else -1",
            ),
        );
        draft.add_entry(
            &section,
            "position.zero",
            Guess::without_value("value at which the motor angle is 0"),
        );
        let why = "the count never wraps; else \"modulo\"";
        draft.add_entry(&section, "position.wraps", Guess::assumed(quote_text("refuse"), why));
        draft.add_entry(
            &section,
            "position.provenance",
            Guess::without_value("source of scale, sign and zero"),
        );
        let scale = match unit(draft, "torque", axis).as_deref() {
            Some("nm" | "n·m" | "n.m") => Guess::from_file(quote_text("nm"), named),
            Some("a") => Guess::without_value("{ nm_per_a = … }: joint torque of one ampere"),
            _ => Guess::without_value(
                "{ per_mille_of_rated_torque = { rated_torque_nm = … } }, { nm_per_count = … } or \
                \"nm\"",
            ),
        };
        draft.add_entry(&section, "torque.scale", scale);
        draft.add_entry(
            &section,
            "torque.sign",
            Guess::without_value(
                "1 if it acts in the positive direction of the robot file, else -1",
            ),
        );
        draft.add_entry(
            &section,
            "torque.provenance",
            Guess::without_value("source of scale and sign"),
        );
    }
}

/// Proposes the rate from a log.
pub(super) fn rate(rate_hz: Option<f64>) -> Guess {
    match rate_hz {
        Some(rate_hz) => {
            Guess::from_file(format!("{rate_hz:?}"), "the mean distance of the stamps")
        }
        None => Guess::without_value("samples per second; a log shows it (--log)"),
    }
}

/// Passes the frames of a log to `take` in batches, until it returns false.
fn read_frames(log: &Path, mut take: impl FnMut(&[Frame]) -> bool) -> Result<(), ProposalError> {
    let wrong = |source| ProposalError::Log { source: Box::new(source) };
    let mut source = open_log(log, None, &[]).map_err(wrong)?;
    let mut batch = Vec::with_capacity(BATCH_FRAMES);
    loop {
        batch.clear();
        let received = source.receive(&mut batch, Duration::ZERO).map_err(wrong)?;
        if !take(&batch) || received == Received::End {
            return Ok(());
        }
    }
}

/// Returns the numbers of the CANopen nodes that send process data in a log (CiA 301: the first
/// TPDO has the identifier 180h + node), in ascending order.
pub(super) fn sending_nodes(log: &Path) -> Result<Vec<u16>, ProposalError> {
    let mut nodes = BTreeSet::new();
    let mut count = 0;
    read_frames(log, |frames| {
        count += frames.len();
        nodes.extend(frames.iter().filter_map(|frame| match frame.id {
            FrameId::Standard(id @ FIRST_TPDO..=LAST_TPDO) => Some(id - FIRST_TPDO + 1),
            _ => None,
        }));
        count < NODE_FRAMES
    })?;
    Ok(nodes.into_iter().collect())
}

/// Returns the rate of the frames in a log that mark a sample.
pub(super) fn rate_hz(log: &Path, marks: FrameId) -> Result<Option<f64>, ProposalError> {
    let mut stamps: Vec<u64> = Vec::new();
    read_frames(log, |frames| {
        stamps.extend(frames.iter().filter(|frame| frame.id == marks).map(|frame| frame.stamp_ns));
        stamps.len() < RATE_STAMPS
    })?;
    let first_ns = stamps.first().copied().unwrap_or_default();
    #[expect(clippy::cast_precision_loss, reason = "times after the first")]
    let seconds = |stamp_ns: &u64| stamp_ns.saturating_sub(first_ns) as f64 * 1e-9;
    let times_s: Vec<f64> = stamps.iter().map(seconds).collect();
    let plausible = ProposalLimits::DEFAULT.rates_hz;
    Ok(mean_rate_hz(&times_s).filter(|found_hz| plausible.contains(found_hz)).map(round_rate))
}
