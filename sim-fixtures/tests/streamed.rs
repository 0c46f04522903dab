//! Drives without a SYNC: what they say is of when they say it.

use didim_drivers::assemble::{Assembler, CycleLosses};
use didim_drivers::layout::{CompiledLayout, Quantity};
use didim_drivers::units::Scales;
use didim_dynamics::robot::Robot;
use didim_sim::{CYCLE_FRAMES, Scenario, ScenarioError, VirtualDevice};

use crate::common::bus;

fn openarm() -> (Scenario, CompiledLayout, Scales) {
    let robot = Robot::from_toml(include_str!("../../config/robots/openarm.toml")).unwrap();
    let scenario = Scenario::from_toml(include_str!("../scenarios/openarm.toml"), robot).unwrap();
    let (layout, scales) = bus(
        include_str!("../../config/cells/openarm.toml"),
        include_str!("../../config/dbc/openarm_damiao.dbc"),
    );
    (scenario, layout, scales)
}

#[test]
fn each_frame_has_the_values_of_its_own_arrival_and_samples_those_of_the_first() {
    let (scenario, layout, scales) = openarm();
    let mut device =
        VirtualDevice::new(&scenario, layout.clone(), scales.clone(), 1_000_000).unwrap();
    let mut closed_loop = scenario.played_loop().unwrap();
    // The loop's samples of the first three seconds, every 0.2 ms.
    let loops: Vec<_> = (0..15_000).map(|_| *closed_loop.step().unwrap()).collect();
    let mut assembler = Assembler::new(layout.clone(), scales.clone());
    let (mut samples, mut frames, mut shifted) = (Vec::new(), Vec::new(), false);
    for k in 0..1_450_u64 {
        frames.clear();
        device.poll_cycle(&mut frames).unwrap();
        assert_eq!(frames.len(), 14);
        assert_eq!(frames[0].stamp_ns, 1_000_000 + k * 2_000_000);
        assert!(frames.windows(2).all(|pair| pair[0].stamp_ns < pair[1].stamp_ns));
        assert!(frames[13].stamp_ns < frames[0].stamp_ns + 2_000_000);
        for frame in &frames {
            #[allow(clippy::cast_precision_loss, reason = "seconds")]
            let samples_of_loop = (frame.stamp_ns - 1_000_000) as f64 / 200_000.0;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small")]
            let (before, part) = (samples_of_loop as usize, samples_of_loop.fract());
            let (_, message) = layout.read(frame).unwrap();
            for signal in &message.extractions {
                let value = signal.value(frame.data()).unwrap();
                let axis = signal.axis;
                let position = |k: usize| loops[k].motor_position_rad[axis];
                let expected = match signal.quantity {
                    Quantity::Position => {
                        position(before) * (1.0 - part) + position(before + 1) * part
                    }
                    Quantity::Torque => loops[before].motor_torque_nm[axis],
                    Quantity::Enabled => 1.0,
                    _ => continue,
                };
                assert!(
                    (value - expected).abs() <= 0.51 * signal.signal.field.step(),
                    "{k} {axis}"
                );
            }
            assembler.handle_frame(frame);
            samples.extend(assembler.poll_sample());
        }
    }
    for sample in &samples {
        // A cycle is ten samples of the loop.
        let truth = &loops[usize::try_from(sample.sequence).unwrap() * 10];
        for axis in 0..7 {
            let off = sample.motor_position_rad[axis] - truth.motor_position_rad[axis];
            // Half a step, and what is not linear in 2 ms.
            assert!(off.abs() < 0.191e-3 + 20e-6, "{} {axis}: {off}", sample.sequence);
            shifted |= truth.motor_position_rad[axis].abs() > 0.1;
        }
    }
    assert!(shifted);
    // The first cycle has none before it, the last is not over.
    let losses = CycleLosses { missing_axis: 1, ..CycleLosses::default() };
    assert_eq!((samples.len(), assembler.losses().cycles), (1_448, losses));
}

#[test]
fn a_scenario_states_its_truth_where_the_robot_has_none() {
    let robot = || Robot::from_toml(include_str!("../../config/robots/openarm.toml")).unwrap();
    let text = include_str!("../scenarios/openarm.toml");
    let scenario = Scenario::from_toml(text, robot()).unwrap();
    assert_eq!(scenario.truth_of("fv1"), Some(0.3));
    let wrong = text.replace("fv1 = ", "fv8 = ");
    let error = Scenario::from_toml(&wrong, robot()).unwrap_err();
    assert!(
        matches!(error, ScenarioError::UnknownParameter { ref name } if name == "fv8"),
        "{error}"
    );
    let (without, _) = text.split_once("[nominal]").unwrap();
    assert!(matches!(Scenario::from_toml(without, robot()), Err(ScenarioError::NoTruth { .. })));
}

#[test]
fn neither_the_device_nor_what_reads_it_allocates_per_frame() {
    let (scenario, layout, scales) = openarm();
    let mut device = VirtualDevice::new(&scenario, layout.clone(), scales.clone(), 0).unwrap();
    let mut assembler = Assembler::new(layout, scales);
    let mut frames = Vec::with_capacity(CYCLE_FRAMES);
    let mut samples = 0;
    let counted = allocation_counter::measure(|| {
        for _ in 0..200 {
            frames.clear();
            device.poll_cycle(&mut frames).unwrap();
            for frame in &frames {
                assembler.handle_frame(frame);
                samples += u32::from(assembler.poll_sample().is_some());
            }
        }
    });
    assert_eq!((counted.count_total, samples), (0, 198));
}
