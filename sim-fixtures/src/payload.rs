//! Payload of the arm.

use didim_dynamics::robot::{NoSuchFrame, Robot};
use didim_identification::identification::{Finding, Note};
use serde::Deserialize;

/// Body fixed to the last link, as its contribution to that link's standard parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// A payload in a file: either a point mass with `mass_kg` and `position_m`, or a body with the
/// three keys of [`Payload`]; and the frame of its values.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawPayload")]
pub struct FramedPayload {
    /// The payload, with its values in the frame.
    payload: Payload,
    /// Link of the URDF on the last link in whose frame it is given. `None` for the model's frame.
    frame: Option<String>,
}

impl FramedPayload {
    /// Returns the payload in the frame of a robot's last link.
    ///
    /// # Errors
    /// [`NoSuchFrame`].
    pub fn on_last_link(&self, robot: &Robot) -> Result<Payload, NoSuchFrame> {
        let Some(name) = &self.frame else { return Ok(self.payload) };
        let frame = robot.load_frame(Some(name))?;
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, mass_kg] =
            frame.parameters_in_link(self.payload.link_parameters());
        let (first_moment_kg_m, inertia_kg_m2) = ([mx, my, mz], [xx, xy, xz, yy, yz, zz]);
        Ok(Payload { mass_kg, first_moment_kg_m, inertia_kg_m2 })
    }

    /// Returns the finding on a payload without a named frame, if the robot is from a URDF.
    pub fn findings(&self, robot: &Robot) -> Vec<Finding> {
        match robot.load_frame(None) {
            Ok(frame) if self.frame.is_none() && !frame.is_model_frame() => {
                Finding::from_notes(&[Note::LoadFrame { link: frame.name }])
            }
            _ => Vec::new(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPayload {
    frame: Option<String>,
    mass_kg: f64,
    position_m: Option<[f64; 3]>,
    first_moment_kg_m: Option<[f64; 3]>,
    inertia_kg_m2: Option<[f64; 6]>,
}

impl TryFrom<RawPayload> for FramedPayload {
    type Error = &'static str;

    fn try_from(raw: RawPayload) -> Result<Self, Self::Error> {
        let RawPayload { frame, mass_kg, position_m, first_moment_kg_m, inertia_kg_m2 } = raw;
        let payload = match (position_m, first_moment_kg_m, inertia_kg_m2) {
            (Some(position), None, None) => Payload::point_mass(mass_kg, position),
            (None, Some(first_moment_kg_m), Some(inertia_kg_m2)) => {
                Payload { mass_kg, first_moment_kg_m, inertia_kg_m2 }
            }
            _ => return Err("a payload has position_m, or first_moment_kg_m and inertia_kg_m2"),
        };
        if !(mass_kg >= 0.0 && payload.link_parameters().iter().all(|value| value.is_finite())) {
            return Err("a payload must be finite, and its mass not negative");
        }
        Ok(Self { payload, frame })
    }
}
