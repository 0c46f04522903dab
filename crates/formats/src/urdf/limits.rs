//! Limits for values in a URDF.

/// Limits that decide about values in a URDF.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UrdfLimits {
    /// Largest excess of a principal moment over the sum of the two others, relative to the largest
    /// \[1\]. Derived: printed numbers have six digits.
    pub triangle_excess: f64,
    /// Distance from a multiple of a quarter turn below which an angle is that multiple \[rad\].
    /// Derived: files print π/2 with at least five digits.
    pub printed_angle_rad: f64,
    /// Largest difference between 1 and the length of a quaternion \[1\]. Derived: files print it with
    /// at least four digits.
    pub quaternion_length: f64,
    /// Sine between two axes below which they count as parallel \[1\]. Derived: otherwise their
    /// common normal would be hundreds of metres away.
    pub parallel_sine: f64,
    /// Smallest rotation of an axis that is worth a note \[rad\]. Derived: printed numbers leave
    /// less.
    pub noted_angle_rad: f64,
    /// Assumed range of a continuous joint either way \[rad\]. Convention: a hundred turns.
    pub continuous_range_rad: f64,
}

impl UrdfLimits {
    /// The values that the program uses.
    pub(super) const DEFAULT: Self = Self {
        triangle_excess: 1e-6,
        printed_angle_rad: 1e-5,
        quaternion_length: 1e-3,
        parallel_sine: 1e-3,
        noted_angle_rad: 1e-10,
        continuous_range_rad: 100.0 * core::f64::consts::TAU,
    };
}
