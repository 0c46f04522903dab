//! From frames to samples: the assembler on both shipped layouts, and candump reading.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use didim::cell::{Cell, Library};
use didim_drivers::assemble::Assembler;
use didim_drivers::frame::Frame;
use didim_drivers::source::{CandumpWriter, InterfaceName, Received, Source, StampDigits, TextLog};
use didim_sim::VirtualDevice;

const CELLS: [&str; 2] = ["tx40-packed-fd", "tx40-cia402"];

fn cell(name: &str) -> Cell {
    let path = format!("{}/../config/cells/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Cell::from_library(Library::SHIPPED, Path::new(&path)).unwrap()
}

/// Frames of the simulated arm during one motion.
fn frames(cell: &Cell) -> Vec<Frame> {
    let scenario = didim_sim::tx40_paper().unwrap();
    let mut device = VirtualDevice::new(
        &scenario,
        cell.bus().unwrap().layout.clone(),
        cell.bus().unwrap().scales.clone(),
        1,
    )
    .unwrap();
    let mut frames = Vec::new();
    while device.poll_due().is_some() {
        device.poll_cycle(&mut frames).unwrap();
    }
    frames
}

fn assembling(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("assemble");
    group.sample_size(20).warm_up_time(Duration::from_millis(500));
    for name in CELLS {
        let cell = cell(name);
        let frames = frames(&cell);
        let assembler =
            Assembler::new(cell.bus().unwrap().layout.clone(), cell.bus().unwrap().scales.clone());
        group.throughput(Throughput::Elements(frames.len() as u64));
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(
                || assembler.clone(),
                |assembler| {
                    for frame in &frames {
                        assembler.handle_frame(frame);
                        black_box(assembler.poll_sample());
                    }
                },
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

fn reading(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("candump");
    group.sample_size(20).warm_up_time(Duration::from_millis(500));
    for name in CELLS {
        let frames = frames(&cell(name));
        let interface = [InterfaceName::new("can0").unwrap()];
        let mut writer = CandumpWriter::new(Vec::new(), &interface, StampDigits::Nanoseconds);
        for frame in &frames {
            writer.write(frame).unwrap();
        }
        let log = writer.finish().unwrap();
        let mut batch = Vec::with_capacity(256);
        group.throughput(Throughput::Elements(frames.len() as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut source = TextLog::new(log.as_slice(), Path::new("a.log"), &[]);
                let mut read = 0;
                loop {
                    batch.clear();
                    match source.receive(&mut batch, Duration::ZERO).unwrap() {
                        Received::End => break,
                        _ => read += batch.len(),
                    }
                }
                assert_eq!(read, frames.len());
            });
        });
    }
    group.finish();
}

criterion_group!(benches, assembling, reading);
criterion_main!(benches);
