//! Meaning of the stamps of a candump log: times, or times since the frame before.

use super::{LineFault, candump};

/// Meaning of the stamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Stamps {
    /// Times of one clock.
    #[default]
    Times,
    /// Times since the frame before, of whichever interface (`candump -td`).
    SincePrevious {
        /// Time of the frame before since the first one \[ns\].
        now_ns: u64,
    },
}

impl Stamps {
    /// Detects the meaning from the first lines of a log. Times since the frame before begin with
    /// 0, and step back further in total than they advance. Times of a clock advance.
    pub(super) fn detect(begin: &[u8]) -> Self {
        let lines = begin.split(|byte| *byte == b'\n').filter_map(|line| candump::parse(line).ok());
        let stamps: Vec<u64> = lines.map(|(_, frame)| frame.stamp_ns).collect();
        let back = stamps.windows(2).fold(0_u64, |back, pair| {
            let step = pair.first().zip(pair.last()).map(|(from, to)| from.saturating_sub(*to));
            back.saturating_add(step.unwrap_or(0))
        });
        match (stamps.first(), stamps.last()) {
            (Some(0), Some(last)) if back > *last => Self::SincePrevious { now_ns: 0 },
            _ => Self::Times,
        }
    }

    /// Returns the time of the next frame from its stamp \[ns\].
    ///
    /// # Errors
    /// [`LineFault::StampRange`] if the sum of the stamps does not fit.
    pub(super) fn next_ns(&mut self, stamp_ns: u64) -> Result<u64, LineFault> {
        let Self::SincePrevious { now_ns } = self else { return Ok(stamp_ns) };
        *now_ns = now_ns.checked_add(stamp_ns).ok_or(LineFault::StampRange)?;
        Ok(*now_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detect(stamps: &[f64]) -> Stamps {
        let line = |stamp: &f64| format!("({stamp:010.6}) can0 181#11\n");
        Stamps::detect(stamps.iter().map(line).collect::<String>().as_bytes())
    }

    #[test]
    fn differences_begin_with_0_and_step_back() {
        let differences = Stamps::SincePrevious { now_ns: 0 };
        assert_eq!(detect(&[0.0, 0.0001, 0.0002, 0.0017, 0.0001, 0.0002]), differences);
        // A clock that was started with the log, two buses of which the second is late, and a
        // recorder whose clock was set back.
        assert_eq!(detect(&[0.0, 0.0002, 0.0001, 0.0021, 0.0022]), Stamps::Times);
        assert_eq!(detect(&[1_436_509_052.2, 1_436_509_052.3, 1_436_509_040.0]), Stamps::Times);
        assert_eq!(detect(&[0.0, 0.0, 0.0]), Stamps::Times);
        assert_eq!(detect(&[]), Stamps::Times);
    }

    #[test]
    fn differences_are_added() {
        let mut stamps = Stamps::SincePrevious { now_ns: 0 };
        assert_eq!([0, 5, 7].map(|stamp| stamps.next_ns(stamp)), [Ok(0), Ok(5), Ok(12)]);
        assert_eq!(stamps.next_ns(u64::MAX), Err(LineFault::StampRange));
        assert_eq!(Stamps::Times.next_ns(7), Ok(7));
    }
}
