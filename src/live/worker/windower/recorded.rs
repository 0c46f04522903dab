//! The window of a recording: it was opened and closed before, and is so again.

use didim_core::JointSample;

use super::{OpenWindow, Windower, rejected};
use crate::live::recording::RecordedWindow;
use crate::live::worker::{Loss, Rejection, WindowEvent};

pub(super) fn handle_sample(
    windower: &mut Windower,
    window: &RecordedWindow,
    sample: &JointSample,
) -> Option<WindowEvent> {
    let before = windower.last_sequence.replace(sample.sequence);
    if sample.sequence == window.first_sequence && windower.opened == 0 {
        windower.opened = 1;
        let (number, samples) = (window.number, Vec::new());
        windower.open = Some(OpenWindow { number, samples, quiet: 0, close_at: None });
    } else if windower.open.is_some() {
        match before {
            Some(after) if sample.sequence <= after => {
                return windower.handle_loss(Loss::OutOfOrder { after, sequence: sample.sequence });
            }
            Some(after) if sample.sequence > after + 1 => {
                let missing = sample.sequence - after - 1;
                return windower.handle_loss(Loss::SampleGap { after, missing });
            }
            _ => {}
        }
    }
    let open = windower.open.as_mut()?;
    open.samples.push(*sample);
    if open.samples.len() < window.samples {
        return None;
    }
    let open = windower.open.take()?;
    Some(windower.close(open, window.end))
}

/// The recording ends before its window does.
pub(super) fn incomplete(open: &OpenWindow, window: &RecordedWindow) -> WindowEvent {
    let (counted, minimum) = (open.samples.len(), window.samples);
    rejected(open.number, &open.samples, Rejection::TooShort { counted, minimum })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::worker::{Trigger, WindowOptions};
    use crate::window::WindowEnd;

    /// A window of 400 samples from 1000 on, of a cell whose windows are opened otherwise.
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
            configuration: None,
        };
        Windower::of_recorded(options.plan(1000.0).unwrap(), window)
    }

    fn feed(windower: &mut Windower, sequences: impl Iterator<Item = u64>) -> Vec<WindowEvent> {
        sequences.filter_map(|n| windower.handle_sample(&JointSample::zero(n, 0))).collect()
    }

    #[test]
    fn its_window_and_no_other_is_made() {
        // A loss before it is not its loss.
        let sequences = (700..800).chain(900..3000).chain(1000..1400);
        let mut windower = windower();
        let events = feed(&mut windower, sequences);
        let [WindowEvent::Closed(window)] = &events[..] else { panic!("{events:?}") };
        assert_eq!((window.number, window.end), (41, WindowEnd::Command));
        assert_eq!((window.first_sequence(), window.last_sequence()), (1000, 1399));
        assert_eq!(window.counted, 50..300);
        assert_eq!((windower.opened(), windower.finish()), (1, None));
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
}
