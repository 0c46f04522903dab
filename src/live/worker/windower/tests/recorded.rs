//! The window of a recording.

use didim_formats::RecordingStart;

use super::*;
use crate::live::window_options::{Trigger, WindowOptions};
use crate::window::WindowEnd;

/// Returns the windower for a window of 400 samples from 1000 on. The windows of its cell have
/// another trigger.
fn windower() -> Windower {
    let options = WindowOptions {
        trigger: Trigger::Interval { length_s: 0.1 },
        margin_before_s: 0.05,
        margin_after_s: 0.1,
        min_s: 0.1,
        max_s: 5.0,
    };
    let window = RecordedWindow {
        number: 41,
        first_sequence: 1000,
        first_stamp_ns: 0,
        last_stamp_ns: 0,
        samples: 400,
        end: WindowEnd::Command,
        start: RecordingStart::of_unix_ns(1_795_331_849_250_000_000),
        configuration: None,
    };
    Windower::of_recorded(options.plan(1000.0).unwrap(), window)
}

fn feed(windower: &mut Windower, sequences: impl Iterator<Item = u64>) -> Vec<WindowEvent> {
    sequences.filter_map(|n| windower.handle_sample(&JointSample::zero(n, 0))).collect()
}

#[test]
fn its_window_and_no_other_is_made() {
    // A loss before the window does not affect it.
    let sequences = (700..800).chain(900..3000).chain(1000..1400);
    let mut windower = windower();
    let events = feed(&mut windower, sequences);
    let [WindowEvent::Closed(window)] = &events[..] else { panic!("{events:?}") };
    assert_eq!((window.number, window.end), (41, WindowEnd::Command));
    assert_eq!((window.first_sequence(), window.last_sequence()), (1000, 1399));
    assert_eq!(window.counted_samples, 50..300);
    assert_eq!(RecordingStart::display_text(window.recording_start), "2026-11-22 07:17:29.250 UTC");
    assert_eq!((windower.opened_count(), windower.finish()), (1, None));
}

#[test]
fn a_gap_inside_it_rejects_it() {
    let events = feed(&mut windower(), (900..1100).chain(1102..2000));
    let [WindowEvent::Rejected(rejected)] = &events[..] else { panic!("{events:?}") };
    let gap = Loss::SampleGap { after: 1099, missing: 2 };
    assert_eq!((rejected.number, &rejected.rejection), (41, &Rejection::Loss(gap)));
}

#[test]
fn a_recording_that_ends_inside_it_gives_no_shorter_one() {
    let mut windower = windower();
    assert!(feed(&mut windower, 900..1300).is_empty());
    let Some(WindowEvent::Rejected(rejected)) = windower.finish() else { panic!() };
    let cut = Rejection::TooShort { counted: 300, minimum: 400 };
    assert_eq!(rejected.rejection, cut);
}
