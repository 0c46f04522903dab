//! From one look at the load to the next: whether it has changed.

use didim_core::identification::Uncertain;

use crate::archive::store::FoundLoad;

/// Masses that are further apart than this differ, in the standard deviations of their difference. These are too large where errors of the
/// arm are in both.
const APART: f64 = 3.0;

/// What a look found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// The mass, where it is told \[kg\].
    pub(super) mass: Option<Uncertain>,
    /// Whether there is a load.
    pub(super) seen: bool,
}

impl Look {
    /// As the arm was with its baseline.
    pub(super) const NONE: Self =
        Self { mass: Some(Uncertain { value: 0.0, standard_deviation: 0.0 }), seen: false };

    pub(super) fn of(found: &FoundLoad) -> Self {
        Self { mass: found.load.mass_kg, seen: found.presence.seen }
    }

    /// On which side another one is, if they differ.
    fn side(&self, other: &Self) -> Option<bool> {
        match (self.mass, other.mass) {
            (Some(one), Some(other)) => {
                let deviation = one.standard_deviation.hypot(other.standard_deviation);
                let off = other.value - one.value;
                (off.abs() > APART * deviation).then_some(off > 0.0)
            }
            _ => (self.seen != other.seen).then_some(other.seen),
        }
    }
}

/// Follows looks one after the other. One look alone changes nothing: it may be chance, and a load is picked up in its midst.
#[derive(Clone, Debug)]
pub(super) struct LoadTrack {
    /// What counts as carried.
    level: Look,
    /// On which side of it the last look was, if it differed.
    suspect: Option<bool>,
}

impl LoadTrack {
    pub(super) fn from(level: Look) -> Self {
        Self { level, suspect: None }
    }

    /// Whether the last look differed, and waits for the next.
    pub(super) fn suspects(&self) -> bool {
        self.suspect.is_some()
    }

    /// What counts as carried.
    pub(super) fn level(&self) -> Look {
        self.level
    }

    /// Takes the next look, and gives what was carried before if that has changed.
    pub(super) fn handle_look(&mut self, look: Look) -> Option<Look> {
        let side = self.level.side(&look);
        let again = side.is_some() && side == self.suspect;
        self.suspect = if again { None } else { side };
        again.then(|| core::mem::replace(&mut self.level, look))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(value: f64, standard_deviation: f64) -> Look {
        let mass = Uncertain { value, standard_deviation };
        Look { mass: Some(mass), seen: mass.is_seen() }
    }

    #[test]
    fn a_load_counts_when_two_looks_agree() {
        let mut track = LoadTrack::from(Look::NONE);
        assert_eq!(track.handle_look(look(0.1, 0.05)), None);
        // In its midst, and then whole.
        assert_eq!(track.handle_look(look(1.0, 0.1)), None);
        assert!(track.suspects());
        assert_eq!(track.handle_look(look(2.0, 0.05)), Some(Look::NONE));
        assert_eq!(track.level(), look(2.0, 0.05));
        assert_eq!(track.handle_look(look(2.1, 0.05)), None);
        // Put down.
        assert_eq!(track.handle_look(look(0.0, 0.05)), None);
        assert_eq!(track.handle_look(look(0.01, 0.05)), Some(look(2.0, 0.05)));
    }

    #[test]
    fn what_is_odd_once_or_on_either_side_is_no_change() {
        let mut track = LoadTrack::from(Look::NONE);
        for value in [1.0, 0.0, 1.0, -1.0, 1.0, 0.1] {
            assert_eq!(track.handle_look(look(value, 0.1)), None, "{value}");
        }
        assert_eq!(track.handle_look(look(0.29, 0.1)), None);
        assert_eq!(track.handle_look(look(0.29, 0.1)), None, "within 3 σ");
    }

    #[test]
    fn where_no_mass_is_told_it_counts_whether_a_load_is_seen() {
        let seen = |seen| Look { mass: None, seen };
        let mut track = LoadTrack::from(Look::NONE);
        assert_eq!(track.handle_look(seen(false)), None);
        assert_eq!(track.handle_look(seen(true)), None);
        assert_eq!(track.handle_look(seen(true)), Some(Look::NONE));
        assert_eq!(track.level(), seen(true));
    }
}
