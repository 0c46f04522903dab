//! Whether a position can follow the one before.
//!
//! A step of half the integer's range is a wrap or an error, and positions on both sides of it do not
//! belong together. The first position has none before it: if it is wrong, all good ones are refused.
//! So a position is confirmed by those that follow it, and dropped for a run that confirms itself.

use didim_core::MAX_JOINTS;

use super::losses::CycleCause;
use crate::units::Scales;

/// Positions in a row that agree with each other and prove each other.
const PROOF: u32 = 3;

type Positions = [f64; MAX_JOINTS];

/// The positions that the next ones are held against.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Continuity {
    /// The latest that was taken, and how many were in a row, up to [`PROOF`].
    taken: Option<(Positions, u32)>,
    /// The latest that was refused, and how many in a row agree.
    refused: Option<(Positions, u32)>,
}

impl Continuity {
    /// Takes the motor positions of a cycle \[rad\].
    ///
    /// # Errors
    /// [`CycleCause::OutOfRange`] where they cannot follow those before, [`CycleCause::Restart`]
    /// where those before are given up and these are what the next ones are held against.
    pub(super) fn admit(
        &mut self,
        position_rad: &Positions,
        axes: usize,
        scales: &Scales,
    ) -> Result<(), CycleCause> {
        let follows = |before: &Positions| {
            let steps = before.iter().zip(position_rad).take(axes).enumerate();
            steps.into_iter().all(|(axis, (from, to))| scales.is_continuous(axis, *from, *to))
        };
        let (taken, proof) = match self.taken {
            None => (true, 0),
            Some((before, proof)) => (follows(&before), proof),
        };
        if taken {
            self.taken = Some((*position_rad, (proof + 1).min(PROOF)));
            self.refused = None;
            return Ok(());
        }
        let run = match self.refused {
            Some((before, run)) if follows(&before) => run + 1,
            _ => 1,
        };
        self.refused = Some((*position_rad, run));
        if proof < PROOF && run >= PROOF {
            *self = Self { taken: Some((*position_rad, PROOF)), refused: None };
            return Err(CycleCause::Restart);
        }
        Err(CycleCause::OutOfRange)
    }
}
