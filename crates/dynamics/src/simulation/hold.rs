//! Torque commands on their way from the controller to the arm.

use crate::control::split_delay;

/// Holds every command for one period, beginning a delay after it was computed.
///
/// The delay is a number of full periods plus a remainder. Between t_k and t_k + remainder the
/// previous command still acts, then the command that was computed the full number of periods ago.
/// Before the first command is due, it already acts: the loop has been at rest before time 0.
#[derive(Clone, Debug)]
pub(super) struct CommandHold<C> {
    /// Commands, newest first: one more than the full periods of the delay, and one for the
    /// remainder.
    commands: Vec<C>,
    remainder_s: f64,
    is_started: bool,
}

impl<C: Clone> CommandHold<C> {
    /// Creates a hold; `none` is a placeholder command with the size of all later ones.
    pub(super) fn new(delay_s: f64, period_s: f64, none: C) -> Self {
        let (periods, remainder_s) = split_delay(delay_s, period_s);
        Self { commands: vec![none; periods + 2], remainder_s, is_started: false }
    }

    /// Adds the command of a new sample.
    pub(super) fn push(&mut self, command: &C) {
        if !self.is_started {
            self.commands.iter_mut().for_each(|held_command| held_command.clone_from(command));
            self.is_started = true;
        }
        // The oldest command moves to the front and is overwritten. `rotate_right` would call a
        // memory move for each command.
        for k in (1..self.commands.len()).rev() {
            self.commands.swap(k - 1, k);
        }
        if let Some(newest) = self.commands.first_mut() {
            newest.clone_from(command);
        }
    }

    /// Returns how long after the newest sample the previous command still acts \[s\].
    pub(super) fn remainder_s(&self) -> f64 {
        self.remainder_s
    }

    /// Returns the command that acts during the remainder.
    pub(super) fn during_remainder(&self) -> &C {
        &self.commands[self.commands.len() - 1]
    }

    /// Returns the command that acts after the remainder, to the end of the period.
    pub(super) fn after_remainder(&self) -> &C {
        // There are at least two commands.
        &self.commands[self.commands.len() - 2]
    }

    /// Returns the command that acts just after the newest sample.
    pub(super) fn at_sample(&self) -> &C {
        if self.remainder_s > 0.0 { self.during_remainder() } else { self.after_remainder() }
    }

    pub(super) fn clear(&mut self) {
        self.is_started = false;
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "commands are passed on unchanged")]
mod tests {
    use super::*;

    fn commands_over_time(delay_s: f64) -> Vec<(f64, f64)> {
        let mut hold = CommandHold::new(delay_s, 0.5, [0.0]);
        (1..=4)
            .map(|k| {
                hold.push(&[f64::from(k)]);
                (hold.at_sample()[0], hold.after_remainder()[0])
            })
            .collect()
    }

    #[test]
    fn commands_act_when_their_delay_is_over() {
        assert_eq!(commands_over_time(0.0), [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (4.0, 4.0)]);
        assert_eq!(commands_over_time(0.5), [(1.0, 1.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]);
        assert_eq!(commands_over_time(0.125), [(1.0, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 4.0)]);
        assert_eq!(commands_over_time(0.625), [(1.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 3.0)]);
        assert_eq!(CommandHold::new(0.625, 0.5, ()).remainder_s(), 0.125);
    }

    #[test]
    fn a_whole_number_of_periods_leaves_no_rest() {
        let hold = CommandHold::new(3.0 * 2e-4, 2e-4, ());
        assert_eq!((hold.remainder_s(), hold.commands.len()), (0.0, 5));
    }
}
