//! The window of a recording: it was opened and closed before, and is so again.

use didim_core::JointSample;

use super::{OpenWindow, Windower, rejected};
use crate::recording::RecordedWindow;
use crate::worker::{Loss, Rejection, WindowEvent};

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
