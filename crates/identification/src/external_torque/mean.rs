//! Mean of a signal of every joint over the last samples.

use didim_dynamics::MAX_JOINTS;

/// Mean over a fixed number of samples.
#[derive(Clone, Debug)]
pub(super) struct MovingMean {
    samples: Vec<[f64; MAX_JOINTS]>,
    next: usize,
    filled: usize,
    sums: [f64; MAX_JOINTS],
}

impl MovingMean {
    /// Creates the mean over `count` samples, at least one.
    pub(super) fn new(count: usize) -> Self {
        let samples = vec![[0.0; MAX_JOINTS]; count.max(1)];
        Self { samples, next: 0, filled: 0, sums: [0.0; MAX_JOINTS] }
    }

    /// Forgets the samples.
    pub(super) fn clear(&mut self) {
        (self.next, self.filled, self.sums) = (0, 0, [0.0; MAX_JOINTS]);
    }

    /// Takes the values of a sample, and replaces them by the means. Returns false until there are
    /// enough samples.
    pub(super) fn replace(&mut self, values: &mut [f64]) -> bool {
        let count = self.samples.len();
        let is_full = self.filled == count;
        let place = &mut self.samples[self.next];
        for ((sum, place), value) in self.sums.iter_mut().zip(place).zip(values.iter()) {
            *sum += value - if is_full { *place } else { 0.0 };
            *place = *value;
        }
        self.next = (self.next + 1) % count;
        self.filled = (self.filled + 1).min(count);
        if self.next == 0 {
            // The sum of differences rounds; that of the values does not drift.
            for (joint, sum) in self.sums.iter_mut().enumerate() {
                *sum = self.samples.iter().map(|sample| sample[joint]).sum();
            }
        }
        for (value, sum) in values.iter_mut().zip(&self.sums) {
            *value = sum / count as f64;
        }
        self.filled == count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_the_last_samples() {
        for count in [1, 4] {
            let mut mean = MovingMean::new(count);
            for k in 0..25_usize {
                let mut values = [k as f64, -2.0 * k as f64];
                assert_eq!(mean.replace(&mut values), k + 1 >= count);
                if k + 1 >= count {
                    let expected = k as f64 - 0.5 * (count as f64 - 1.0);
                    let expected = [expected, -2.0 * expected];
                    assert_eq!(values.map(f64::to_bits), expected.map(f64::to_bits));
                }
            }
            mean.clear();
            assert_eq!(mean.replace(&mut [7.0, 7.0]), count == 1);
        }
    }
}
