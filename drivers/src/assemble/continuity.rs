//! Check of each position against the previous one.
//!
//! A step of half the integer's range is a wrap or an error, so positions before and after such a
//! step do not belong together. The first position has no predecessor: if it is wrong, all good
//! positions after it are refused. So later positions have to confirm it. Before that, a run of
//! refused positions that agree with each other replaces it.

use didim_dynamics::MAX_JOINTS;

use super::losses::CycleCause;
use crate::units::Scales;

type Positions = [f64; MAX_JOINTS];

/// Positions with which the next ones are compared.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Continuity {
    /// Latest accepted positions, and the number of positions accepted so far, up to
    /// [`AssemblyLimits::confirming_positions`](super::AssemblyLimits). Refused positions in
    /// between do not reset it.
    accepted: Option<(Positions, u32)>,
    /// Latest refused positions, and the number of refused positions in a row that agree.
    rejected: Option<(Positions, u32)>,
}

impl Continuity {
    /// Checks and stores the motor positions of a cycle \[rad\].
    ///
    /// # Errors
    /// [`CycleCause::OutOfRange`] if the positions cannot follow the previous ones.
    /// [`CycleCause::Restart`] if these positions replace the previous ones, which were never
    /// confirmed.
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
