//! Signals at an earlier instant, between their samples.

use didim_dynamics::MAX_JOINTS;

/// The last samples of one signal of every axis, read with a delay for each axis.
#[derive(Clone, Debug)]
pub(super) struct DelayLine {
    /// Ring of samples. It holds one sample more than the longest delay needs.
    samples: Vec<[f64; MAX_JOINTS]>,
    next: usize,
    filled: usize,
    /// Delay of each axis \[samples\], not negative.
    delays: [f64; MAX_JOINTS],
}

impl DelayLine {
    /// Creates the line of delays \[samples\] that are not negative.
    pub(super) fn new(delays: [f64; MAX_JOINTS]) -> Self {
        let longest = delays.iter().copied().fold(0.0, f64::max);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and checked against the longest delay"
        )]
        let capacity = longest.ceil() as usize + 1;
        Self { samples: vec![[0.0; MAX_JOINTS]; capacity], next: 0, filled: 0, delays }
    }

    /// Returns true if another line has the same delays.
    pub(super) fn has_delays_of(&self, other: &Self) -> bool {
        self.delays.map(f64::to_bits) == other.delays.map(f64::to_bits)
    }

    /// Forgets the samples.
    pub(super) fn clear(&mut self) {
        (self.next, self.filled) = (0, 0);
    }

    /// Takes the values of the newest sample.
    pub(super) fn push(&mut self, values: &[f64]) {
        self.samples[self.next][..values.len()].copy_from_slice(values);
        self.next = (self.next + 1) % self.samples.len();
        self.filled = (self.filled + 1).min(self.samples.len());
    }

    /// Reads the delayed values of all axes, with linear interpolation between samples. Returns
    /// false until there are enough samples.
    pub(super) fn read(&self, values: &mut [f64]) -> bool {
        if self.filled < self.samples.len() {
            return false;
        }
        for (axis, value) in values.iter_mut().enumerate() {
            let delay = self.delays[axis];
            let share = delay.fract();
            let newer = self.sample_before(delay.floor())[axis];
            *value = newer;
            if share > 0.0 {
                *value += share * (self.sample_before(delay.ceil())[axis] - newer);
            }
        }
        true
    }

    /// Returns the sample a whole number of samples before the newest.
    fn sample_before(&self, count: f64) -> &[f64; MAX_JOINTS] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number within the capacity"
        )]
        let count = count as usize;
        let capacity = self.samples.len();
        &self.samples[(self.next + 2 * capacity - 1 - count) % capacity]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_axis_is_read_at_its_own_delay() {
        let mut delays = [0.0; MAX_JOINTS];
        delays[..3].copy_from_slice(&[0.0, 0.5, 2.25]);
        let mut line = DelayLine::new(delays);
        let mut values = [0.0; 3];
        for k in 0..10 {
            let t = f64::from(k);
            line.push(&[t, 10.0 * t, 100.0 * t]);
            assert_eq!(line.read(&mut values), k >= 3);
            if k >= 3 {
                let expected = [t, 10.0 * (t - 0.5), 100.0 * (t - 2.25)];
                assert_eq!(values.map(f64::to_bits), expected.map(f64::to_bits));
            }
        }
        line.clear();
        line.push(&[0.0; 3]);
        assert!(!line.read(&mut values));
    }
}
