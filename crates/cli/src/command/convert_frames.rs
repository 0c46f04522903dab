//! Conversion of unchanged frames between formats.

use std::path::Path;
use std::time::Duration;

use didim_drivers::frame::Frame;
use didim_drivers::source::mcap::McapInfo;
use didim_drivers::source::{
    CandumpWriter, McapSource, McapWriter, Received, Source as _, StampDigits,
};

use crate::CliError;
use crate::output::write_whole;
use didim::cell::Cell;
use didim::live::recording::open_log;

/// Capacity of a batch of frames.
const BATCH_FRAMES: usize = 1024;

/// Writes an MCAP recording as a candump log of the same frames, with the time of day if the
/// recording has it.
pub(super) fn write_candump(input: &Path, output: &Path) -> Result<(), CliError> {
    let mut source = McapSource::open(input, &[]).map_err(CliError::from_failure)?;
    write_whole(output, |out| {
        let info = source.info().cloned().unwrap_or_default();
        let names = source.interfaces().to_vec();
        let mut writer = CandumpWriter::new(out, &names, StampDigits::Nanoseconds);
        let mut batch: Vec<Frame> = Vec::with_capacity(BATCH_FRAMES);
        while source.receive(&mut batch, Duration::ZERO).map_err(CliError::from_failure)?
            != Received::End
        {
            for frame in batch.drain(..) {
                let stamped = frame.with_stamp(info.log_time(frame.stamp_ns));
                writer.write(&stamped).map_err(CliError::from_failure)?;
            }
        }
        writer.finish().map_err(CliError::from_failure)?;
        Ok(())
    })
}

/// Writes a log, a capture of the cell's bus, or a complete ring of recordings as one MCAP
/// recording. Adds the joint curves if the cell has a bus.
pub(super) fn write_mcap(input: &Path, output: &Path, cell: &Cell) -> Result<(), CliError> {
    let layout = cell.bus().ok().map(|bus| &bus.layout);
    let mut source = open_log(input, layout, &[]).map_err(CliError::from_failure)?;
    write_whole(output, |out| {
        // Each line of a log names its interface, but a recording lists all interfaces at its
        // beginning. The log is therefore read twice.
        let mut names = open_log(input, layout, &[]).map_err(CliError::from_failure)?;
        let mut batch: Vec<Frame> = Vec::with_capacity(BATCH_FRAMES);
        while names.receive(&mut batch, Duration::ZERO).map_err(CliError::from_failure)?
            != Received::End
        {
            batch.clear();
        }
        let info = McapInfo {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cell: cell.name.clone(),
            configuration: cell.configuration_sha256.clone(),
            interfaces: names.interfaces().to_vec(),
            ..McapInfo::default()
        };
        let mut writer = McapWriter::new(out, &info).map_err(CliError::from_failure)?;
        let mut curves = cell.bus().ok().map(|bus| cell.joint_curves(bus));
        if let Some(curves) = &curves {
            writer = writer.with_joints(curves.names()).map_err(CliError::from_failure)?;
        }
        let mut sequence = 0_u32;
        while source.receive(&mut batch, Duration::ZERO).map_err(CliError::from_failure)?
            != Received::End
        {
            for frame in batch.drain(..) {
                let written = match &mut curves {
                    Some(curves) => curves.write(&frame, sequence, &mut writer),
                    None => writer.write(&frame, sequence),
                };
                written.map_err(CliError::from_failure)?;
                sequence = sequence.wrapping_add(1);
            }
        }
        if let Some(curves) = &mut curves {
            curves.finish(&mut writer).map_err(CliError::from_failure)?;
        }
        writer.finish().map_err(CliError::from_failure)?;
        Ok(())
    })
}
