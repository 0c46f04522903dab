//! Prior bodies of the links.

use core::fmt;

use nalgebra::Vector3;

use super::assumptions::PriorAssumptions;
use super::body::Body;
use super::error::FeasibilityError;
use didim_dynamics::robot::{Joint, JointIndex, JointKind, ParameterKind, Robot};

/// Permitted total masses of arms, from tweezers to cranes \[kg\].
const MASSES_KG: core::ops::RangeInclusive<f64> = 1e-3..=1e6;
/// Smallest [extent](Body::least_extent) of a nominal body. A thinner body leaves no interior in
/// which a minimisation could start.
const MIN_EXTENT: f64 = 1e-9;

/// Source of a prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PriorSource {
    /// The nominal parameters of the robot's file.
    Nominal,
    /// The robot's geometry and the mass of all moving links, from a data sheet.
    Geometry {
        /// Mass of all moving links \[kg\].
        total_mass_kg: f64,
    },
}

impl fmt::Display for PriorSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nominal => write!(f, "the robot's nominal parameters"),
            Self::Geometry { total_mass_kg } => {
                write!(f, "the robot's geometry and a total mass of {total_mass_kg} kg")
            }
        }
    }
}

/// Prior knowledge of the links: one body per link, and the known drive inertias.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    pub(super) link_bodies: Vec<Body>,
    /// Drive inertia of each motor, if it is configured.
    pub(super) drive_inertia: Vec<Option<f64>>,
    source: PriorSource,
}

impl Prior {
    /// Creates the prior of the nominal parameters, which have to be physically consistent for
    /// every link.
    ///
    /// # Errors
    /// [`FeasibilityError::NothingNominal`] and [`FeasibilityError::NominalIsNoBody`].
    pub fn nominal(robot: &Robot) -> Result<Self, FeasibilityError> {
        let Some(nominal) = robot.nominal() else {
            return Err(FeasibilityError::NothingNominal { robot: robot.name().to_owned() });
        };
        let (table, values) = (robot.parameters(), nominal.standard_parameters());
        let value =
            |kind, joint| table.column(kind, joint).and_then(|column| values.get(column).copied());
        let link_bodies = (0..robot.joints())
            .map(|link: usize| {
                let ten = ParameterKind::LINK
                    .map(|kind| value(kind, JointIndex::new(link)).unwrap_or(0.0));
                let body = Body::from_parameters(ten);
                if body.least_extent().is_some_and(|extent| extent > MIN_EXTENT) {
                    Ok(body)
                } else {
                    Err(FeasibilityError::NominalIsNoBody { link: link + 1 })
                }
            })
            .collect::<Result<_, _>>()?;
        let positive = |motor| {
            value(ParameterKind::Ia, JointIndex::new(motor))
                .filter(|ia| ia.is_finite() && *ia > 0.0)
        };
        let drive_inertia = (0..robot.joints()).map(positive).collect();
        Ok(Self { link_bodies, drive_inertia, source: PriorSource::Nominal })
    }

    /// Creates a prior without CAD: cylinders from each frame's origin to the next one's, each 0.7
    /// times as heavy as the previous one. A total mass that is up to ten times too large has
    /// little effect. A total mass below a fifth of the real one gives worse results than no prior.
    ///
    /// # Errors
    /// [`FeasibilityError::TotalMass`].
    pub fn geometric(robot: &Robot, total_mass_kg: f64) -> Result<Self, FeasibilityError> {
        if !MASSES_KG.contains(&total_mass_kg) {
            return Err(FeasibilityError::TotalMass { found: total_mass_kg });
        }
        let chain = robot.chain();
        let shares: Vec<f64> = core::iter::successors(Some(1.0), |share| {
            Some(share * PriorAssumptions::DEFAULT.link_mass_ratio)
        })
        .take(chain.len())
        .collect();
        let unit = total_mass_kg / shares.iter().sum::<f64>();
        let link_bodies = shares.iter().enumerate().map(|(link, share)| {
            let tip = chain
                .get(link + 1)
                .map_or(Vector3::z() * PriorAssumptions::DEFAULT.last_length_m, origin_in_previous);
            cylinder(unit * share, tip)
        });
        Ok(Self {
            link_bodies: link_bodies.collect(),
            drive_inertia: vec![None; chain.len()],
            source: PriorSource::Geometry { total_mass_kg },
        })
    }

    /// Returns the source of the prior.
    pub fn source(&self) -> PriorSource {
        self.source
    }

    /// Returns the body of each link.
    pub fn link_bodies(&self) -> &[Body] {
        &self.link_bodies
    }

    /// Returns the weight λ that suits the prior: 2/s² for a relative standard deviation s of the
    /// bodies. It is 2 for geometry (s = 1), and 22 for nominal parameters (s = 0.3).
    pub fn default_weight(&self) -> f64 {
        match self.source {
            PriorSource::Nominal => PriorAssumptions::DEFAULT.nominal_weight,
            PriorSource::Geometry { .. } => PriorAssumptions::DEFAULT.geometric_weight,
        }
    }
}

/// Returns the origin of a joint's frame in the previous frame \[m\]: TransX(d) RotX(α) TransZ(r).
/// A prismatic joint is in the middle of its range.
fn origin_in_previous(joint: &Joint) -> Vector3<f64> {
    let slid = match joint.kind {
        JointKind::Revolute => 0.0,
        JointKind::Prismatic => 0.5 * (joint.limits.position_min + joint.limits.position_max),
    };
    let r = joint.r_m + slid;
    Vector3::new(joint.d_m, -r * joint.alpha.sin, r * joint.alpha.cos)
}

/// Creates a cylinder between the origin and a point. It is at least as long as it is wide. Its
/// axis is z if both points are the same.
fn cylinder(mass_kg: f64, tip: Vector3<f64>) -> Body {
    let volume = mass_kg / PriorAssumptions::DEFAULT.density_kg_m3;
    let squat = (volume / core::f64::consts::TAU).cbrt();
    let length = tip.norm().max(2.0 * squat);
    let radius = (volume / (core::f64::consts::PI * length)).sqrt();
    let axis = tip.try_normalize(0.0).unwrap_or_else(Vector3::z);
    Body::cylinder(mass_kg, radius, length, tip * 0.5, axis)
}
