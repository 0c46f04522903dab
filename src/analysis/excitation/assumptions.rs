//! Assumptions of designs: without a result, and about the bodies of links.

/// Assumptions about noise for a design without a result.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DesignAssumptions {
    /// Noise of a row as a share of the joint's torque limit \[1\]. Convention for designs without
    /// a result.
    pub noise_share: f64,
    /// Independent rows per second \[Hz\]. Convention for designs without a cell.
    pub rows_per_s: f64,
    /// Share of a use's required uncertainty that noise may cause \[1\]. Derived: a third of the
    /// standard uncertainty is about a tenth of the variance.
    pub noise_part: f64,
}

impl DesignAssumptions {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self =
        Self { noise_share: 0.01, rows_per_s: 40.0, noise_part: 1.0 / 3.0 };
}

/// Resolution of the bodies of links.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BodyAssumptions {
    /// Largest number of points of the hull of a mesh \[1\]. Derived: on a sphere of 0.1 m the
    /// radius about so many points is below 1 mm.
    pub hull_points: usize,
    /// Number of sides of the prism about a cylinder \[1\]. Derived: its corners are 0.9 % of the
    /// radius outside.
    pub cylinder_sides: usize,
}

impl BodyAssumptions {
    /// The values that the program uses.
    pub(crate) const DEFAULT: Self = Self { hull_points: 256, cylinder_sides: 24 };
}
