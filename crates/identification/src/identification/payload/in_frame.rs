//! A load in a named frame on the last link.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::equation::LoadSums;
use super::error::PayloadError;
use super::load::{Load, LoadBody, LoadParameter, UncertainValue};
use super::presence::{Comparison, DeclaredLoad};
use crate::identification::problem::PayloadLimits;
use didim_dynamics::robot::NamedFrame;

/// Centre and inertia of a load in a named frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CentreOfMass {
    /// Name of the frame: a link of the URDF, or `link_6` for the link frame of a robot file.
    pub frame: String,
    /// Centre of mass in this frame \[m\]; `None` if no mass is detected.
    pub centre_m: [Option<UncertainValue>; 3],
    /// Inertia about the centre of mass, xx xy xz yy yz zz, along the axes of this frame
    /// \[kg·m²\]. Entry xy is minus the integral of xy.
    pub inertia_kg_m2: [Option<UncertainValue>; 6],
}

/// Load with everything that depends on the axes, in a named frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadInFrame {
    /// Frame, centre and inertia.
    #[serde(flatten)]
    pub centre: CentreOfMass,
    /// Sums of load parameters in this frame that the record identifies.
    pub parameters: Vec<LoadParameter>,
    /// Load parameters, of ten, that no motion of this arm makes identifiable.
    pub without_effect: Vec<&'static str>,
    /// Other load parameters that are identifiable only in sums, or not at all.
    pub not_identifiable: Vec<&'static str>,
    /// Physically consistent body of the load.
    pub body: Option<LoadBody>,
    /// Comparison with the declared load.
    pub declared: Option<Comparison>,
}

/// Load in the frame of the last link, as estimated.
pub(super) struct EstimatedLoad<'a> {
    pub(super) sums: &'a LoadSums,
    pub(super) values: &'a DVector<f64>,
    pub(super) covariance: &'a DMatrix<f64>,
    pub(super) declared: DeclaredLoad,
}

impl LoadInFrame {
    /// Describes an estimate in another frame: φ = M φ' for the ten parameters, so that the sums
    /// S φ are (S M) φ'. Returns `None` if rounding does not allow to choose the sums.
    ///
    /// # Errors
    /// [`PayloadError`].
    pub(super) fn new(
        load: &EstimatedLoad<'_>,
        body: Option<&LoadBody>,
        frame: &NamedFrame,
        limits: &PayloadLimits,
    ) -> Result<Option<Self>, PayloadError> {
        let Some((sums, change)) = load.sums.in_frame(frame) else { return Ok(None) };
        let values = &change * load.values;
        let covariance = &change * load.covariance * change.transpose();
        let centre_m = load.declared.centre_m.map(|centre| frame.point_in_frame(centre));
        let declared = DeclaredLoad { centre_m, ..load.declared };
        let Load { centre_m, inertia_kg_m2, .. } =
            Load::from_sums(&sums, &values, &covariance, limits);
        let [without_effect, not_identifiable] = sums.unidentifiable();
        Ok(Some(Self {
            centre: CentreOfMass { frame: frame.name.clone(), centre_m, inertia_kg_m2 },
            parameters: LoadParameter::list(&sums, &values, &covariance),
            without_effect,
            not_identifiable,
            body: body.map(|body| body.in_frame(frame)),
            declared: Comparison::compare(declared, &sums, &values, &covariance, limits)?,
        }))
    }
}

impl LoadBody {
    /// Returns the same body in another frame.
    fn in_frame(&self, frame: &NamedFrame) -> Self {
        let inverse = frame.inverse();
        let [xx, xy, xz, yy, yz, zz] = self.inertia_kg_m2;
        // Without mass and first moments, the inertia is rotated alone.
        let rotated = inverse.parameters_in_link([xx, xy, xz, yy, yz, zz, 0.0, 0.0, 0.0, 0.0]);
        Self {
            centre_m: inverse.point_in_link(self.centre_m),
            inertia_kg_m2: core::array::from_fn(|entry| rotated[entry]),
            ..self.clone()
        }
    }
}
