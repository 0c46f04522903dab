//! Payload of the arm.

use serde::Deserialize;

/// Body fixed to the last link, as its contribution to that link's standard parameters.
///
/// In a file, it is either a point mass with `mass_kg` and `position_m`, or a body with the three
/// keys below.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawPayload")]
pub struct Payload {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// First moments MX, MY, MZ in the frame of the last link \[kg·m\].
    pub first_moment_kg_m: [f64; 3],
    /// Inertias XX, XY, XZ, YY, YZ, ZZ about the origin of the last link's frame \[kg·m²\].
    pub inertia_kg_m2: [f64; 6],
}

impl Payload {
    /// Creates a point mass \[kg\] at a position in the frame of the last link \[m\].
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

    /// Returns the ten link parameters in the order of `ParameterKind::LINK`.
    pub(crate) fn link_parameters(&self) -> [f64; 10] {
        let [xx, xy, xz, yy, yz, zz] = self.inertia_kg_m2;
        let [mx, my, mz] = self.first_moment_kg_m;
        [xx, xy, xz, yy, yz, zz, mx, my, mz, self.mass_kg]
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPayload {
    mass_kg: f64,
    position_m: Option<[f64; 3]>,
    first_moment_kg_m: Option<[f64; 3]>,
    inertia_kg_m2: Option<[f64; 6]>,
}

impl TryFrom<RawPayload> for Payload {
    type Error = &'static str;

    fn try_from(raw: RawPayload) -> Result<Self, Self::Error> {
        let RawPayload { mass_kg, position_m, first_moment_kg_m, inertia_kg_m2 } = raw;
        let payload = match (position_m, first_moment_kg_m, inertia_kg_m2) {
            (Some(position), None, None) => Self::point_mass(mass_kg, position),
            (None, Some(first_moment_kg_m), Some(inertia_kg_m2)) => {
                Self { mass_kg, first_moment_kg_m, inertia_kg_m2 }
            }
            _ => return Err("a payload has position_m, or first_moment_kg_m and inertia_kg_m2"),
        };
        if !(mass_kg >= 0.0 && payload.link_parameters().iter().all(|value| value.is_finite())) {
            return Err("a payload must be finite, and its mass not negative");
        }
        Ok(payload)
    }
}
