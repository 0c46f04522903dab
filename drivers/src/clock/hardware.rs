//! Mapping of a controller's free-running clock to CLOCK_REALTIME.

use super::LIMITS;

/// Maps hardware stamps to CLOCK_REALTIME by the software stamps of the same frames.
///
/// The clock of a controller starts at any value and drifts, but it stamps frames without the
/// latency of the interrupt. A software stamp is late by that latency and never early. So the
/// offset between the clocks is the smallest difference (software − hardware) of the last one to
/// two seconds. The sum of the hardware stamp and this offset has the regularity of the
/// controller's clock and the time of the computer.
#[derive(Clone, Debug, Default)]
pub struct HardwareClock {
    /// Smallest difference (software − hardware) in the last full window, and in the present window
    /// \[ns\].
    differences: Option<(i128, i128)>,
    window_started_ns: u64,
    steps: u64,
}

impl HardwareClock {
    /// Returns the CLOCK_REALTIME instant of a frame from its hardware and its software stamp
    /// \[ns\].
    pub fn realtime_ns(&mut self, hardware_ns: u64, software_ns: u64) -> u64 {
        let difference = i128::from(software_ns) - i128::from(hardware_ns);
        let (last, filling) = match self.differences {
            Some((last, filling))
                if (difference - last.min(filling)).abs() < LIMITS.hardware_step_ns =>
            {
                if hardware_ns.saturating_sub(self.window_started_ns) < LIMITS.hardware_window_ns {
                    (last, filling.min(difference))
                } else {
                    self.window_started_ns = hardware_ns;
                    (filling, difference)
                }
            }
            other => {
                self.steps += u64::from(other.is_some());
                self.window_started_ns = hardware_ns;
                (difference, difference)
            }
        };
        self.differences = Some((last, filling));
        // The sum is not later than the software stamp, so it fits.
        u64::try_from(i128::from(hardware_ns) + last.min(filling)).unwrap_or(software_ns)
    }

    /// Returns the number of times that one of the two clocks was set.
    pub fn step_count(&self) -> u64 {
        self.steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const START: u64 = 1_700_000_000_000_000_000;

    /// Simulates a frame every millisecond with an interrupt 5 to 300 µs late; returns the worst
    /// error.
    fn worst_error(drift_ppm: i64, step_at: Option<(u64, i64)>) -> (u64, u64) {
        let mut clock = HardwareClock::default();
        let (mut worst, mut random) = (0, 12_345_u64);
        for n in 0..20_000_u64 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let late = 5_000 + (random >> 40) % 295_000;
            let step = step_at.filter(|(at, _)| n >= *at).map_or(0, |(_, by)| by);
            let true_ns = (START + n * 1_000_000).strict_add_signed(step);
            let hardware = 77 + n * 1_000_000_u64.strict_add_signed(drift_ppm);
            let mapped = clock.realtime_ns(hardware, true_ns + late);
            if n > 100 && step_at.is_none_or(|(at, _)| n.abs_diff(at) > 100) {
                worst = worst.max(mapped.abs_diff(true_ns));
            }
        }
        (worst, clock.step_count())
    }

    #[test]
    fn latency_is_taken_out_and_drift_is_followed() {
        let (still, _) = worst_error(0, None);
        assert!(still < 20_000, "{still} ns");
        for drift_ppm in [-50, 50] {
            let (drifting, steps) = worst_error(drift_ppm, None);
            assert!(drifting < 120_000, "{drifting} ns");
            assert_eq!(steps, 0);
        }
    }

    #[test]
    fn a_clock_that_is_set_is_followed_and_counted() {
        for by in [3_600_000_000_000, -3_600_000_000_000] {
            let (worst, steps) = worst_error(0, Some((10_000, by)));
            assert!(worst < 20_000, "{worst} ns");
            assert_eq!(steps, 1);
        }
    }

    proptest! {
        #[test]
        fn no_stamps_make_it_panic_or_later_than_the_software(
            stamps in prop::collection::vec(any::<(u64, u64)>(), 1..20),
        ) {
            let mut clock = HardwareClock::default();
            for (hardware, software) in stamps {
                prop_assert!(clock.realtime_ns(hardware, software) <= software);
            }
        }
    }
}
