//! Hysteresis state of friction along a record.

use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::numeric::Lanes;
use didim_dynamics::robot::Hysteresis;

/// Returns the hysteresis state of friction along these positions; empty without hysteresis. `ends`
/// are the samples at which a recording ends. In each recording the state starts at 0, midway
/// between its limits.
pub(crate) fn hysteresis_along(
    state: Option<Hysteresis>,
    ends: &[usize],
    position: impl Fn(usize) -> [f64; MAX_JOINTS],
) -> Vec<[f64; MAX_JOINTS]> {
    let Some(mut state) = state else { return Vec::new() };
    let mut shares = Vec::with_capacity(ends.last().copied().unwrap_or_default());
    for &end in ends {
        state.restart_at(&position(shares.len()));
        shares.extend((shares.len()..end).map(|k| state.advance_to(&position(k))));
    }
    shares
}

/// Returns the states of some samples from `first` on. Beyond the last sample they are those of the
/// last.
pub(crate) fn hysteresis_from(
    shares: &[[f64; MAX_JOINTS]],
    first: usize,
) -> Option<[Group; MAX_JOINTS]> {
    let last = shares.len().checked_sub(1)?;
    let of_joint = |joint: usize| Lanes::from_fn(|l| shares[(first + l).min(last)][joint]);
    Some(core::array::from_fn(of_joint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use didim_dynamics::robot::{FrictionLaw, Robot};

    /// A recording does not know the hysteresis state of the previous one.
    #[test]
    fn friction_that_slides_begins_anew_with_each_recording() {
        let robot =
            Robot::from_toml(include_str!("../../../../../config/robots/tx40.toml")).unwrap();
        assert!(
            hysteresis_along(Hysteresis::from_robot(&robot), &[5], |_| [0.0; MAX_JOINTS])
                .is_empty()
        );
        let law = FrictionLaw::Hysteresis { way_rad: 0.2 };
        let lagging = robot.own_friction().iter().map(|own| own.with_law(law)).collect();
        let robot = robot.with_friction(lagging);
        let along = |ends: &[usize]| {
            let friction = hysteresis_along(Hysteresis::from_robot(&robot), ends, |k| {
                [0.06 * k as f64; MAX_JOINTS]
            });
            friction.iter().map(|shares| shares[3]).collect::<Vec<f64>>()
        };
        let expected = [0.0, 0.6, 1.0, 1.0, 1.0];
        let close = |found: &[f64], expected: &[f64]| {
            found.len() == expected.len()
                && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        assert!(close(&along(&[5]), &expected), "{:?}", along(&[5]));
        assert!(close(&along(&[2, 5]), &[0.0, 0.6, 0.0, 0.6, 1.0]), "{:?}", along(&[2, 5]));
    }
}
