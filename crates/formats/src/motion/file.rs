//! Input of every motion format.

use didim_identification::excitation::Course;

/// Points per second of tables \[Hz\].
pub(super) const TABLE_HZ: f64 = 500.0;
/// Points per second of trajectories \[Hz\].
pub(super) const POINTS_HZ: f64 = 100.0;
/// Points per second of programs whose controller chooses the speed \[Hz\].
pub(super) const PROGRAM_HZ: f64 = 10.0;

/// A motion, with names and comments for a file.
#[derive(Clone, Copy)]
pub struct MotionFile<'a> {
    /// The motion \[rad\].
    pub motion: &'a dyn Course,
    /// Name of each joint.
    pub joints: &'a [String],
    /// Lines of the comment that the file begins with.
    pub header: &'a [String],
}

impl MotionFile<'_> {
    /// Returns the header as comments.
    pub(super) fn header_comments(&self, mark: &str) -> String {
        self.header.iter().map(|line| format!("{mark} {line}\n")).collect()
    }

    /// Returns the times of evenly spaced points, including both ends.
    pub(super) fn times_s(&self, rate_hz: f64) -> impl Iterator<Item = f64> {
        let duration_s = self.motion.duration_s();
        let steps = (duration_s * rate_hz).ceil().max(1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a motion has far fewer points than 2^52"
        )]
        let last = steps as usize;
        (0..=last).map(move |i| duration_s * i as f64 / steps)
    }
}

/// Converts a name to an identifier of every language here: at most 24 letters, digits and
/// underscores, a letter first.
pub(super) fn identifier(name: &str) -> String {
    let plain = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let plain: String = plain.skip_while(|c| !c.is_ascii_alphabetic()).take(24).collect();
    if plain.is_empty() { "motion".to_owned() } else { plain }
}

/// Formats numbers with commas between them.
pub(super) fn list(numbers: impl IntoIterator<Item = f64>, digits: usize) -> String {
    let numbers: Vec<String> = numbers.into_iter().map(|of| format!("{of:.digits$}")).collect();
    numbers.join(", ")
}

/// Converts positions to degrees.
pub(super) fn to_degrees(positions: &[f64]) -> impl Iterator<Item = f64> {
    positions.iter().map(|position| position.to_degrees())
}
