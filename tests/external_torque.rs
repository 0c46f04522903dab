//! The observer thread: what it costs, and what it does with samples that it cannot use.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::{Network, eventually};
use didim::cell::Cell;
use didim::live::external_torque::{
    ObserverModel, Observing, ObservingParts, SharedExternalTorque, clients, sample_queue,
    watch_models,
};
use didim::live::stream::{MessageState, StreamNode, StreamOptions};
use didim_dynamics::JointSample;
use didim_identification::external_torque::{
    ExternalTorqueObserver, ObserverOptions, ObserverSignals,
};
use didim_identification::identification::{KnownArm, KnownModel, ParameterCovariance};
use nalgebra::DMatrix;

/// The arm of a cell with its nominal parameters.
fn observer(cell: &Cell) -> ExternalTorqueObserver {
    let nominal = cell.robot.nominal().unwrap();
    let values = cell.base.to_base(nominal.standard_parameters());
    let names = cell.base.names().iter().map(String::as_str);
    let parameters: Vec<(&str, f64)> = names.zip(values).collect();
    let model = KnownModel { parameters: &parameters, fixed_parameters: &[], uncertainty: None };
    let count = parameters.len();
    let covariance = ParameterCovariance::from_symmetric(&(DMatrix::identity(count, count) * 1e-6));
    let signals = ObserverSignals {
        sample_rate_hz: cell.sample_rate_hz(),
        transmission: Some(cell.robot.transmission().clone()),
        torque_timing: cell.torque_timing,
        delays: cell.signal_delays.clone(),
    };
    let options = ObserverOptions { bandwidth_hz: 10.0, noise: vec![0.1; 6], reached: Vec::new() };
    let arm = KnownArm { model, covariance: Some(&covariance) };
    ExternalTorqueObserver::new(&cell.robot, &cell.base, &arm, signals, options).unwrap()
}

/// A sample of an arm that moves a little.
fn sample(sequence: u64) -> JointSample {
    let mut sample = JointSample::zero(sequence, sequence);
    let t = 2e-4 * sequence as f64;
    for (motor, position) in sample.motor_position_rad.iter_mut().take(6).enumerate() {
        *position = (t * (1.0 + motor as f64)).sin();
    }
    sample
}

/// Handles this number of samples.
fn take(observing: &mut Observing, mut samples: u32) {
    while samples > 0 {
        samples -= u32::from(observing.step());
    }
}

/// Every sample gives a message, and the library's loan of a slot is the only memory it takes. A
/// lost sample is a gap, and one that did not fit into the queue is counted.
#[test]
fn the_observer_thread_allocates_nothing_of_its_own() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/cells/tx40-packed-fd.toml");
    let cell = Cell::read(&file).unwrap();
    let network = Network::new();
    let options = StreamOptions { joints: 6, sample_rate_hz: 5000.0, ..network.options() };
    let shared = SharedExternalTorque::default();
    let stop = Arc::new(AtomicBool::new(false));
    let mut next = Some(ObserverModel {
        observer: Box::new(observer(&cell)),
        result: 8,
        name: "7".to_owned(),
    });
    let models = watch_models(Box::new(move || next.take().map(Ok)), &shared, &stop).unwrap();
    eventually("the model is handed over", || shared.snapshot().result.is_some());
    let (mut tap, samples, reader) = sample_queue(&shared);
    let (_sender, clients) = clients();
    let parts = ObservingParts { samples, reader, models, clients, shared: shared.clone() };
    let mut observing = Observing::start(&options, parts).unwrap();
    let mut subscriber = StreamNode::join(&options).unwrap().external_torque_reader().unwrap();

    let watched = shared.clone();
    let bus = std::thread::spawn(move || {
        for k in 0..20_000_u64 {
            // Ten samples are lost on the way.
            let sequence = if k < 15_000 { k } else { k + 10 };
            tap.pass_on(&sample(sequence), 0);
            tap.wake();
            // The queue is never full.
            if k % 1000 == 999 {
                eventually("the samples are taken", || watched.snapshot().published > k);
            }
        }
        // Nobody reads any more, and there are more than the queue holds.
        (0..5000).for_each(|k| tap.pass_on(&sample(30_000 + k), 0));
    });
    // The first messages connect the reader.
    take(&mut observing, 100);
    let cost = allocation_counter::measure(|| take(&mut observing, 19_900));
    bus.join().unwrap();
    assert_eq!((cost.count_total, cost.bytes_total), (19_900, 48 * 19_900), "{cost:?}");
    assert_eq!(cost.count_current, 0, "{cost:?}");
    stop.store(true, Ordering::Relaxed);
    let status = shared.snapshot();
    assert_eq!((status.published, status.unpublished, status.skipped), (20_000, 0, 5000 - 4096));
    assert!(cost.count_total <= 20_000, "{cost:?}");
    // Of both stretches the first three time constants and the first difference do not count:
    // 3.5 / (2π 10 Hz) at 5 kHz.
    let unusable = 2.0 * 3.5 * 5000.0 / (std::f64::consts::TAU * 10.0);
    let valid = 20_000.0 - unusable;
    assert!((status.valid as f64 - valid).abs() < 5.0, "{} {valid}", status.valid);
    assert_eq!(status.joints.len(), 6);

    // A reader that was too slow has the newest messages.
    let mut last = None;
    while let Some(message) = subscriber.receive().unwrap() {
        assert!(last.is_none_or(|before| message.number == before + 1));
        assert_eq!((message.result, message.state), (8, MessageState::Valid as u32));
        last = Some(message.number);
    }
    assert_eq!(last, Some(19_999));
}
