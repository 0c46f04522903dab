#![allow(clippy::single_range_in_vec_init, reason = "a list of ranges is meant")]

mod recorded;

use didim_dynamics::Reading;

use super::*;
use crate::live::window_options::{Trigger, WindowOptions};
use crate::live::worker::{EstimationStatus, RejectedWindow};
use crate::window::Window;

const RATE_HZ: f64 = 1000.0;

fn motion() -> WindowOptions {
    WindowOptions {
        trigger: Trigger::Motion { velocity_threshold_rad_s: 0.5, idle_s: 0.1, difference_s: 0.01 },
        margin_before_s: 0.05,
        margin_after_s: 0.05,
        min_s: 0.2,
        max_s: 2.0,
    }
}

fn windower(options: &WindowOptions) -> Windower {
    Windower::new(options.plan(RATE_HZ).unwrap())
}

/// Returns samples at rest, except that joint 3 moves at 1 rad/s during each of the ranges.
fn samples(length: u64, moves: &[core::ops::Range<u64>]) -> Vec<JointSample> {
    let mut angle = 0.3;
    (0..length)
        .map(|sequence| {
            if moves.iter().any(|range| range.contains(&sequence)) {
                angle += 1.0 / RATE_HZ;
            }
            let mut sample = JointSample::zero(sequence, 17 * sequence);
            sample.motor_position_rad[2] = angle;
            sample
        })
        .collect()
}

fn events(windower: &mut Windower, samples: &[JointSample]) -> Vec<WindowEvent> {
    samples.iter().filter_map(|sample| windower.handle_sample(sample)).collect()
}

fn closed(event: &WindowEvent) -> &Window {
    match event {
        WindowEvent::Closed(window) => window,
        WindowEvent::Rejected(rejected) => panic!("{rejected:?}"),
    }
}

fn reason(event: &WindowEvent) -> &Rejection {
    match event {
        WindowEvent::Rejected(rejected) => &rejected.rejection,
        WindowEvent::Closed(window) => panic!("window {} was closed", window.number),
    }
}

#[test]
fn motion_opens_and_rest_closes_with_margins_on_both_sides() {
    let mut windower = windower(&motion());
    let windows = events(&mut windower, &samples(3000, &[500..900, 1500..2000]));
    assert_eq!(windows.len(), 2);
    for (event, motion) in windows.iter().zip([500_u64..900, 1500..2000]) {
        let window = closed(event);
        assert_eq!(window.end, WindowEnd::Rest);
        let counted = &window.samples[window.counted_samples.clone()];
        // The threshold is half the speed, so half a lag of 10 samples is not detected at either
        // end. The window begins a complete lag before the detection.
        let (first, last) = (counted.first().unwrap().sequence, counted.last().unwrap().sequence);
        assert!((motion.start - 10..=motion.start).contains(&first), "{first}");
        assert!((motion.end - 1..=motion.end + 10).contains(&last), "{last}");
        assert_eq!(window.counted_samples.start, 50);
        assert_eq!(window.samples.len() - window.counted_samples.end, 50);
        let gapless =
            window.samples.windows(2).all(|pair| pair[1].sequence == pair[0].sequence + 1);
        assert!(gapless);
    }
    assert_eq!((closed(&windows[0]).number, closed(&windows[1]).number), (0, 1));
    assert_eq!(windower.open_samples(), None);
}

#[test]
fn one_count_of_an_encoder_is_not_motion() {
    let mut windower = windower(&motion());
    // A count of 2π/2^16 every few samples: 0.1 rad/s from one sample to the next.
    let count = core::f64::consts::TAU / 65536.0;
    let mut flickering = samples(2000, &[]);
    for sample in &mut flickering {
        sample.motor_position_rad[0] = count * f64::from(u8::from(sample.sequence % 3 == 0));
    }
    assert_eq!(events(&mut windower, &flickering), []);
    assert_eq!(windower.opened_count(), 0);
}

#[test]
fn a_short_rest_does_not_cut_a_window() {
    let mut windower = windower(&motion());
    let windows = events(&mut windower, &samples(1500, &[300..500, 560..800]));
    assert_eq!(windows.len(), 1);
    assert!(closed(&windows[0]).counted_samples.len() >= 500);
}

#[test]
fn a_gap_rejects_the_open_window_and_the_next_one_keeps_its_margin() {
    let mut windower = windower(&motion());
    let mut stream = samples(3000, &[500..1500]);
    stream.drain(700..703);
    let windows = events(&mut windower, &stream);
    assert_eq!(windows.len(), 2);
    let WindowEvent::Rejected(rejected) = &windows[0] else { panic!("{:?}", windows[0]) };
    assert_eq!(rejected.rejection, Rejection::Loss(Loss::SampleGap { after: 699, missing: 3 }));
    assert_eq!(rejected.last_sequence, 699);
    let window = closed(&windows[1]);
    assert_eq!(window.number, 1);
    assert_eq!(window.first_sequence(), 703, "nothing from before the gap");
    assert_eq!(window.counted_samples.start, 50, "the margin is taken out of the motion");
}

#[test]
fn loss_at_rest_is_no_window_s_loss() {
    let mut windower = windower(&motion());
    let mut stream = samples(2000, &[1000..1400]);
    stream.drain(100..110);
    let windows = events(&mut windower, &stream);
    assert_eq!(windows.len(), 1);
    assert_eq!(closed(&windows[0]).end, WindowEnd::Rest);
}

#[test]
fn every_loss_rejects_and_the_reason_is_kept() {
    for loss in [
        Loss::QueueDrops { frames: 4 },
        Loss::StreamOverflow { batches: 2 },
        Loss::Restarted,
        Loss::OutOfOrder { after: 5, sequence: 3 },
    ] {
        let mut windower = windower(&motion());
        assert_eq!(windower.handle_loss(loss), None, "nothing is open yet");
        assert_eq!(events(&mut windower, &samples(600, &[200..1000])), []);
        let rejected = windower.handle_loss(loss).unwrap();
        assert_eq!(reason(&rejected), &Rejection::Loss(loss));
        assert_eq!(windower.open_samples(), None);
    }
}

#[test]
fn a_sample_that_comes_twice_is_a_loss() {
    let mut windower = windower(&motion());
    let mut stream = samples(1000, &[200..1000]);
    stream[600] = stream[599];
    let windows = events(&mut windower, &stream);
    assert_eq!(
        reason(&windows[0]),
        &Rejection::Loss(Loss::OutOfOrder { after: 599, sequence: 599 })
    );
}

#[test]
fn a_window_in_which_too_little_counts_is_rejected() {
    let mut windower = windower(&motion());
    let windows = events(&mut windower, &samples(2000, &[500..600]));
    let Rejection::TooShort { counted, minimum: 200 } = *reason(&windows[0]) else {
        panic!("{windows:?}");
    };
    assert!((95..=115).contains(&counted), "{counted}");
}

#[test]
fn a_window_is_never_longer_than_its_limit() {
    let mut windower = windower(&motion());
    let windows = events(&mut windower, &samples(10_000, &[500..9000]));
    assert_eq!(windows.len(), 5);
    for event in &windows[..4] {
        assert_eq!(closed(event).samples.len(), 2000);
        assert_eq!(closed(event).end, WindowEnd::Length);
        assert_eq!(closed(event).counted_samples, 50..1950);
    }
    assert_eq!(closed(&windows[4]).end, WindowEnd::Rest);
}

#[test]
fn intervals_count_the_same_number_of_samples_each() {
    let options = WindowOptions { trigger: Trigger::Interval { length_s: 0.5 }, ..motion() };
    let mut windower = windower(&options);
    let windows = events(&mut windower, &samples(2600, &[]));
    assert!(windows.len() >= 4);
    for event in &windows {
        let window = closed(event);
        assert_eq!(window.counted_samples, 50..550);
        assert_eq!(window.samples.len(), 600);
        assert_eq!(window.end, WindowEnd::Interval);
    }
    // The margin after one window equals the margin before the next.
    assert_eq!(closed(&windows[1]).first_sequence(), closed(&windows[0]).last_sequence() - 49);
}

#[test]
fn commands_open_and_close_with_margins() {
    let options = WindowOptions { trigger: Trigger::Command {}, ..motion() };
    let mut windower = windower(&options);
    let stream = samples(2000, &[0..2000]);
    assert_eq!(windower.handle_end(), Err(CommandError::NotOpen));
    assert_eq!(events(&mut windower, &stream[..500]), []);
    windower.handle_begin().unwrap();
    assert_eq!(windower.handle_begin(), Err(CommandError::AlreadyOpen));
    assert_eq!(events(&mut windower, &stream[500..900]), []);
    assert_eq!(windower.open_samples(), Some(450));
    windower.handle_end().unwrap();
    assert_eq!(windower.handle_end(), Err(CommandError::NotOpen));
    let windows = events(&mut windower, &stream[900..]);
    assert_eq!(windows.len(), 1);
    let window = closed(&windows[0]);
    assert_eq!((window.first_sequence(), window.last_sequence()), (450, 949));
    assert_eq!(window.samples[window.counted_samples.start].sequence, 500);
    assert_eq!(window.counted_samples.len(), 400);

    // The bus falls silent within the margin.
    windower.handle_begin().unwrap();
    let more = samples(3000, &[0..3000]);
    assert_eq!(events(&mut windower, &more[2000..2500]), []);
    assert_eq!(windower.handle_silence(), None, "nobody has asked to close it");
    windower.handle_end().unwrap();
    let event = windower.handle_silence().unwrap();
    assert_eq!((closed(&event).last_sequence(), closed(&event).end), (2499, WindowEnd::Command));
    assert_eq!(closed(&event).samples.len() - closed(&event).counted_samples.end, 50);
    assert_eq!(windower.handle_silence(), None);

    let mut by_motion = self::windower(&motion());
    assert_eq!(by_motion.handle_begin(), Err(CommandError::NotByCommand));
    assert_eq!(by_motion.handle_end(), Err(CommandError::NotByCommand));
}

#[test]
fn the_end_of_the_stream_closes_what_is_open() {
    let mut windower = windower(&motion());
    assert_eq!(windower.finish(), None);
    assert_eq!(events(&mut windower, &samples(1000, &[200..1000])), []);
    let event = windower.finish().unwrap();
    assert_eq!(closed(&event).end, WindowEnd::EndOfStream);
    assert_eq!(closed(&event).last_sequence(), 999);
    assert_eq!(closed(&event).samples.len() - closed(&event).counted_samples.end, 50);
}

#[test]
fn stamps_do_not_matter() {
    let stream = samples(3000, &[500..900, 1500..2000]);
    let mut jittered = stream.clone();
    for sample in &mut jittered {
        sample.stamp_ns = sample.sequence.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
    let shape = |events: Vec<WindowEvent>| -> Vec<_> {
        events
            .iter()
            .map(|event| {
                let window = closed(event);
                (window.first_sequence(), window.last_sequence(), window.counted_samples.clone())
            })
            .collect()
    };
    assert_eq!(
        shape(events(&mut windower(&motion()), &stream)),
        shape(events(&mut windower(&motion()), &jittered))
    );
}

#[test]
fn options_that_cannot_be_meant_are_refused_by_name() {
    let key = |options: &WindowOptions| options.plan(RATE_HZ).unwrap_err().key;
    assert_eq!(key(&WindowOptions { margin_before_s: -1.0, ..motion() }), "margin_before_s");
    assert_eq!(key(&WindowOptions { min_s: f64::NAN, ..motion() }), "min_s");
    assert_eq!(key(&WindowOptions { max_s: 0.25, ..motion() }), "max_s");
    let interval = Trigger::Interval { length_s: 1.95 };
    assert_eq!(key(&WindowOptions { trigger: interval, ..motion() }), "length_s");
    let still = Trigger::Motion { velocity_threshold_rad_s: 0.0, idle_s: 1.0, difference_s: 0.01 };
    assert_eq!(key(&WindowOptions { trigger: still, ..motion() }), "velocity_threshold_rad_s");
    assert!(motion().plan(0.0).is_err());
}

#[test]
fn the_cell_file_s_form() {
    let options: WindowOptions = toml::from_str(
        "trigger = { by = 'motion', velocity_threshold_rad_s = 0.5, idle_s = 0.1 }\n\
         margin_before_s = 0.05\nmargin_after_s = 0.05\nmin_s = 0.2\nmax_s = 2.0",
    )
    .unwrap();
    assert_eq!(options, motion());
    let unknown = toml::from_str::<WindowOptions>("trigger = { by = 'command' }\nmargin = 1.0");
    assert!(unknown.unwrap_err().to_string().contains("margin"));
    let unknown = toml::from_str::<WindowOptions>(
        "trigger = { by = 'interval', length_s = 1.0, lenght_s = 2.0 }",
    );
    assert!(unknown.unwrap_err().to_string().contains("lenght_s"));
}

#[test]
fn an_open_window_is_identified_at_once_whatever_opened_it() {
    let options = motion();
    let mut windower = windower(&options);
    assert_eq!(windower.handle_identify(), Err(CommandError::NotOpen));
    let stream = samples(3000, &[500..2500]);
    // Detected 5 samples after its beginning, with 50 and 10 before that; 200 have to count.
    assert!(events(&mut windower, &stream[..700]).is_empty());
    let early = windower.handle_identify();
    assert!(matches!(early, Err(CommandError::TooShort { minimum: 200, .. })), "{early:?}");
    assert!(windower.open_samples().is_some(), "it stays open");
    assert!(events(&mut windower, &stream[700..1200]).is_empty());
    let event = windower.handle_identify().unwrap();
    let window = closed(&event);
    assert_eq!((window.number, window.last_sequence(), window.end), (0, 1199, WindowEnd::Command));
    assert_eq!(window.counted_samples.end, window.samples.len() - 50);
    assert_eq!(windower.handle_identify(), Err(CommandError::NotOpen));
    // The motion continues, and so does the next window.
    let rest = events(&mut windower, &stream[1200..]);
    assert_eq!(closed(&rest[0]).number, 1);
    assert_eq!(closed(&rest[0]).first_sequence(), 1200 - 60);
}

/// The remainder of such a motion is distinguished from a motion that is too short. It does not
/// affect the health of the service.
#[test]
fn what_is_left_of_an_identified_motion_is_no_fault() {
    let mut windower = windower(&motion());
    let stream = samples(4000, &[500..1300, 2500..2600]);
    assert!(events(&mut windower, &stream[..1200]).is_empty());
    closed(&windower.handle_identify().unwrap());
    let windows = events(&mut windower, &stream[1200..]);
    let [WindowEvent::Rejected(rest), WindowEvent::Rejected(short)] = &windows[..] else {
        panic!("{windows:?}");
    };
    assert!(matches!(rest.rejection, Rejection::Remainder { minimum: 200, .. }), "{rest:?}");
    assert!(matches!(short.rejection, Rejection::TooShort { minimum: 200, .. }), "{short:?}");
    let reasons = |rejected: &RejectedWindow| {
        let last_rejection = Some(rejected.clone());
        let status = EstimationStatus { last_rejection, ..EstimationStatus::default() };
        crate::service::status::Health::new(None, Some(&status)).reasons
    };
    assert_eq!((reasons(rest).len(), reasons(short).len()), (0, 1));
}

/// Sets the modes of two drives: one reports every 40 samples, the other every 100.
fn with_modes(stream: &mut [JointSample], mode_of: impl Fn(u64) -> f64) {
    for sample in stream {
        for (joint, every) in [(0, 40), (1, 100)] {
            if sample.sequence.is_multiple_of(every) {
                sample.readings.set(Reading::Mode, joint, mode_of(sample.sequence));
            }
        }
    }
}

#[test]
fn a_mode_that_changes_ends_a_window_before_it_and_is_no_margin_of_the_next() {
    let mut windower = windower(&motion());
    let mut stream = samples(3000, &[500..1500]);
    with_modes(&mut stream, |sequence| if sequence < 1000 { 8.0 } else { 10.0 });
    let windows = events(&mut windower, &stream);
    assert_eq!(windows.len(), 2, "{windows:?}");
    let (before, after) = (closed(&windows[0]), closed(&windows[1]));
    assert_eq!((before.end, after.end), (WindowEnd::ModeChange, WindowEnd::Rest));
    assert_eq!((before.last_sequence(), after.first_sequence()), (999, 1000));
    assert_eq!(before.samples.len() - before.counted_samples.end, 50, "a margin after");
    assert_eq!(after.counted_samples.start, 50, "the margin is taken out of the motion");
    let mode = |window: &Window| window.readings().drive_mode.iter().map(|of| of.mode).collect();
    let modes: [Vec<i16>; 2] = [mode(before), mode(after)];
    assert_eq!(modes, [[8, 8], [10, 10]]);
}

#[test]
fn a_mode_that_changes_soon_leaves_too_little_and_one_that_stays_or_changes_at_rest_nothing() {
    let windows_of = |mode_of: fn(u64) -> f64| {
        let mut stream = samples(3000, &[500..1500]);
        with_modes(&mut stream, mode_of);
        events(&mut windower(&motion()), &stream)
    };
    let soon = windows_of(|sequence| if sequence < 600 { 8.0 } else { 10.0 });
    assert!(matches!(reason(&soon[0]), Rejection::TooShort { .. }), "{soon:?}");
    assert_eq!(closed(&soon[1]).end, WindowEnd::Rest);
    for mode_of in
        [|_| 8.0, |sequence| if sequence < 200 { 0.0 } else { 8.0 }] as [fn(u64) -> f64; 2]
    {
        let windows = windows_of(mode_of);
        assert_eq!((windows.len(), closed(&windows[0]).end), (1, WindowEnd::Rest));
        assert!(closed(&windows[0]).samples.len() > 1000);
    }
}
