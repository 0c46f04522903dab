//! Something that the arm carries.

/// A body that is fixed to the last link: what it adds to that link's standard parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// First moments MX, MY, MZ in the frame of the last link \[kg·m\].
    pub first_moment_kg_m: [f64; 3],
    /// XX, XY, XZ, YY, YZ, ZZ about the origin of that frame \[kg·m²\].
    pub inertia_kg_m2: [f64; 6],
}

impl Payload {
    /// A mass \[kg\] at a point of the last link's frame \[m\].
    pub fn point_mass(mass_kg: f64, [x, y, z]: [f64; 3]) -> Self {
        let m = mass_kg;
        Self {
            mass_kg,
            first_moment_kg_m: [m * x, m * y, m * z],
            // J = m (pᵀp I − p pᵀ)
            inertia_kg_m2: [
                m * (y * y + z * z),
                -m * x * y,
                -m * x * z,
                m * (x * x + z * z),
                -m * y * z,
                m * (x * x + y * y),
            ],
        }
    }

    /// The ten parameters in the order of `ParameterKind::LINK`.
    pub(crate) fn link_parameters(&self) -> [f64; 10] {
        let [xx, xy, xz, yy, yz, zz] = self.inertia_kg_m2;
        let [mx, my, mz] = self.first_moment_kg_m;
        [xx, xy, xz, yy, yz, zz, mx, my, mz, self.mass_kg]
    }
}
