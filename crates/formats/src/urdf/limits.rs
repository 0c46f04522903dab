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
    /// Largest difference between 1 and the length of a quaternion \[1\]. Derived: files print it
    /// with at least four digits.
    pub quaternion_length: f64,
    /// Sine between two axes below which they count as parallel \[1\]. Derived: otherwise their
    /// common normal would be hundreds of metres away.
    pub parallel_sine: f64,
    /// Smallest rotation of an axis that is worth a note \[rad\]. Derived: printed numbers leave
    /// less.
    pub noted_angle_rad: f64,
    /// Entry of an axis of length 1 below which it is 0 \[1\]. Derived: exporters leave rounding of
    /// 1e-7 or less, and a tilt of 1e-5 rad is not measured.
    pub zero_axis_entry: f64,
    /// Angle beyond which a whole number is taken for degrees \[rad\]. Derived: an angle in radians
    /// is no whole number, and within a turn.
    pub whole_degrees_rad: f64,
    /// Position limit beyond which a whole number is taken for degrees \[rad\]. Convention: ±10 rad
    /// is a usual limit of a joint that turns freely.
    pub whole_degrees_limit_rad: f64,
    /// Largest error of a quarter turn that is printed with few digits \[rad\]. Derived: 3.14 is
    /// 1.6e-3 rad from half a turn, and 4.71 is 2.4e-3 rad from three quarters.
    pub rough_angle_rad: f64,
    /// Largest number of decimals of such an angle \[1\]. Convention: what a calibration prints has
    /// more.
    pub rough_decimals: usize,
    /// Length below which two axes intersect, and an offset is zero \[m\]. Convention: below it no
    /// part is made or measured. Offsets of 1e-10 m to 3e-7 m would make parameters that rounding
    /// tells apart.
    pub zero_length_m: f64,
    /// Smallest length taken for zero that is worth a note \[m\]. Derived: rounding leaves less.
    pub noted_length_m: f64,
    /// Share of the largest nominal value of its kind below which one is 0 \[1\]. Derived: rounding
    /// of rotated bodies leaves less.
    pub zero_share: f64,
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
        zero_axis_entry: 1e-5,
        whole_degrees_rad: core::f64::consts::TAU,
        whole_degrees_limit_rad: 2.0 * core::f64::consts::TAU,
        rough_angle_rad: 3e-3,
        rough_decimals: 4,
        zero_length_m: 1e-6,
        noted_length_m: 1e-12,
        zero_share: 1e-12,
        continuous_range_rad: 100.0 * core::f64::consts::TAU,
    };
}
