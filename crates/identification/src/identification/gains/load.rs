//! Load with known mass and centre.

use serde::Serialize;

/// A load with known mass and centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KnownLoad {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Centre of mass in the frame of the last link \[m\].
    pub centre_m: [f64; 3],
}

impl KnownLoad {
    /// Returns the load's parameters in the order of
    /// [`ParameterKind::LINK`](didim_dynamics::robot::ParameterKind::LINK), with all of its mass
    /// concentrated at its centre.
    pub fn parameters(self) -> [f64; 10] {
        let (m, [x, y, z]) = (self.mass_kg, self.centre_m);
        let inertia = [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y];
        let [xx, xy, xz, yy, yz, zz] = inertia.map(|of| m * of);
        [xx, xy, xz, yy, yz, zz, m * x, m * y, m * z, m]
    }
}
