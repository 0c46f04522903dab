//! Check that a position can follow the previous one.
//!
//! A step of half the integer's range is a wrap or an error, and positions on both sides of it do
//! not belong together. The first position has no predecessor: if it is wrong, all good ones are
//! refused. So later positions have to confirm it. It is dropped for a run of positions that
//! confirm each other.

use didim_dynamics::MAX_JOINTS;

use super::losses::CycleCause;
use crate::units::Scales;

type Positions = [f64; MAX_JOINTS];

/// Positions that the next ones are compared with.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Continuity {
    /// Latest positions that were accepted, and the number of accepted ones in a row, up to
    /// [`AssemblyLimits::confirming_positions`](super::AssemblyLimits).
    accepted: Option<(Positions, u32)>,
    /// Latest positions that were refused, and the number of refused ones in a row that agree.
    rejected: Option<(Positions, u32)>,
}

impl Continuity {
    /// Checks and stores the motor positions of a cycle \[rad\].
    ///
    /// # Errors
    /// [`CycleCause::OutOfRange`] if they cannot follow the previous positions.
    /// [`CycleCause::Restart`] if the previous positions are dropped and the next ones are compared
    /// with these.
    pub(super) fn check_and_store(
        &mut self,
        position_rad: &Positions,
        axes: usize,
        scales: &Scales,
        confirming: u32,
    ) -> Result<(), CycleCause> {
        let follows = |before: &Positions| {
            let steps = before.iter().zip(position_rad).take(axes).enumerate();
            steps.into_iter().all(|(axis, (from, to))| scales.is_continuous(axis, *from, *to))
        };
        let (taken, proof) = match self.accepted {
            None => (true, 0),
            Some((before, proof)) => (follows(&before), proof),
        };
        if taken {
            self.accepted = Some((*position_rad, (proof + 1).min(confirming)));
            self.rejected = None;
            return Ok(());
        }
        let run = match self.rejected {
            Some((before, run)) if follows(&before) => run + 1,
            _ => 1,
        };
        self.rejected = Some((*position_rad, run));
        if proof < confirming && run >= confirming {
            *self = Self { accepted: Some((*position_rad, confirming)), rejected: None };
            return Err(CycleCause::Restart);
        }
        Err(CycleCause::OutOfRange)
    }
}
