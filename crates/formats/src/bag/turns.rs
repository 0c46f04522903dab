//! States of two publishers in one topic, by turns: positions that jump to and fro, as no joint
//! moves.

/// Share of a joint's range from which a step is a jump.
const JUMP_SHARE: f64 = 0.05;
/// And the next position but one is back by all but this part of it.
const RETURN_SHARE: f64 = 0.1;
/// Share of the messages from which a second publisher is assumed.
const ALTERNATING_SHARE: f64 = 0.1;
/// A joint that moves less rests and flickers between the steps of its encoder: 6e-3 rad of one
/// with 10 bits \[rad or m\].
const MIN_MOTION: f64 = 1e-2;

/// Returns the first joint whose positions jump back and forth, and how often.
pub(super) fn has_two_publishers(positions: &[Vec<f64>]) -> Option<(usize, usize)> {
    positions.iter().enumerate().find_map(|(joint, position)| {
        let (low, high) = position
            .iter()
            .fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(*v), high.max(*v)));
        let jump = JUMP_SHARE * (high - low);
        let jumps = position.windows(3).filter(|three| {
            let forward = (three[1] - three[0]).abs().min((three[2] - three[1]).abs());
            forward > jump && (three[2] - three[0]).abs() < RETURN_SHARE * forward
        });
        let count = jumps.count();
        #[expect(clippy::cast_precision_loss, reason = "samples in memory are far fewer than 2^52")]
        let often = count as f64 > ALTERNATING_SHARE * position.len() as f64;
        (high - low > MIN_MOTION && often).then_some((joint, count))
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
            assert_eq!(has_two_publishers(&[rests]), None, "{step}");
        }
        // By turns.
        let other: Vec<f64> = (0..1000).map(|k| 0.3 + steps(k, 0.2)).collect();
        assert!(has_two_publishers(&[other]).is_some());
    }
}
