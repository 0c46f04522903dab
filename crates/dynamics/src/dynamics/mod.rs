//! Inverse and direct dynamics, regressor, mass matrix and base parameters.
//!
//! A [`Model`] is immutable and shared; a [`Workspace`] holds all scratch memory of one thread. No
//! algorithm allocates. All are generic over [`Scalar`](crate::numeric::Scalar), and linear in the
//! standard parameters: inertia about the origin of the link's frame, first moments, mass, drive
//! inertia and friction.

mod base;
mod composite;
mod direct;
mod drives;
mod factor;
mod inertia;
mod inverse;
mod kinematics;
mod link_frames;
mod load;
mod mass_matrix;
mod model;
mod motion;
mod partials;
mod pose;
mod regressor;
mod regressor_columns;
#[cfg(test)]
mod tests;
mod variation;
mod vector;
mod workspace;

pub use base::{
    BaseParameters, BaseParametersError, ColumnSelection, UnknownBaseParameter, format_sum,
    select_columns,
};
pub use factor::NotPositiveDefinite;
pub use link_frames::LinkFrame;
pub use model::Model;
pub use regressor_columns::RegressorColumns;
pub(crate) use variation::{Variation, VariationWorkspace};
pub use workspace::Workspace;
