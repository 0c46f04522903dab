//! Reasons why there are no consistent parameters.

use thiserror::Error;

use didim_dynamics::dynamics::UnknownBaseParameter;

/// Reason why there are no consistent parameters. Each message names the problem, its place and the
/// remedy.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FeasibilityError {
    /// The robot file has no nominal parameters, so they cannot provide a prior.
    #[error(
        "the robot \"{robot}\" has no [nominal] parameters; give the total mass of its moving \
        links instead (`--total-mass-kg`)"
    )]
    NothingNominal {
        /// Its name.
        robot: String,
    },
    /// The nominal parameters are not physically consistent: they are base parameters, or those of
    /// a point or a plate without thickness.
    #[error(
        "the nominal parameters of link {link} are not physically consistent. Enter mass, first \
        moments and inertia about the origin of the link's frame as in CAD, or give the total mass \
        of the moving links instead"
    )]
    NominalIsNoBody {
        /// Link, counted from 1.
        link: usize,
    },
    /// The total mass is not between a gram and a thousand tonnes.
    #[error("the total mass of the moving links is {found} kg; give that of the data sheet, in kg")]
    TotalMass {
        /// The number found.
        found: f64,
    },
    /// The mass of the load is not positive, so there is no prior body.
    #[error("the mass of the load is {found} kg; state a positive one")]
    LoadMass {
        /// The number found.
        found: f64,
    },
    /// The weight λ is invalid.
    #[error(
        "the weight of the prior is {found}; give 2/s², where s is the relative standard deviation \
         of the prior's bodies: 2 for geometry alone, 22 for CAD"
    )]
    Weight {
        /// The number found.
        found: f64,
    },
    /// The prior has another number of links than the robot.
    #[error("the prior has {found} bodies for {expected} links; make it of the same robot")]
    OtherPrior {
        /// Bodies of the prior.
        found: usize,
        /// Links of the robot.
        expected: usize,
    },
    /// The base parameters are those of another robot.
    #[error(
        "the base parameters are not those of the robot \"{robot}\"; compute them from its model"
    )]
    OtherBaseParameters {
        /// The robot's name.
        robot: String,
    },
    /// A name of the estimate is not a base parameter.
    #[error(transparent)]
    Unknown(#[from] UnknownBaseParameter),
    /// A base parameter has two values.
    #[error("`{name}` is identified and fixed at the same time; keep one of its values")]
    Repeated {
        /// Its name.
        name: String,
    },
    /// The dimensions of names, values and covariance differ.
    #[error(
        "{names} names have {values} values and a covariance of {rows} × {columns}; give those of \
        one estimate"
    )]
    Shape {
        /// Names.
        names: usize,
        /// Values.
        values: usize,
        /// Rows of the covariance.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// A value or standard deviation is not a valid number.
    #[error(
        "`{name}` has no finite value with a positive standard deviation; identify it again, or \
        leave it out"
    )]
    NoValue {
        /// Its name.
        name: String,
    },
    /// The covariance has directions without variance.
    #[error(
        "the covariance is not positive definite; give the corrected covariance of one estimate, \
        to all its digits"
    )]
    Covariance,
    /// Some base parameters that the bodies depend on were not identified.
    #[error(
        "{} are not identified: the estimate has them at a fixed value that may be physically \
        inconsistent. Without it the prior alone would decide. Identify all base parameters, or \
        fix these at a value with a standard deviation", .names.join(" ")
    )]
    LeftOut {
        /// Their names.
        names: Vec<String>,
    },
    /// The minimisation did not converge.
    #[error(
        "no minimum was found in {iterations} steps (at λ = {weight:.3e}). Use a larger weight of \
        the prior. Check for reversed signs if the estimate is far from physically consistent"
    )]
    NotConverged {
        /// Newton steps.
        iterations: usize,
        /// Weight at which it stopped.
        weight: f64,
    },
}
