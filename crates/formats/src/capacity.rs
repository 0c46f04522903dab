//! Largest measurement that fits this machine.

use crate::free_memory::free_memory;

/// Largest memory of one value of a sample during its identification \[B\]. Six axes with position
/// and torque take at most 430 bytes (`tests/memory.rs`).
const BYTES_A_VALUE: usize = 36;
/// Number of samples if the free memory is unknown: 12 minutes at 5 kHz.
const DEFAULT_SAMPLES: usize = 3_600_000;

/// Number of samples that the free memory holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Number of samples.
    pub samples: usize,
}

impl Capacity {
    /// Returns the capacity for samples with this number of values (positions and torques of all
    /// axes).
    pub fn of_values(values: usize) -> Self {
        Self::of_bytes(values.saturating_mul(BYTES_A_VALUE))
    }

    /// Returns the capacity for samples of this size \[bytes\].
    pub fn of_bytes(bytes: usize) -> Self {
        Self::of_free(free_memory(), bytes)
    }

    fn of_free(free: u64, bytes: usize) -> Self {
        let samples = usize::try_from(free).unwrap_or(usize::MAX) / bytes.max(1);
        Self { samples: if free == 0 { DEFAULT_SAMPLES } else { samples } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_samples_as_fit() {
        assert_eq!(Capacity::of_free(4_300_000, 430), Capacity { samples: 10_000 });
        assert_eq!(
            Capacity::of_free(0, 430),
            Capacity { samples: DEFAULT_SAMPLES },
            "no system says so"
        );
        // This machine runs tests.
        assert!(Capacity::of_values(12).samples > 10_000);
        assert!(Capacity::of_values(24).samples < Capacity::of_values(1).samples);
    }
}
