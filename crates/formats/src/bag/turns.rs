//! Detection of two publishers in one topic: positions that alternate between two states, as no
//! joint moves.

use crate::time_limits::TimeLimits;

/// Returns the first joint whose positions jump back and forth, and how often.
pub(super) fn find_two_publishers(positions: &[Vec<f64>]) -> Option<(usize, usize)> {
    positions.iter().enumerate().find_map(|(joint, position)| {
        let (low, high) = position
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
        let jump = TimeLimits::DEFAULT.jump_share * (high - low);
        let jumps = position.windows(3).filter(|three| {
            let forward = (three[1] - three[0]).abs().min((three[2] - three[1]).abs());
            forward > jump
                && (three[2] - three[0]).abs()
                    < TimeLimits::DEFAULT.alternating_return_share * forward
        });
        let count = jumps.count();
        #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
        let often = count as f64 > TimeLimits::DEFAULT.alternating_share * position.len() as f64;
        (high - low > TimeLimits::DEFAULT.alternating_motion && often).then_some((joint, count))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_at_rest_may_flicker() {
        let steps = |k: u32, step: f64| step * f64::from(k * k % 7 % 2);
        for step in [1.534e-3, 6.14e-3] {
            let rests: Vec<f64> = (0..1000).map(|k| 0.3 + steps(k, step)).collect();
            assert_eq!(find_two_publishers(&[rests]), None, "{step}");
        }
        // By turns.
        let other: Vec<f64> = (0..1000).map(|k| 0.3 + steps(k, 0.2)).collect();
        assert!(find_two_publishers(&[other]).is_some());
    }
}
